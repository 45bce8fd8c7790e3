r"""
A motion on its torus
=====================

The phases :math:`z_1, z_2` of a motion move on straight lines of a torus,
each at its own frequency. In Neumann time they grow at a constant rate. The
same curve on the sphere is the path of γ, between two lines of spheroconic
coordinates.
"""

import numpy as np
from matplotlib import pyplot as plt

import veselova as vs

BLUE, ORANGE = "#0072B2", "#E69F00"


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


body = vs.Veselova(
    [3, 2, 1], [0.64, 0.54, 0.54], [1, 0.6, 0.3], normalize=True
)
torus = vs.torus(body)
motion = vs.solve(body, np.linspace(0, 180, 12_001))
phases = torus.phases + motion.tau1[:, None] * torus.frequencies_tau1
print("cycles:", (phases[-1] - phases[0]).round(2))


def embed(z1, z2, thickness=0.42):
    """Return points of a torus in space, and their outward normals."""
    a, b = 2 * np.pi * z1, 2 * np.pi * z2
    normal = np.stack(
        [np.cos(b) * np.cos(a), np.cos(b) * np.sin(a), np.sin(b)], axis=-1
    )
    ring = np.stack([np.cos(a), np.sin(a), np.zeros_like(a)], axis=-1)
    return ring + thickness * normal, normal


# %%
# The torus is drawn as points sorted by depth, and the curve where it faces
# the eye.

view = camera(-90, 48)
points, normals = embed(
    *np.meshgrid(np.linspace(0, 1, 1200), np.linspace(0, 1, 600))
)
points, normals = points.reshape(-1, 3), normals.reshape(-1, 3)
order = np.argsort(points @ view[2])
order = order[(normals[order] @ view[2]) > 0]
light = (normals[order] @ (view.T @ [-0.45, 0.55, 0.7])).clip(0, 1)
shade = np.array([0.80, 0.86, 0.93]) * (0.62 + 0.38 * light[:, None])

figure, axes = plt.subplots(1, 2, figsize=(11, 5), layout="constrained")
axes[0].scatter(
    *(points[order] @ view[:2].T).T,
    c=shade,
    s=4,
    linewidths=0,
    rasterized=True,
)
curve, outward = embed(*phases.T)
hidden = outward @ view[2] < 0.02
page = np.where(hidden[:, None], np.nan, curve @ view[:2].T)
axes[0].plot(*page.T, color=BLUE, linewidth=1.1)
axes[0].plot(*page[0], "o", color=ORANGE, markersize=8)
axes[0].set(aspect="equal", title="phases $z_1$ (along) and $z_2$ (around)")
axes[0].axis("off")
draw_surface(axes[1], side := camera(25, 20))
draw_curve(axes[1], motion.q, side, BLUE, 1.1)
axes[1].plot(
    *(motion.q[0] @ side[:2].T), "o", color=ORANGE, markersize=8, zorder=6
)
axes[1].set_title(r"the path of $\gamma$ on the sphere")
plt.show()
