"""Pictures of curves on spheres and ellipsoids, as the examples of the gallery draw them."""

import matplotlib as mpl
import numpy as np
from matplotlib.collections import LineCollection

BLUE, RED, GREEN, PURPLE, ORANGE = "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00"
mpl.rcParams |= {"figure.dpi": 110, "savefig.dpi": 110, "font.size": 11, "mathtext.fontset": "cm"}


def camera(azimuth=35.0, elevation=25.0):
    """Return the directions on the page: to the right, upwards, and towards the eye."""
    a, e = np.radians([azimuth, elevation])
    right = np.array([-np.sin(a), np.cos(a), 0])
    towards = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    return np.array([right, np.cross(towards, right), towards])


def draw_surface(axes, semiaxes=(1, 1, 1), view=None, colour=(0.80, 0.86, 0.93)):
    """Draw a shaded ellipsoid as it is seen from afar."""
    view = camera() if view is None else view
    form = view @ np.diag(1 / np.square(semiaxes)) @ view.T
    reach = 1.03 * np.sqrt(np.diag(np.linalg.inv(form)))
    x, y = np.meshgrid(*(np.linspace(-r, r, 700) for r in reach[:2]))
    half = (form[0, 2] * x + form[1, 2] * y) / form[2, 2]
    rest = (form[0, 0] * x**2 + 2 * form[0, 1] * x * y + form[1, 1] * y**2 - 1) / form[2, 2]
    inside = half**2 - rest
    depth = np.sqrt(np.maximum(inside, 0)) - half
    normal = np.einsum("ij,jkl->ikl", form, np.stack([x, y, depth]))
    normal /= np.linalg.norm(normal, axis=0)
    light = np.tensordot(np.array([-0.45, 0.55, 0.70]), normal, 1).clip(0, 1)
    image = np.ones((*x.shape, 4))
    image[..., :3] = (np.array(colour) * (0.72 + 0.28 * light[..., None])).clip(0, 1)
    image[..., :3] += 0.25 * light[..., None] ** 12 * (1 - image[..., :3])
    # The edge is smooth over two pixels.
    image[..., 3] = (80 * inside / inside.max()).clip(0, 1)
    extent = (-reach[0], reach[0], -reach[1], reach[1])
    axes.imshow(image, extent=extent, origin="lower", zorder=1)
    axes.set(xlim=1.02 * np.array(extent[:2]), ylim=1.02 * np.array(extent[2:]), aspect="equal")
    axes.axis("off")


def draw_curve(axes, points, semiaxes=(1, 1, 1), view=None, colour=BLUE, width=1.6, far=0.22):
    """Draw a curve on an ellipsoid: the near side on top, the far side faint."""
    view = camera() if view is None else view
    page = points @ view[:2].T
    near = (points / np.square(semiaxes)) @ view[2] > 0
    lines = np.stack([page[:-1], page[1:]], axis=1)
    colours = np.broadcast_to(mpl.colors.to_rgba_array(colour), (len(points), 4))[:-1]
    for side, alpha, order in ((~near[:-1], far, 2), (near[:-1], 1.0, 3)):
        part = colours[side].copy()
        part[:, 3] *= alpha
        axes.add_collection(
            LineCollection(lines[side], colors=part, linewidths=width, zorder=order)
        )


def draw_points(axes, points, semiaxes=(1, 1, 1), view=None, **style):
    """Draw points on the near side of an ellipsoid."""
    view = camera() if view is None else view
    points = np.atleast_2d(points)
    near = (points / np.square(semiaxes)) @ view[2] > 0
    axes.scatter(*(points[near] @ view[:2].T).T, zorder=5, **style)
