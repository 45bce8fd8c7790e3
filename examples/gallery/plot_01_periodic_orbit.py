r"""
A periodic orbit
================

The motion of a body in space has two frequencies. Where their ratio is
rational, the path of γ on the sphere closes. Here the initial velocity is
solved for, so that the ratio is 5 : 7.

The time after which the path closes is not the number of cycles over a mean
frequency: a mean over the torus is not the mean along one closed orbit. The
period is found where Neumann time has grown by the number of its cycles.
"""

import numpy as np
from matplotlib import pyplot as plt
from scipy.optimize import brentq

import veselova as vs

BLUE, RED = "#0072B2", "#D55E00"


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


def body(slope):
    return vs.Veselova(
        [3, 2, 1], [0.64, 0.54, 0.54], [1, slope, 0.3], normalize=True
    )


def slope_of(ratio):
    def defect(slope):
        slow, fast = vs.torus(body(slope)).frequencies_tau1
        return slow / fast - ratio

    return brentq(defect, -0.2, 0.6, xtol=1e-15)


# %%
# A velocity for which :math:`f_1 : f_2 = 5 : 7`, and the period. Signs of
# components of γ return after two cycles of each phase, which takes 10 and
# 14 cycles.

slope = slope_of(5 / 7)
closed = body(slope)
torus = vs.torus(closed)
cycles = 10 / torus.frequencies_tau1[0]  # in Neumann time


def excess(t):
    return vs.solve(closed, [t]).tau1[0] - cycles


guess = 10 / torus.frequencies_t[0]
period = brentq(excess, 0.8 * guess, 1.2 * guess, xtol=1e-13)
print(
    f"slope {slope:.12f}, period {period:.12f},",
    f"cycles over mean frequency {guess:.12f}",
)

# %%
# The orbit, and another one that does not close.

orbit = vs.solve(closed, np.linspace(0, period, 6001))
print(f"the path closes to {np.abs(orbit.q[-1] - orbit.q[0]).max():.0e}")
other = vs.solve(
    body(slope_of(np.sqrt(0.5))), np.linspace(0, 12 * period, 40_001)
)

view = camera(20, 22)
figure, axes = plt.subplots(1, 2, figsize=(10, 5), layout="constrained")
draw_surface(axes[0], view)
draw_curve(axes[0], orbit.q, view, RED, 2.2)
axes[0].plot(*(view[:2] @ orbit.q[0]), "ko")
axes[0].set_title(f"$f_1:f_2 = 5:7$, closed after $t = {period:.4f}$")
draw_surface(axes[1], view)
draw_curve(axes[1], other.q, view, BLUE, 0.5)
axes[1].set_title(r"$f_1:f_2 = 1:\sqrt{2}$, never closed")
plt.show()
