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
        return {name: value[0] for name, value in found.items()}

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
        if len(self._modes[1]) or self._slow_modes:
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
        doubled, coefficients, _ = self._modes
        f = self._fields["frequencies"]
        amplitudes = 2 * coefficients / (ctx.pi * (doubled.astype(object) @ f))
        begin = amplitudes @ self._sinusoids(self._fields["phases"])[1]
        smallest = ctx.mpf(10) ** (5 - ctx.dps)
        for _ in range(_MOST_STEPS):
            cosines, sines = self._sinusoids(z + delta * f)
            slow, slope = self._slow_part(uniform + delta)
            value = mean * delta + amplitudes @ sines - begin + slow
            step = value / (mean + 2 * coefficients @ cosines + slope)
            delta = delta - step
            if abs(step) <= smallest * max(1, abs(delta)):
                return delta
        raise InternalContradiction("Newton's method for the time map does not converge")

    def _slow_part(self, tau1: Any) -> tuple[Any, Any]:
        """Return what slow modes add to the time and to its slope, each as a product: a difference
        of sines over a small m·f would lose digits.
        """
        ctx = self._context
        time = slope = ctx.mpf(0)
        for pace, coefficient, angle in self._slow_modes:
            h = ctx.pi * pace * tau1
            time += 2 * coefficient * ctx.cos(angle + h) * tau1 * ctx.sinc(h)
            slope += 2 * coefficient * ctx.cos(angle + 2 * h)
        return time, slope

    @cached_property
    def _slow_modes(self) -> list[tuple[Any, Any, Any]]:
        """Return m·f, F_m and 2π(m·z⁰ + turn) of the modes that nearly stand, as at a resonance."""
        doubled, coefficients, turns, slow = self._all_modes
        halves = doubled[slow].astype(object) / self._context.mpf(2)
        angles = 2 * self._context.pi * (halves @ self._fields["phases"] + turns[slow])
        return list(
            zip(halves @ self._fields["frequencies"], coefficients[slow], angles, strict=True)
        )

    @cached_property
    def _modes(self) -> tuple[NDArray[np.int64], Objects, Objects]:
        """Return M, F_m and e^{2πi turn} of the other modes."""
        doubled, coefficients, turns, slow = self._all_modes
        turn = np.frompyfunc(lambda x: self._context.expjpi(2 * x), 1, 1)
        return doubled[~slow], coefficients[~slow], np.asarray(turn(turns[~slow]), dtype=object)

    @cached_property
    def _all_modes(self) -> tuple[NDArray[np.int64], Objects, Objects, NDArray[np.bool_]]:
        """Return the doubled modes M of the time map, their coefficients, their turns, and which of
        them are slow.
        """
        genus = int(self._document["genus"])
        doubled = 2 * np.array(self._document["modes"], dtype=np.int64).reshape(-1, genus)
        coefficients = self._fields["coefficients"]
        turns = np.full(len(doubled), self._context.mpf(0), dtype=object)
        if "area" in self._document:
            odd = self._document["area"]["odd"]
            halves = np.array(odd["modes"], dtype=np.int64).reshape(-1, genus)
            doubled = np.concatenate([doubled, halves])
            coefficients = np.concatenate(
                [coefficients, self._numbers(odd["coefficients"]).reshape(-1)]
            )
            turn = self._context.mpf(odd["turn"])
            turns = np.concatenate([turns, np.full(len(halves), turn, dtype=object)])
        f = self._fields["frequencies"]
        sizes = np.abs(doubled).astype(object) @ np.abs(f)
        slow = np.asarray(np.abs(doubled.astype(object) @ f) <= _SLOW * sizes, dtype=bool)
        return doubled, coefficients, turns, slow

    def _sinusoids(self, z: Objects) -> tuple[Objects, Objects]:
        """Return cos 2π(M·z/2 + turn) and sin 2π(M·z/2 + turn) of all modes."""
        doubled, _, factors = self._modes
        found = self._powers(z, doubled) * factors
        parts = np.frompyfunc(lambda x: (x.real, x.imag), 1, 2)(found)
        return np.asarray(parts[0]), np.asarray(parts[1])

    def _powers(self, half_turns: Objects, orders: NDArray[np.int64]) -> Objects:
        """Return e^{πi orders·half_turns} for rows of whole orders, (N,)."""
        product: Any = self._context.mpc(1)
        for turns, column in zip(half_turns, orders.T, strict=True):
            highest = int(np.max(np.abs(column), initial=0))
            table = [self._context.mpc(1)]
            unit = self._context.expjpi(turns)
            for _ in range(highest):
                table.append(table[-1] * unit)
            both = np.array([*table, *(x.conjugate() for x in table[:0:-1])], dtype=object)
            product = product * both[column]
        return np.asarray(product, dtype=object) * np.ones(len(orders), dtype=object)

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
                powers = self._powers(turns, orders) if lattice.F else np.ones(1, dtype=object)
                total += gaussian * (factor * (weights @ powers)).real
            found.append(total)
        return np.array(found, dtype=object)

    @cached_property
    def _lattice(self) -> _Lattice:
        return _Lattice(self._document, self._fields["riemann_matrix"], self._context)


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
