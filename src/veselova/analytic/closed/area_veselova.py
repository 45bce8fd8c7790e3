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

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.decimals import Objects, enclose, rational, working_digits
from veselova.mechanics.core.exact_input import to_float
from veselova.mechanics.core.upper import register
from veselova.mechanics.geometry.sphere import ExactState
from veselova.mechanics.geometry.symmetric_axes import midpoints
from veselova.mechanics.systems.rigid_body import RigidBody
from veselova.mechanics.systems.rolling_ball import RollingBall
from veselova.mechanics.systems.rolling_veselova import BallPath, WithDisplacement
from veselova.mechanics.systems.veselova import Veselova

__all__ = ["AreaVeselova", "RollingAreaVeselova", "area_torus", "unit_of", "vector_of"]

Array = NDArray[np.float64]

#: Derived: digits of the data, and where K is within _NEAR of γ.
_DIGITS = 80
_MORE_DIGITS = 230

#: Derived: digits of the data for each digit asked for: squares of gaps, and what they lose on the
#: way.
_PER_DIGIT = 5
_NEAR = 1e-5

#: Method: sine of the angle between K and γ that counts as zero, and is taken in its place.
_LEAST_ANGLE = Fraction(1, 10**30)

#: Derived: entries of q and of q̇ over |q̇| that are none: what rounding leaves, and what a turn of K
#: makes.
_ROUNDING = Fraction(1, 10**100)
_TILT = Fraction(1, 10**28)

#: Derived: distances of c'_2 from an I' that come of rounding, or of a turn of K, over those of the
#: I'.
_TOLD_APART = Fraction(1, 10**90)
_TILTED_APART = Fraction(1, 10**28)

#: Method: by how much equal B's are separated where K is nearly along γ: there differences of A'
#: are as small as what a solution would separate them by.
_APART = Fraction(1, 10**40)


def vector_of(rationals: Any) -> Objects:
    """Return a vector in the precision in force."""
    return midpoints(enclose(np.array(rationals, dtype=object)))  # type: ignore[no-any-return]


def unit_of(vector: Objects) -> Objects:
    """Return a vector over its length."""
    return midpoints(vector / (vector @ vector).sqrt())  # type: ignore[no-any-return]


class AreaVeselova(Veselova):
    """The rank-one problem of a body with an area constant, its own time t'.

    - told_apart: the distance of c'_2 from an I' below which both may be one, over that of the I'
    - sign: ς
    - mu2: in units in which the least A' is one, exactly
    - tilt: L₁₀/L₀₀
    - uniform: μ₁k_h in the units of the body
    - across: (μ₁−μ₂)k_h in the units of the body
    - angle: the sine of the angle between K and γ
    - columns, plane: [v u −n] at the start by its columns, and n, e_⊥

    All but the angle are rationals. ``energy`` is that of the body, or its Jacobi integral where
    (Ω,γ) ≠ 0 is constant.

    With ``digits`` the data are rounded so far below them that nothing is lost. The frame is then
    [v u −n], otherwise the natural one. Where K is along γ, to 1e-5, they are not served.
    """

    told_apart: Fraction
    sign: int
    mu2: Fraction
    tilt: Fraction
    uniform: Fraction
    across: Fraction
    angle: float
    plane: tuple[tuple[Fraction, ...], ...]
    columns: tuple[tuple[Fraction, ...], ...]

    def __init__(self, body: RigidBody, digits: int = 0) -> None:
        places = _DIGITS + _PER_DIGIT * digits
        with working_digits(places):
            momentum = _momentum(body)
        if momentum.angle < _NEAR:
            places = _MORE_DIGITS
            with working_digits(places):
                momentum = _momentum(body)
        with working_digits(places):
            sign, mu, u, v, L = _axes(momentum)
            A = sign * (momentum.inverse - mu[1])
            unit = min(A)
            slope = sign * (u @ (momentum.inverse * v)) / (v @ (A * v))
            # w' = u + (β/α)v with β/α = −(u,A'v)/(v,A'v)
            w = A * (u - slope * v)
            q, q_dot = _moving(v, np.cross(v, w) / L[0], momentum.angle, places)
            normal = np.cross(u, v)
            columns = _exact([q, u, -normal])
            frame = tuple(zip(*columns, strict=True)) if digits else None
            self._become(ExactState(_exact(A / unit), columns[0], _exact(q_dot), frame))
            self._set(
                given={},
                energy=float(body.integrals(body.start)[body.energy_name][0]),
                told_apart=_TILTED_APART if momentum.angle < _LEAST_ANGLE else _TOLD_APART,
                sign=sign,
                mu2=rational(mu[1] / unit),
                tilt=rational(L[1] / L[0]),
                columns=columns,
                angle=momentum.angle,
                uniform=rational(mu[0] * momentum.horizontal),
                across=rational((mu[0] - mu[1]) * momentum.horizontal),
                plane=_exact([normal, np.cross(normal, momentum.gamma)]),
            )

    def direction(
        self, g: int, unit: Fraction, frozen: Sequence[Fraction]
    ) -> tuple[Fraction, Fraction]:
        """Return L of du/dτ₁ = (−μ2, ς)."""
        first = self.mu2 / frozen[0] if g == 1 else -self.mu2 / unit
        return first, Fraction(self.sign)

    def joins(self, torus: Any) -> bool:
        """Return whether c_2 is I_2, a separatrix, as far as the data tell; torus: the kernel's."""
        if torus.of_c.size < 2:
            return False
        first, middle, last = torus.of_I
        distance = torus.d[min(middle, torus.of_c[1]), max(middle, torus.of_c[1])]
        return bool(distance < float(self.told_apart) * torus.d[first, last])

    def side_of(self, n_2: Array) -> float:
        """Return the sign of u against n_2 at the start."""
        return float(np.sign(n_2 @ to_float(self.columns[1])))


class RollingAreaVeselova(AreaVeselova, WithDisplacement):
    """The same for a ball: ``displacement`` has the coefficients of an and ae_⊥ in x(t) − x(0)."""

    def path(self, turn: Array, side: float) -> BallPath:
        """Return [μ1k_h t − across ∫odd dτ₁] n + ς ∫(q',u) dτ₁ e_⊥."""
        rows = [[0.0, self.sign * side], [-float(self.across), 0.0]] if len(turn) > 1 else []
        return BallPath(np.array([float(self.uniform), 0.0]), np.array(rows).reshape(-1, 2))


def area_torus(body: RigidBody, digits: int = 0) -> AreaVeselova:
    """Return the problem on whose torus a body or a ball moves."""
    kind = RollingAreaVeselova if isinstance(body, RollingBall) else AreaVeselova
    return kind(body, digits)


# a worker solves without public names, with which the methods above problems are registered
register(area_torus=area_torus)


@dataclass(frozen=True)
class _Momentum:
    """K = K_h + κγ and what belongs to it: K_h = horizontal·direction, the form M in the basis
    (K_h, γ), and the angle of K with γ, its sine.
    """

    added: Fraction | None
    inverse: Objects
    gamma: Objects
    direction: Objects
    horizontal: Any
    angle: float
    form: tuple[Any, Any, Any]


def _momentum(body: RigidBody) -> _Momentum:
    exact_gamma, exact_Omega = body.to_axes()
    moments, added = body.moments, body.added
    # The motion does not depend on the unit of inertia. K_h does, and (Ω,γ) does not.
    unit = 1 / min(moments)
    inverse = vector_of([1 / (moment * unit) for moment in moments])
    Omega, gamma = vector_of(exact_Omega), unit_of(vector_of(exact_gamma))
    spin = Omega @ gamma
    # JΩ − (JΩ,γ)γ/(γ,γ), orthogonal to γ however small it is
    JOmega, given = (
        np.array(x, dtype=object)
        for x in ([x * unit * y for x, y in zip(exact_Omega, moments, strict=True)], exact_gamma)
    )
    across = vector_of(JOmega - (JOmega @ given) / (given @ given) * given)
    D = None if added is None else vector_of([added * unit])[0]
    area = spin if D is None else (Omega / inverse) @ gamma - D * spin
    # products, not squares: Arb's power of a ball around zero is none
    horizontal = (across @ across).sqrt()
    size = (horizontal * horizontal + area * area).sqrt()
    angle = horizontal / size
    if all(x == 0 for x in across):
        least = min(range(3), key=lambda i: abs(float(gamma[i])))
        across = np.cross(gamma, vector_of([int(i == least) for i in range(3)]))
    direction = unit_of(across)
    if angle < vector_of([_LEAST_ANGLE])[0]:
        horizontal = vector_of([_LEAST_ANGLE])[0] * size
    if angle < _NEAR:
        inverse = _separated(inverse)
    # Gram_B in the basis (K, γ)
    dd, dg, gg = (
        x @ (inverse * y) for x, y in ((direction, direction), (direction, gamma), (gamma, gamma))
    )
    Kg = horizontal * dg + area * gg
    KK = horizontal * horizontal * dd + area * (2 * horizontal * dg + area * gg)
    if D is None:
        form = (KK - (Kg - area) * (Kg - area) / gg - 2 * area * area, area, 0 * area)
    else:
        twice_energy = KK + D * Kg * Kg / (1 - D * gg)
        form = (twice_energy + area * area / D, -area / D, 1 / D)
    known = (horizontal.mid(), float(angle), tuple(midpoints(np.array(form, dtype=object))))
    return _Momentum(added, inverse, gamma, direction, *known)


def _axes(
    momentum: _Momentum,
) -> tuple[int, tuple[Any, Any], Objects, Objects, tuple[Any, Any]]:
    """Return ς, (μ1, μ2), u, v, and L₀₀ and L₁₀, by the axes of M in the orthonormal basis
    (direction, γ): u = x₁·direction + y₁γ.
    """
    first, mixed, last = momentum.form
    k = momentum.horizontal
    first, mixed = first / k / k, mixed / k
    difference = first - last
    root = (difference * difference + 4 * mixed * mixed).sqrt()
    cosine = ((root + abs(difference)) / (2 * root)).sqrt()
    sine = mixed / (root * cosine)
    turn = 1 if mixed >= 0 else -1
    above = (cosine, sine) if difference >= 0 else (abs(sine), turn * cosine)
    below = (-above[1], above[0])
    values = ((first + last + root) / 2, (first + last - root) / 2)
    sign = 1 if momentum.added is None else -1
    (mu1, x), (mu2, y) = zip(values, (above, below), strict=True)
    if sign < 0:
        (mu1, x), (mu2, y) = (mu2, y), (mu1, x)
    # dt/dτ₁ > 0 on the whole torus, where ρ takes both signs: so L₀₀ > 0
    if x[0] < 0:
        x = (-x[0], -x[1])
    if x[0] * y[1] - x[1] * y[0] < 0:
        y = (-y[0], -y[1])
    u, v = (midpoints(a * momentum.direction + b * momentum.gamma) for a, b in (x, y))
    return sign, (mu1.mid(), mu2.mid()), u, v, ((x[0] / k).mid(), (y[0] / k).mid())


def _moving(q: Objects, q_dot: Objects, angle: float, places: int) -> tuple[Objects, Objects]:
    """Return q and q̇ with zeros where both entries are rounding, or come of the turn of K."""
    is_along = angle < _LEAST_ANGLE
    least = vector_of([_TILT if is_along else min(_ROUNDING, Fraction(1, 10**places))])[0]
    speed = max(np.abs(midpoints(q_dot)))
    at_rest = (np.abs(q) < least) & (np.abs(midpoints(q_dot)) < least * speed)
    return np.where(at_rest, 0 * q, q), np.where(at_rest, 0 * q, midpoints(q_dot))


def _separated(inverse: Objects) -> Objects:
    """Return B's of which none are equal, to 1e-40."""
    counts = [sum(other == value for other in inverse[:i]) for i, value in enumerate(inverse)]
    return vector_of([rational(x) * (1 - n * _APART) for x, n in zip(inverse, counts, strict=True)])


def _exact(balls: Any) -> Any:
    """Return the midpoints, nested in lists, as tuples of rationals."""
    if np.ndim(balls) > 1:
        return tuple(map(_exact, balls))
    return tuple(map(rational, balls))
