r"""
Confocal caustics
=================

All tangents of a geodesic on an ellipsoid touch one confocal quadric (Chasles). The dots are the
points where they touch it: they fill a hyperboloid of one sheet on the left, one of two sheets on
the right. The geodesic keeps to the zone where its tangents reach the quadric.
"""

import numpy as np
from drawing import camera, draw_curve, draw_surface
from matplotlib import pyplot as plt
from matplotlib.collections import LineCollection

import veselova as vs

A = np.array([4, 2, 1])
semiaxes = np.sqrt(A)
view = camera(-62, 22)


def draw(axes, X, X_dot, colour):
    """Draw a geodesic and where its tangents touch, and return the parameter of the quadric."""
    geodesic = vs.EllipsoidGeodesic(A, X, X_dot, normalize=True)
    motion = vs.solve(geodesic, np.linspace(0, 2500, 80_001))
    quadric = geodesic.quadrics[0]
    # Σ (x_i + s v_i)²/(A_i − c) = 1 has a double root s.
    weights = 1 / (A - quadric)
    s = -np.einsum("ti,i,ti->t", motion.X, weights, motion.X_dot)
    bend = np.einsum("ti,i,ti->t", motion.X_dot, weights, motion.X_dot)
    s /= np.where(np.abs(bend) > 1e-4, bend, np.nan)
    touched = motion.X + s[:, None] * motion.X_dot
    level = np.einsum("ti,i,ti->t", touched, weights, touched)
    near = np.abs(touched).max(axis=1) < 2.6
    print(f"quadric {quadric:.9f}; on it to {np.abs(level[near] - 1).max():.0e}")
    depth = touched @ view[2]
    for part, order in ((near & (depth < 0), 0), (near & (depth >= 0), 4)):
        page = touched[part] @ view[:2].T
        axes.scatter(*page.T, s=1.0, color="0.3", linewidths=0, alpha=0.35, zorder=order)
    draw_surface(axes, semiaxes, view, colour=(0.93, 0.89, 0.80))
    draw_curve(axes, motion.X[:8000], semiaxes, view, colour=colour, width=0.5)
    rays = np.stack([motion.X, touched], axis=1)[near & (depth > 0)][:8000:250]
    axes.add_collection(LineCollection(rays @ view[:2].T, colors=colour, linewidths=0.8, zorder=5))
    axes.set(xlim=(-3, 3), ylim=(-2.6, 2.6))
    return quadric


figure, axes = plt.subplots(1, 2, figsize=(11, 5), layout="constrained")
starts = [([2, 0, 0], [0, 1, 0.8], "#0072B2"), ([0, 0, 1], [0.8, 1, 0], "#D55E00")]
for axis, (position, velocity, colour) in zip(axes, starts, strict=True):
    quadric = draw(axis, position, velocity, colour)
    axis.set_title(rf"$\sum x_i^2/(A_i - {quadric:.3f}) = 1$")
plt.show()
