r"""
Beside a separatrix
===================

Where :math:`c_2 = I_2` the motion tends to a rotation about the middle
axis. A start beside it stays longer, the nearer it is: the time between two
turns grows like the logarithm of the distance. The data are texts, taken
exactly, so that distances of 1e-30 and 1e-60 can be told apart.
"""

import numpy as np
from matplotlib import pyplot as plt

import veselova as vs

BLUE, GREEN, ORANGE, RED = "#0072B2", "#009E73", "#E69F00", "#D55E00"


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


# %%
# γ starts on the middle axis. With A = (3, 2, 1) the velocity (1, 0, 3)
# lies on the separatrix.

distances = ["1e-60", "1e-30", "1e-15", "1e-3"]
times = np.linspace(0, 120, 4001)
motions = {}
for distance in distances:
    slope = "3." + "0" * (int(distance[3:]) - 1) + "1"
    body = vs.Veselova([3, 2, 1], [0, 1, 0], [1, 0, slope])
    motions[distance] = vs.solve(body, times)
    print(
        f"distance {distance:>5}:",
        f"largest error bound {motions[distance].error.max():.0e}",
    )

figure = plt.figure(figsize=(11, 5.2), layout="constrained")
grid = figure.add_gridspec(4, 2, width_ratios=[1.5, 1])
rows = [figure.add_subplot(grid[k, 0]) for k in range(4)]
colours = [BLUE, GREEN, ORANGE, RED]
for axis, distance, colour in zip(rows, distances, colours, strict=True):
    axis.plot(times, motions[distance].q[:, 1], color=colour, linewidth=1.3)
    axis.set(
        ylim=(-1.15, 1.15),
        xlim=(0, 120),
        ylabel=r"$\gamma_2$",
        yticks=[-1, 0, 1],
    )
    axis.set_title(f"distance {distance}", loc="right", fontsize=10)
    axis.label_outer()
rows[-1].set_xlabel("$t$")
sphere = figure.add_subplot(grid[:, 1])
view = camera(20, 18)
draw_surface(sphere, view)
draw_curve(sphere, motions["1e-3"].q, view, RED, 0.9)
draw_curve(sphere, motions["1e-60"].q, view, BLUE, 2.2)
sphere.set_title("distances 1e-60 and 1e-3")
plt.show()
