r"""
Geodesics through an umbilic
============================

An ellipsoid with three different axes has four umbilics, where its two
curvatures are equal. Every geodesic through one of them passes through the
opposite one. A single such geodesic, followed on, tends to the ellipse
through all four.
"""

import numpy as np
from matplotlib import pyplot as plt

import veselova as vs

BLUE, PURPLE, RED = "#0072B2", "#CC79A7", "#D55E00"


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


A = np.array([4, 2, 1])  # squares of the semi-axes
semiaxes = np.sqrt(A)
x = np.sqrt(A[0] * (A[0] - A[1]) / (A[0] - A[2]))
z = np.sqrt(A[2] * (A[1] - A[2]) / (A[0] - A[2]))
umbilics = np.array([[x, 0, z], [-x, 0, z], [x, 0, -z], [-x, 0, -z]])


def geodesic(angle, lengths):
    """Return the geodesic from the first umbilic at an angle to y."""
    along = np.cross([0, 1, 0], umbilics[0] / A)
    along /= np.linalg.norm(along)
    direction = np.cos(angle) * np.array([0, 1, 0]) + np.sin(angle) * along
    start = vs.EllipsoidGeodesic(A, umbilics[0], direction, normalize=True)
    return vs.solve(start, lengths)


# %%
# All geodesics from an umbilic to the opposite one have the same length,
# half of the ellipse.

t = np.linspace(0, np.pi, 4001)
ellipse = np.stack(
    [semiaxes[0] * np.cos(t), np.zeros_like(t), semiaxes[2] * np.sin(t)],
    axis=1,
)
half = np.linalg.norm(np.diff(ellipse, axis=0), axis=1).sum()
fan = [
    geodesic(angle, np.linspace(0, half, 801))
    for angle in np.arange(0.1, 2 * np.pi, np.pi / 14)
]
miss = max(np.linalg.norm(path.X[-1] - umbilics[3]) for path in fan)
print(
    f"half of the ellipse {half:.6f};",
    f"largest distance from the opposite umbilic {miss:.0e}",
)
long = geodesic(0.05, np.linspace(0, 7 * half, 6001))

view = camera(-38, 30)
figure, axes = plt.subplots(1, 2, figsize=(11, 4.6), layout="constrained")
titles = [
    "every geodesic meets the opposite umbilic",
    "one geodesic, seven times across",
]
for axis, title in zip(axes, titles, strict=True):
    draw_surface(axis, view, semiaxes, "YlOrBr_r")
    axis.set_title(title)
for path in fan:
    draw_curve(axes[0], path.X, view, BLUE, 1.0, semiaxes)
draw_curve(axes[1], long.X, view, RED, 1.4, semiaxes)
seen = umbilics[(umbilics / A) @ view[2] > 0] @ view[:2].T
for axis in axes:
    axis.scatter(*seen.T, color=PURPLE, edgecolors="black", s=45, zorder=5)
plt.show()
