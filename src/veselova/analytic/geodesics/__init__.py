"""Geodesics between two points of an ellipsoid: scalar functions that numba compiles."""
