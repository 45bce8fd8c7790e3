"""Geodesics on any ellipsoid: from a point in a direction, and between two points."""
