"""Chebyshev interpolants of a motion in t, for many times at once."""
