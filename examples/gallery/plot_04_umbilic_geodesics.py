r"""
Geodesics through an umbilic
============================

An ellipsoid with three different axes has four umbilics, where its two curvatures are equal. Every
geodesic through one of them passes through the opposite one. A single such geodesic, followed on,
tends to the ellipse through all four.
"""

import numpy as np
from drawing import BLUE, PURPLE, RED, camera, draw_curve, draw_points, draw_surface
from matplotlib import pyplot as plt

import veselova as vs

A = np.array([4, 2, 1])  # squares of the semi-axes
semiaxes = np.sqrt(A)
x = np.sqrt(A[0] * (A[0] - A[1]) / (A[0] - A[2]))
z = np.sqrt(A[2] * (A[1] - A[2]) / (A[0] - A[2]))
umbilics = np.array([[x, 0, z], [-x, 0, z], [x, 0, -z], [-x, 0, -z]])


def geodesic(angle, lengths):
    """Return the geodesic that leaves the first umbilic at an angle to the y-axis."""
    along = np.cross([0, 1, 0], umbilics[0] / A)
    along /= np.linalg.norm(along)
    direction = np.cos(angle) * np.array([0, 1, 0]) + np.sin(angle) * along
    start = vs.EllipsoidGeodesic(A, umbilics[0], direction, normalize=True)
    return vs.solve(start, lengths)


# %%
# All geodesics from an umbilic to the opposite one have the same length, half of the ellipse.

t = np.linspace(0, np.pi, 4001)
ellipse = np.stack([semiaxes[0] * np.cos(t), np.zeros_like(t), semiaxes[2] * np.sin(t)], axis=1)
half = np.linalg.norm(np.diff(ellipse, axis=0), axis=1).sum()
fan = [
    geodesic(angle, np.linspace(0, half, 801)) for angle in np.arange(0.1, 2 * np.pi, np.pi / 14)
]
miss = max(np.linalg.norm(path.X[-1] - umbilics[3]) for path in fan)
print(f"half of the ellipse {half:.6f}; largest distance from the opposite umbilic {miss:.0e}")
long = geodesic(0.05, np.linspace(0, 7 * half, 6001))

view = camera(-38, 30)
figure, axes = plt.subplots(1, 2, figsize=(11, 4.6), layout="constrained")
titles = ["every geodesic meets the opposite umbilic", "one geodesic, seven times across"]
for axis, title in zip(axes, titles, strict=True):
    draw_surface(axis, semiaxes, view, colour=(0.93, 0.89, 0.80))
    axis.set_title(title)
for path in fan:
    draw_curve(axes[0], path.X, semiaxes, view, colour=BLUE, width=1.0, far=0.3)
draw_curve(axes[1], long.X, semiaxes, view, colour=RED, width=1.4, far=0.3)
for axis in axes:
    draw_points(axis, umbilics, semiaxes, view, color=PURPLE, edgecolors="black", s=45)
plt.show()
