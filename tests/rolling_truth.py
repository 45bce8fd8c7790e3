"""The ball itself, integrated in space with its contact forces: nothing of it is in the package."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from itertools import combinations
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

__all__ = [
    "RolledBall",
    "roll",
    "roll_in_n_dimensions",
    "roll_over_sphere",
    "roll_over_sphere_in_80_bits",
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


def roll_over_sphere(ball: Any, times: Sequence[float]) -> tuple[Any, Any, Any]:
    """Return (γ, frame, contact point) of a ball over a fixed sphere, by Newton and Euler with the
    force R at the contact point and torques a∧b across γ, for a, b across γ.

    mV̇ = R, Iω̇ = [Iω,ω] + R∧r + Σ μ a∧b, V = −ωr, ⟨ω,a∧b⟩ = 0, r from the centre C to the contact.
    """
    n = ball.n
    pairs = np.triu_indices(n, 1)
    size = len(pairs[0])
    m, rho, sigma = float(ball.ball.mass), float(ball.ball.radius), float(ball.sphere)
    side = 1.0 if ball.side == "outside" else -1.0
    L = sigma + side * rho
    if n == 3:
        signs = np.array([[0, 0, -1.0], [0, 1.0, 0], [-1.0, 0, 0]])
        operator = signs.T @ ball.ball.tensor @ signs
        omega = signs.T @ ball.Omega
    else:
        operator, omega = np.diag([float(x) for x in ball.ball.moments]), ball.Omega

    def skew(x: Any) -> Any:
        W = np.zeros((n, n))
        W[pairs] = x
        return W - W.T

    def wedge(x: Any, y: Any) -> Any:
        return (np.outer(x, y) - np.outer(y, x))[pairs]

    def field(_: float, y: Any) -> Any:
        w, E, C, V = np.split(y, [size, size + n * n, size + n * n + n])
        E, W = E.reshape(n, n), skew(w)
        gamma, speed = E @ C / L, E @ V
        gamma_dot = -W @ gamma + speed / L
        across = np.linalg.svd(gamma[None])[2][1:]
        turns = np.array([wedge(a, b) for i, a in enumerate(across) for b in across[i + 1 :]])
        arms = np.array([wedge(e, -side * rho * gamma) for e in np.eye(n)])
        # unknowns: ω̇, V̇ seen from the body, R, μ
        k = len(turns)
        M, b = np.zeros((size + 2 * n + k,) * 2), np.zeros(size + 2 * n + k)
        Iw = skew(operator @ w)
        M[:size, :size], M[:size, size + n : size + 2 * n] = operator, -arms.T
        M[:size, size + 2 * n :], b[:size] = -turns.T, (Iw @ W - W @ Iw)[pairs]
        M[size : size + n, size : size + n] = m * np.eye(n)
        M[size : size + n, size + n : size + 2 * n] = -np.eye(n)
        M[size + n : size + 2 * n, size : size + n] = np.eye(n)
        M[size + n : size + 2 * n, :size] = arms
        b[size + n : size + 2 * n] = side * rho * W @ gamma_dot + W @ speed
        M[size + 2 * n :, :size] = turns
        moved = np.outer(gamma_dot, gamma @ W) + np.outer(W @ gamma, gamma_dot)
        b[size + 2 * n :] = [a @ moved @ c for i, a in enumerate(across) for c in across[i + 1 :]]
        found = np.linalg.solve(M, b)
        return np.concatenate([found[:size], (-W @ E).ravel(), V, E.T @ found[size : size + n]])

    E = ball.frame
    speed = side * rho * skew(omega) @ E[:, 0]
    start = np.concatenate([omega, E.ravel(), L * np.eye(n)[0], E.T @ speed])
    found = solve_ivp(
        field, (0.0, times[-1]), start, "DOP853", rtol=1e-13, atol=1e-14, t_eval=times
    ).y.T
    frames = found[:, size : size + n * n].reshape(-1, n, n)
    normals = found[:, size + n * n : size + n * n + n] / L
    return np.einsum("nij,nj->ni", frames, normals), frames, sigma * normals


def roll_over_sphere_in_80_bits(ball: Any, times: Sequence[float]) -> tuple[Any, Any, Any]:
    """Return (γ, frame, contact point) by Taylor series in 80 bits, put back on the manifold every
    20 units of time: with J_ij = x_ix_j along the principal axes,

    γ̇ = εv, ṗ = −ωp + (1−ε)(Jω)v, ė = −ωe for ω = γ∧v, p = (γ,xγ)xv − (v,xγ)xγ.
    """
    n, L = ball.n, np.longdouble
    x, gamma, v = (
        np.array([_longdouble(entry) for entry in row])
        for row in (ball.inverse, ball.exact_gamma, ball.exact_velocity)
    )
    x = np.sqrt(np.prod(x)) / x
    length = np.sqrt(gamma @ gamma)
    gamma, v = gamma / length, v / length
    axes = np.eye(n) if ball.axes is None else ball.axes
    # the start of the body in 80 bits: principal axes made orthonormal, and e_1 = γ
    axes = axes.astype(L)
    for _ in range(2):
        axes = axes @ (3 * np.eye(n) - axes.T @ axes) / 2
    columns = [gamma]
    for column in (axes.T @ ball.frame.astype(L)).T[1:]:
        for other in columns:
            column = column - other * (other @ column)
        columns.append(column / np.sqrt(column @ column))
    p = (gamma @ (x * gamma)) * (x * v) - (v @ (x * gamma)) * (x * gamma)
    twice_energy = p @ v
    state = np.concatenate([p, gamma, np.array(columns).T.ravel()])
    integrator = _taylor_over_sphere(n)
    integrator.pars[:] = [*x, _longdouble(ball.ratio)]
    integrator.time, now, found = L(0), 0.0, []
    for time in times:
        while now < time:
            integrator.state[:] = state
            now = min(time, now + 20.0)
            integrator.propagate_until(L(now))
            p, gamma, E = np.split(np.array(integrator.state), [n, 2 * n])
            gamma = gamma / np.sqrt(gamma @ gamma)
            p, E = p - gamma * (p @ gamma), E.reshape(n, n)
            v = (p / x - gamma * (p / x @ gamma)) / (gamma @ (x * gamma))
            E = E @ (3 * np.eye(n) - E.T @ E) / 2
            state = np.concatenate([p * np.sqrt(twice_energy / (p @ v)), gamma, E.ravel()])
        found.append((axes @ state[n : 2 * n], axes @ state[2 * n :].reshape(n, n)))
    normals, frames = (np.array(rows) for rows in zip(*found, strict=True))
    contact = _longdouble(ball.sphere) * np.einsum("nji,nj->ni", frames, normals)
    return normals, frames, contact


@cache
def _taylor_over_sphere(n: int) -> Any:
    """Return heyoka's integrator of these equations, for states (p, γ, E)."""
    import heyoka as hy

    symbols = np.array(hy.make_vars(*[f"y{i}" for i in range(2 * n + n * n)]), dtype=object)
    p, q, E = symbols[:n], symbols[n : 2 * n], symbols[2 * n :].reshape(n, n)
    x, epsilon = np.array([hy.par[i] for i in range(n)], dtype=object), hy.par[n]

    def dot(a: Any, b: Any) -> Any:
        return hy.sum([s * t for s, t in zip(a, b, strict=True)])

    free, xq = p / x, x * q
    v = (free - q * (dot(free, q) / dot(q, q))) / dot(q, xq)
    xv = x * v
    moved = (1.0 - epsilon) * (xq * dot(xv, v) - xv * dot(xq, v))
    rates = [v * dot(q, p) - q * dot(v, p) + moved, epsilon * v]
    columns = [v * dot(q, column) - q * dot(v, column) for column in E.T]
    right = np.concatenate([*rates, np.array(columns).T.ravel()])
    return hy.taylor_adaptive(
        list(zip(symbols, right, strict=True)),
        [np.longdouble(0)] * len(symbols),
        fp_type=np.longdouble,
        pars=[np.longdouble(0)] * (n + 1),
        tol=np.longdouble(1e-20),
    )


def _longdouble(number: Any) -> Any:
    high = float(number)
    return np.longdouble(high) + np.longdouble(float(Fraction(number) - Fraction(high)))


def _cross_matrix(u: Any) -> Any:
    return np.array([[0, -u[2], u[1]], [u[2], 0, -u[0]], [-u[1], u[0], 0]])
