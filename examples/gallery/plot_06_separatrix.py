r"""
Beside a separatrix
===================

Where :math:`c_2 = I_2` the motion tends to a rotation about the middle axis. A start beside it
stays longer, the nearer it is: the time between two turns grows like the logarithm of the distance.
The data are texts, taken exactly, so that distances of 1e-30 and 1e-60 can be told apart.
"""

import numpy as np
from drawing import BLUE, GREEN, ORANGE, RED, camera, draw_curve, draw_surface
from matplotlib import pyplot as plt

import veselova as vs

# %%
# γ starts on the middle axis. With A = (3, 2, 1) the velocity (1, 0, 3) lies on the separatrix.

distances = ["1e-60", "1e-30", "1e-15", "1e-3"]
times = np.linspace(0, 120, 4001)
motions = {}
for distance in distances:
    slope = "3." + "0" * (int(distance[3:]) - 1) + "1"
    body = vs.Veselova([3, 2, 1], [0, 1, 0], [1, 0, slope])
    motions[distance] = vs.solve(body, times)
    print(f"distance {distance:>5}: largest error bound {motions[distance].error.max():.0e}")

figure = plt.figure(figsize=(11, 5.2), layout="constrained")
grid = figure.add_gridspec(4, 2, width_ratios=[1.5, 1])
rows = [figure.add_subplot(grid[k, 0]) for k in range(4)]
colours = [BLUE, GREEN, ORANGE, RED]
for axis, distance, colour in zip(rows, distances, colours, strict=True):
    axis.plot(times, motions[distance].q[:, 1], color=colour, linewidth=1.3)
    axis.set(ylim=(-1.15, 1.15), xlim=(0, 120), ylabel=r"$\gamma_2$", yticks=[-1, 0, 1])
    axis.set_title(f"distance {distance}", loc="right", fontsize=10)
    axis.label_outer()
rows[-1].set_xlabel("$t$")
sphere = figure.add_subplot(grid[:, 1])
view = camera(20, 18)
draw_surface(sphere, view=view)
draw_curve(sphere, motions["1e-3"].q, view=view, colour=RED, width=0.9)
draw_curve(sphere, motions["1e-60"].q, view=view, colour=BLUE, width=2.2)
sphere.set_title("distances 1e-60 and 1e-3")
plt.show()
