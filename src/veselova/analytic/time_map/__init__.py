"""The time map t(τ₁) and its inverse, by Fourier series or on Chebyshev panels."""
