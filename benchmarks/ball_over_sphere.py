"""Draw sections of balls over spheres, docs/ball-over-sphere.svg: python
benchmarks/ball_over_sphere.py [picture].

Every point is a passage of γ through the plane γ_2 = 0, upwards: where, and in which direction; a
start has one colour. At ε = −1 the points of a start lie on curves, at ε = ½ some fill areas.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

import veselova as vs

PICTURE = Path(__file__).parent.parent / "docs" / "ball-over-sphere.svg"

#: A body of moments J = (1, 0.8, 0.22) about the contact point, over a sphere of radius σ.
BALL: dict[str, Any] = {"inertia": ["0.999", "0.799", "0.219"], "mass": "0.001", "radius": 1}

CASES: tuple[tuple[str, dict[str, Any]], ...] = (
    (
        "ε = −1, a shell around the sphere: every start stays on a curve",
        {"sphere": "0.5", "side": "around"},
    ),
    (
        "ε = ½, a ball outside of an equal one: some starts fill areas",
        {"sphere": 1, "side": "outside"},
    ),
)

#: Starts of each, and the longest time: too far for digits where motions are chaotic.
#: Integration to 1e-8 would blur curves.
STARTS, LAST = 8, 600.0


def section(ball: Any) -> Any:
    """Return the angles of γ in its plane and of its velocity against the plane, (N, 2)."""

    def height(_: float, state: Any) -> float:
        return float(state[4])

    height.direction = 1  # type: ignore[attr-defined]
    found = solve_ivp(
        ball.rhs,
        (0.0, LAST),
        ball.initial_state(),
        "DOP853",
        rtol=1e-12,
        atol=1e-13,
        events=height,
    )
    rows = []
    for state in found.y_events[0]:
        series = ball.series_of(state[None])
        (x, _, z), v = series["gamma"][0], ball.velocity(series)[0] * float(ball.ratio)
        along = (v[2] * x - v[0] * z) / np.linalg.norm(v)
        rows.append((np.arctan2(z, x) % np.pi, along))
    return np.array(rows).reshape(-1, 2)


def draw(picture: Path) -> None:
    """Write the two sections side by side."""
    import matplotlib

    matplotlib.use("svg")
    matplotlib.rcParams["svg.hashsalt"] = "ball-over-sphere"
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(1, 2, figsize=(9, 3.6), sharey=True)
    for axis, (name, where) in zip(axes, CASES, strict=True):
        for angle in np.linspace(0.05, np.pi / 2, STARTS):
            # γ in the plane, its velocity at an angle to it
            gamma = np.array([np.cos(angle), 0.0, np.sin(angle)])
            v = np.array([-0.3 * gamma[2], np.sqrt(0.91), 0.3 * gamma[0]])
            Omega = np.cross(v, gamma)
            ball = vs.RubberBall(**BALL, **where, gamma=gamma, Omega=Omega)
            points = section(ball)
            axis.plot(*points.T, ".", markersize=1.8, rasterized=True)
        axis.set_title(name, loc="left", fontsize=9)
        axis.set_xlabel("angle of γ in the plane $γ_2 = 0$, radians")
        for side in ("top", "right"):
            axis.spines[side].set_visible(False)
    axes[0].set_ylabel("part of γ̇ along the plane")
    figure.tight_layout()
    figure.savefig(picture, dpi=200, metadata={"Date": None, "Creator": None})
    print(f"wrote {picture}")


if __name__ == "__main__":
    draw(Path(sys.argv[1]) if len(sys.argv) > 1 else PICTURE)
