r"""
A body in four dimensions
=========================

A cube of four dimensions turns about its centre, constrained by the
direction q = e₁. Its attitude is a matrix of SO(4), in closed form. The
cube is drawn in perspective, twice: from four dimensions to three, and from
three to the page. Below, the path of q on the three-dimensional sphere, in
perspective too: from a point near its pole, 0.35 outside the sphere.
"""

import itertools

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


body = vs.Veselova(
    [3, 2, 1.5, 1],
    [0.5, 0.5, 0.5, 0.5],
    [1.1, -0.7, 0.3, -0.7],
    normalize=True,
)
motion = vs.solve(body, np.linspace(0, 60, 12_001))
print("frequencies:", vs.torus(body).frequencies_t.round(6))

# %%
# Corners and edges of the cube, and both projections.

corners = np.array(list(itertools.product([-0.5, 0.5], repeat=4)))
pairs = itertools.combinations(range(16), 2)
edges = [
    (i, j)
    for i, j in pairs
    if np.isclose(np.abs(corners[i] - corners[j]).sum(), 1)
]
view = camera(30, 18)


def project(points):
    """Return where points fall on the page, and their fourth coordinate."""
    space = points[:, :3] / (1.9 - points[:, 3:])
    seen = space @ view.T
    return seen[:, :2] / (4 - seen[:, 2:]), points[:, 3]


figure = plt.figure(figsize=(11, 7.6), layout="constrained")
grid = figure.add_gridspec(2, 4, height_ratios=[1, 1.75])
for column, t in enumerate((0, 100, 200, 300)):
    axes = figure.add_subplot(grid[0, column])
    page, depth = project(
        corners @ motion.frame[t]
    )  # the corners in space: g = Eᵀ
    lines = [page[list(edge)] for edge in edges]
    shade = [depth[list(edge)].mean() for edge in edges]
    order = np.argsort(shade)
    axes.add_collection(
        LineCollection(
            [lines[k] for k in order],
            array=np.sort(shade),
            cmap="viridis",
            linewidths=1 + 2.5 * (np.sort(shade) + 0.7),
        )
    )
    axes.scatter(*page.T, c=depth, cmap="viridis", s=30, zorder=3)
    axes.set(
        xlim=(-0.23, 0.23),
        ylim=(-0.23, 0.23),
        aspect="equal",
        title=f"$t = {t / 200:g}$",
    )
    axes.axis("off")

axes = figure.add_subplot(grid[1, :])
points = motion.q[:, :3] / (1.35 - motion.q[:, 3:])
page = points @ view.T
order = np.argsort(page[:-1, 2])
segments = np.stack([page[:-1, :2], page[1:, :2]], axis=1)[order]
colours = plt.cm.plasma(motion.times[:-1] / motion.times[-1])[order]
near = (page[:-1, 2][order] - page[:, 2].min()) / np.ptp(page[:, 2])
axes.add_collection(
    LineCollection(segments, colors=colours, linewidths=0.3 + 1.7 * near**2)
)
axes.autoscale()
axes.set(
    aspect="equal",
    title="the path of $q$, from early (dark) to late (bright)",
)
axes.axis("off")
plt.show()
