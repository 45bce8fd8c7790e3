"""The problem table: motions with tags, through which every engine runs.

Tags: ``generic`` (all branch points distinct), ``special-start`` (generic torus, start on a
coordinate axis or at a turning point), ``near-degenerate`` (a gap or cut nearly closed),
``closed-cut`` (equal A's, or directions that do not move),
``separatrix`` (some c_k = I_i), ``at-rest``, ``wide`` (A's over many orders of magnitude),
``matrix`` (A given as a matrix),
``scaled`` (units far from one), ``reference`` (45-digit motion).
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cache
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import brentq

from veselova import ChaplyginBall, RubberBall, Veselova, VeselovaSO3

REFERENCE = Path(__file__).parent / "reference" / "rank1.json"


@dataclass(frozen=True, eq=False)
class Case:
    """One row of the table: the problem, the times of interest, and the reference points where
    there are any.
    """

    name: str
    A: Sequence[Any]
    q: Sequence[Any]
    q_dot: Sequence[Any]
    tags: frozenset[str]
    frame: Any = None
    span: float = 50.0
    points: tuple[dict[str, Any], ...] = field(default=(), repr=False)

    @cache  # noqa: B019 - cases live as long as the module
    def problem(self) -> Veselova:
        """Return the problem, normalised."""
        return Veselova(self.A, self.q, self.q_dot, self.frame, normalize=True)

    def times(self, count: int = 6) -> np.ndarray[Any, np.dtype[np.float64]]:
        """Return times in both directions up to the end of the span, zero not among them."""
        half = self.span * np.geomspace(1e-2, 1.0, count // 2)
        return np.concatenate([-half[::-1], half])


def _tags(*names: str) -> frozenset[str]:
    return frozenset(names)


def _reference_cases() -> list[Case]:
    special = {
        "axis-start": _tags("generic", "special-start"),
        "planar": _tags("closed-cut"),
        "symmetric-two": _tags("closed-cut"),
        "near-equal": _tags("generic", "near-degenerate"),
        "slow": _tags("generic", "scaled"),
    }
    cases = []
    for item in json.loads(REFERENCE.read_text())["problems"]:
        tags = special.get(item["name"], _tags("generic")) | {"reference"}
        span = max(float(point["t"]) for point in item["points"])
        cases.append(
            Case(
                item["name"],
                item["A"],
                item["q"],
                item["q_dot"],
                tags,
                item["frame"],
                span,
                tuple(item["points"]),
            )
        )
    return cases


def near_separatrix(gap: float) -> Case:
    """Return an n = 3 motion with c_2 above I_2 by about ``gap``: the unstable great circle's
    neighbourhood.

    q' is turned in the tangent plane until F_2 = q_2² + Σ P_2j²/(I_2−I_j), which vanishes where c_2
    = I_2, is as wanted.
    """
    A = np.array([3.0, 2.0, 1.0])
    q = np.array([0.6, 0.48, 0.64])
    tangent = np.array([0.8, -0.36, -0.48]), np.array([0.0, 0.8, -0.6])

    def excess(angle: float) -> float:
        problem = Veselova(
            A, q, np.cos(angle) * tangent[0] + np.sin(angle) * tangent[1], normalize=True
        )
        return float(problem.constants[0]) - 0.5 - gap

    angles = np.linspace(0, np.pi, 40)
    values = np.array([excess(angle) for angle in angles])
    k = np.flatnonzero(values[:-1] * values[1:] < 0)[0]
    angle = brentq(excess, angles[k], angles[k + 1], xtol=1e-17, rtol=1e-15)
    q_dot = np.cos(angle) * tangent[0] + np.sin(angle) * tangent[1]
    return Case(
        f"near-separatrix-{gap:g}",
        A.tolist(),
        q.tolist(),
        q_dot.tolist(),
        _tags("generic", "near-degenerate"),
        span=30.0,
    )


def _matrix_case() -> Case:
    rotation = np.linalg.qr(np.random.default_rng(7).normal(size=(4, 4)))[0]
    A = rotation @ np.diag([3.0, 2.0, 1.5, 1.0]) @ rotation.T
    return Case(
        "matrix-inertia",
        ((A + A.T) / 2).tolist(),
        [0.5, 0.5, 0.5, 0.5],
        [1.1, -0.7, 0.3, -0.7],
        _tags("generic", "matrix"),
    )


TABLE: tuple[Case, ...] = (
    *_reference_cases(),
    Case("body4", [3, 2, "1.5", 1], ["0.5"] * 4, ["1.1", "-0.7", "0.3", "-0.7"], _tags("generic")),
    Case(
        "rising-A",
        [0.3, 0.5, 0.8, 1.3, 2.1],
        [1, -1, 2, -2, 1],
        [0.1, 0.3, -0.2, 0.5, 1],
        _tags("generic"),
    ),
    Case(
        "eight",
        [1, 2, 3, 4, 5, 6, 7, 8],
        [1, 1, -1, 1, 1, -1, 1, 1],
        [1, -2, 3, -4, 3, 2, -1, 0.5],
        _tags("generic"),
        span=20,
    ),
    Case("ratio-100", [100, 10, 1], [0.2, 0.5, 0.8], [1, 0.3, -0.4], _tags("generic")),
    Case("turning-point", [3, 2, 1], [0.6, 0, 0.8], [0.8, 0, -0.6001], _tags("closed-cut")),
    Case(
        "large-units",
        [3e8, 2e8, 1.1e8],
        [0.3, 0.5, 0.8],
        [1e-6, -4e-7, 2e-7],
        _tags("generic", "scaled"),
        span=5e7,
    ),
    Case(
        "fast", [3, 2, 1], [0.3, 0.5, 0.8], [1e9, -4e8, 2e8], _tags("generic", "scaled"), span=5e-8
    ),
    near_separatrix(1e-3),
    near_separatrix(1e-6),
    near_separatrix(1e-10),
    _matrix_case(),
    Case("isotropic", [1, 1, 1], [0.3, 0.5, 0.8], [1, -0.4, 0.2], _tags("closed-cut")),
    Case("unstable-circle", [3, 2, 1], [1, 0, 0], [0, 0, 1], _tags("closed-cut")),
    Case(
        "two-pairs", [2, 1, 2, 1], [0.3, 0.5, -0.4, 0.7], [1, -0.4, 0.2, 0.1], _tags("closed-cut")
    ),
    Case(
        "five-equal",
        [1, 1, 2, 1, 1, 1],
        [0.3, 0.5, 0.4, 0.7, -0.2, 0.1],
        [1, -0.4, 0.2, 0.1, 0.3, 0.6],
        _tags("closed-cut"),
    ),
    Case(
        "equal-and-frozen",
        [3, 2, 2, 2, 1],
        [0.6, 0, 0.5, 0, 0.4],
        [0.3, 0, 0.2, 0.7, 0],
        _tags("closed-cut"),
    ),
    Case(
        "narrow-frozen-cut",
        [3, 2, 1.5, 1],
        [0.6, 1e-100, 0.5, 0.6],
        [0.8, 2e-100, -0.6, 0.1],
        _tags("near-degenerate"),
    ),
    Case("wide-ratio", [1e8, 1e4, 1], [0.2, 0.5, 0.8], [1, 0.3, -0.4], _tags("wide"), span=5),
    # c_2 = I_2 exactly: an umbilic of the ellipsoid has q_2 = 0 and λ_1 = λ_2 = I_2.
    Case(
        "umbilic",
        ["1", "1/10", "1/26"],
        ["3/5", 0, "4/5"],
        ["4/5", 1, "-3/5"],
        _tags("separatrix"),
        span=8,
    ),
    Case(
        "near-umbilic",
        ["1", "1/10", "1/26"],
        ["3/5", "1e-30", "4/5"],
        ["4/5", 1, "-3/5"],
        _tags("near-degenerate"),
        span=8,
    ),
    Case("at-rest", [3, 2, 1], [0.3, 0.5, 0.8], [0, 0, 0], _tags("at-rest")),
)


@dataclass(frozen=True, eq=False)
class BodyCase:
    """A row of the bodies with an area constant, as ``rubber-ball``, as ``chaplygin-ball``, and as
    ``veselova-so3`` with I + ma², which turns as the first does.
    """

    name: str
    inertia: Any
    gamma: Sequence[Any]
    Omega: Sequence[Any]
    tags: frozenset[str] = _tags("generic")
    span: float = 20.0
    mass: Any = "0.7"
    radius: Any = "0.8"

    def problem(self, system: str) -> Any:
        """Return the problem of a system, normalised."""
        data = {"gamma": self.gamma, "Omega": self.Omega, "normalize": True}
        if system != "veselova-so3":
            kind = RubberBall if system == "rubber-ball" else ChaplyginBall
            rest = {"mass": self.mass, "radius": self.radius, "position": ("1/2", -2)}
            return kind(self.inertia, **rest, **data, strict=False)
        added = Fraction(self.mass) * Fraction(self.radius) ** 2
        rows = self.inertia
        if isinstance(rows[0], list):
            moved = [
                [Fraction(x) + added * (i == j) for j, x in enumerate(row)]
                for i, row in enumerate(rows)
            ]
        else:
            moved = [Fraction(x) + added for x in rows]
        return VeselovaSO3(moved, **data)

    def times(self) -> np.ndarray[Any, np.dtype[np.float64]]:
        """Return times up to the end of the span."""
        return self.span * np.array([0, 0.01, 0.1, 0.3, 1])


#: 0.7·0.8² = 0.448 is ma². Where K is along γ, Ω is J⁻¹γ.
_GENERIC = ["1", "1.4", "2"]
_GAMMA = ["2/7", "3/7", "6/7"]
_ALONG = [
    str(Fraction(g) / (Fraction(x) + Fraction("0.448")))
    for g, x in zip(_GAMMA, _GENERIC, strict=True)
]

BODIES: tuple[BodyCase, ...] = (
    BodyCase("generic", _GENERIC, _GAMMA, ["0.3", "-0.7", "0.9"]),
    BodyCase("other-side", _GENERIC, _GAMMA, ["1.3", "0.2", "-0.1"]),
    BodyCase("fast", _GENERIC, _GAMMA, ["3e8", "-7e8", "9e8"], span=2e-8),
    BodyCase("hardly-twists", _GENERIC, [0.6, 0, 0.8], ["0.8", 1, "-0.5999999"]),
    BodyCase(
        "matrix",
        [[2, 0.3, 0], [0.3, 1.5, 0.1], [0, 0.1, 1.7]],
        [0.6, 0, 0.8],
        [1, 2, 0.5],
        _tags("matrix"),
    ),
    BodyCase("symmetric", [1, 1, 1.5], _GAMMA, ["0.3", "-0.7", "0.9"], _tags("closed-cut")),
    BodyCase("symmetric-two", [1, 1.5, 1.5], _GAMMA, ["0.3", "-0.7", "0.9"], _tags("closed-cut")),
    BodyCase("isotropic", [1, 1, 1], _GAMMA, ["0.3", "-0.7", "0.9"], _tags("closed-cut")),
    BodyCase("about-an-axis", _GENERIC, _GAMMA, [1, 0, 0], _tags("closed-cut")),
    BodyCase("nearly-about-an-axis", _GENERIC, _GAMMA, [1, "1e-30", 0], _tags("near-degenerate")),
    BodyCase(
        "hardly-twice-about-an-axis",
        ["1000/623", "1000/789", "1000/789"],
        [1, 0, 0],
        ["-1/250000000", "629/1000", "119/200"],
        _tags("closed-cut"),
        mass="1/2500000",
        radius=1,
    ),
    BodyCase("upright", _GENERIC, [0, 0, 1], ["0.3", "-0.7", "0.9"]),
    BodyCase("steady", _GENERIC, [1, 0, 0], [1, 0, 0], _tags("closed-cut", "euler")),
    BodyCase("momentum-upright", _GENERIC, _GAMMA, _ALONG, _tags("euler")),
    BodyCase(
        "symmetric-upright",
        [1, 1, "1.5"],
        _GAMMA,
        [
            str(Fraction(g) / x)
            for g, x in zip(_GAMMA, map(Fraction, ("1.448", "1.448", "1.948")), strict=True)
        ],
        _tags("euler"),
    ),
    *(
        BodyCase(
            f"nearly-upright-{off}",
            _GENERIC,
            _GAMMA,
            [str(Fraction(_ALONG[0]) + Fraction(off)), *_ALONG[1:]],
            _tags("near-degenerate"),
        )
        for off in ("1e-3", "1e-9", "1e-25", "1e-40")
    ),
    BodyCase("at-rest", _GENERIC, _GAMMA, [0, 0, 0], _tags("at-rest")),
)


@dataclass(frozen=True, eq=False)
class BallCaseN:
    """A row of the balls in ℝⁿ, n ≥ 4, whose J has the numbers A, and ma² is ``share`` of its least
    entry.
    """

    name: str
    A: Sequence[Any]
    gamma: Sequence[Any]
    gamma_dot: Sequence[Any]
    tags: frozenset[str] = _tags("generic")
    span: float = 20.0
    share: Any = "3/5"

    def problem(self, system: str, **changes: Any) -> Any:
        """Return the problem of a system, normalised."""
        A = [Fraction(x) for x in self.A]
        least = min(x * y / math.prod(A) for x, y in combinations(A, 2))
        q, v = ([Fraction(x) for x in vector] for vector in (self.gamma, self.gamma_dot))
        data = {
            "inertia": {"special": self.A},
            "mass": least * Fraction(self.share) / Fraction("0.64"),
            "radius": "0.8",
            "gamma": self.gamma,
            "Omega": [a * d - b * c for (a, c), (b, d) in combinations(zip(q, v, strict=True), 2)],
            "position": ["1/2", -2, *[1] * (len(A) - 3)],
            "normalize": True,
        }
        kind = RubberBall if system == "rubber-ball" else ChaplyginBall
        return kind(**{**data, **changes})

    def times(self) -> np.ndarray[Any, np.dtype[np.float64]]:
        """Return times up to the end of the span."""
        return self.span * np.array([0, 0.01, 0.1, 0.3, 1])


_Q4 = [0.5, 0.1, 0.5, 0.7]
_V4 = [1.1, -0.7, 0.3, -0.9]

BALLS_IN_MORE_DIMENSIONS: tuple[BallCaseN, ...] = (
    BallCaseN("generic-4", ["1.6", "1.2", "0.9", "0.5"], _Q4, _V4),
    BallCaseN("generic-5", [1.6, 1.3, 1.1, 0.8, 0.5], [*_Q4, 0.3], [*_V4, 0.6]),
    BallCaseN("heavy", ["1.6", "1.2", "0.9", "0.5"], _Q4, _V4, share="999/1000"),
    BallCaseN("light", ["1.6", "1.2", "0.9", "0.5"], _Q4, _V4, share="1/1000"),
    BallCaseN("units", [1.6e9, 1.2e9, 9e8, 5e8], _Q4, [x * 1e5 for x in _V4], span=2e-4),
    BallCaseN("two-equal", [1.6, 1.2, 1.2, 0.5], _Q4, _V4, _tags("closed-cut")),
    BallCaseN("two-pairs", [1.6, 1.6, 0.5, 0.5], _Q4, _V4, _tags("closed-cut")),
    BallCaseN("three-equal", [1.2, 1.2, 1.2, 0.5], _Q4, _V4, _tags("closed-cut")),
    BallCaseN("isotropic", [1, 1, 1, 1], _Q4, _V4, _tags("closed-cut")),
    BallCaseN(
        "frozen", [1.6, 1.2, 0.9, 0.5], [0.5, 0, 0.5, 0.7], [1, 0, 0.3, -1], _tags("closed-cut")
    ),
    BallCaseN(
        "twice-frozen", [1.6, 1.2, 0.9, 0.5], [0.6, 0, 0.8, 0], [4, 0, -3, 0], _tags("closed-cut")
    ),
    BallCaseN("nearly-equal", [1.6, "1.2000000001", "1.2", 0.5], _Q4, _V4, _tags("generic")),
    # an umbilic in the plane of three axes
    BallCaseN(
        "separatrix",
        ["1", "1/10", "1/20", "1/26"],
        ["3/5", 0, 0, "4/5"],
        ["4/5", 1, 0, "-3/5"],
        _tags("separatrix"),
        span=6,
    ),
    BallCaseN("at-rest", [1.6, 1.2, 0.9, 0.5], _Q4, [0, 0, 0, 0], _tags("at-rest")),
)


def tagged(*tags: str) -> list[Case]:
    """Return the cases that carry all the tags."""
    return [case for case in TABLE if case.tags.issuperset(tags)]


def named(name: str) -> Case:
    """Return the case of a name."""
    return next(case for case in TABLE if case.name == name)
