"""Motions in separable potentials, by inversion of their quadratures."""
