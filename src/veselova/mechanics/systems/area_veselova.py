"""Bodies with an area constant (K,γ): the rank-one problem on whose torus they move, n = 3.

Veselova's body with (Ω,γ) = c and Chaplygin's ball are one system. K and γ are fixed in space,
Ω = Bw with w = K + σγ, and w is in the kernel of Gram_B(K,γ) − M:

    Veselova   B = 𝓘⁻¹, K = 𝓘Ω − (𝓘Ω,γ)γ + cγ,    M = [[2E, c], [c, 0]],
               2E = (BK,K) − ((BK,γ) − c)²/(Bγ,γ)
    Chaplygin  B = J⁻¹, K = JΩ − D(Ω,γ)γ, D = ma², M = diag(2h, 1/D),     2h = (K,Ω)

Let (u,v)ᵀ = L(K,γ)ᵀ diagonalise M and the Gram matrix of (K,γ) at once: u and v are orthonormal,
LMLᵀ = diag(μ1, μ2), with μ2 the least (ς = 1, Veselova) or the largest (ς = −1, Chaplygin). Then
w = αu + βv with α > 0, and A' = ς(B − μ2) > 0, q = v, w' = u + (β/α)v are the data of a rank-one
Veselova problem, q̇ along v×A'w', with the natural frame {v, ±u, ±n}, n = u×v, and c'_2 = 1/μ',
μ' = ς(μ1 − μ2). The flow is linear in the same phases z. Its direction and its time differ,

    du = (−μ2, ς) dτ₁,    dt = (L₀₀Q − L₁₀ρ) dτ₁,    Q = √(c'_2λ_1λ_2),    ρ/Q = (u,A'v)/(v,A'v),

and a ball of radius a has its contact point at

    x(t) = x(0) + a [μ1 k_h t + (μ1−μ2) k_h L₁₀ ∫ρ dτ₁] n + a ς ∫(q',u) dτ₁ e_⊥,

k_h the length of the horizontal part of K and e_⊥ = n×γ. The length of q̇ is chosen so that the own
time t' of the rank-one problem has dt' = L₀₀Q dτ₁.

Where K is along γ the axes u, v are not defined: γ moves as in Euler's top. There K is turned from
γ by 1e-30. Then A' is isotropic to 1e-60, and its differences, which are those of B, have all
digits.
"""

from __future__ import annotations

import decimal
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from operator import mul
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core import decimal_vectors as vectors
from veselova.mechanics.core.decimal_vectors import Vector
from veselova.mechanics.core.exact_input import read_only
from veselova.mechanics.core.problem import Series
from veselova.mechanics.systems.rigid_body import RigidBody
from veselova.mechanics.systems.veselova import Veselova

__all__ = ["AreaData", "AreaVeselova", "RollingAreaVeselova"]

Array = NDArray[np.float64]

#: Digits of the data, and where K is within _NEAR of γ.
_DIGITS = 110
_MORE_DIGITS = 260

#: Digits of the data for each digit asked for: squares of gaps, and what they lose on the way.
_PER_DIGIT = 5
_NEAR = Decimal("1e-5")

#: Sine of the angle between K and γ that counts as zero, and is taken in its place.
_LEAST_ANGLE = Decimal("1e-30")

#: Entries of q and of q̇ over |q̇| that are none: what rounding leaves, and what a turn of K makes.
_ROUNDING = Decimal("1e-100")
_TILT = Decimal("1e-28")

#: Distances of c'_2 from an I' that come of rounding, or of a turn of K, over those of the I'.
_TOLD_APART = Fraction(1, 10**90)
_TILTED_APART = Fraction(1, 10**28)

#: By how much equal B's are separated where K is nearly along γ: there differences of A' are as
#: small as what a solution would separate them by.
_APART = Decimal("1e-40")


@dataclass(frozen=True)
class AreaData:
    """What a body with an area constant gives, along its principal axes, as exact rationals.

    - inverse: (3,) B
    - gamma: (3,) of any length
    - Omega: (3,)
    - added: D, None for Veselova's body
    - energy: the energy of the body, or its Jacobi integral, which a torus states
    """

    inverse: tuple[Fraction, ...]
    gamma: tuple[Fraction, ...]
    Omega: tuple[Fraction, ...]
    added: Fraction | None
    energy: float

    @classmethod
    def of(cls, body: RigidBody, added: Fraction | None = None) -> AreaData:
        """Return what a body gives; ``added`` is D."""
        gamma, Omega = body.to_axes()
        inverse = tuple(1 / moment for moment in body.moments)
        energy = float(body.integrals(body.start)[body.energy_name][0])
        return cls(inverse, gamma, Omega, added, energy)


class AreaVeselova(Veselova):
    """The rank-one problem of a body with an area constant, its own time t'.

    - spin: |Ω| at the start
    - told_apart: the distance of c'_2 from an I' below which both may be one, over that of the I'
    - sign: ς
    - mu2: in units in which the least A' is one, exactly
    - tilt: L₁₀/L₀₀
    - uniform: μ₁k_h in the units of the body
    - across: (μ₁−μ₂)k_h in the units of the body
    - u: (3,) at the start
    - normal: (3,) n at the start
    - horizontal: (3,) e_⊥ at the start
    - angle: the sine of the angle between K and γ
    - exact_tilt, exact_uniform, exact_across: the same as rationals
    - columns, exact_plane: [v u −n] at the start by its columns, and n, e_⊥, rationals

    With ``digits`` the data are rounded so far below them that nothing is lost. The frame is then
    [v u −n], otherwise the natural one. Where K is along γ, to 1e-5, they are not served.
    """

    body_energy: float
    spin: float
    told_apart: Fraction
    sign: int
    mu2: Fraction
    tilt: float
    uniform: float
    across: float
    u: Array
    normal: Array
    horizontal: Array
    angle: float
    exact_tilt: Fraction
    exact_uniform: Fraction
    exact_across: Fraction
    exact_plane: tuple[tuple[Fraction, ...], ...]
    columns: tuple[tuple[Fraction, ...], ...]

    def __init__(self, data: AreaData, digits: int = 0) -> None:
        with decimal.localcontext() as context:
            context.prec = _DIGITS + _PER_DIGIT * digits
            context.Emin, context.Emax = decimal.MIN_EMIN, decimal.MAX_EMAX
            momentum = _momentum(data)
            if momentum.angle < _NEAR:
                context.prec = _MORE_DIGITS
                momentum = _momentum(data)
            found = _Pencil.of(momentum)
            A = [found.sign * (b - found.mu[1]) for b in found.inverse]
            unit = min(A)
            slope = vectors.dot(found.u, vectors.times(found.inverse, found.v))
            slope /= found.sign * vectors.dot(found.v, vectors.times(A, found.v))
            # w' = u + (β/α)v with β/α = −(u,A'v)/(v,A'v)
            w = [x - slope * y for x, y in zip(found.u, found.v, strict=True)]
            q_dot = [x / found.L[0] for x in vectors.cross(found.v, vectors.times(A, w))]
            q, q_dot = _moving(found.v, q_dot, momentum.angle)
            normal = vectors.cross(found.u, found.v)
            columns = (q, found.u, [-x for x in normal])
            super().__init__(
                [Fraction(a / unit) for a in A],
                [Fraction(x) for x in q],
                [Fraction(x) for x in q_dot],
                _exact(zip(*columns, strict=True)) if digits else None,
                normalize=True,
            )
            self._set(
                body_energy=data.energy,
                spin=float(np.linalg.norm(_floats(data.Omega))),
                told_apart=_TILTED_APART if momentum.angle < _LEAST_ANGLE else _TOLD_APART,
                sign=found.sign,
                mu2=Fraction(found.mu[1] / unit),
                tilt=float(found.L[1] / found.L[0]),
                exact_tilt=Fraction(found.L[1] / found.L[0]),
                columns=_exact(columns),
                angle=float(momentum.angle),
                exact_uniform=Fraction(found.mu[0] * momentum.horizontal),
                exact_across=Fraction((found.mu[0] - found.mu[1]) * momentum.horizontal),
                exact_plane=_exact((normal, vectors.cross(normal, momentum.gamma))),
                uniform=float(found.mu[0] * momentum.horizontal),
                across=float((found.mu[0] - found.mu[1]) * momentum.horizontal),
                u=_floats(found.u),
                normal=_floats(normal),
                horizontal=_floats(vectors.cross(normal, momentum.gamma)),
            )

    @property
    def energy(self) -> float:
        """Return the energy of the body, or its Jacobi integral where (Ω,γ) ≠ 0 is constant."""
        return self.body_energy

    @property
    def has_units(self) -> bool:
        """Return whether that is a float."""
        return bool(np.isfinite(self.body_energy))


class RollingAreaVeselova(AreaVeselova):
    """The same for a ball: its motions have the series ``displacement``, the coefficients of an and
    ae_⊥ in x(t) − x(0).
    """

    outputs: ClassVar[Mapping[str, tuple[str, ...]]] = {
        **Veselova.outputs,
        "displacement": ("horizontal",),
    }
    bounded: ClassVar[tuple[str, ...]] = ("frame", "displacement")

    @property
    def start(self) -> Series:
        """Return the series at t = 0."""
        return {**super().start, "displacement": np.zeros((1, 2))}


@dataclass(frozen=True)
class _Momentum:
    """K = K_h + κγ and what belongs to it: K_h = horizontal·direction, the form M in the basis
    (K_h, γ), and the angle of K with γ, its sine.
    """

    data: AreaData
    inverse: Vector
    gamma: Vector
    direction: Vector
    horizontal: Decimal
    angle: Decimal
    form: tuple[Decimal, Decimal, Decimal]


def _momentum(data: AreaData) -> _Momentum:
    # The motion does not depend on the unit of inertia. K_h does, and (Ω,γ) does not.
    unit = max(data.inverse)
    inverse = [vectors.of_rational(b / unit) for b in data.inverse]
    gamma = vectors.unit([vectors.of_rational(x) for x in data.gamma])
    Omega = [vectors.of_rational(x) for x in data.Omega]
    along = vectors.dot([x / b for x, b in zip(Omega, inverse, strict=True)], gamma)
    spin = vectors.dot(Omega, gamma)
    across = _across(data, unit)
    D = None if data.added is None else vectors.of_rational(data.added * unit)
    area = spin if D is None else along - D * spin
    horizontal = vectors.dot(across, across).sqrt()
    size = (horizontal**2 + area**2).sqrt()
    angle = horizontal / size
    if not horizontal:
        least = min(range(3), key=lambda i: abs(gamma[i]))
        across = list(vectors.cross(gamma, [Decimal(int(i == least)) for i in range(3)]))
    direction = vectors.unit(across)
    if angle < _LEAST_ANGLE:
        horizontal = _LEAST_ANGLE * size
    if angle < _NEAR:
        inverse = _separated(inverse)
    B_direction, B_gamma = (vectors.times(inverse, x) for x in (direction, gamma))
    # Gram_B in the basis (K, γ)
    Kg = horizontal * vectors.dot(B_direction, gamma) + area * vectors.dot(B_gamma, gamma)
    KK = horizontal**2 * vectors.dot(B_direction, direction) + area * (
        2 * horizontal * vectors.dot(B_direction, gamma) + area * vectors.dot(B_gamma, gamma)
    )
    gg = vectors.dot(B_gamma, gamma)
    if D is None:
        form = (KK - (Kg - area) ** 2 / gg - 2 * area**2, area, Decimal(0))
    else:
        twice_energy = KK + D * Kg**2 / (1 - D * gg)
        form = (twice_energy + area**2 / D, -area / D, 1 / D)
    return _Momentum(data, tuple(inverse), tuple(gamma), tuple(direction), horizontal, angle, form)


def _across(data: AreaData, unit: Fraction) -> list[Decimal]:
    """Return JΩ − (JΩ,γ)γ/(γ,γ), orthogonal to γ however small it is."""
    JOmega = [x * unit / b for x, b in zip(data.Omega, data.inverse, strict=True)]
    along = sum(map(mul, JOmega, data.gamma)) / sum(map(mul, data.gamma, data.gamma))
    return [vectors.of_rational(x - along * y) for x, y in zip(JOmega, data.gamma, strict=True)]


@dataclass(frozen=True)
class _Pencil:
    """u, v and (μ1, μ2), with L₀₀ and L₁₀."""

    inverse: Vector
    sign: int
    mu: tuple[Decimal, Decimal]
    u: Vector
    v: Vector
    L: tuple[Decimal, Decimal]

    @classmethod
    def of(cls, momentum: _Momentum) -> _Pencil:
        """Return the axes of M in the orthonormal basis (direction, γ): u = x₁·direction + y₁γ."""
        first, mixed, last = momentum.form
        k = momentum.horizontal
        first, mixed = first / k**2, mixed / k
        difference = first - last
        root = (difference**2 + 4 * mixed**2).sqrt()
        cosine = ((root + abs(difference)) / (2 * root)).sqrt()
        sine = mixed / (root * cosine)
        above = (cosine, sine) if difference >= 0 else (abs(sine), cosine.copy_sign(mixed))
        below = (-above[1], above[0])
        values = ((first + last + root) / 2, (first + last - root) / 2)
        sign = 1 if momentum.data.added is None else -1
        (mu1, x), (mu2, y) = zip(values, (above, below), strict=True)
        if sign < 0:
            (mu1, x), (mu2, y) = (mu2, y), (mu1, x)
        # dt/dτ₁ > 0 on the whole torus, where ρ takes both signs: so L₀₀ > 0
        if x[0] < 0:
            x = (-x[0], -x[1])
        if x[0] * y[1] - x[1] * y[0] < 0:
            y = (-y[0], -y[1])
        u, v = (_combination(pair, momentum) for pair in (x, y))
        return cls(momentum.inverse, sign, (mu1, mu2), u, v, (x[0] / k, y[0] / k))


def _combination(pair: tuple[Decimal, Decimal], momentum: _Momentum) -> Vector:
    x, y = pair
    terms = zip(momentum.direction, momentum.gamma, strict=True)
    return tuple(x * e + y * g for e, g in terms)


def _moving(
    q: Sequence[Decimal], q_dot: Sequence[Decimal], angle: Decimal
) -> tuple[list[Decimal], list[Decimal]]:
    """Return q and q̇ with zeros where both entries are rounding, or come of the turn of K."""
    rounding = Decimal(10) ** (10 - decimal.getcontext().prec)
    least = _TILT if angle < _LEAST_ANGLE else min(_ROUNDING, rounding)
    speed = max(abs(x) for x in q_dot)
    rests = [abs(x) < least and abs(y) < least * speed for x, y in zip(q, q_dot, strict=True)]
    return tuple(
        [Decimal(0) if at_rest else x for x, at_rest in zip(values, rests, strict=True)]
        for values in (q, q_dot)
    )  # type: ignore[return-value]


def _separated(inverse: Sequence[Decimal]) -> list[Decimal]:
    """Return B's of which none are equal, to 1e-40."""
    result = list(inverse)
    for i, value in enumerate(result):
        count = sum(other == value for other in inverse[:i])
        result[i] = value * (1 - count * _APART)
    return result


def _exact(rows: Iterable[Iterable[Decimal]]) -> tuple[tuple[Fraction, ...], ...]:
    return tuple(tuple(Fraction(x) for x in row) for row in rows)


def _floats(vector: Sequence[Any]) -> Array:
    return read_only(np.array([float(x) for x in vector]))
