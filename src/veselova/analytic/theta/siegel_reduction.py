"""Siegel reduction: a symplectic change of variables after which theta series of any τ are short
and do not cancel.

Each step is exact for theta functions with any real characteristics,

    θ[ε;δ](z|τ) = Σ_{m∈Z^g} exp(πi(m+ε)ᵀτ(m+ε) + 2πi(m+ε)·(z+δ)),

and none has a root whose branch is in doubt:

    basis        m = Uᵀm':       θ[ε;δ](z|τ) = θ[U⁻ᵀε; Uδ](Uz | UτUᵀ)
    translation  τ = τ' + B:     θ[ε;δ](z|τ) = e^{−πi ε·(Bε + diag B)} θ[ε; δ+Bε+½diag B](z|τ')
    inversion    of m_1 alone (Poisson summation), a = τ_11, b = (τ_21 …), D the rest: θ[ε;δ](z|τ) =
                 (−ia)^{−½} e^{2πi δ_1ε_1 − πi z_1²/a} θ[δ_1,ε'; −ε_1,δ'](−z_1/a, z'−bz_1/a | −1/a,
                 −b/a, D−bbᵀ/a)
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.balls import balls

__all__ = ["SiegelReduction", "reduce_lattice", "turns_of"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Wide = NDArray[np.clongdouble]
WideReal = NDArray[np.longdouble]
Integers = NDArray[np.int64]

#: Derived: Lovász' constant; and by how much |τ_11| must stay below 1 for an inversion, so that
#: rounding does not go to and fro.
_LOVASZ = 0.99
_INSIDE = 1 - 1e-9

#: Derived: the rounding of a long double.
_WIDE_EPSILON = float(np.finfo(np.longdouble).eps)

#: Derived: whole numbers whose product is up to here lose eight bits of a long double at most in a
#: phase that they multiply, which leaves those of a double.
_FEW = 256

#: Budget: from this error of τ', relative to its largest entry, the way there is computed again,
#: with so many digits.
_ROUGH = 2.0**-56
_DIGITS = 60

#: Derived: each inversion multiplies det Im τ by 1/|τ_11|² > 1; this many are never needed by
#: matrices of doubles.
_MOST_STEPS = 2000


def turns_of(whole: Any, part: WideReal) -> WideReal:
    """Return whole·part modulo 1, (N,), for whole numbers of any size (N, g) and a row of parts, in
    steps of four bits: a single product would have its error in units of the whole number.
    """
    rest, part = np.array(whole, dtype=np.longdouble), part - np.rint(part)
    turns = np.zeros(len(rest), dtype=np.longdouble)
    while rest.any():
        digit = np.fmod(rest, 16)
        turns += digit @ part
        turns -= np.rint(turns)
        rest = (rest - digit) / 16
        part = 16 * part
        part = part - np.rint(part)
    return turns


def reduce_lattice(form: Array) -> Integers:
    """Return U ∈ GL(g, Z), whose rows are a basis of Z^g reduced in the quadratic form (Lenstra,
    Lenstra, Lovász).
    """
    size = len(form)
    U = np.eye(size, dtype=np.int64)
    vectors = np.linalg.cholesky(form)  # row i is basis vector i
    k = 1
    while k < size:
        for j in range(k - 1, -1, -1):
            _, triangle = np.linalg.qr(vectors[: k + 1].T)
            multiple = round(triangle[j, k] / triangle[j, j])
            if multiple:
                vectors[k] -= multiple * vectors[j]
                U[k] -= multiple * U[j]
        _, triangle = np.linalg.qr(vectors[: k + 1].T)
        above = triangle[k - 1, k]
        own = triangle[k, k]
        if own * own + above * above >= _LOVASZ * triangle[k - 1, k - 1] ** 2:
            k += 1
        else:
            vectors[[k - 1, k]], U[[k - 1, k]] = vectors[[k, k - 1]], U[[k, k - 1]]
            k = max(k - 1, 1)
    return U


@dataclass
class SiegelReduction:
    """A reduced matrix τ' and the way there: θ[ε;δ](z|τ) = e^{c} e^{πi zᵀQz} θ[ε';δ'](Lz|τ').

    - tau: (g, g) reduced: Im τ' reduced as a form, |Re τ'| ≤ ½, |τ'_11| ≥ 1
    - linear: L (g, g)
    - quadratic: Q (g, g)
    - symplectic: (2g, 2g) integer matrix [[A, B], [C, D]] with τ' = (Aτ+B)(Cτ+D)⁻¹
    - rounding: (g, g), bounds of the error of the entries of τ'

    Steps cancel, and exponents turn many times: both are carried in long doubles, which have 11
    bits more where the processor has them. Integers are chosen in doubles. Where steps cancel much,
    τ', L and Q are computed again from the integers alone.
    """

    tau: Any
    linear: Wide = field(init=False)
    quadratic: Wide = field(init=False)
    symplectic: Integers = field(init=False)
    _steps: list[tuple[str, Array]] = field(default_factory=list, init=False)
    _log_root: Any = field(default=np.clongdouble(0), init=False)
    _changes: list[tuple[Complex, Array]] = field(default_factory=list, init=False)

    def __post_init__(self) -> None:
        g = len(self.tau)
        self.tau = np.array(self.tau, dtype=np.clongdouble)
        self.linear, self.quadratic = (
            np.eye(g, dtype=np.clongdouble),
            np.zeros((g, g), dtype=np.clongdouble),
        )
        self.symplectic = np.eye(2 * g, dtype=np.int64)
        given = self.tau
        for _ in range(_MOST_STEPS):
            self._change_basis()
            self._translate()
            if abs(self.tau[0, 0]) >= _INSIDE:
                break
            self._invert()
        if np.max(self.rounding) > _ROUGH * np.max(np.abs(self.tau)):
            self._refine(given)

    def _change_basis(self) -> None:
        U = reduce_lattice(self.tau.imag.astype(float))
        if not np.array_equal(U, np.eye(len(U))):
            self._round(U, np.abs(U) @ np.abs(self.tau).astype(float) @ np.abs(U).T)
        self.tau = U @ self.tau @ U.T
        self.tau = (self.tau + self.tau.T) / 2
        self.linear = U @ self.linear
        self._compose(U, 0 * U, 0 * U, np.rint(np.linalg.inv(U)).T.astype(np.int64))
        self._steps.append(("basis", U.astype(float)))

    def _translate(self) -> None:
        B = np.rint(self.tau.real.astype(float)).astype(np.int64)
        if B.any():
            self.tau = self.tau - B
            one = np.eye(len(B), dtype=np.int64)
            self._compose(one, -B, 0 * B, one)
            self._steps.append(("translation", B.astype(float)))

    def _invert(self) -> None:
        a = self.tau[0, 0]
        b = self.tau[0, 1:]
        row = self.linear[0].copy()
        self.quadratic = self.quadratic - np.outer(row, row) / a
        change = np.eye(len(self.tau), dtype=complex)
        change[1:, 0] = -(b / a).astype(complex)
        change[0, 0] = complex(-1 / a)
        self.linear[1:] -= np.outer(b, row) / a
        self.linear[0] = -row / a
        tau = self.tau.copy()
        tau[0, 0], tau[0, 1:], tau[1:, 0] = -1 / a, -b / a, -b / a
        tau[1:, 1:] -= np.outer(b, b) / a
        sizes = np.abs(tau).astype(float)
        sizes[1:, 1:] += np.abs(np.outer(b, b) / a).astype(float)
        self._round(change, sizes)
        self.tau = tau
        self._log_root = (
            self._log_root - np.log(-1j * a) / 2
        )  # Re(−ia) = Im a > 0: the principal branch
        one = np.eye(len(tau), dtype=np.int64)
        first = np.zeros_like(one)
        first[0, 0] = 1
        self._compose(one - first, first, -first, one - first)
        self._steps.append(("inversion", np.empty(0)))

    def _refine(self, given: Wide) -> None:
        """Compute τ' = (Aτ+B)J⁻¹, L = J⁻ᵀ, Q = −J⁻¹C and det J again, J = Cτ+D, in balls. The steps
        choose among the branches of (det J)^{−½}, which differ by quarter turns of its square.
        """
        g = len(given)
        (A, B), (C, D) = (np.hsplit(half, 2) for half in np.vsplit(self.symplectic, 2))
        with balls(_DIGITS) as xp:
            tau = xp.complex_array(*(part.astype(float) for part in (given.real, given.imag)))
            inverse, determinant = _inverse(C.astype(object) @ tau + D.astype(object))
            exact = (A.astype(object) @ tau + B.astype(object)) @ inverse
            found, linear, quadratic = (_wide(x) for x in (exact, inverse.T, -inverse @ C))
            root = _wide(-determinant.log() / 2)[()]
        if not np.all(np.abs(found - self.tau) <= self.rounding + _WIDE_EPSILON * np.abs(found)):
            return  # integers beyond 64 bits, or more lost than the balls have
        self.tau, self.linear, self.quadratic = found, linear, quadratic
        quarter = np.longdouble("0.785398163397448309615660845819875721")
        turns = np.rint((self._log_root - root).imag / quarter)
        self._log_root = root + 1j * quarter * turns
        self._changes = []
        self._round(np.eye(g), np.abs(found).astype(float))
        del self.__dict__["rounding"]

    def _round(self, change: Any, sizes: Array) -> None:
        """Note a step that takes dτ to M dτ Mᵀ, and the sizes of what it adds; translations round
        nothing.
        """
        own = 3 * _WIDE_EPSILON * sizes
        self._changes.append((np.asarray(change, dtype=complex), own))

    @cached_property
    def rounding(self) -> Array:
        """Return the bounds: the rounding of each step by the product of those after it, whose
        factors may be large and cancel.
        """
        after = np.eye(len(self.tau), dtype=complex)
        bound = np.zeros(self.tau.shape)
        for change, own in reversed(self._changes):
            bound += np.abs(after) @ own @ np.abs(after).T
            after = after @ change
        return bound

    @cached_property
    def _growth(self) -> float:
        """Return by how much the steps multiply the rounding of a characteristic, at most: the
        product of the largest entries of their whole matrices, of a basis those of ε among them.
        """
        matrices = [matrix for kind, matrix in self._steps if kind == "translation"]
        for kind, matrix in self._steps:
            if kind == "basis":
                matrices.append(np.maximum(np.abs(matrix), np.abs(np.linalg.inv(matrix))))
        return math.prod(float(np.max(np.abs(matrix))) for matrix in matrices)

    def _compose(self, A: Integers, B: Integers, C: Integers, D: Integers) -> None:
        self.symplectic = np.block([[A, B], [C, D]]) @ self.symplectic

    def characteristic(
        self, given_epsilon: Array, given_delta: Array
    ) -> tuple[WideReal, WideReal, Any, Any]:
        """Return ε', δ' and the factor of these characteristics: e^{2πi·turns + logarithm}.

        Whole numbers are taken off at each step, where they are exact: θ[ε+a;δ+b] = e^{2πi ε·b}
        θ[ε;δ]. In phases of many turns they would cost digits.
        """
        largest = float(np.max(np.abs([given_epsilon, given_delta])))
        exact = max(largest, 1.0) * self._growth > _FEW
        to_number: Any = _to_fractions if exact else np.longdouble
        to_whole: Any = _nearest if exact else np.rint
        epsilon: Any = to_number(given_epsilon)
        delta: Any = to_number(given_delta)
        turns: Any = to_number(np.zeros(1))[0]
        half = to_number(np.full(1, 0.5))[0]
        for kind, given in self._steps:
            if kind == "basis":
                epsilon = to_number(np.rint(np.linalg.inv(given)).T) @ epsilon
                delta = to_number(given) @ delta
            elif kind == "translation":
                matrix = to_number(given)
                moved = matrix @ epsilon
                turns -= epsilon @ (moved + np.diag(matrix)) * half
                delta = delta + moved + np.diag(matrix) * half
            else:
                turns += delta[0] * epsilon[0]
                epsilon[0], delta[0] = delta[0], -epsilon[0]
            epsilon = epsilon - to_whole(epsilon)
            whole = to_whole(delta)
            turns += epsilon @ whole
            turns -= round(turns)
            delta = delta - whole
        if exact:
            epsilon, delta, (turns,) = map(_to_wide, (epsilon, delta, np.array([turns])))
        return epsilon, delta, turns, self._log_root


def _inverse(matrix: NDArray[Any]) -> tuple[NDArray[Any], Any]:
    """Return the inverse and the determinant of a matrix of complex balls, by elimination."""
    size = len(matrix)
    rows = np.hstack([matrix, np.eye(size, dtype=np.int64).astype(object)])
    determinant = 1
    for k in range(size):
        pivot = k + int(np.argmax([abs(complex(x)) for x in rows[k:, k]]))
        if pivot != k:
            rows[[k, pivot]] = rows[[pivot, k]]
            determinant = -determinant
        determinant = determinant * rows[k, k]
        rows[k] = rows[k] / rows[k, k]
        for i in range(size):
            if i != k:
                rows[i] = rows[i] - rows[i, k] * rows[k]
    return rows[:, size:], determinant


def _to_fractions(values: Any) -> Any:
    """Return doubles or long doubles as an array of the rationals that they store."""
    given = np.asarray(values)
    exact = [Fraction(*x.as_integer_ratio()) for x in given.ravel()]
    return np.array(exact, dtype=object).reshape(given.shape)


def _nearest(values: Any) -> Any:
    """Return the whole numbers next to rationals."""
    return np.array([round(x) for x in values], dtype=object)


def _to_wide(values: Any) -> Any:
    """Return the long doubles next to rationals."""
    pairs = [(float(x), float(x - Fraction(float(x)))) for x in values]
    return np.array([np.longdouble(high) + np.longdouble(rest) for high, rest in pairs])


def _wide(values: Any) -> Any:
    """Return the long doubles next to complex balls."""

    def long_double(ball: Any) -> Any:
        high = float(ball.mid())
        return np.longdouble(high) + np.longdouble(float((ball - high).mid()))

    given = np.asarray(values, dtype=object)
    found = np.array([long_double(x.real) + 1j * long_double(x.imag) for x in given.ravel()])
    return found.reshape(given.shape)
