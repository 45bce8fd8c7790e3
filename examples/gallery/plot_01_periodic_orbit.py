r"""
A periodic orbit
================

The motion of a body in space has two frequencies. Where their ratio is rational, the path of γ on
the sphere closes. Here the initial velocity is solved for, so that the ratio is 5 : 7.

The time after which the path closes is not the number of cycles over a mean frequency: a mean over
the torus is not the mean along one closed orbit. The period is found where Neumann time has grown
by the number of its cycles.
"""

import numpy as np
from drawing import BLUE, RED, camera, draw_curve, draw_points, draw_surface
from matplotlib import pyplot as plt
from scipy.optimize import brentq

import veselova as vs


def body(slope):
    return vs.Veselova([3, 2, 1], [0.64, 0.54, 0.54], [1, slope, 0.3], normalize=True)


def slope_of(ratio):
    def defect(slope):
        slow, fast = vs.torus(body(slope)).frequencies_tau1
        return slow / fast - ratio

    return brentq(defect, -0.2, 0.6, xtol=1e-15)


# %%
# A velocity for which :math:`f_1 : f_2 = 5 : 7`, and the period. Signs of components of γ return
# after two cycles of each phase, which takes 10 and 14 cycles.

slope = slope_of(5 / 7)
closed = body(slope)
torus = vs.torus(closed)
cycles = 10 / torus.frequencies_tau1[0]  # in Neumann time


def excess(t):
    return vs.solve(closed, [t]).tau1[0] - cycles


guess = 10 / torus.frequencies_t[0]
period = brentq(excess, 0.8 * guess, 1.2 * guess, xtol=1e-13)
print(f"slope {slope:.12f}, period {period:.12f}, cycles over mean frequency {guess:.12f}")

# %%
# The orbit, and another one that does not close.

orbit = vs.solve(closed, np.linspace(0, period, 6001))
print(f"the path closes to {np.abs(orbit.q[-1] - orbit.q[0]).max():.0e}")
other = vs.solve(body(slope_of(np.sqrt(0.5))), np.linspace(0, 12 * period, 40_001))

view = camera(20, 22)
figure, axes = plt.subplots(1, 2, figsize=(10, 5), layout="constrained")
draw_surface(axes[0], view=view)
draw_curve(axes[0], orbit.q, view=view, colour=RED, width=2.2)
draw_points(axes[0], orbit.q[0], view=view, color="black", s=30)
axes[0].set_title(f"$f_1:f_2 = 5:7$, closed after $t = {period:.4f}$")
draw_surface(axes[1], view=view)
draw_curve(axes[1], other.q, view=view, colour=BLUE, width=0.5)
axes[1].set_title(r"$f_1:f_2 = 1:\sqrt{2}$, never closed")
plt.show()
