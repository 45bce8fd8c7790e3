"""The evaluator of closed-form documents: inverse time map, phases, theta quotients, attitude.
``found`` are the fields of a document as ``read_document`` gives them.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.geometry.so_n import coefficients, skew, wedge

__all__ = ["evaluate", "largest_speed"]

Array = NDArray[np.float64]

#: Terms below e^(−39) = 1e-17 of the largest are left out: π|x|² ≤ 39.
_NATS = 39.0

#: Entries of one block of (times × modes) or (times × lattice).
_BLOCK = 400_000

#: Newton's steps of the inverse time map, each kept inside a bracket that it halves where it must.
_MOST_STEPS = 200

#: Σ|m_k f_k| in roundings below which m·f counts as zero.
_STANDING = 4.0


class _Modes(NamedTuple):
    """Σ 2c cos 2π(m·z + turn) over modes m (M, g) with coefficients c and turns (M,)."""

    orders: Array
    coefficients: Array
    turns: Array

    @classmethod
    def of_halves(cls, series: Mapping[str, Any]) -> _Modes:
        """Return a series of a document whose modes are doubled there."""
        weights = series["coefficients"]
        return cls(series["modes"] / 2, weights, np.full(len(weights), series["turn"]))

    def rows(self, count: int) -> list[slice]:
        """Return slices that cut so many times into blocks."""
        return _rows(count, _BLOCK // max(1, len(self.orders)))


@np.errstate(over="ignore", invalid="ignore")  # far times, whose error says it
def evaluate(found: Mapping[str, Any], times: Array) -> dict[str, Array]:
    """Return the series of a document at times (N,), by name."""
    tau1, z = _neumann_time(found, times)
    rows = _rows(len(z), _BLOCK // 1000)
    values = np.concatenate([_lattice_sum(found, z[block]) for block in rows])
    quotients = values / values[:, :1]

    def entries(pairs: Array) -> Array:
        return np.asarray(quotients[:, pairs[..., 0].astype(int)] * pairs[..., 1])

    columns = np.concatenate([found["normals"], found["gamma"][None]])
    normals = np.swapaxes(entries(columns), 1, 2)
    directions, x = found["directions"], entries(found["q"])
    x_prime = np.einsum("tik,tk->ti", normals, entries(found["q_prime"]))
    if "shell" in found:
        return _shell(found, tau1, z, x, x_prime)
    frame = np.empty((len(times), len(directions), len(directions)))
    frame[:, :, 0] = x @ directions.T
    frame[:, :, 1:] = directions @ normals @ found["rotation"] + found["frozen"]
    q_prime = x_prime @ directions.T
    rate = found["rate"]
    slope = rate["constant"] * np.abs(quotients[:, rate["characteristic"]]) ** rate["power"]
    series = _series_of(found, tau1, frame, q_prime / slope[:, None])
    if "path" not in found:
        return series
    return {**series, "position": _contact_point(found, tau1, z, times)}


def _shell(
    found: Mapping[str, Any], tau1: Array, z: Array, x: Array, x_prime: Array
) -> dict[str, Array]:
    """Return the series of a shell around a sphere from Neumann's point x and dx/dτ₁: γ along
    y = B^{1/2}x, and the frame E = Re Σ_j ψ_j(z) e^{2πi α_jτ₁} b_j, with entry i of ψ_j a sum of
    c e^{πi M·z}.
    """
    shell, axes = found["shell"], found["axes"]
    to_axes, m, n = axes @ found["directions"], len(shell["roots"]), len(axes)
    y, y_prime = x * shell["roots"], x_prime * shell["roots"]
    size = np.linalg.norm(y, axis=1)[:, None]
    gamma = y / size
    # γ̇ = −v, dt/dτ₁ = C/|y|
    v = (np.sum(gamma * y_prime, axis=1)[:, None] * gamma - y_prime) / shell["constant"]
    weights = np.zeros((len(shell["columns"]), m * m), np.complex128)
    places = np.arange(len(weights)), shell["columns"].astype(int)
    weights[places] = shell["real"] + 1j * shell["imaginary"]
    blocks = _rows(len(z), _BLOCK // max(1, len(weights)))
    psi = [np.exp(1j * np.pi * (z[rows] @ shell["modes"].T)) @ weights for rows in blocks]
    start = shell["start"][0] + 1j * shell["start"][1]
    turned = np.exp(2j * np.pi * np.mod(tau1[:, None] * shell["rates"], 1.0))[:, :, None] * start
    attitude = np.swapaxes(np.concatenate(psi).reshape(-1, m, m), 1, 2) @ turned
    frame = to_axes @ attitude.real + axes @ shell["still"]
    gamma, v = gamma @ to_axes.T, v @ to_axes.T
    Omega = np.cross(v, gamma) if n == 3 else coefficients(wedge(gamma, v))
    position = shell["sphere"] * np.einsum("tij,ti->tj", frame, gamma)
    return {"Omega": Omega, "gamma": gamma, "frame": frame, "position": position}


def largest_speed(found: Mapping[str, Any], series: Mapping[str, Array]) -> Array:
    """Return how fast q, the frame, the point of a geodesic and the contact point move at most,
    (N,).
    """
    speeds = [series[name] for name in ("q_dot", "q_prime", "Omega", "X_dot") if name in series]
    speed = np.sum([np.linalg.norm(speed, axis=1) for speed in speeds], axis=0)
    radius = found["path"]["radius"] if "path" in found else 0.0
    if "shell" in found:  # the contact point moves by (1 − 1/ε)σγ̇
        radius = 2 * found["shell"]["sphere"]
    if "X" in series:  # the frame of a geodesic turns by the curvatures of its ellipsoid at most
        speed = speed * max(1.0, math.sqrt(np.max(found["A"])) / float(np.min(found["A"])))
    return np.asarray(speed * max(1.0, radius))


def _contact_point(found: Mapping[str, Any], tau1: Array, z: Array, times: Array) -> Array:
    """Return x(0) − a ℜᵀ(y_2, …, y_g, y_γ), y_k the integral of (q',n_k) over τ₁, y_γ = speed·t.

    With an area constant ``plane`` stands in the place of ℜ, and to y_γ comes ``odd`` times the odd
    part of t.
    """
    path = found["path"]
    columns = [_integral(series, found, tau1, z) for series in path["transverse"]]
    along = path["speed"] * times
    plane = found["rotation"]
    if "area" in found:
        plane = path["plane"]
        along = along + path["odd"] * _integral(found["area"]["odd"], found, tau1, z)
    y = np.stack([*columns, along], axis=1)
    return np.asarray(path["position"] - path["radius"] * (y @ plane))


def _integral(series: Mapping[str, Any], found: Mapping[str, Any], tau1: Array, z: Array) -> Array:
    """Return ∫Σ 2c cos 2π(m·z + turn) dτ₁ from zero, m = M/2.

    A mode gives c/(π m·f) [sin 2π(m·z + turn) − sin 2π(m·z⁰ + turn)]. It is made as a product, so
    that nothing cancels where m·f is small; where m·f = 0 it is 2cτ₁ cos 2π(m·z⁰ + turn).
    """
    start, modes = found["phases"], _Modes.of_halves(series)
    pace = np.pi * (modes.orders @ found["frequencies"])
    offset = 2 * np.pi * (modes.orders @ start + modes.turns)
    values = np.empty(len(z))
    for rows in modes.rows(len(z)):
        h, length = _half_advance(np.pi * ((z[rows] - start) @ modes.orders.T), pace, tau1[rows])
        values[rows] = (np.cos(offset + h) * length) @ (2 * modes.coefficients)
    return values


def _half_advance(h: Array, pace: Array, tau1: Array) -> tuple[Array, Array]:
    """Return h = πm·f τ₁, which is known modulo π, and sin h/(πm·f); pace: πm·f.

    Less than a radian of a slow mode is the product itself: h has lost its digits.
    """
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        slow = tau1[:, None] * pace
        near = np.abs(slow) < 1
        length = np.where(near, tau1[:, None] * np.sinc(slow / np.pi), np.sin(h) / pace)
    return np.where(near, slow, h), length


def _series_of(
    found: Mapping[str, Any], tau1: Array, frame: Array, velocity: Array
) -> dict[str, Array]:
    """Return the series under the names of the system; ``velocity`` is that of q in the system's
    own time.
    """
    system, q, axes = found["problem"]["system"], frame[:, :, 0], found["axes"]
    if system == "ellipsoid-geodesic":
        X = found["A"] * q / np.sqrt(np.sum(found["A"] * q * q, axis=1))[:, None]
        return {"X": X, "X_dot": frame[:, :, -1], "frame": frame, "tau1": tau1}
    axes = np.eye(len(found["A"])) if axes is None else axes
    if "area" in found:
        return _body_with_area(found["area"], axes @ frame @ found["area"]["attitude"])
    if "ball" in found:
        omega = _angular_velocity_of_ball(found["ball"], frame)
        rotated = axes @ skew(omega, len(axes)) @ axes.T
        frame = axes @ frame
        return {"gamma": frame[:, :, 0], "Omega": coefficients(rotated), "frame": frame}
    frame, velocity = axes @ frame, velocity @ axes.T
    q = frame[:, :, 0]
    if system == "neumann":
        return {"q": q, "q_prime": velocity, "frame": frame}
    if system in ("veselova-so3", "rubber-ball"):
        return {"gamma": q, "Omega": np.cross(velocity, q), "frame": frame}
    return {"q": q, "q_dot": velocity, "frame": frame, "tau1": tau1}


def _body_with_area(area: Mapping[str, Any], frame: Array) -> dict[str, Array]:
    """Return γ, Ω and the frame of a body with an area constant.

    Ω = B(K + σγ), σ = (c − (BK,γ))/(Gγ,γ): K is fixed in space, B the inverse of the inertia, and c
    and G are (Ω,γ) and B, or 0 and −BI/D = B − 1/D for a ball that twists.
    """
    inverse, form, momentum = area["inverse"], area["form"], area["momentum"]
    gamma = frame[:, :, 0]
    # (BK,γ), B − G a number times one, (K,γ) known: it cancels where that number is large beside G
    level = momentum[0] * (inverse[0, 0] - form[0, 0])
    along = level + np.sum((frame @ momentum @ form) * gamma, axis=1)
    share = (area["constant"] - along) / np.sum((gamma @ form) * gamma, axis=1)
    Omega = frame @ momentum @ inverse + share[:, None] * (gamma @ inverse)
    return {"gamma": gamma, "Omega": Omega, "frame": frame}


def _angular_velocity_of_ball(ball: Mapping[str, Any], frame: Array) -> Array:
    """Return the coefficients of ω on E_i∧E_j, i < j, of a ball in ℝⁿ, (N, n(n−1)/2).

    ω = q∧ξ, or (xq∧xξ)/D − q∧ξ for a ball that twists freely, ξ = [x⁻¹p − (p,x⁻¹q)q]/(q,xq), p
    fixed in space.
    """
    x = ball["roots"]
    q = frame[:, :, 0]
    free = frame @ ball["momentum"] / x
    xi = free - np.sum(free * q, axis=1)[:, None] * q
    xi = xi / np.sum(q * x * q, axis=1)[:, None]
    omega = coefficients(wedge(q, xi))
    return (
        omega
        if ball["added"] is None
        else omega * (coefficients(np.outer(x, x)) / ball["added"] - 1)
    )


def _rows(count: int, block: int) -> list[slice]:
    return [slice(first, first + max(1, block)) for first in range(0, count, max(1, block))]


def _neumann_time(found: Mapping[str, Any], times: Array) -> tuple[Array, Array]:
    """Return τ₁ (N,), and the phases z modulo 2, (N, g).

    With τ₁ = t/F_0 + δ the equation is F_0 δ + Σ F_m/(π m·f) [sin 2πm·z − sin 2πm·z⁰] = 0 at z = z⁰
    + (f/F_0)t + fδ. The left side increases with δ. Modes with m·f = 0 to its rounding, as at a
    resonance, belong to F_0.
    """
    f, start = found["frequencies"], found["phases"]
    modes = _Modes(found["modes"], found["coefficients"], np.zeros(len(found["modes"])))
    if "area" in found:
        odd = _Modes.of_halves(found["area"]["odd"])
        modes = _Modes(*(np.concatenate(pair) for pair in zip(modes, odd, strict=True)))
    rounding = _STANDING * np.finfo(float).eps * (np.abs(modes.orders) @ np.abs(f))
    still = np.abs(modes.orders @ f) <= rounding
    angles = 2 * np.pi * (modes.orders[still] @ start + modes.turns[still])
    mean = found["mean_rate"] + float(np.cos(angles) @ (2 * modes.coefficients[still]))
    modes = _Modes(*(part[~still] for part in modes))
    advance = np.fmod(times[:, None] * (f / mean), 2.0)
    delta = np.zeros(len(times))
    if modes.orders.size:
        for rows in modes.rows(len(times)):
            delta[rows] = _solve_delta(found, modes, mean, times[rows] / mean, advance[rows])
    return times / mean + delta, np.mod(start + advance + delta[:, None] * f, 2.0)


def _solve_delta(
    found: Mapping[str, Any], modes: _Modes, mean: float, uniform: Array, advance: Array
) -> Array:
    """Return δ for each row of t/F_0 and of the uniform advance, by Newton's method inside a
    bracket.
    """
    f, weights = found["frequencies"], 2 * modes.coefficients
    pace = np.pi * (modes.orders @ f)
    offset = 2 * np.pi * (np.mod(modes.orders @ found["phases"], 1.0) + modes.turns)
    half_turns = np.pi * (advance @ modes.orders.T)
    low = np.full(len(advance), -float(np.sum(np.abs(weights / pace))) / mean)
    high = -low
    delta = np.zeros(len(advance))
    # to the rounding of the modes: slow ones move no further than the time
    lengths = 1 / (np.abs(pace) + 1 / (1 + np.abs(uniform[:, None])))
    noise = float(np.max(lengths @ np.abs(weights), initial=0.0)) / mean
    smallest = 4 * np.finfo(float).eps * max(noise, 1.0 / float(np.max(np.abs(f))))
    for _ in range(_MOST_STEPS):
        h, length = _half_advance(half_turns + delta[:, None] * pace, pace, uniform + delta)
        value = mean * delta + (np.cos(offset + h) * length) @ weights
        slope = mean + np.cos(offset + 2 * h) @ weights
        low = np.where(value <= 0, delta, low)
        high = np.where(value >= 0, delta, high)
        with np.errstate(divide="ignore", invalid="ignore"):
            step = delta - value / slope
        inside = (step >= low) & (step <= high) & (slope > 0)
        following = np.where(inside, step, (low + high) / 2)
        moved = np.max(np.abs(following - delta), initial=0.0)
        delta = following
        if moved <= smallest:
            break
    return delta


def _lattice_sum(found: Mapping[str, Any], z: Array) -> Array:
    """Return the theta functions of a document at phases (N, g), up to a factor that all have in
    common, (N, K).

    θ[ε;δ](z) = Σ_{m∈Z^g} exp(−π(m+ε)ᵀT(m+ε)) cos 2π(m+ε)·(z+δ). Where T has a small eigenvalue the
    document names a ``basis`` and its ``waves`` F: Poisson summation over the other coordinates G
    turns their waves into Gaussians. With y = U(z+δ), C = T_FG T_GG⁻¹ and S = T_FF − C T_GF, all in
    that basis, the sum is, but for a factor,

        Σ_{x∈Z^F+ε_F} Σ_{k∈Z^G} exp(−π xᵀSx − π dᵀT_GG⁻¹d) cos 2π[x·(y_F + Cd) + k·ε_G],   d = k −
        y_G.
    """
    T, reduction = found["riemann_matrix"], found["reduction"]
    U = np.eye(len(T)) if reduction is None else reduction["basis"]
    F = list(range(len(T))) if reduction is None else reduction["waves"].astype(int).tolist()
    G = [i for i in range(len(T)) if i not in F]
    form = U @ T @ U.T
    inverse: Array = np.asarray(np.linalg.inv(form[np.ix_(G, G)]), dtype=np.float64)
    C = form[np.ix_(F, G)] @ inverse
    S = form[np.ix_(F, F)] - C @ form[np.ix_(G, F)]
    to_basis = np.rint(np.linalg.inv(U)).T
    cell = _lattice_within(inverse, np.zeros(len(G)), 0.5)
    values = np.empty((len(z), len(found["characteristics"])))
    for j, (epsilon, delta) in enumerate(found["characteristics"]):
        half: Array = np.asarray(to_basis @ epsilon, dtype=np.float64)
        y = (z + delta) @ U.T
        x = _lattice_within(S, half[F], 0.0)
        weights = np.exp(-np.pi * np.einsum("xi,ij,xj->x", x, S, x))
        k = np.rint(y[:, None, G]) + cell  # (N, K, G)
        d = k - y[:, None, G]
        gaussians = np.exp(-np.pi * np.einsum("nki,ij,nkj->nk", d, inverse, d))
        turns = (y[:, None, F] + d @ C.T) @ x.T + (k @ half[G])[:, :, None]
        values[:, j] = np.einsum("nk,nkx,x->n", gaussians, np.cos(2 * np.pi * turns), weights)
    return values


def _lattice_within(form: Array, shift: Array, margin: float) -> Array:
    """Return the points x ∈ Z^d + shift with π xᵀ form x ≤ _NATS beside the shortest, (X, d), and
    those within it of some point of |r_i| ≤ margin.
    """
    if not len(form):
        return np.zeros((1, 0))
    farthest = margin**2 * float(np.sum(np.abs(form)))  # no corner of the cell is farther
    square = _NATS / np.pi + farthest
    shortest = float(shift @ form @ shift)  # no shorter one is needed to bound the box
    widths = np.sqrt(square + shortest) * np.sqrt(np.diag(np.linalg.inv(form))) + margin
    sides = (
        np.arange(np.ceil(-w - s), np.floor(w - s) + 1) + s
        for w, s in zip(widths, shift, strict=True)
    )
    points = np.array(list(itertools.product(*sides)))
    norms = np.einsum("xi,ij,xj->x", points, form, points)
    # The largest term of a characteristic is that of its shortest vector, which is long where a cut
    # is nearly closed.
    radius = np.sqrt(square + norms.min()) + np.sqrt(farthest)
    return np.asarray(points[np.sqrt(norms) <= radius])
