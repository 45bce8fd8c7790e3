r"""
A resonance scan
================

The ratio of the two frequencies of a body depends on its inertia and on one
constant of the motion, :math:`c_2`. The picture has 2500 tori. Lines mark
ratios with small denominators: there the path of γ closes. Along the white
line the motion is a separatrix.
"""

import numpy as np
from matplotlib import pyplot as plt

import veselova as vs

# %%
# γ starts on the second axis. Then the angle of its velocity determines
# :math:`c_2`.

middle = np.linspace(1.02, 2.98, 50)
angle = np.linspace(0.02, np.pi / 2 - 0.02, 50)
A2, theta = (
    grid.ravel() for grid in np.meshgrid(middle, angle, indexing="ij")
)
ones, zeros = np.ones_like(A2), np.zeros_like(A2)
A = np.stack([3 * ones, A2, ones], axis=1)
q_dot = np.stack([np.cos(theta), zeros, np.sin(theta)], axis=1)
tori = vs.tori(A, [[0, 1, 0]] * len(A), q_dot)
print(np.unique(tori.outcome, return_counts=True))

# %%
# The ratio, with its resonances.

shape = (middle.size, angle.size)
c2 = 4 / 3 - 1 / (3 * np.cos(theta) ** 2 + np.sin(theta) ** 2)
ratio = (tori.frequencies_tau1[:, 0] / tori.frequencies_tau1[:, 1]).reshape(
    shape
)
figure, axes = plt.subplots(figsize=(8.5, 6), layout="constrained")
grid = A2.reshape(shape), c2.reshape(shape)
image = axes.pcolormesh(
    *grid, ratio, cmap="viridis", shading="gouraud", rasterized=True
)
figure.colorbar(image, label="$f_1/f_2$")
resonances = {
    f"{p}:{q}": p / q
    for q in range(2, 8)
    for p in range(1, q)
    if np.gcd(p, q) == 1
}
levels = dict(sorted(((value, name) for name, value in resonances.items())))
for side in (grid[1] < 1 / grid[0], grid[1] > 1 / grid[0]):
    values = np.where(side, ratio, np.nan)
    lines = axes.contour(
        *grid, values, levels=list(levels), colors="black", linewidths=0.9
    )
    axes.clabel(lines, fmt=levels, fontsize=9)
axes.plot(middle, 1 / middle, color="white", linewidth=2.5)
axes.set(
    xlabel="$A_2$, with $A_1 = 3$ and $A_3 = 1$",
    ylabel="$c_2$",
    ylim=(c2.min(), c2.max()),
)
plt.show()
