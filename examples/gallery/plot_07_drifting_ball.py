r"""
A drifting ball
===============

A ball that neither slips nor twists obeys Veselova's equations. Its centre
goes on at a constant speed, across its momentum K, and sways beside that
line: here regularly, and in bursts for a start near a separatrix. The path
is known in closed form, so the position after a million units of time costs
no more than the first.
"""

import numpy as np
from matplotlib import pyplot as plt

import veselova as vs

BLUE, GREEN, ORANGE, RED = "#0072B2", "#009E73", "#E69F00", "#D55E00"


def roll(gamma, Omega):
    """Return a ball, its motion, and its path, the drift to the right."""
    ball = vs.RubberBall(
        [0.4, 0.6, 0.98], 1, 1, gamma, Omega, normalize=True
    )
    motion = vs.solve(ball, np.linspace(0, 100, 10_001))
    along = ball.drift.velocity / np.linalg.norm(ball.drift.velocity)
    turn = np.array([along, [-along[1], along[0]]])
    return ball, motion, motion.position @ turn.T, turn


ball, motion, path, turn = roll([-0.48, 0.8, 0.36], [0.8, 0.48, 0])
far = vs.solve(ball, [1_000_000])
print("mean velocity", ball.drift.velocity.round(9))
print(
    "position at t = 1 000 000:",
    far.position[0].round(5),
    f"± {far.error[0]:.0e}",
)

# %%
# The ball seen from above at seven times, with three circles drawn on it;
# then longer paths.

figure, axes = plt.subplots(
    3, 1, figsize=(10, 6.6), height_ratios=[1.2, 1, 1], layout="constrained"
)
axes[0].plot(*path.T, color="black", linewidth=1.5, zorder=6)
circle = np.exp(2j * np.pi * np.linspace(0, 1, 300))
for k in range(0, 1501, 250):
    x, y = path[k]
    axes[0].fill(
        x + circle.real, y + circle.imag, color="#e4ebf3", zorder=3
    )
    axes[0].plot(
        x + circle.real,
        y + circle.imag,
        color="0.35",
        zorder=5,
        linewidth=0.9,
    )
    attitude = motion.frame[
        k
    ].T  # from the body to space; its first row is the vertical
    for i, colour in enumerate((ORANGE, BLUE, GREEN)):
        a, b = np.delete(np.eye(3), i, axis=0)
        space = (
            np.outer(circle.real, a) + np.outer(circle.imag, b)
        ) @ attitude.T
        seen = np.where(space[:, :1] > 0, space[:, 1:] @ turn.T, np.nan)
        axes[0].plot(
            x + seen[:, 0],
            y + seen[:, 1],
            color=colour,
            linewidth=1.6,
            zorder=4,
        )
axes[0].set(
    aspect="equal",
    xlim=(-1.2, path[1500, 0] + 1.2),
    title="from above; the path in black",
)
axes[0].axis("off")

_, _, burst, _ = roll([0, 1, 0], [-0.8538, 0, 0.5206])
titles = ("the same ball, longer", "a start near a separatrix")
for axis, curve, colour, title in zip(
    axes[1:], (path, burst), (BLUE, RED), titles, strict=True
):
    axis.plot(*curve.T, color=colour, linewidth=1.3)
    axis.set(ylabel="across", xlim=(0, curve[-1, 0]))
    axis.set_title(title, loc="right", fontsize=10)
axes[2].set_xlabel("along the mean velocity")
plt.show()
