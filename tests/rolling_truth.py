"""The ball itself, integrated in space with its contact forces: nothing of it is in the package."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

__all__ = [
    "RolledBall",
    "roll",
    "roll_in_80_bits",
    "roll_in_n_dimensions",
    "roll_in_n_dimensions_in_80_bits",
]

#: The vertical.
_UP = np.array([1.0, 0.0, 0.0])


@dataclass(frozen=True)
class RolledBall:
    """frame (N, 3, 3) columns e_i in the body · Omega (N, 3) there · position, velocity, force
    (N, 2).
    """

    frame: Any
    Omega: Any
    position: Any
    velocity: Any
    force: Any


def roll(ball: Any, times: Sequence[float], twists: bool = False) -> RolledBall:
    """Return the motion of a ball from its start, by Newton's and Euler's equations in space.

    Unknowns of each instant: angular and linear acceleration, the force at the contact point, and
    the torque about the vertical that keeps the ball from twisting, zero where it ``twists``.
    """
    inertia = ball.ball.tensor
    m, a = float(ball.ball.mass), float(ball.ball.radius)
    attitude = ball.frame.T
    spin = attitude @ ball.Omega
    contact = [float(x) for x in ball.ball.contact]

    def accelerations(y: Any) -> Any:
        R, w = y[:9].reshape(3, 3), y[9:12]
        tensor = R @ inertia @ R.T
        M, b = np.zeros((10, 10)), np.zeros(10)
        M[:3, :3], M[:3, 6:9], M[:3, 9] = tensor, _cross_matrix(a * _UP), -_UP
        b[:3] = -np.cross(w, tensor @ w)
        M[3:6, 3:6], M[3:6, 6:9] = m * np.eye(3), -np.eye(3)
        M[6:9, 3:6], M[6:9, :3] = np.eye(3), a * _cross_matrix(_UP)
        if twists:
            M[9, 9] = 1
        else:
            M[9, :3] = _UP
        return np.linalg.solve(M, b)

    def field(_: float, y: Any) -> Any:
        found = accelerations(y)
        turned = _cross_matrix(y[9:12]) @ y[:9].reshape(3, 3)
        return np.concatenate([turned.ravel(), found[:6], y[13:15]])

    start = np.concatenate([attitude.ravel(), spin, a * np.cross(spin, _UP), contact])
    found = solve_ivp(
        field, (0.0, times[-1]), start, "DOP853", rtol=1e-13, atol=1e-14, t_eval=times
    ).y.T
    force = np.array([accelerations(y)[6:9] for y in found])
    frames = np.swapaxes(found[:, :9].reshape(-1, 3, 3), 1, 2)
    Omega = np.einsum("nij,nj->ni", frames, found[:, 9:12])
    return RolledBall(frames, Omega, found[:, 15:17], found[:, 13:15], force[:, 1:])


def roll_in_n_dimensions(ball: Any, times: Sequence[float], inertia: Any = None) -> RolledBall:
    """Return the motion of a ball in ℝⁿ, Omega as the coefficients on E_i∧E_j: Newton and Euler
    with the force −f at the contact point and, where it may not twist, torques e_i∧e_j.

    ``inertia``: the operator about the centre as a matrix, left out where it is diagonal.

    Iω̇ = [Iω,ω] + a Σ f_k e_k∧q + Σ μ_ij e_i∧e_j, mv̇ = −f, v_k = a(e_k, ωq).
    """
    n, twists = ball.n, ball.twists
    pairs = list(combinations(range(n), 2))
    operator = np.diag([float(x) for x in ball.ball.moments]) if inertia is None else inertia
    m, a = float(ball.ball.mass), float(ball.ball.radius)
    size = len(pairs)

    def skew(x: Any) -> Any:
        W = np.zeros((n, n))
        for value, (i, j) in zip(x, pairs, strict=True):
            W[i, j], W[j, i] = value, -value
        return W

    def wedge(x: Any, y: Any) -> Any:
        return np.array([x[i] * y[j] - x[j] * y[i] for i, j in pairs])

    def accelerations(omega: Any, E: Any) -> Any:
        rows = [a * wedge(E[:, k], E[:, 0]) for k in range(1, n)]
        if not twists:
            rows += [wedge(E[:, i], E[:, j]) for i, j in combinations(range(1, n), 2)]
        G = np.array(rows)
        moved = np.zeros((len(rows), n - 1))
        moved[: n - 1] = -np.eye(n - 1)
        # unknowns: ω̇, v̇ and the multipliers
        M = np.block(
            [
                [operator, np.zeros((size, n - 1)), -G.T],
                [np.zeros((n - 1, size)), m * np.eye(n - 1), -moved.T],
                [G, moved, np.zeros((len(rows), len(rows)))],
            ]
        )
        momentum, turning = skew(operator @ omega), skew(omega)
        free = momentum @ turning - turning @ momentum
        b = np.zeros(len(M))
        b[:size] = [free[i, j] for i, j in pairs]
        return np.linalg.solve(M, b)

    def field(_: float, y: Any) -> Any:
        omega, E = y[:size], y[size + n - 1 : size + n - 1 + n * n].reshape(n, n)
        found = accelerations(omega, E)
        velocity = y[size : size + n - 1]
        return np.concatenate([found[: size + n - 1], (-skew(omega) @ E).ravel(), velocity])

    E, omega = ball.frame, ball.Omega
    velocity = [a * E[:, k] @ skew(omega) @ E[:, 0] for k in range(1, n)]
    contact = [float(x) for x in ball.ball.contact]
    start = np.concatenate([omega, velocity, E.ravel(), contact])
    found = solve_ivp(
        field, (0.0, times[-1]), start, "DOP853", rtol=1e-13, atol=1e-14, t_eval=times
    ).y.T
    frames = found[:, size + n - 1 : size + n - 1 + n * n].reshape(-1, n, n)
    force = m * np.array(
        [accelerations(y[:size], frame)[size : size + n - 1] for y, frame in zip(found, frames)]
    )
    return RolledBall(
        frames,
        found[:, :size],
        found[:, size + n - 1 + n * n :],
        found[:, size : size + n - 1],
        force,
    )


def roll_in_80_bits(ball: Any, times: Sequence[float], twists: bool = False) -> tuple[Any, Any]:
    """Return γ (N, 3) and the contact point (N, 2) of a ball with principal moments by a Taylor
    method in 80 bits, its start projected in as many: K̇ = K×Ω, ė_i = e_i×Ω, ẋ_k = a(e_k, Ω×γ).
    """
    import heyoka as hy

    number = np.longdouble
    a, D = number(float(ball.ball.radius)), number(float(ball.ball.added))
    moments = np.diag(ball.ball.tensor).astype(number) + D
    E, Omega = ball.frame.astype(number), ball.Omega.astype(number)
    for k in range(3):
        E[:, k] -= E[:, :k] @ (E[:, :k].T @ E[:, k])
        E[:, k] /= np.sqrt(E[:, k] @ E[:, k])
    M, along = moments * Omega, Omega @ E[:, 0]
    lost = D * along if twists else moments * Omega @ E[:, 0] - along
    start = np.concatenate([M - lost * E[:, 0], E.T.ravel(), np.zeros(2)]).astype(number)
    names = [f"x{i}" for i in range(14)]
    x = hy.make_vars(*names)
    K, *frame = ([*x[i : i + 3]] for i in range(0, 12, 3))
    gamma = frame[0]

    def dot(u: Any, v: Any) -> Any:
        return hy.sum([p * q for p, q in zip(u, v, strict=True)])

    def cross(u: Any, v: Any) -> Any:
        return [u[i - 2] * v[i - 1] - u[i - 1] * v[i - 2] for i in range(3)]

    B = [1 / moment for moment in moments]
    BK, Bg = ([b * y for b, y in zip(B, u, strict=True)] for u in (K, gamma))
    if twists:
        share = D * dot(BK, gamma) / (number(1) - D * dot(Bg, gamma))
    else:
        share = (dot(K, gamma) - dot(BK, gamma)) / dot(Bg, gamma)
    spin = [p + share * q for p, q in zip(BK, Bg, strict=True)]
    velocity = cross(spin, gamma)
    rates = [y for u in (K, *frame) for y in cross(u, spin)]
    rates += [a * dot(e, velocity) for e in frame[1:]]
    taylor = hy.taylor_adaptive(
        list(zip(x, rates, strict=True)), start, fp_type=number, compact_mode=True
    )
    found = taylor.propagate_grid(np.array(times, dtype=number))[-1]
    return found[:, 3:6], found[:, 12:] + ball.start["position"]


def roll_in_n_dimensions_in_80_bits(ball: Any, times: Sequence[float]) -> tuple[Any, Any]:
    """Return the frame (N, n, n) and the contact point (N, n−1) of a ball in ℝⁿ along its principal
    axes by a Taylor method in 80 bits: ė_i = −ωe_i, ẋ_k = −a(e_k, q̇), the momentum q∧p with p
    fixed in space, and J(q∧ξ) = q∧p or Iω + D(qqᵀω + ωqqᵀ) = q∧p for ω.
    """
    import heyoka as hy

    number = np.longdouble

    def exact(x: Any) -> Any:
        return number(x.numerator) / number(x.denominator)

    n, twists = ball.n, ball.twists
    a, D = exact(ball.ball.radius), exact(ball.ball.added)
    A = np.array([exact(x) for x in ball.ball.A])
    root = A / np.sqrt(np.prod(A))
    E = ball.frame.astype(number)
    for k in range(n):
        E[:, k] -= E[:, :k] @ (E[:, :k].T @ E[:, k])
        E[:, k] /= np.sqrt(E[:, k] @ E[:, k])
    P = ball.momentum_in_space.astype(number)
    names = [f"x{i}" for i in range(n * n + n - 1)]
    x = hy.make_vars(*names)
    frame = [[*x[n * k : n * (k + 1)]] for k in range(n)]
    q = frame[0]

    def dot(u: Any, v: Any) -> Any:
        return hy.sum([y * z for y, z in zip(u, v, strict=True)])

    def scaled(u: Any, powers: int = 1) -> Any:
        return [y * r**powers for y, r in zip(u, root, strict=True)]

    p = [hy.sum([P[k] * frame[k][i] for k in range(1, n)]) for i in range(n)]
    across = dot(p, scaled(q, -1))
    xi = [(y - across * z) / dot(q, scaled(q)) for y, z in zip(scaled(p, -1), q, strict=True)]

    def turn(u: Any) -> Any:
        """Return −ωu."""
        own = [y * dot(q, u) - z * dot(xi, u) for y, z in zip(xi, q, strict=True)]
        if not twists:
            return own
        far = [
            y * dot(scaled(q), u) - z * dot(scaled(xi), u)
            for y, z in zip(scaled(xi), scaled(q), strict=True)
        ]
        return [y / D - z for y, z in zip(far, own, strict=True)]

    rates = [y for e in frame for y in turn(e)]
    rates += [-a * dot(e, rates[:n]) for e in frame[1:]]
    start = np.concatenate([E.T.ravel(), np.zeros(n - 1)]).astype(number)
    taylor = hy.taylor_adaptive(
        list(zip(x, rates, strict=True)), start, fp_type=number, compact_mode=True
    )
    found = taylor.propagate_grid(np.array(times, dtype=number))[-1]
    frames = np.swapaxes(found[:, : n * n].reshape(-1, n, n), 1, 2)
    return frames, found[:, n * n :] + ball.start["position"][0]


def _cross_matrix(u: Any) -> Any:
    return np.array([[0, -u[2], u[1]], [u[2], 0, -u[0]], [-u[1], u[0], 0]])
