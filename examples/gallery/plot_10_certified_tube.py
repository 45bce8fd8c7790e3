r"""
A certified tube
================

Every component of a motion has an error bound, and with ``certified=True``
a proven one. Drawn true to scale the tube around the motion is thinner than
any line. Here it is magnified, and its true radius is below: of
integration, of the closed form in doubles, and of the proven enclosure.
"""

import numpy as np
from matplotlib import pyplot as plt

import veselova as vs

BLUE, GREEN, RED = "#0072B2", "#009E73", "#D55E00"

body = vs.Veselova([3, 2, 1], ["0.6", 0, "0.8"], ["0.8", 1, "-0.6"])
times = np.linspace(0, 20, 401)
closed = vs.solve(body, times)
integrated = vs.solve(body, times, "numeric")
proven_times = np.linspace(0, 20, 5)
proven = vs.solve(body, proven_times, certified=True, digits=20).decimals
radii = proven.radii["q"].astype(float).max(axis=1)
true = np.abs(closed.q[::100] - proven.midpoints["q"].astype(float)).max(
    axis=1
)
print("proven:", proven.certified, f"largest radius {radii.max():.0e}")
print(f"true error of the closed form in doubles: {true.max():.0e}")

scale = 2e9
figure, axes = plt.subplots(
    2, 1, figsize=(10, 6.4), sharex=True, layout="constrained"
)
for name, motion, colour in (
    ("integration", integrated, RED),
    ("closed form", closed, BLUE),
):
    half = scale * motion.error
    low, high = motion.q[:, 0] - half, motion.q[:, 0] + half
    axes[0].fill_between(
        times, low, high, color=colour, alpha=0.35, linewidth=0, label=name
    )
    axes[1].semilogy(
        times, motion.error, color=colour, label=f"{name}: error bound"
    )
axes[0].plot(times, closed.q[:, 0], color="black", linewidth=0.8)
axes[0].set(
    ylabel=r"$\gamma_1$",
    ylim=(-1.6, 1.6),
    title=f"radius of the tube × {scale:.0e}",
)
axes[0].legend(loc="upper left", ncols=2)
axes[1].semilogy(
    proven_times[1:],
    true[1:].clip(1e-18),
    "k.",
    label="closed form: true error",
)
axes[1].semilogy(
    proven_times,
    radii,
    "o-",
    color=GREEN,
    markersize=4,
    label="proven, 20 digits",
)
axes[1].set(xlabel="$t$", ylabel="radius", ylim=(1e-24, 1e-8), xlim=(0, 20))
axes[1].legend(loc="upper right", bbox_to_anchor=(1, 0.5), ncols=2)
plt.show()
