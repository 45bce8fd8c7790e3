"""The closed form as one text: scalar functions over an arithmetic, arrays in, arrays out.

``arithmetic`` has doubles, compiled by numba where it is installed. The same files are executed
over ``arithmetic_of_arb`` for digits (``closed.over_arb``), so that they import one another
relatively.
"""
