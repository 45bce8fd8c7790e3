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

The steps choose whole numbers alone; τ', L and Q follow from these and from τ, in balls.
"""

from __future__ import annotations

import cmath
import math
import operator
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeVar

import flint
import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.budget import checkpoint
from veselova.mechanics.core.decimals import precision
from veselova.mechanics.core.errors import Unsolved

__all__ = [
    "Arguments",
    "Member",
    "SiegelReduction",
    "arguments",
    "exact",
    "imaginary",
    "reduce_form",
    "with_enough_bits",
]

Array = NDArray[np.float64]

#: Arrays of whole numbers, of FLINT's rationals or of balls.
Objects = NDArray[Any]

T = TypeVar("T")

#: Derived: by how much |τ_11| must stay below 1 for an inversion, so that rounding does not go to
#: and fro.
_INSIDE = 1 - 1e-9

#: Budget: bits in which a computation begins, twice as many each time that they do not suffice,
#: and the most.
_BITS, _MOST_BITS = 192, 12288

#: Derived: each inversion multiplies det Im τ by 1/|τ_11|² > 1; this many are never needed by
#: matrices of doubles.
_MOST_STEPS = 2000

_HALF = flint.fmpq(1, 2)

#: Complex doubles as balls; imaginary parts of balls; whole numbers next to real parts of balls.
exact = np.frompyfunc(lambda x: flint.acb(x.real, x.imag), 1, 1)
imaginary = np.frompyfunc(operator.attrgetter("imag"), 1, 1)
_nearest = np.frompyfunc(lambda x: (x.real.mid() + 0.5).mid().floor().unique_fmpz(), 1, 1)
_floors = np.frompyfunc(operator.methodcaller("floor"), 1, 1)
_arb = np.frompyfunc(flint.arb, 1, 1)


def with_enough_bits(compute: Callable[[], T | None]) -> T:
    """Return what a computation in balls gives, with more bits while it gives None.

    Raises Unsolved (``beyond-floats``) where the most bits do not suffice.
    """
    bits = _BITS
    while bits <= _MOST_BITS:
        checkpoint()
        with precision(bits):
            if (found := compute()) is not None:
                return found
        bits *= 2
    raise Unsolved("beyond-floats", f"τ or z takes more than {_MOST_BITS} bits")


def reduce_form(form: Objects) -> Any:
    """Return U ∈ GL(g, Z), FLINT's matrix, whose rows are a basis of Z^g reduced in a form of balls
    (Lenstra, Lenstra, Lovász); None where they are too few digits to say that it is positive.
    """
    entries = [[x.mid().man_exp() for x in row] for row in form]
    top = max(int(m).bit_length() + int(e) for row in entries for m, e in row)
    shift = flint.ctx.prec - top
    gram = flint.fmpz_mat([[_shifted(int(m), int(e) + shift) for m, e in row] for row in entries])
    rows = gram.tolist()
    if any(
        flint.fmpz_mat([row[:k] for row in rows[:k]]).det() <= 0 for k in range(1, 1 + len(rows))
    ):
        return None
    basis: Any = gram.lll(True, 0.99, 0.51, "gram")
    return basis[1]


def _shifted(mantissa: int, exponent: int) -> int:
    return mantissa << exponent if exponent >= 0 else mantissa >> -exponent


class Member(NamedTuple):
    """A characteristic by its place among those given: ε as given, (g,), and after the reduction
    [ε'; δ'], (2g,), and the turns of its factor, FLINT's rationals.
    """

    place: int
    given: Objects
    reduced: Objects
    turns: Any

    @property
    def delta(self) -> Array:
        """Return δ' in doubles."""
        return np.split(self.reduced.astype(float), 2)[1]


class Arguments(NamedTuple):
    """What N points are to the sums of one characteristic, in doubles or in balls.

    - v: (N, g), u = e^{2πi v}
    - nearest: n of the largest term, and own: n + ε', (N, g)
    - turns: of the common factor e^{2πi·turns}, complex, (N,)
    - slopes: Qz + Lᵀ(n + ε'), the gradient of the largest term over 2πi, (N, g)
    """

    v: NDArray[Any]
    nearest: Array
    own: NDArray[Any]
    turns: NDArray[Any]
    slopes: NDArray[Any]


def arguments(
    matrices: tuple[NDArray[Any], NDArray[Any], NDArray[Any], Any], z: NDArray[Any], member: Member
) -> Arguments:
    """Return what points (N, g) are to the sums of one characteristic; ``matrices``: τ', L, Q and
    the turns of c, doubles or balls as the points are.
    """
    tau, L, Q, turns_of_c = matrices
    in_balls = z.dtype == object
    halves = np.asarray(_arb(member.reduced)) if in_balls else member.reduced.astype(float)
    epsilon, delta = np.split(halves, 2)
    pulled, inner = z @ Q, z @ L.T
    forms, heights = tau.astype(complex).imag, inner.astype(complex).imag
    nearest = np.rint(-np.linalg.solve(forms, heights.T).T - epsilon.astype(float))
    own = nearest.astype(z.dtype) + epsilon
    moved = own @ tau
    turns = np.sum(z * pulled + own * (2 * (inner + delta) + moved), axis=1) / 2 + turns_of_c
    return Arguments(inner + delta + moved, nearest, own, turns, pulled + own @ L)


@dataclass(frozen=True)
class SiegelReduction:
    """The way from τ to a reduced matrix τ', θ[ε;δ](z|τ) = e^{2πi·turns} c e^{πi zᵀQz}
    θ[ε';δ'](Lz|τ') with the turns, ε' and δ' of a ``Member``.

    - tau: τ, balls (g, g)
    - symplectic: 2g × 2g matrix [[A, B], [C, D]] of whole numbers with τ' = (Aτ+B)(Cτ+D)⁻¹
    - halves: 2ε' and 2δ' of ε = δ = 0, (2g,)
    - angle: of c, in one of its branches
    """

    tau: Objects
    symplectic: Objects
    halves: Objects
    angle: float

    @classmethod
    def of(cls, tau: Objects) -> SiegelReduction | None:
        """Return that of a matrix of the half space (g, g), balls, in the precision in force; None
        where it is not enough.

        Reduced: Im τ' is reduced as a form, |Re τ'| ≤ ½, |τ'_11| ≥ 1.
        """
        g, given = len(tau), tau
        whole = np.eye(2 * g, dtype=object)
        epsilon, delta = np.zeros((2, g), dtype=object)
        eighths, angle = 0, 0.0
        for _ in range(_MOST_STEPS):
            if (basis := reduce_form(imaginary(tau))) is None:
                return None
            adjugate = basis.inv(integer=True) * basis.det()  # det = ±1
            U, dual = _array(basis), _array(adjugate).T
            tau, epsilon, delta = U @ tau @ U.T, dual @ epsilon, U @ delta
            whole = np.concatenate([U @ whole[:g], dual @ whole[g:]])
            B = _nearest(tau)
            tau = tau - B
            whole[:g] -= B @ whole[g:]
            diagonal, moved = np.diagonal(B), B @ epsilon
            # of ε·(Bε + diag B)/2, in halves of ε
            eighths -= int(epsilon @ (moved + 2 * diagonal))
            delta = delta + moved + diagonal
            a = tau[0, 0]
            if abs(complex(a)) >= _INSIDE:
                break
            tau = _inverted(tau)
            whole[[0, g]] = np.stack([whole[g], -whole[0]])
            angle -= cmath.phase(-1j * complex(a)) / 2  # Re(−ia) = Im a > 0: the principal branch
            eighths += 2 * int(epsilon[0] * delta[0])
            epsilon[0], delta[0] = delta[0], -epsilon[0]
        halves = np.concatenate([epsilon, delta])
        return cls(given, whole, halves, angle + math.pi * (eighths % 8) / 4)

    @property
    def _blocks(self) -> list[list[Objects]]:
        """Return [[A, B], [C, D]]."""
        return [np.hsplit(rows, 2) for rows in np.vsplit(self.symplectic, 2)]

    def matrices(self) -> tuple[Objects, Objects, Objects, Any]:
        """Return τ', L = (Cτ+D)⁻ᵀ, Q = −(Cτ+D)⁻¹C and the turns of c in the precision in force.

        The steps choose among the branches of c = (det(Cτ+D))^{−½}, which differ by eighths.
        """
        (A, B), (C, D) = self._blocks
        factor = flint.acb_mat((C @ self.tau + D).tolist())
        inverse = _array(factor.inv())
        root = -factor.det().log() / 2
        eighths = round((self.angle - float(root.imag)) / (math.pi / 4))
        turns = root / flint.acb(0, 2 * flint.arb.pi()) + flint.arb(eighths) / 8
        return (A @ self.tau + B) @ inverse, inverse.T, -inverse @ C, turns

    def _characteristic(self, given: Objects) -> tuple[Objects, Any]:
        """Return ε' and δ', (2g,), at most ½ in size, and the turns, for ε and δ (2g,).

        With a = Dε − Cδ and b = −Bε + Aδ, θ[ε;δ] goes to ½[2ε'; 2δ'] of zero and [a; b], by
        ½(ε·δ − a·b) − ½(2δ' of zero)·a turns.
        """
        (A, B), (C, D) = self._blocks
        epsilon, delta = np.split(given, 2)
        a, b = D @ epsilon - C @ delta, A @ delta - B @ epsilon
        own = self.halves * _HALF
        turns = (epsilon @ delta - a @ b) / 2 - a @ own[len(a) :]
        found = np.concatenate([a, b]) + own
        # ½ goes to −½: characteristics that differ by whole numbers are one
        whole = _floors(found + _HALF)
        reduced = found - whole
        turns += reduced[: len(a)] @ whole[len(a) :]
        return reduced, turns - (turns + _HALF).floor()

    def alike(self, characteristics: Array) -> list[list[Member]]:
        """Return characteristics (C, 2, g) after the reduction, those together that share their
        terms up to signs: equal ε', and δ's that differ by halves.
        """
        groups: dict[tuple[Any, ...], list[Member]] = {}
        g = characteristics.shape[-1]
        for place, row in enumerate(characteristics.reshape(-1, 2 * g).tolist()):
            given = np.array([flint.fmpq(*x.as_integer_ratio()) for x in row], dtype=object)
            reduced, turns = self._characteristic(given)
            key = (*reduced[:g], *(2 * x - (2 * x).floor() for x in reduced[g:]))
            groups.setdefault(key, []).append(Member(place, given[:g], reduced, turns))
        return list(groups.values())


def _array(matrix: Any) -> Objects:
    """Return a matrix of FLINT's as an array."""
    return np.array(matrix.tolist(), dtype=object)


def _inverted(tau: Objects) -> Objects:
    """Return the matrix after an inversion of m_1."""
    a, b = tau[0, 0], tau[1:, 0]
    found = np.empty_like(tau)
    found[0, 0] = -1 / a
    found[0, 1:] = found[1:, 0] = -b / a
    found[1:, 1:] = tau[1:, 1:] - np.outer(b, b) / a
    return found
