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

__all__ = ["RolledBall", "roll", "roll_over_sphere", "roll_over_sphere_in_80_bits"]

#: Takes Ω to the coefficients of ω on E_1∧E_2, E_1∧E_3, E_2∧E_3, and back: ω_ij = −ε_ijk Ω_k.
_SIGNS = np.array([[0, 0, -1.0], [0, 1.0, 0], [-1.0, 0, 0]])


@dataclass(frozen=True)
class RolledBall:
    """frame (N, n, n) columns e_i in the body · Omega there: (N, 3), or coefficients on E_i∧E_j ·
    position, velocity, force (N, n − 1).
    """

    frame: Any
    Omega: Any
    position: Any
    velocity: Any
    force: Any


def _body(ball: Any) -> tuple[Any, Any]:
    """Return the inertia operator and ω as coefficients on E_i∧E_j."""
    if len(ball.gamma) == 3:
        return _SIGNS @ ball.ball.tensor @ _SIGNS, _SIGNS @ ball.Omega
    return np.diag([float(x) for x in ball.ball.moments]), ball.Omega


def _skew(x: Any, n: int) -> Any:
    """Return ω of its coefficients."""
    W = np.zeros((n, n))
    W[np.triu_indices(n, 1)] = x
    return W - W.T


def _wedge(x: Any, y: Any) -> Any:
    """Return the coefficients of x∧y."""
    return (np.outer(x, y) - np.outer(y, x))[np.triu_indices(len(x), 1)]


def _integrated(field: Any, start: Any, times: Sequence[float]) -> Any:
    """Return states at times, rows of (N, D)."""
    options: dict[str, Any] = {"rtol": 1e-13, "atol": 1e-14, "t_eval": times}
    return solve_ivp(field, (0.0, times[-1]), start, "DOP853", **options).y.T


def roll(ball: Any, times: Sequence[float]) -> RolledBall:
    """Return the motion of a ball in ℝⁿ from its start: Newton and Euler with the force −f at the
    contact point and, where it may not twist, torques e_i∧e_j.

    Iω̇ = [Iω,ω] + a Σ f_k e_k∧q + Σ μ_ij e_i∧e_j, mv̇ = −f, v_k = a(e_k, ωq).
    """
    n, twists = len(ball.gamma), ball.system == "chaplygin-ball"
    operator, omega = _body(ball)
    m, a = float(ball.ball.mass), float(ball.ball.radius)
    size = len(omega)

    def accelerations(omega: Any, E: Any) -> Any:
        rows = [a * _wedge(E[:, k], E[:, 0]) for k in range(1, n)]
        if not twists:
            rows += [_wedge(E[:, i], E[:, j]) for i, j in combinations(range(1, n), 2)]
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
        momentum, turning = _skew(operator @ omega, n), _skew(omega, n)
        b = np.zeros(len(M))
        b[:size] = (momentum @ turning - turning @ momentum)[np.triu_indices(n, 1)]
        return np.linalg.solve(M, b)

    def field(_: float, y: Any) -> Any:
        omega, velocity, E, _ = split(y)
        found = accelerations(omega, E)
        turned = (-_skew(omega, n) @ E).ravel()
        return np.concatenate([found[: size + n - 1], turned, velocity])

    def split(y: Any) -> tuple[Any, Any, Any, Any]:
        ends = np.cumsum([size, n - 1, n * n])
        omega, velocity, E, position = np.split(y, ends, axis=-1)
        return omega, velocity, E.reshape(*E.shape[:-1], n, n), position

    E = ball.frame
    velocity = a * E[:, 1:].T @ _skew(omega, n) @ E[:, 0]
    contact = [float(x) for x in ball.ball.contact]
    start = np.concatenate([omega, velocity, E.ravel(), contact])
    omegas, velocities, frames, positions = split(_integrated(field, start, times))
    pushed = [accelerations(w, E)[size : size + n - 1] for w, E in zip(omegas, frames)]
    turning = omegas @ _SIGNS if n == 3 else omegas
    return RolledBall(frames, turning, positions, velocities, m * np.array(pushed))


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
    operator, omega = _body(ball)

    def field(_: float, y: Any) -> Any:
        w, E, C, V = np.split(y, [size, size + n * n, size + n * n + n])
        E, W = E.reshape(n, n), _skew(w, n)
        gamma, speed = E @ C / L, E @ V
        gamma_dot = -W @ gamma + speed / L
        across = np.linalg.svd(gamma[None])[2][1:]
        turns = np.array([_wedge(a, b) for i, a in enumerate(across) for b in across[i + 1 :]])
        arms = np.array([_wedge(e, -side * rho * gamma) for e in np.eye(n)])
        # unknowns: ω̇, V̇ seen from the body, R, μ
        k = len(turns)
        M, b = np.zeros((size + 2 * n + k,) * 2), np.zeros(size + 2 * n + k)
        Iw = _skew(operator @ w, n)
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
    speed = side * rho * _skew(omega, n) @ E[:, 0]
    start = np.concatenate([omega, E.ravel(), L * np.eye(n)[0], E.T @ speed])
    found = _integrated(field, start, times)
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
    twice_energy, first = p @ v, _first_integral(x, gamma, v)
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
            if n == 3 and ball.ratio == -1:
                v = _turned(x, gamma, v, first)
                p = (gamma @ (x * gamma)) * (x * v) - (v @ (x * gamma)) * (x * gamma)
            E = E @ (3 * np.eye(n) - E.T @ E) / 2
            state = np.concatenate([p * np.sqrt(twice_energy / (p @ v)), gamma, E.ravel()])
        found.append((axes @ state[n : 2 * n], axes @ state[2 * n :].reshape(n, n)))
    normals, frames = (np.array(rows) for rows in zip(*found, strict=True))
    contact = _longdouble(ball.sphere) * np.einsum("nji,nj->ni", frames, normals)
    return normals, frames, contact


def _first_integral(x: Any, gamma: Any, v: Any) -> Any:
    """Return F₁ = X₁² − Σ (X₁X'_j − X_jX'_1)²/(b₁ − b_j) of Neumann's system, ε = −1: X along √x γ,
    |X'|² = (X,bX), b = 1/x.
    """
    X, moved, b = np.sqrt(x) * gamma, np.sqrt(x) * v, 1 / x
    X = X / np.sqrt(X @ X)
    moved = moved - X * (X @ moved)
    moved = moved * np.sqrt((X @ (b * X)) / (moved @ moved))
    areas = X[0] * moved[1:] - X[1:] * moved[0]
    return X[0] ** 2 - np.sum(areas**2 / (b[0] - b[1:]))


def _turned(x: Any, gamma: Any, v: Any, first: Any) -> Any:
    """Return v turned about γ to bring F₁ back; as it is, where F₁ hardly depends on it."""
    across, step = np.cross(gamma, v), np.longdouble(1e-6)
    off = _first_integral(x, gamma, v) - first
    slope = (_first_integral(x, gamma, v + step * across) - first - off) / step
    return v - across * (off / slope) if abs(slope) > 0.1 else v


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
        compact_mode=True,
    )


def _longdouble(number: Any) -> Any:
    high = float(number)
    return np.longdouble(high) + np.longdouble(float(Fraction(number) - Fraction(high)))
