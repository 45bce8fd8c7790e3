"""The closed form as one text: scalar functions over an arithmetic, arrays in, arrays out.

``arithmetic`` has doubles, compiled by numba where it is installed, else run by the interpreter.
"""
