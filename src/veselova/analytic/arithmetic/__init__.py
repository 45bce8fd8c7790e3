"""Balls in arrays, and Fourier sums of them."""
