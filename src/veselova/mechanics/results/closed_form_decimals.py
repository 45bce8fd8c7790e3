"""The evaluator of closed-form documents whose numbers are decimals: the steps of
closed_form_evaluation, in mpmath with a precision of its own.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from decimal import Decimal
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.errors import InternalContradiction
from veselova.mechanics.results.closed_form_evaluation import (
    lattice_within,
    neumann_time,
    series_of,
)

__all__ = ["DecimalEvaluator"]

Objects = NDArray[np.object_]

#: Digits beyond those of the document in which is computed: of its numbers, and of sums.
_SPARE = 30

#: Newton's steps from a root in double precision: each doubles its digits.
_MOST_STEPS = 12

#: A mode is slow where |m·f| is below so much of Σ|m_k f_k|: others lose at most six of the digits
#: to spare in differences of sines.
_SLOW = 1e-6


class DecimalEvaluator:
    """Evaluates one document with ``digits`` digits after the point.

    Numbers are mpf of a context of its own, in object arrays.
    """

    def __init__(self, document: Mapping[str, Any], arrays: Mapping[str, Any]) -> None:
        from mpmath import MPContext

        self._document = document
        self._arrays = arrays
        self._digits = int(document["digits"])
        self._context = MPContext()
        self._context.dps = self._digits + _SPARE

    def series(self, times: Sequence[Fraction]) -> dict[str, Objects]:
        """Return the series at exact times, by name, arrays of Decimal."""
        rows = [self._state(time) for time in times]
        number = np.frompyfunc(self._to_decimal, 1, 1)
        if not rows:
            return {}
        return {name: number(np.stack([row[name] for row in rows])) for name in rows[0]}

    def _to_decimal(self, value: Any) -> Decimal:
        whole = len(str(int(abs(value))))
        return Decimal(self._context.nstr(value, self._digits + 2 + whole, strip_zeros=False))

    def _numbers(self, values: Any) -> Objects:
        """Return nested lists of numbers or texts as mpf."""
        return np.asarray(np.frompyfunc(self._context.mpf, 1, 1)(np.array(values, dtype=object)))

    @cached_property
    def _fields(self) -> dict[str, Objects]:
        names = (
            *("A", "phases", "frequencies", "coefficients", "riemann_matrix"),
            *("rotation", "directions", "frozen", "mean_rate"),
        )
        return {name: self._numbers(self._document[name]) for name in names}

    @cached_property
    def _area(self) -> dict[str, Any]:
        """Return the field ``area`` with its numbers, where the document has it."""
        if "area" not in self._document:
            return {}
        area = self._document["area"]
        names = ("attitude", "momentum", "inverse", "form", "constant")
        return {"area": {name: self._numbers(area[name]) for name in names}}

    def _state(self, time: Fraction) -> dict[str, Objects]:
        mpf = self._context.mpf
        tau1, z = self._phases(time)
        values = self._theta(z)
        quotients = values / values[0]

        def entries(pairs: Any) -> Objects:
            return np.array(
                [mpf(constant) * quotients[place] for place, constant in pairs], dtype=object
            )

        document = {**self._document, **self._area}
        fields = self._fields
        normals = np.stack(
            [entries(column) for column in [*document["normals"], document["gamma"]]], axis=1
        )
        directions = fields["directions"]
        frame = np.empty((len(directions), len(directions)), dtype=object)
        frame[:, 0] = directions @ entries(document["q"])
        frame[:, 1:] = directions @ normals @ fields["rotation"] + fields["frozen"]
        velocity = directions @ (normals @ entries(document["q_prime"]))
        rate = document["rate"]
        ratio = abs(quotients[int(rate["characteristic"])]) ** int(rate["power"])
        velocity = velocity / (mpf(rate["constant"]) * ratio)
        root = np.frompyfunc(self._context.sqrt, 1, 1)
        rows = np.array([tau1], dtype=object), frame[None], velocity[None]
        found = series_of(document, fields["A"], *rows, root=root)
        series = {name: value[0] for name, value in found.items()}
        if "path" in document:
            series["position"] = self._contact_point(time, tau1, z)
        return series

    def _phases(self, time: Fraction) -> tuple[Any, Objects]:
        """Return τ₁, and z modulo 2, at an exact time: Newton's method from the root in doubles."""
        ctx = self._context
        fields = self._fields
        mean = fields["mean_rate"][()]
        f = fields["frequencies"]
        # the whole turns of far times take digits of their own
        far = max(0, math.ceil(math.log10(1 + abs(float(time)))))
        with ctx.extradps(far):
            t = ctx.mpf(time.numerator) / time.denominator
            uniform = t / mean
            z = np.array([x % 2 for x in fields["phases"] + uniform * f], dtype=object)
        delta = ctx.mpf(0)
        if self._time_modes.size:
            near = float(time)
            rest = np.array([float(time - Fraction(near))])
            tau1 = neumann_time(self._document, self._arrays, np.array([near]), rest)
            delta = self._root(z, uniform, ctx.mpf(float(tau1[2][0])))
        return uniform + delta, z + delta * f

    def _root(self, z: Objects, uniform: Any, delta: Any) -> Any:
        """Return δ with F_0 δ + Σ F_m/(π m·f) [sin 2πm·(z + δf) − sin 2πm·z⁰] = 0, and
        ``uniform`` + δ = τ₁.
        """
        ctx = self._context
        mean = self._fields["mean_rate"][()]
        f = self._fields["frequencies"]
        smallest = ctx.mpf(10) ** (5 - ctx.dps)
        for _ in range(_MOST_STEPS):
            time, rate = self._time_modes.at(z + delta * f, uniform + delta)
            step = (mean * delta + time) / (mean + rate)
            delta = delta - step
            if abs(step) <= smallest * max(1, abs(delta)):
                return delta
        raise InternalContradiction("Newton's method for the time map does not converge")

    @cached_property
    def _time_modes(self) -> _Series:
        """Return the periodic part of dt/dτ₁."""
        parts = [(2 * self._rows(self._document), self._document, 0)]
        if "area" in self._document:
            odd = self._document["area"]["odd"]
            parts.append((self._rows(odd), odd, odd["turn"]))
        return self._series_of(parts)

    @cached_property
    def _across(self) -> list[_Series]:
        """Return the series of a path, and last the odd part of the time."""
        document = self._document
        all_of_them = list(document["path"]["transverse"])
        if "area" in document:
            all_of_them.append(document["area"]["odd"])
        return [self._series_of([(self._rows(x), x, x["turn"])]) for x in all_of_them]

    def _rows(self, series: Mapping[str, Any]) -> NDArray[np.int64]:
        """Return the modes of a series as they are written, (M, g)."""
        genus = int(self._document["genus"])
        return np.array(series["modes"], dtype=np.int64).reshape(-1, genus)

    def _series_of(
        self, parts: Sequence[tuple[NDArray[np.int64], Mapping[str, Any], Any]]
    ) -> _Series:
        """Return the sum of series, each with its doubled modes and its turn."""
        mpf = self._context.mpf
        turns = [np.full(len(modes), mpf(turn), dtype=object) for modes, _, turn in parts]
        return _Series(
            self._context,
            np.concatenate([modes for modes, _, _ in parts]),
            np.concatenate([self._numbers(x["coefficients"]).reshape(-1) for _, x, _ in parts]),
            np.concatenate(turns),
            self._fields["phases"],
            self._fields["frequencies"],
        )

    def _contact_point(self, time: Fraction, tau1: Any, z: Objects) -> Objects:
        """Return the contact point, as ``closed_form_evaluation`` does."""
        path = self._document["path"]
        y = [series.at(z, tau1)[0] for series in self._across]
        odd = y.pop() if "area" in self._document else self._context.mpf(0)
        t = self._context.mpf(time.numerator) / time.denominator
        along = self._numbers(path["speed"])[()] * t + self._numbers(path.get("odd", 0))[()] * odd
        plane = self._numbers(path["plane"]) if "plane" in path else self._fields["rotation"]
        moved = np.array([*y, along], dtype=object) @ plane
        return np.asarray(self._numbers(path["position"]) - self._numbers(path["radius"]) * moved)

    def _theta(self, z: Objects) -> Objects:
        """Return the theta functions at one point, up to a common factor, as ``lattice_sum``
        defines them.
        """
        ctx = self._context
        lattice = self._lattice
        to_doubles = lattice.basis.astype(float)
        found = []
        for epsilon, delta in self._arrays["characteristics"]:
            y = lattice.basis @ (z + self._numbers(delta.tolist()))
            half = np.rint(2 * np.linalg.inv(to_doubles).T @ epsilon).astype(np.int64)  # 2ε
            G = lattice.G
            nearest = np.array([int(ctx.nint(x)) for x in y[G]], dtype=object)
            orders, weights = lattice.points(tuple(half[lattice.F].tolist()))
            total = ctx.mpf(0)
            for k in lattice.cell:
                whole = nearest + k
                d = whole - y[G]
                gaussian = ctx.exp(-ctx.pi * (d @ lattice.inverse @ d)) if G else ctx.mpf(1)
                turns = y[lattice.F] + lattice.cross @ d if G else y[lattice.F]
                factor = ctx.expjpi(ctx.mpf(int(whole @ half[G]))) if G else ctx.mpc(1)
                powers = _powers(ctx, turns, orders) if lattice.F else np.ones(1, dtype=object)
                total += gaussian * (factor * (weights @ powers)).real
            found.append(total)
        return np.array(found, dtype=object)

    @cached_property
    def _lattice(self) -> _Lattice:
        return _Lattice(self._document, self._fields["riemann_matrix"], self._context)


class _Series:
    """Σ 2c cos 2π(M·z/2 + turn) along z⁰ + fτ₁, for M (K, g), c and turns (K,)."""

    def __init__(
        self,
        context: Any,
        doubled: NDArray[np.int64],
        coefficients: Objects,
        turns: Objects,
        start: Objects,
        frequencies: Objects,
    ) -> None:
        self._context = ctx = context
        self.size = len(doubled)
        halves = doubled.astype(object) / ctx.mpf(2)
        pace = halves @ frequencies
        slow = np.asarray(
            np.abs(pace) <= _SLOW * (np.abs(halves) @ np.abs(frequencies)), dtype=bool
        )
        turn = np.frompyfunc(lambda x: ctx.expjpi(2 * x), 1, 1)
        self._doubled = doubled[~slow]
        self._factors = np.asarray(turn(turns[~slow]), dtype=object)
        self._weights = 2 * coefficients[~slow]
        self._amplitudes = self._weights / (2 * ctx.pi * pace[~slow])
        self._begin = self._amplitudes @ self._sinusoids(start)[1]
        #: m·f, c and 2π(m·z⁰ + turn) of the modes that nearly stand, as at a resonance.
        angles = 2 * ctx.pi * (halves[slow] @ start + turns[slow])
        self._slow = list(zip(pace[slow], coefficients[slow], angles, strict=True))

    def at(self, z: Objects, tau1: Any) -> tuple[Any, Any]:
        """Return the integral over τ₁ from zero, and the function, at phases z modulo 2.

        Slow modes are products: a difference of sines over a small m·f would lose digits.
        """
        ctx = self._context
        cosines, sines = self._sinusoids(z)
        integral = self._amplitudes @ sines - self._begin
        value = self._weights @ cosines
        for pace, coefficient, angle in self._slow:
            h = ctx.pi * pace * tau1
            integral += 2 * coefficient * ctx.cos(angle + h) * tau1 * ctx.sinc(h)
            value += 2 * coefficient * ctx.cos(angle + 2 * h)
        return integral, value

    def _sinusoids(self, z: Objects) -> tuple[Objects, Objects]:
        """Return cos 2π(M·z/2 + turn) and sin 2π(M·z/2 + turn) of the modes that move."""
        found = _powers(self._context, z, self._doubled) * self._factors
        parts = np.frompyfunc(lambda x: (x.real, x.imag), 1, 2)(found)
        return np.asarray(parts[0]), np.asarray(parts[1])


def _powers(context: Any, half_turns: Objects, orders: NDArray[np.int64]) -> Objects:
    """Return e^{πi orders·half_turns} for rows of whole orders, (N,)."""
    product: Any = context.mpc(1)
    for turns, column in zip(half_turns, orders.T, strict=True):
        highest = int(np.max(np.abs(column), initial=0))
        table = [context.mpc(1)]
        unit = context.expjpi(turns)
        for _ in range(highest):
            table.append(table[-1] * unit)
        both = np.array([*table, *(x.conjugate() for x in table[:0:-1])], dtype=object)
        product = product * both[column]
    return np.asarray(product, dtype=object) * np.ones(len(orders), dtype=object)


class _Lattice:
    """The points of a document's theta sums in its basis, and their weights; F, G, C and S as
    ``lattice_sum`` defines them.
    """

    def __init__(self, document: Mapping[str, Any], T: Objects, context: Any) -> None:
        genus = int(document["genus"])
        reduction = document.get("reduction") or {
            "basis": np.eye(genus, dtype=int).tolist(),
            "waves": list(range(genus)),
        }
        self._context = context
        self._terms_to = math.log(10) * context.dps
        self.basis = np.array(reduction["basis"], dtype=object)
        self.F = list(reduction["waves"])
        self.G = [i for i in range(genus) if i not in self.F]
        form = self.basis @ T @ self.basis.T
        self.inverse: Any = np.empty((0, 0), dtype=object)
        self.cross: Any = np.empty((len(self.F), 0), dtype=object)
        self.form = form[np.ix_(self.F, self.F)]
        if self.G:
            block = context.matrix(form[np.ix_(self.G, self.G)].tolist())
            self.inverse = np.array(context.inverse(block).tolist(), dtype=object)
            self.cross = form[np.ix_(self.F, self.G)] @ self.inverse
            self.form = self.form - self.cross @ form[np.ix_(self.G, self.F)]
        self._weighted: dict[tuple[int, ...], tuple[NDArray[np.int64], Objects]] = {}

    @cached_property
    def cell(self) -> NDArray[np.int64]:
        """Return the k next to y_G that matter, (K, |G|)."""
        inverse = self.inverse.astype(float)
        points = lattice_within(inverse, np.zeros(len(self.G)), 0.5, self._terms_to)
        return np.rint(points).astype(np.int64)

    def points(self, doubled: tuple[int, ...]) -> tuple[NDArray[np.int64], Objects]:
        """Return 2x and the weights e^{−πxᵀSx} of x ∈ Z^F + ε_F, whose double is given."""
        if doubled not in self._weighted:
            shift = np.array(doubled) / 2
            points = lattice_within(self.form.astype(float), shift, 0.0, self._terms_to)
            orders = np.rint(2 * points).astype(np.int64)
            whole = orders.astype(object)
            forms = np.sum((whole @ self.form) * whole, axis=1) if self.F else np.zeros(1)
            weight = np.frompyfunc(lambda x: self._context.exp(-self._context.pi * x / 4), 1, 1)
            self._weighted[doubled] = orders, np.asarray(weight(forms), dtype=object)
        return self._weighted[doubled]
