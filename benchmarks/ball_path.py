"""Draw where balls roll, docs/ball-path.svg: python benchmarks/ball_path.py [picture].

A ball that may not twist stays in a strip along its momentum. Chaplygin's ball and the ball with
constant spin drift across theirs. Each path is the closed form, and its arrow ``ball.drift``.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np

import veselova as vs

PICTURE = Path(__file__).parent.parent / "docs" / "ball-path.svg"

#: Inertia about the centre, mass, radius and γ of all three.
BALL: dict[str, Any] = {
    "inertia": ["0.11", "0.85", "0.92"],
    "mass": "0.1",
    "radius": 1,
    "gamma": ["2/7", "3/7", "6/7"],
}

BALLS = (
    ("does not twist", vs.RubberBall(**BALL, Omega=["-0.96", "0.2", "0.22"])),
    ("twists steadily", vs.RubberBall(**BALL, Omega=["-0.96", "0.2", "0.5"])),
    ("twists freely (Chaplygin)", vs.ChaplyginBall(**BALL, Omega=["-0.96", "0.2", "0.5"])),
)

#: The longest time, and states of a path.
LAST = 30.0
COUNT = 601


def draw(picture: Path) -> None:
    """Write the paths, each turned so that its mean velocity points to the right."""
    import matplotlib

    matplotlib.use("svg")
    matplotlib.rcParams["svg.hashsalt"] = "ball-path"
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(len(BALLS), 1, figsize=(9, 3.9), sharex=True)
    times = np.linspace(0, LAST, COUNT)
    for axis, (name, ball) in zip(axes, BALLS, strict=True):
        motion = vs.solve(ball, times)
        along = ball.drift.direction
        across = np.array([-along[1], along[0]])
        turned = motion.position @ np.stack([along, across], axis=1)
        axis.plot(*turned.T, color="#1b6ca8", linewidth=1.1)
        axis.axhspan(turned[:, 1].min(), turned[:, 1].max(), color="#1b6ca8", alpha=0.08)
        axis.plot(*turned[0], "o", color="#1b6ca8", markersize=4)
        end = ball.drift.speed * LAST
        level = turned[:, 1].mean()
        axis.annotate(
            "",
            xy=(end, level),
            xytext=(0, level),
            arrowprops={"arrowstyle": "->", "color": "#c2571a", "linewidth": 1.0},
        )
        axis.set_title(name, loc="left", fontsize=10)
        axis.set_aspect("equal")
        axis.set_ylabel("across")
        for side in ("top", "right"):
            axis.spines[side].set_visible(False)
    axes[-1].set_xlabel("along the mean velocity, in radii of the ball (t from 0 to 30)")
    figure.tight_layout()
    figure.savefig(picture, metadata={"Date": None, "Creator": None})
    print(f"wrote {picture}")


if __name__ == "__main__":
    draw(Path(sys.argv[1]) if len(sys.argv) > 1 else PICTURE)
