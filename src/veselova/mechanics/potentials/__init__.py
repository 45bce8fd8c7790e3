"""Potentials: polynomials, Laurent polynomials, the separable family, functions on a group."""
