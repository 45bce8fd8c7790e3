"""The evaluator of closed-form documents: inverse time map, phases, theta quotients, attitude. It
uses NumPy alone.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["evaluate", "fastest", "lattice_sum", "neumann_time"]

Array = NDArray[np.float64]

#: Terms below e^(−39) = 1e-17 of the largest are left out: π|x|² ≤ 39.
_NATS = 39.0

#: Entries of one block of (times × modes) or (times × lattice).
_BLOCK = 400_000

#: Newton's steps of the inverse time map, each kept inside a bracket that it halves where it must.
_MOST_STEPS = 200

#: Σ|m_k f_k| in roundings below which m·f counts as zero.
_STANDING = 4.0


@np.errstate(over="ignore", invalid="ignore")  # far times, whose error says it
def evaluate(
    document: Mapping[str, Any],
    arrays: Mapping[str, Array],
    times: Array,
) -> dict[str, Array]:
    """Return the series of a document at times (N,), by name."""
    tau1, z, _ = neumann_time(document, arrays, times)
    values = np.concatenate(
        [lattice_sum(document, arrays, z[rows]) for rows in _rows(len(z), _BLOCK // 1000)]
    )
    quotients = values / values[:, :1]

    def entries(pairs: Any) -> Array:
        places = np.array([place for place, _ in pairs])
        return np.asarray(
            quotients[:, places] * np.array([float(constant) for _, constant in pairs])
        )

    normals = np.stack(
        [entries(column) for column in [*document["normals"], document["gamma"]]], axis=2
    )
    directions = arrays["directions"]
    frame = np.empty((len(times), len(directions), len(directions)))
    frame[:, :, 0] = entries(document["q"]) @ directions.T
    frame[:, :, 1:] = directions @ normals @ arrays["rotation"] + arrays["frozen"]
    q_prime = np.einsum("tik,tk->ti", normals, entries(document["q_prime"])) @ directions.T
    rate = document["rate"]
    place = int(rate["characteristic"])
    slope = float(rate["constant"]) * np.abs(quotients[:, place]) ** int(rate["power"])
    series = _series_of(document, arrays["A"], tau1, frame, q_prime / slope[:, None])
    if "path" not in document:
        return series
    return {**series, "position": _contact_point(document, arrays, tau1, z, times)}


def fastest(
    document: Mapping[str, Any], arrays: Mapping[str, Array], series: Mapping[str, Array]
) -> Array:
    """Return how fast q, the frame, the point of a geodesic and the contact point move at most,
    (N,).
    """
    speeds = [series[name] for name in ("q_dot", "q_prime", "Omega", "X_dot") if name in series]
    found = np.sum([np.linalg.norm(speed, axis=1) for speed in speeds], axis=0)
    radius = float(document["path"]["radius"]) if "path" in document else 0.0
    if "X" in series:  # the frame of a geodesic turns by the curvatures of its ellipsoid at most
        found = found * max(1.0, math.sqrt(np.max(arrays["A"])) / float(np.min(arrays["A"])))
    return np.asarray(found * max(1.0, radius))


def _contact_point(
    document: Mapping[str, Any], arrays: Mapping[str, Array], tau1: Array, z: Array, times: Array
) -> Array:
    """Return x(0) − a ℜᵀ(y_2, …, y_g, y_γ), y_k the integral of (q',n_k) over τ₁, y_γ = speed·t.

    With an area constant ``plane`` stands in the place of ℜ, and to y_γ comes ``odd`` times the odd
    part of t.
    """
    path = document["path"]
    columns = [_integral(series, arrays, tau1, z) for series in path["transverse"]]
    along = float(path["speed"]) * times
    plane = arrays["rotation"]
    if "area" in document:
        plane = np.array(path["plane"], dtype=np.float64)
        along = along + float(path["odd"]) * _integral(document["area"]["odd"], arrays, tau1, z)
    y = np.stack([*columns, along], axis=1)
    return np.asarray(
        np.array(path["position"], dtype=np.float64) - float(path["radius"]) * (y @ plane)
    )


def _integral(
    series: Mapping[str, Any], arrays: Mapping[str, Array], tau1: Array, z: Array
) -> Array:
    """Return ∫Σ 2c cos 2π(m·z + turn) dτ₁ from zero, m = M/2.

    A mode gives c/(π m·f) [sin 2π(m·z + turn) − sin 2π(m·z⁰ + turn)]. It is made as a product, so
    that nothing cancels where m·f is small; where m·f = 0 it is 2cτ₁ cos 2π(m·z⁰ + turn).
    """
    start = arrays["phases"]
    modes = np.array(series["modes"], dtype=np.float64).reshape(-1, len(start)) / 2
    pace = np.pi * (modes @ arrays["frequencies"])
    weights = 2 * np.array(series["coefficients"], dtype=np.float64)
    offset = 2 * np.pi * (modes @ start + float(series["turn"]))
    found = np.empty(len(z))
    for rows in _rows(len(z), _BLOCK // max(1, len(modes))):
        h, reach = _reach(np.pi * ((z[rows] - start) @ modes.T), pace, tau1[rows])
        found[rows] = (np.cos(offset + h) * reach) @ weights
    return found


def _reach(h: Array, pace: Array, tau1: Array) -> tuple[Array, Array]:
    """Return h = πm·f τ₁, which is known modulo π, and sin h/(πm·f); pace: πm·f.

    Less than a radian of a slow mode is the product itself: h has lost its digits.
    """
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        slow = tau1[:, None] * pace
        near = np.abs(slow) < 1
        reach = np.where(near, tau1[:, None] * np.sinc(slow / np.pi), np.sin(h) / pace)
    return np.where(near, slow, h), reach


def _series_of(
    document: Mapping[str, Any], A: Array, tau1: Array, frame: Array, velocity: Array
) -> dict[str, Array]:
    """Return the series under the names of the system; ``velocity`` is that of q in the system's
    own time.
    """
    axes = document.get("axes")
    if "area" in document:
        return _body_with_area(document["area"], axes, frame)
    q = frame[:, :, 0]
    if document["problem"]["system"] == "ellipsoid-geodesic":
        X = A * q / np.sqrt(np.sum(A * q * q, axis=1))[:, None]
        return {"X": X, "X_dot": frame[:, :, -1], "frame": frame, "tau1": tau1}
    matrix = None if axes is None else np.array(axes, dtype=np.float64)
    if "ball" in document:
        omega = _turning_of_ball(document["ball"], frame)
        if matrix is not None:
            omega = _turn(matrix, omega)
            frame = matrix @ frame
        return {"gamma": frame[:, :, 0], "Omega": omega, "frame": frame}
    if matrix is not None:
        frame = matrix @ frame
        velocity = velocity @ matrix.T
        q = frame[:, :, 0]
    if document["problem"]["system"] == "neumann":
        return {"q": q, "q_prime": velocity, "frame": frame}
    if document["problem"]["system"] in ("veselova-so3", "rubber-ball"):
        return {"gamma": q, "Omega": np.cross(velocity, q), "frame": frame}
    return {"q": q, "q_dot": velocity, "frame": frame, "tau1": tau1}


def _body_with_area(area: Mapping[str, Any], axes: Any, frame: Array) -> dict[str, Array]:
    """Return γ, Ω and the frame of a body with an area constant from [v n_2 γ'] of its torus.

    Ω = B(K + σγ), σ = (c − (BK,γ))/(Gγ,γ): K is fixed in space, B the inverse of the inertia, and c
    and G are (Ω,γ) and B, or 0 and −BI/D = B − 1/D for a ball that twists.
    """
    inverse, form, momentum, attitude = (
        np.asarray(area[name], dtype=np.float64)
        for name in ("inverse", "form", "momentum", "attitude")
    )
    frame = frame @ attitude
    if axes is not None:
        frame = np.asarray(axes, dtype=np.float64) @ frame
    gamma = frame[:, :, 0]
    free = frame @ momentum @ inverse
    # (BK,γ), B − G a number times one, (K,γ) known: it cancels where that number is large beside G
    level = momentum[0] * (inverse[0, 0] - form[0, 0])
    along = level + np.sum((frame @ momentum @ form) * gamma, axis=1)
    share = (float(area["constant"]) - along) / np.sum((gamma @ form) * gamma, axis=1)
    Omega = free + share[:, None] * (gamma @ inverse)
    return {"gamma": gamma, "Omega": Omega, "frame": frame}


def _turning_of_ball(ball: Mapping[str, Any], frame: Array) -> Array:
    """Return the coefficients of ω on E_i∧E_j, i < j, of a ball in ℝⁿ, (N, n(n−1)/2).

    ω = q∧ξ, or (xq∧xξ)/D − q∧ξ for a ball that twists freely, ξ = [x⁻¹p − (p,x⁻¹q)q]/(q,xq), p
    fixed in space.
    """
    x = np.asarray(ball["roots"], dtype=np.float64)
    q = frame[:, :, 0]
    free = frame @ np.asarray(ball["momentum"], dtype=np.float64) / x
    xi = free - np.sum(free * q, axis=1)[:, None] * q
    xi = xi / np.sum(q * x * q, axis=1)[:, None]
    rows, columns = np.triu_indices(len(x), 1)
    turning = q[:, rows] * xi[:, columns] - q[:, columns] * xi[:, rows]
    if ball["added"] is None:
        return np.asarray(turning)
    return np.asarray((x[rows] * x[columns] / float(ball["added"]) - 1) * turning)


def _turn(axes: Array, omega: Any) -> Any:
    """Return the coefficients on E_i∧E_j in the body of those along the principal axes."""
    rows, columns = np.triu_indices(len(axes), 1)
    matrices = np.zeros((len(omega), *axes.shape))
    matrices[:, rows, columns] = omega
    in_body = axes @ (matrices - np.swapaxes(matrices, 1, 2)) @ axes.T
    return in_body[:, rows, columns]


def _rows(count: int, block: int) -> list[slice]:
    return [slice(first, first + max(1, block)) for first in range(0, count, max(1, block))]


def neumann_time(
    document: Mapping[str, Any],
    arrays: Mapping[str, Array],
    times: Array,
) -> tuple[Array, Array, Array]:
    """Return τ₁ (N,), the phases z modulo 2, (N, g), and δ (N,).

    With τ₁ = t/F_0 + δ the equation is F_0 δ + Σ F_m/(π m·f) [sin 2πm·z − sin 2πm·z⁰] = 0 at z = z⁰
    + (f/F_0)t + fδ. The left side increases with δ. Modes with m·f = 0, as at a resonance, belong
    to F_0.
    """
    f = arrays["frequencies"]
    series = arrays["modes"], arrays["coefficients"], np.zeros(len(arrays["modes"]))
    if "area" in document:
        series = _with_odd_part(document["area"]["odd"], *series)
    series, standing = _moving_modes(arrays, series)
    mean = float(document["mean_rate"]) + standing
    advance = np.fmod(times[:, None] * (f / mean), 2.0)
    delta = np.zeros(len(times))
    if count := len(series[0]):
        for rows in _rows(len(times), _BLOCK // count):
            delta[rows] = _solve_delta(arrays, series, mean, times[rows] / mean, advance[rows])
    tau1 = times / mean + delta
    z = np.mod(arrays["phases"] + advance + delta[:, None] * f, 2.0)
    return tau1, z, delta - times * (standing / mean / float(document["mean_rate"]))


def _moving_modes(
    arrays: Mapping[str, Array], series: tuple[Array, Array, Array]
) -> tuple[tuple[Array, Array, Array], float]:
    """Return the modes, coefficients and turns that move, and what the others add to F_0."""
    modes, coefficients, turns = series
    still = _standing_modes(modes, arrays["frequencies"])
    angles = 2 * np.pi * (modes[still] @ arrays["phases"] + turns[still])
    return (
        (modes[~still], coefficients[~still], turns[~still]),
        float(np.cos(angles) @ (2 * coefficients[still])),
    )


def _standing_modes(modes: Array, f: Array) -> NDArray[np.bool_]:
    """Return which modes (M, g) have m·f = 0 to its rounding, as at a resonance, (M,)."""
    rounding = _STANDING * np.finfo(float).eps * (np.abs(modes) @ np.abs(f))
    return np.asarray(np.abs(modes @ f) <= rounding)


def _with_odd_part(
    odd: Mapping[str, Any], modes: Array, coefficients: Array, turns: Array
) -> tuple[Array, Array, Array]:
    """Return the modes of a time map with those of its odd part, which are doubled there."""
    halves = np.array(odd["modes"], dtype=np.float64).reshape(-1, modes.shape[1]) / 2
    further = np.array(odd["coefficients"], dtype=np.float64)
    return (
        np.concatenate([modes, halves]),
        np.concatenate([coefficients, further]),
        np.concatenate([turns, np.full(len(further), float(odd["turn"]))]),
    )


def _solve_delta(
    arrays: Mapping[str, Array],
    series: tuple[Array, Array, Array],
    mean: float,
    uniform: Array,
    advance: Array,
) -> Array:
    """Return δ for each row of t/F_0 and of the uniform advance, by Newton's method inside a
    bracket; series: modes, coefficients and turns.
    """
    f = arrays["frequencies"]
    modes, coefficients, turns = series
    pace = np.pi * (modes @ f)
    offset = 2 * np.pi * (np.mod(modes @ arrays["phases"], 1.0) + turns)
    half_turns = np.pi * (advance @ modes.T)

    def excess(delta: Array) -> tuple[Array, Array]:
        tau1 = uniform + delta
        h, reach = _reach(half_turns + delta[:, None] * pace, pace, tau1)
        value = mean * delta + (np.cos(offset + h) * reach) @ (2 * coefficients)
        slope = mean + np.cos(offset + 2 * h) @ (2 * coefficients)
        return value, slope

    low = np.full(len(advance), -2 * float(np.sum(np.abs(coefficients / pace))) / mean)
    high = -low
    delta = np.zeros(len(advance))
    # to the rounding of the modes: slow ones move no further than the time
    reaches = 1 / (np.abs(pace) + 1 / (1 + np.abs(uniform[:, None])))
    noise = float(np.max(reaches @ np.abs(2 * coefficients), initial=0.0)) / mean
    smallest = 4 * np.finfo(float).eps * max(noise, 1.0 / float(np.max(np.abs(f))))
    for _ in range(_MOST_STEPS):
        value, slope = excess(delta)
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


def lattice_sum(document: Mapping[str, Any], arrays: Mapping[str, Array], z: Array) -> Array:
    """Return the theta functions of a document at phases (N, g), up to a factor that all have in
    common, (N, K).

    θ[ε;δ](z) = Σ_{m∈Z^g} exp(−π(m+ε)ᵀT(m+ε)) cos 2π(m+ε)·(z+δ). Where T has a small eigenvalue the
    document names a ``basis`` and its ``waves`` F: Poisson summation over the other coordinates G
    turns their waves into Gaussians. With y = U(z+δ), C = T_FG T_GG⁻¹ and S = T_FF − C T_GF, all in
    that basis, the sum is, but for a factor,

        Σ_{x∈Z^F+ε_F} Σ_{k∈Z^G} exp(−π xᵀSx − π dᵀT_GG⁻¹d) cos 2π[x·(y_F + Cd) + k·ε_G],   d = k −
        y_G.
    """
    T = arrays["riemann_matrix"]
    genus = int(document["genus"])
    reduction = document.get("reduction") or {
        "basis": np.eye(genus).tolist(),
        "waves": list(range(genus)),
    }
    U = np.array(reduction["basis"], dtype=np.float64)
    F = list(reduction["waves"])
    G = [i for i in range(genus) if i not in F]
    form = U @ T @ U.T
    inverse: Array = np.asarray(np.linalg.inv(form[np.ix_(G, G)]), dtype=np.float64)
    C = form[np.ix_(F, G)] @ inverse
    S = form[np.ix_(F, F)] - C @ form[np.ix_(G, F)]
    to_basis = np.rint(np.linalg.inv(U)).T
    cell = _lattice_within(inverse, np.zeros(len(G)), 0.5)
    found = np.empty((len(z), len(arrays["characteristics"])))
    for j, (epsilon, delta) in enumerate(arrays["characteristics"]):
        half: Array = np.asarray(to_basis @ epsilon, dtype=np.float64)
        y = (z + delta) @ U.T
        x = _lattice_within(S, half[F], 0.0)
        weights = np.exp(-np.pi * np.einsum("xi,ij,xj->x", x, S, x))
        k = np.rint(y[:, None, G]) + cell  # (N, K, G)
        d = k - y[:, None, G]
        gaussians = np.exp(-np.pi * np.einsum("nki,ij,nkj->nk", d, inverse, d))
        turns = (y[:, None, F] + d @ C.T) @ x.T + (k @ half[G])[:, :, None]
        found[:, j] = np.einsum("nk,nkx,x->n", gaussians, np.cos(2 * np.pi * turns), weights)
    return found


def _lattice_within(form: Array, shift: Array, margin: float) -> Array:
    """Return the points x ∈ Z^d + shift with π xᵀ form x ≤ _NATS, (X, d), and those within it of
    some point of |r_i| ≤ margin.
    """
    if not len(form):
        return np.zeros((1, 0))
    # The nearest point may be as far as a corner of the cell, and others count against it.
    corners = np.array(list(itertools.product((-margin, margin), repeat=len(form))))
    farthest = float(np.max(np.einsum("ci,ij,cj->c", corners, form, corners)))
    square = _NATS / np.pi + farthest
    shortest = float(shift @ form @ shift)  # no shorter one is needed to bound the box
    widths = np.sqrt(square + shortest) * np.sqrt(np.diag(np.linalg.inv(form))) + margin
    ranges = [
        np.arange(np.ceil(-w - s), np.floor(w - s) + 1) + s
        for w, s in zip(widths, shift, strict=True)
    ]
    points = np.array(list(itertools.product(*ranges)))
    norms = np.einsum("xi,ij,xj->x", points, form, points)
    # The largest term of a characteristic is that of its shortest vector, which is long where a cut
    # is nearly closed.
    reach = np.sqrt(square + norms.min()) + np.sqrt(farthest)
    return np.asarray(points[np.sqrt(norms) <= reach])
