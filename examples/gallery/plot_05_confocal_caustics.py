r"""
Confocal caustics
=================

All tangents of a geodesic on an ellipsoid touch one confocal quadric
(Chasles). The dots are the points where they touch it: they fill a
hyperboloid of one sheet on the left, one of two sheets on the right. The
geodesic keeps to the zone where its tangents reach the quadric.
"""

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.collections import LineCollection

import veselova as vs


def camera(azimuth, elevation):
    """Return the directions to the right, upwards and towards the eye."""
    a, e = np.radians([azimuth, elevation])
    right = np.array([-np.sin(a), np.cos(a), 0])
    eye = np.array(
        [np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)]
    )
    return np.array([right, np.cross(eye, right), eye])


def draw_surface(axes, view, semiaxes=(1, 1, 1), cmap="Blues_r"):
    """Draw a shaded ellipsoid as it is seen from afar."""
    form = view @ np.diag(1 / np.square(semiaxes)) @ view.T
    size = np.sqrt(np.diag(np.linalg.inv(form)))
    x, y = np.meshgrid(*(np.linspace(-r, r, 700) for r in size[:2]))
    half = (form[0, 2] * x + form[1, 2] * y) / form[2, 2]
    level = form[0, 0] * x**2 + 2 * form[0, 1] * x * y + form[1, 1] * y**2
    inside = half**2 - (level - 1) / form[2, 2]
    points = np.array([x, y, np.sqrt(inside.clip(0)) - half])
    normal = np.einsum("ij,jkl->ikl", form, points)
    light = np.tensordot([-0.45, 0.55, 0.7], normal, 1)
    light = np.where(
        inside > 0, light / np.linalg.norm(normal, axis=0), np.nan
    )
    extent = (-size[0], size[0], -size[1], size[1])
    axes.imshow(
        light, cmap, vmin=-4, vmax=1.4, extent=extent, origin="lower"
    )
    axes.set(
        xlim=1.05 * np.array(extent[:2]), ylim=1.05 * np.array(extent[2:])
    )
    axes.axis("off")


def draw_curve(axes, points, view, colour, width=1.0, semiaxes=(1, 1, 1)):
    """Draw a curve on an ellipsoid, its far side faint."""
    near = (points / np.square(semiaxes)) @ view[2] > 0
    for side, alpha in ((~near, 0.25), (near, 1)):
        page = np.where(side[:, None], points @ view[:2].T, np.nan)
        axes.plot(*page.T, color=colour, alpha=alpha, linewidth=width)


A = np.array([4, 2, 1])
semiaxes = np.sqrt(A)
view = camera(-62, 22)


def draw(axes, X, X_dot, colour):
    """Draw a geodesic and where its tangents touch; return the quadric."""
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
    print(
        f"quadric {quadric:.9f};",
        f"on it to {np.abs(level[near] - 1).max():.0e}",
    )
    depth = touched @ view[2]
    for part, order in ((near & (depth < 0), -1), (near & (depth >= 0), 4)):
        page = touched[part] @ view[:2].T
        axes.scatter(
            *page.T,
            s=1.0,
            color="0.3",
            linewidths=0,
            alpha=0.35,
            zorder=order,
        )
    draw_surface(axes, view, semiaxes, "YlOrBr_r")
    draw_curve(axes, motion.X[:8000], view, colour, 0.5, semiaxes)
    rays = np.stack([motion.X, touched], axis=1)[near & (depth > 0)][
        :8000:250
    ]
    axes.add_collection(
        LineCollection(
            rays @ view[:2].T, colors=colour, linewidths=0.8, zorder=5
        )
    )
    axes.set(xlim=(-3, 3), ylim=(-2.6, 2.6))
    return quadric


figure, axes = plt.subplots(1, 2, figsize=(11, 5), layout="constrained")
starts = [
    ([2, 0, 0], [0, 1, 0.8], "#0072B2"),
    ([0, 0, 1], [0.8, 1, 0], "#D55E00"),
]
for axis, (position, velocity, colour) in zip(axes, starts, strict=True):
    quadric = draw(axis, position, velocity, colour)
    axis.set_title(rf"$\sum x_i^2/(A_i - {quadric:.3f}) = 1$")
plt.show()
