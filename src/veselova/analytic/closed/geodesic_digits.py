"""Geodesics in many digits, and proven lengths: the text of ``analytic.geodesics`` over Arb."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from fractions import Fraction
from functools import lru_cache, partial
from itertools import pairwise
from typing import Any

import numpy as np
from flint import arb, arb_mat
from numpy.typing import NDArray

from veselova.analytic.closed.surface import TEXT, Surface
from veselova.analytic.curve.kernel_text import rebound, zeros
from veselova.analytic.geodesics.shortest import STRAIGHT, TURNED
from veselova.mechanics.core.budget import checkpoint
from veselova.mechanics.core.decimals import (
    SHOWN_DIGITS,
    Decimals,
    decimal_pair,
    enclose,
    precision,
)
from veselova.mechanics.core.errors import Unsolved
from veselova.mechanics.geometry.places import angle_of_balls

__all__ = ["in_digits", "proven_lengths"]

Array = NDArray[Any]

#: Calibrated: working digits beyond those asked for, and attempts, each with so many more.
_SPARE, _ATTEMPTS = 12, 7

#: Calibrated: bits by which Θ at its zero is known to its ε.
_GUARD_BITS = 32

#: Derived: N nodes of Gauss on a panel of half length h ≤ 0.625 leave out (64/15) h M
#: ϱ^(2−2N)/(1−ϱ^(−2)), M the largest |f| on the ellipse ϱ about it, which is within |Im x| ≤ 1.2
#: (Trefethen, Approximation Theory and Practice, 19.3). There each of the four forms is
#: cosh(x+α)cosh(x−α) but for a factor, so that cos²(1.2) ≤ |form(x)|/form(Re x) ≤ 1, and over a
#: distance δ it changes by e^(2δ) at most: of J is left out less than _LEFT_OUT ϱ^(−2N) J, and of
#: S, whose 1/t² = (p/P) sinh²x is below (p/P) cosh²x, less than that of S + pJ.
_RHO, _LEFT_OUT = 4.07, 4e11

#: Method: the longest panel where nothing is proven, in digits: integrands may grow by so much
#: from a panel to its ellipse that _MORE nodes make good for it.
_LONGEST, _MORE = 0.2, 1.1

#: Budget: most digits and ratio of semiaxes with which Jacobi's equation is integrated, in seconds,
#: and its steps.
_MOST_SERIES, _LONGEST_SERIES, _MOST_STEPS = 250, 1000, 10_000

#: Method: the first |log| of the bracket of a zero, in ε, and by how much wider ones follow.
_BRACKET, _WIDER, _BRACKETS = 1e4, 100, 8

_point = np.frompyfunc(lambda x: arb(x).mid(), 1, 1)
_radius = np.frompyfunc(lambda x: arb(x).rad(), 1, 1)
_widen = np.frompyfunc(lambda x, off: arb(x) + arb(0, abs(arb(off)).upper()), 2, 1)


@lru_cache(maxsize=16)
def _over_arb(digits: int, certified: bool) -> dict[str, Any]:
    """Return the text with an arithmetic of so many digits in place of that of doubles; call it in
    their precision.

    certified: whether places and zeros of Θ are balls that hold them, and not points.
    """
    text = rebound(TEXT)
    tiny = arb(10) ** -digits
    scale = (digits + 3) / 18  # those of doubles are for fifteen digits
    for name in ("NUDGE", "ROUND", "LEAST_K1", "LEAST_K2", "LEAST"):
        # exact, as K₁ is compared with ROUND
        text[name] = (arb(10) ** math.floor(scale * math.log10(TEXT[name]))).mid()
    more = 1.0 if certified else _MORE
    count = math.ceil(more * digits * math.log(10) / (2 * math.log(_RHO))) + 10
    roots = [arb.legendre_p_root(count, k, weight=True) for k in range(count)]
    left_out = _LEFT_OUT * arb(_RHO) ** (-2 * count)
    has_series = not certified and digits <= _MOST_SERIES + 2 * _SPARE

    def whole(x: Any) -> int:
        checkpoint()  # once for all panels of a range
        return round(float(x.mid()))

    text |= {
        "NODES": np.array([x for x, _ in roots], dtype=object),
        "WEIGHTS": np.array([w for _, w in roots], dtype=object),
        "ORDER": math.ceil(digits * math.log(10) / 2),
        "SMALLEST": tiny / 10,
        "EPSILON": tiny,
        "LAST_STEP": arb(10) ** (-digits // 2 - 1),
        "FARTHEST": TEXT["FARTHEST"] * scale,
        "LOST": 1e6,
        "NEAR_UMBILIC": 1e-6,
        "LONGEST": _LONGEST_SERIES if has_series else 0.0,
        "pi": arb.pi(),
        "sqrt": lambda x: arb(x).nonnegative_part().sqrt(),
        "atan2": angle_of_balls,
        **{name: _method(name) for name in ("asinh", "cos", "exp", "log", "sin")},
        "size": lambda x: abs(arb(x).mid()),
        "whole": whole,
        "MOST_STEPS": _MOST_STEPS,
        "zeros": zeros,
        "convolve": _convolve,
        "midpoint": lambda x: arb(x).mid(),
        "widen": lambda x, terms: _widen(x, left_out * terms),
        "numbers": lambda values: enclose(np.asarray(values, dtype=object)),
        "rounded": (lambda values: values) if certified else _point,
    }
    graded = {"PANEL": math.inf, "panels": partial(_graded, text["panels"], digits)}
    text |= {"enclose": partial(_enclose_zero, text)} if certified else graded
    return text


def _convolve(a: Array, b: Array, n: int) -> Any:
    checkpoint()
    row, column = a[: n + 1].tolist(), b[n::-1].tolist()
    return (arb_mat(1, n + 1, row) * arb_mat(n + 1, 1, column))[0, 0]


def _graded(
    panel: Callable[..., Any], digits: int, form: Any, first: Any, last: Any, *scaled: Any
) -> Any:
    """Return the sums of panels that grow with the distance to singularities, ±α ± iπ/2 where a
    form is cosh(x+α)cosh(x−α) but for a factor; scaled: scale and inverted.
    """
    scale, inverted = scaled
    pairs = (1, 1), (form.E0, form.E1), (form.P, form.p), (form.Q, form.q)
    centres = [0.0]
    for low, high in pairs:
        least, most = (high, low) if inverted else (low, high)
        # cosh α, which is no double at many digits
        root = (arb(least) / (arb(most) * scale**2)).nonnegative_part().sqrt()
        alpha = float((root + (root**2 - 1).nonnegative_part().sqrt()).log().mid())
        centres += [alpha, -alpha]
    begin, end = float(arb(first).mid()), float(arb(last).mid())
    edges = [begin]
    while edges[-1] < end:
        length = TEXT["PANEL"]
        while 2 * length < _LONGEST * digits and _is_clear(edges[-1], 2 * length, centres):
            length *= 2
        edges.append(edges[-1] + length)
    exact = [first, *map(arb, edges[1:-1]), last]
    parts = [panel(form, *ends, *scaled) for ends in pairwise(exact)]
    return tuple(map(sum, zip(*parts, strict=True)))


def _is_clear(begin: float, length: float, centres: list[float]) -> bool:
    """Return whether the ellipse ϱ about a panel leaves out centres ± iπ/2."""
    half = length / 2
    at = [complex(x - begin - half, math.pi / 2) / half for x in centres]
    return all(abs(z - 1) + abs(z + 1) > _RHO + 1 / _RHO for z in at)


def _method(name: str) -> Callable[[Any], Any]:
    return lambda x: getattr(arb(x), name)()


def _enclose_zero(
    text: dict[str, Any], shape: Any, ends: Any, kind: int, z: Any, rest: Any
) -> tuple[Any, Any]:
    """Return balls about z and 1−z with a zero of Θ, whose signs differ at both ends. Raises
    Unsolved (``not-enclosed``) where no narrow ones are found.
    """
    wide = _BRACKET * text["EPSILON"]
    for _ in range(_BRACKETS):
        signs, bracket = [], []
        for step in (-wide, wide):
            # of log z/(1−z); one of both numbers is exact, and the other follows
            if z < rest:
                near = arb(z * (1 + step)).mid()
                pair = near, 1 - near
            else:
                near = arb(rest * (1 - step)).mid()
                pair = 1 - near, near
            theta = text["over_ends"](shape, ends, *pair, kind == TURNED).theta
            signs.append(theta if kind == STRAIGHT else -theta)
            bracket.append(pair)
        if signs[0] < 0 and signs[1] > 0:
            (z1, rest1), (z2, rest2) = bracket
            return z1.union(z2), rest1.union(rest2)
        wide *= _WIDER
    raise Unsolved("not-enclosed", "the point may be conjugate to the other, as antipodes are")


def _working(digits: int) -> AbstractContextManager[None]:
    return precision(math.ceil(digits * math.log2(10)) + _GUARD_BITS)


def in_digits(
    exact: Sequence[Fraction], digits: int, solve: Callable[[Surface], dict[str, Array]]
) -> tuple[dict[str, Array], Decimals]:
    """Return what ``solve`` finds on an ellipsoid as doubles, and as decimals whose radii are the
    differences of two working precisions: below 10^−digits, or that of what is larger than one or
    than the middle semiaxis. Raises Unsolved (``no-digit-left``).
    """
    before: dict[str, Array] | None = None
    for attempt in range(1, _ATTEMPTS + 1):
        working = digits + _SPARE * attempt
        checkpoint("geodesics", attempt - 1, _ATTEMPTS)
        with _working(working):
            surface = Surface(exact, _over_arb(working, False))
            found = solve(surface)
            plain = {"error": found.pop("error").astype(np.float64)}
            if "unique" in found:
                plain["unique"] = found.pop("unique")
            if before is not None:
                found = {name: _widen(x, x - before[name]) for name, x in found.items()}
                unit = {"s12": surface.unit, "m12": surface.unit, "caustic": surface.unit**2}
                if all(_reached(x, unit.get(name, 1), digits) for name, x in found.items()):
                    pairs = {
                        name: decimal_pair(x, digits + SHOWN_DIGITS) for name, x in found.items()
                    }
                    doubles = {name: x.astype(np.float64) for name, x in found.items()}
                    return doubles | plain, Decimals.of_geodesics(digits, False, pairs)
        before = found
    raise Unsolved(
        "no-digit-left", f"{digits} digits were not reached with {working} working digits"
    )


def _reached(values: Array, unit: Any, digits: int) -> bool:
    """Return whether the radii of balls are below 10^−digits; those of NaN are not known."""
    least = arb(10) ** -digits
    return all(
        math.isnan(float(x)) or x.rad() <= least * max(unit, abs(x.mid())) for x in values.ravel()
    )


def proven_lengths(
    exact: Sequence[Fraction], digits: int, ends: Callable[[Surface], tuple[Array, Array]]
) -> tuple[Decimals, NDArray[np.bool_]]:
    """Return the distances s₁₂ of places as decimals with proven radii, and whether it is proven
    that one geodesic alone is so short.

    By Itoh and Kiyohara (2004) the cut locus of a point is on β = −β₁: a geodesic of the normal
    position of ``analytic.geodesics.shortest``, which stays at β < −β₁ before its end, is shortest.
    That there is one follows from the signs of Θ, and S holds its length. It is one between some
    points of the balls of the places, and off umbilics and planes by NUDGE: distances differ by at
    most |Δβ| + a|Δω| each, as |∂r/∂β| ≤ b and |∂r/∂ω| ≤ a. A spheroid has three axes, two of them
    so near that lengths change by far less. Off the line β₂ = −β₁, which holds the cut locus of any
    point of any ellipsoid, it is the only one. Raises Unsolved (``not-enclosed``).
    """
    for attempt in range(1, _ATTEMPTS + 1):
        working = digits + _SPARE * attempt
        checkpoint("geodesics", attempt - 1, _ATTEMPTS)
        with _working(working):
            text = _over_arb(working, True)
            surface = Surface(exact, text)
            starts, stops = ends(surface)
            # and β that are made equal
            apart = np.sum(_radius(starts) + _radius(stops), axis=1) + 20 * text["EPSILON"]
            differ = np.any(_point(starts) != _point(stops), axis=1)
            lengths = 0 * apart
            lengths[differ] = surface.shortest(starts[differ], stops[differ])[:, 0]
            lengths = _widen(lengths, 4 * (1 + surface.shape.a) * apart) * surface.unit
            if all(x.is_finite() for x in lengths) and _reached(lengths, surface.unit, digits):
                pair = decimal_pair(lengths, digits + SHOWN_DIGITS)
                off_line = [not x.contains(0) for x in starts[:, 0] + stops[:, 0]]
                return Decimals.of_geodesics(digits, True, {"s12": pair}), off_line | ~differ
    raise Unsolved("not-enclosed", "signs of Θ do not prove a shortest geodesic to so many digits")
