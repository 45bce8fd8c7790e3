"""Motions in closed form: from exact data to the arrays of the kernel, and back to series."""
