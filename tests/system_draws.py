"""Adversarial starts of Neumann's system, geodesics, bodies on T SO(3) and separable potentials."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np

from draws import CLASSES, adversarial_data
from veselova import EllipsoidGeodesic, NeumannSystem, SeparableVeselova, VeselovaSO3
from veselova.mechanics.core.problem import Problem
from veselova.mechanics.results.trajectory import Trajectory

__all__ = ["CLASSES_OF", "LEAST", "adversarial_system", "pessimism"]

#: Half a unit in the last place of one.
LEAST = float(np.finfo(float).eps) / 2

#: What every system has beyond the classes of Veselova's.
_SLOW = ("tiny velocity", "huge velocity", "tiny entries")

#: Classes of starts by system.
CLASSES_OF: dict[str, tuple[str, ...]] = {
    "neumann": (
        *CLASSES,
        *_SLOW,
        "rest",
        "no velocity",
        "near a stable equilibrium",
        "near an unstable equilibrium",
        "near a saddle",
    ),
    "ellipsoid-geodesic": (*CLASSES, *_SLOW, "flat", "needle", "nearly round"),
    "veselova-so3": (
        *CLASSES,
        *_SLOW,
        "rest",
        "matrix",
        "clebsch",
        "family",
        "tiny potential",
        "huge potential",
        "walls",
    ),
    "separable": (
        *CLASSES,
        *_SLOW,
        "rest",
        "degenerate",
        "tiny potential",
        "huge potential",
        "walls",
        "near walls",
    ),
}


def adversarial_system(
    rng: np.random.Generator, system: str, n: int
) -> tuple[str, Callable[[], Problem]]:
    """Return the name of a class of starts at which closed forms usually fail, and what makes one
    of it, in exact rationals.

    Making it may refuse by name: entries go to 1e±300. n is 3 for ``veselova-so3``.
    """
    name, A, q, v = adversarial_data(rng, 3 if system == "veselova-so3" else n, CLASSES_OF[system])
    power, wild = (
        Fraction(1, 10 ** int(rng.integers(1, 301))),
        Fraction(10) ** int(rng.integers(-300, 301)),
    )
    if name == "tiny velocity":
        v = [x * power for x in v]
    if name == "huge velocity":
        v = [x / power for x in v]
    if name == "tiny entries":
        i = int(rng.integers(len(q)))
        q, v = [x * power if k != i else x for k, x in enumerate(q)], [x * wild for x in v]
    return name, lambda: _MAKERS[system](rng, name, A, q, v, power)


Row = list[Fraction]


def _neumann(
    rng: np.random.Generator, name: str, A: Row, q: Row, v: Row, power: Fraction
) -> Problem:
    if name == "scaled":  # of times: τ₁ is √A
        unit = Fraction(10) ** int(rng.integers(-100, 101))
        A, v = [a * unit * unit for a in A], [x / unit / max(map(abs, v)) for x in v]
    if name in ("rest", "no velocity"):
        v = [Fraction()] * len(A)
    order = sorted(range(len(A)), key=lambda i: A[i])
    axes = {
        "near a stable equilibrium": order[-1],
        "near an unstable equilibrium": order[0],
        "near a saddle": order[len(A) // 2],
    }
    axes["rest"] = order[int(rng.integers(len(A)))]
    if name in axes:
        i, small = axes[name], power if name != "rest" else Fraction()
        q, v = (
            [x * small if k != i else Fraction(1) for k, x in enumerate(q)],
            [x * small for x in v],
        )
        if name != "rest" and rng.random() < 0.5:
            k = (i + 1) % len(A)
            q[k] = v[k] = Fraction()
    return NeumannSystem(A, q, v, normalize=True)


def _geodesic(
    rng: np.random.Generator, name: str, A: Row, q: Row, v: Row, power: Fraction
) -> Problem:
    thin = Fraction(1, 10 ** int(rng.integers(1, 13)))
    if name == "flat":
        A[int(rng.integers(len(A)))] *= thin
    if name == "needle":
        A[int(rng.integers(len(A)))] /= thin
    if name == "nearly round":
        A = [1 + x * thin for x in A]
    X, V = ([a * x for a, x in zip(A, row, strict=True)] for row in (q, v))  # q is along the normal
    return EllipsoidGeodesic(A, X, V, normalize=True)


def _so3(rng: np.random.Generator, name: str, A: Row, q: Row, v: Row, power: Fraction) -> Problem:
    gamma, inertia = q, [1 / a for a in A]
    Omega = [v[(i + 1) % 3] * q[(i + 2) % 3] - v[(i + 2) % 3] * q[(i + 1) % 3] for i in range(3)]
    given: Any = inertia
    if name == "rest":
        Omega = [Fraction()] * 3
    if name == "matrix":
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        tensor = turn @ np.diag([float(x) for x in inertia]) @ turn.T
        given = ((tensor + tensor.T) / 2).tolist()
    potential = _alphas(rng, name, [x != 0 for x in gamma], power)
    if name in CLASSES and rng.random() < 0.5:
        potential = {"clebsch": Fraction(int(rng.integers(-999, 1000)), 1000)}
    return VeselovaSO3(given, gamma, _text(Omega), potential, strict=False, normalize=True)


def _alphas(rng: np.random.Generator, name: str, moves: list[bool], power: Fraction) -> Any:
    clebsch, *alphas = (Fraction(int(x), 1000) for x in rng.integers(-999, 1000, 6))
    if name == "clebsch":
        return {"clebsch": clebsch}
    sizes = {
        "tiny potential": power,
        "huge potential": 1 / power,
        "family": Fraction(1),
        "walls": Fraction(1),
    }
    if name not in sizes:
        return None
    walls = (
        [abs(x) if m else Fraction() for x, m in zip(alphas[2:], moves, strict=True)]
        if name == "walls"
        else [Fraction()] * 3
    )
    return {"family": _text([x * sizes[name] for x in (*alphas[:2], *walls)])}


def _separable(
    rng: np.random.Generator, name: str, A: Row, q: Row, v: Row, power: Fraction
) -> Problem:
    quartic, quadratic, *betas = (
        Fraction(int(x), 1000) for x in rng.integers(-999, 1000, 2 + len(A))
    )
    size = {"tiny potential": power, "huge potential": 1 / power}.get(name, Fraction(1))
    if name == "rest":
        v = [Fraction()] * len(A)
    A = [a if a not in A[:i] else a * (1 + (i + 1) * power) for i, a in enumerate(A)]
    if name == "degenerate":  # a parabola's vertex, a double zero, a constant
        quartic, quadratic = (
            (quartic, Fraction()),
            (Fraction(), quadratic),
            (Fraction(), Fraction()),
        )[int(rng.integers(3))]
    if name in ("walls", "near walls"):
        strength = power if name == "near walls" else Fraction(1)
        betas = [abs(b) * strength if x else Fraction() for b, x in zip(betas, q, strict=True)]
    else:
        betas = [Fraction()] * len(A)
    parts = {"quartic": quartic * size, "quadratic": quadratic * size, "centrifugal": betas}
    return SeparableVeselova(A, q, v, parts, normalize=True)


def _text(values: Row) -> list[str]:
    return [str(x) for x in values]


_MAKERS: dict[str, Callable[..., Problem]] = {
    "neumann": _neumann,
    "ellipsoid-geodesic": _geodesic,
    "veselova-so3": _so3,
    "separable": _separable,
}


def pessimism(found: Trajectory, off: Any) -> float:
    """Return the median over times of reported over true errors.

    A true error counts as half a unit in the last place of the largest number of the bounded
    series, or of one, at least: the point of a needle-like ellipsoid has no finer doubles.
    """
    values = [
        np.abs(found.series(series)).reshape(off.size, -1) for series in found.problem.bounded
    ]
    sizes = np.maximum(1.0, np.max(np.concatenate(values, axis=1), axis=1))
    return float(np.median(found.error / np.maximum(off, LEAST * sizes)))
