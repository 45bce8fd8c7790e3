"""Doubles and balls behind one interface; double-double and fixed-point
numbers.
"""
