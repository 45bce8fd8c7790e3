"""The closed form as one text: scalar functions over an arithmetic, arrays in, arrays out.

``arithmetic`` has doubles, compiled by numba where it is installed. ``over`` executes the same files
over ``arithmetic_of_arb``, for digits.
"""
