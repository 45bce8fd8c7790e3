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
    "BallArguments",
    "Member",
    "SiegelReduction",
    "exact",
    "nearest_term",
    "reduce_form",
    "to_doubles",
    "with_enough_bits",
]

Array = NDArray[np.float64]

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


def exact(values: Any) -> Any:
    """Return complex doubles, (N, g), as a matrix of balls."""
    return flint.acb_mat([[flint.acb(x.real, x.imag) for x in row] for row in values.tolist()])


def to_doubles(matrix: Any) -> NDArray[np.complex128]:
    """Return a matrix of balls as complex doubles."""
    return np.array([[complex(x) for x in row] for row in matrix.tolist()])


def reduce_form(form: Any) -> Any:
    """Return U ∈ GL(g, Z), whose rows are a basis of Z^g reduced in a form of balls (Lenstra,
    Lenstra, Lovász); None where they are too few digits to say that it is positive.
    """
    entries = [[x.mid().man_exp() for x in row] for row in form.tolist()]
    top = max(int(m).bit_length() + int(e) for row in entries for m, e in row)
    shift = flint.ctx.prec - top
    gram = flint.fmpz_mat([[_shifted(int(m), int(e) + shift) for m, e in row] for row in entries])
    size = gram.nrows()
    for k in range(1, size + 1):
        if flint.fmpz_mat([[gram[i, j] for j in range(k)] for i in range(k)]).det() <= 0:
            return None
    basis: Any = gram.lll(True, 0.99, 0.51, "gram")
    return basis[1]


def _shifted(mantissa: int, exponent: int) -> int:
    return mantissa << exponent if exponent >= 0 else mantissa >> -exponent


class Member(NamedTuple):
    """A characteristic by its place among those given: ε as given, and after the reduction [ε'; δ']
    and the turns of its factor, FLINT's rationals.
    """

    place: int
    given: list[Any]
    reduced: list[Any]
    turns: Any

    @property
    def doubles(self) -> tuple[Array, Array]:
        """Return ε' and δ'."""
        epsilon, delta = np.array(self.reduced, dtype=float).reshape(2, -1)
        return epsilon, delta


class BallArguments(NamedTuple):
    """What N points are to the sums of one characteristic, in balls.

    - tau: τ' (g, g)
    - v: (N, g), u = e^{2πi v}
    - nearest: n of the largest term, (N, g)
    - turns: of the common factor e^{2πi·turns}, complex, (N,)
    - pulled: Qz, (N, g)
    """

    tau: Any
    v: Any
    nearest: Array
    turns: list[Any]
    pulled: Any


@dataclass(frozen=True)
class SiegelReduction:
    """The way from τ to a reduced matrix τ', θ[ε;δ](z|τ) = e^{2πi·turns} c e^{πi zᵀQz}
    θ[ε';δ'](Lz|τ') with the turns, ε' and δ' of a ``Member``.

    - tau: τ, balls (g, g)
    - symplectic: 2g × 2g integer matrix [[A, B], [C, D]] with τ' = (Aτ+B)(Cτ+D)⁻¹
    - halves: 2ε' and 2δ' of ε = δ = 0, (2g)
    - angle: of c, in one of its branches
    """

    tau: Any
    symplectic: Any
    halves: list[int]
    angle: float

    @classmethod
    def of(cls, tau: Any) -> SiegelReduction | None:
        """Return that of a matrix of the half space (g, g), balls, in the precision in force; None
        where it is not enough.

        Reduced: Im τ' is reduced as a form, |Re τ'| ≤ ½, |τ'_11| ≥ 1.
        """
        g = tau.nrows()
        one = flint.fmpz_mat([[int(i == j) for j in range(g)] for i in range(g)])
        none = 0 * one
        first = flint.fmpz_mat([[int(i == j == 0) for j in range(g)] for i in range(g)])
        given, whole = tau, _join(one, none, none, one)
        epsilon, delta = flint.fmpz_mat(g, 1), flint.fmpz_mat(g, 1)
        eighths, angle = 0, 0.0
        for _ in range(_MOST_STEPS):
            if (U := reduce_form(tau.imag)) is None:
                return None
            dual = (U.inv(integer=True) * U.det()).transpose()  # of an adjugate, det = ±1
            tau, whole = U * tau * U.transpose(), _join(U, none, none, dual) * whole
            epsilon, delta = dual * epsilon, U * delta
            B = flint.fmpz_mat([[_nearest(x.real) for x in row] for row in tau.tolist()])
            tau, whole = tau - B, _join(one, -B, none, one) * whole
            diagonal = flint.fmpz_mat(g, 1, [B[i, i] for i in range(g)])
            moved = B * epsilon
            # of ε·(Bε + diag B)/2, in halves of ε
            eighths -= int((epsilon.transpose() * (moved + 2 * diagonal))[0, 0])
            delta += moved + diagonal
            a = tau[0, 0]
            if abs(complex(a)) >= _INSIDE:
                break
            tau = _inverted(tau)
            whole = _join(one - first, first, -first, one - first) * whole
            angle -= cmath.phase(-1j * complex(a)) / 2  # Re(−ia) = Im a > 0: the principal branch
            eighths += 2 * int(epsilon[0, 0] * delta[0, 0])
            epsilon[0, 0], delta[0, 0] = delta[0, 0], -epsilon[0, 0]
        halves = [int(x) for x in (*epsilon.entries(), *delta.entries())]
        return cls(given, whole, halves, angle + math.pi * (eighths % 8) / 4)

    def matrices(self) -> tuple[Any, Any, Any, Any]:
        """Return τ', L = (Cτ+D)⁻ᵀ, Q = −(Cτ+D)⁻¹C and log c in the precision in force.

        The steps choose among the branches of c = (det(Cτ+D))^{−½}, which differ by eighths.
        """
        (A, B), (C, D) = _blocks(self.symplectic)
        factor = C * self.tau + D
        inverse = factor.inv()
        root = -factor.det().log() / 2
        eighth = flint.arb.pi() / 4
        logarithm = (
            root + flint.acb(0, round((self.angle - float(root.imag)) / float(eighth))) * eighth
        )
        return (A * self.tau + B) * inverse, inverse.transpose(), -inverse * C, logarithm

    def _characteristic(self, given: list[Any]) -> tuple[list[Any], Any]:
        """Return ε' and δ', (2g), at most ½ in size, and the turns, for ε and δ (2g).

        With a = Dε − Cδ and b = −Bε + Aδ, θ[ε;δ] goes to ½[2ε'; 2δ'] of zero and [a; b], by
        ½(ε·δ − a·b) − ½(2δ' of zero)·a turns.
        """
        g = len(given) // 2
        (A, B), (C, D) = _blocks(self.symplectic)
        epsilon, delta = (flint.fmpq_mat(g, 1, x) for x in (given[:g], given[g:]))
        a, b = (x.entries() for x in (D * epsilon - C * delta, A * delta - B * epsilon))
        own = [flint.fmpq(half, 2) for half in self.halves]
        turns = (_dot(given[:g], given[g:]) - _dot(a, b)) / 2 - _dot(a, own[g:])
        found = [x + y for x, y in zip([*a, *b], own, strict=True)]
        # ½ goes to −½: characteristics that differ by whole numbers are one
        half = flint.fmpq(1, 2)
        whole = [(x + half).floor() for x in found]
        reduced = [x - n for x, n in zip(found, whole, strict=True)]
        turns += _dot(reduced[:g], whole[g:])
        return reduced, turns - (turns + half).floor()

    def alike(self, characteristics: NDArray[np.float64]) -> list[list[Member]]:
        """Return characteristics (C, 2, g) after the reduction, those together that share their
        terms up to signs: equal ε', and δ's that differ by halves.
        """
        groups: dict[tuple[Any, ...], list[Member]] = {}
        g = characteristics.shape[-1]
        for place, row in enumerate(characteristics.reshape(-1, 2 * g).tolist()):
            given = [flint.fmpq(*x.as_integer_ratio()) for x in row]
            reduced, turns = self._characteristic(given)
            key = (*reduced[:g], *(2 * x - (2 * x).floor() for x in reduced[g:]))
            groups.setdefault(key, []).append(Member(place, given[:g], reduced, turns))
        return list(groups.values())

    def arguments(self, z: Any, member: Member) -> BallArguments:
        """Return what points (N, g), balls, are to the sums of one characteristic."""
        tau, L, Q, logarithm = self.matrices()
        pulled, inner = z * Q, z * L.transpose()
        nearest = nearest_term(to_doubles(tau).imag, to_doubles(inner).imag, member.doubles[0])
        if not np.all(np.isfinite(nearest)):
            raise Unsolved("beyond-floats", "an exponent leaves the range of a float")
        epsilon, delta = np.array(list(map(flint.arb, member.reduced))).reshape(2, -1)
        own = flint.acb_mat([[int(n) + e for n, e in zip(row, epsilon)] for row in nearest])
        shift, moved = flint.acb_mat([delta.tolist()] * z.nrows()), own * tau
        halves = _dots(z, pulled), _dots(own, 2 * (inner + shift) + moved)
        turn = logarithm / flint.acb(0, flint.arb.pi())
        turns = [(x + y + turn) / 2 for x, y in zip(*halves, strict=True)]
        return BallArguments(tau, inner + shift + moved, nearest, turns, pulled)


def nearest_term(form: Array, heights: Array, epsilon: Array) -> Array:
    """Return n of the largest terms where Im τ' is ``form``, at imaginary parts of Lz, (N, g)."""
    return np.asarray(np.rint(-np.linalg.solve(form, heights.T).T - epsilon))


def _dots(left: Any, right: Any) -> list[Any]:
    return [_dot(*pair) for pair in zip(left.tolist(), right.tolist(), strict=True)]


def _dot(x: list[Any], y: list[Any]) -> Any:
    return sum(a * b for a, b in zip(x, y, strict=True))


def _blocks(matrix: Any) -> list[list[Any]]:
    """Return [[A, B], [C, D]]."""
    g = matrix.nrows() // 2
    rows = matrix.tolist()
    return [
        [flint.fmpz_mat([row[j : j + g] for row in rows[i : i + g]]) for j in (0, g)]
        for i in (0, g)
    ]


def _join(A: Any, B: Any, C: Any, D: Any) -> Any:
    upper = [[*a, *b] for a, b in zip(A.tolist(), B.tolist(), strict=True)]
    return flint.fmpz_mat(upper + [[*c, *d] for c, d in zip(C.tolist(), D.tolist(), strict=True)])


def _nearest(x: Any) -> Any:
    return (x.mid() + flint.arb(1) / 2).mid().floor().unique_fmpz()


def _inverted(tau: Any) -> Any:
    """Return the matrix after an inversion of m_1."""
    rows, a = tau.tolist(), tau[0, 0]
    b = [row[0] for row in rows[1:]]
    first = [-1 / a, *(-x / a for x in b)]
    rest = [
        [-x / a, *(rows[i][j] - x * y / a for j, y in enumerate(b, 1))] for i, x in enumerate(b, 1)
    ]
    return flint.acb_mat([first, *rest])
