"""Numerical analysis that knows no mechanics: Jacobi's functions, roots, Chebyshev and Fourier
sums.
"""
