"""Generalized Chaplygin reduction: Proposition pro, the momentum equation and the invariants 𝒜,
along motions of LR systems.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm, expm_frechet

from conftest import slow
from lr_draws import RANKS, random_lr, random_operator
from paper.lr_reduction import ChaplyginReduction
from veselova import LRSystem, MatrixGroup, solve
from veselova.mechanics.core.flow import FLOATS

#: A potential of e_1 alone, invariant under every H of (4.1).
OF_E1 = [
    {"coefficient": 0.2, "powers": [[1, 1, 2]]},
    {"coefficient": -0.1, "powers": [[1, 2, 1], [1, 3, 1]]},
]


def su3_over_u2(rng: np.random.Generator, *, turning: bool = True) -> LRSystem:
    """A system on SU(3) with 𝔥 = u(2), so that Q is the complex projective plane, or su(2), so that
    it is a five-sphere.
    """
    group = MatrixGroup.su(3)
    h: list[Any] = [
        [[0, 0, 0], [0, 0, 1], [0, -1, 0]],
        [[0, 0, 0], [0, 0, 1j], [0, 1j, 0]],
        np.diag([0, 1j, -1j]),
    ]
    h += [np.diag([2j, -1j, -1j])] if turning else []
    omega = group.element(rng.normal(size=8))
    system = LRSystem.on(group, random_operator(rng, 8), h, None, omega)
    free, _ = system.distribution.components(np.eye(6), system.omega)
    omega = group.element(
        system.distribution.body(np.eye(6), free, np.zeros(system.distribution.constraints))
    )
    return LRSystem.on(group, system.inertia.matrix, h, None, omega, homogeneous=True)


def systems(rng: np.random.Generator) -> list[LRSystem]:
    found = [random_lr(rng, n, r) for n, r in RANKS if n > 2]
    return [
        *found,
        random_lr(rng, 4, 2, potential=OF_E1),
        su3_over_u2(rng),
        su3_over_u2(rng, turning=False),
    ]


def velocity(system: LRSystem) -> Any:
    return system.g @ system.distribution.group.element(system.omega)


def rate(system: LRSystem, function: Any) -> Any:
    """The derivative of a function of (g, ω) along the motion, by a complex step along the field
    with multipliers.
    """
    flow, D = system.flow("multipliers"), system.distribution.group.dimension
    step = flow.initial + 1e-30j * flow.field(flow.initial, flow.parameters, FLOATS)
    g, omega = step[D:].reshape(system.g.shape), step[:D] / flow.time_unit
    return np.asarray(function(g, omega)).imag / 1e-30 / flow.time_unit


def test_the_reduced_equations_are_those_of_the_motion(rng: np.random.Generator) -> None:
    """(1.2) gives the acceleration that the LR system has: Proposition pro, to rounding."""
    for system in systems(rng):
        reduction, W = ChaplyginReduction(system), system.distribution.in_body

        def quasivelocity(g: Any, omega: Any) -> Any:
            return W(g)[0] @ omega  # noqa: B023 - called at once

        acceleration = reduction.acceleration(system.g, velocity(system))
        assert np.allclose(acceleration, rate(system, quasivelocity), rtol=1e-10, atol=1e-11)


@pytest.mark.parametrize(("n", "rank"), [(3, 1), (4, 2), (5, 2)])
def test_the_left_side_of_the_reduced_equations_is_lagrange_s(
    n: int, rank: int, rng: np.random.Generator
) -> None:
    """In the chart x ↦ H exp(Σ x_k w_k)g: ∂L/∂x − d/dt ∂L/∂ẋ by differences of L is the curvature
    term of (1.2).
    """
    system = random_lr(rng, n, rank, potential=OF_E1)
    reduction, group = ChaplyginReduction(system), system.distribution.group
    w, u = (
        system.distribution.space[: system.distribution.rank],
        system.distribution.components(system.g, system.omega)[0],
    )
    acceleration, step = reduction.acceleration(system.g, velocity(system)), 1e-3
    variations = system.g @ group.element(system.distribution.in_body(system.g)[0])
    forces = reduction.constraint_force(system.g, velocity(system), variations)

    def L(x: Any, v: Any) -> float:
        point, tangent = expm_frechet(group.element(x @ w), group.element(v @ w))
        return float(reduction.lagrangian(point @ system.g, tangent @ system.g))

    def slope(function: Any, e: Any) -> float:
        return float(8 * (function(e) - function(-e)) - function(2 * e) + function(-2 * e)) / (
            12 * step
        )

    for l, e in enumerate(step * np.eye(u.size)):
        position = slope(lambda d: L(d, u), e)

        def momentum(t: Any, e: Any = e) -> float:
            x, v = t * u + t * t / 2 * acceleration, u + t * acceleration
            return slope(lambda d: L(x, v + d), e)

        left = position - slope(momentum, step)
        force = reduction.constraint_force(
            system.g,
            velocity(system),
            system.g @ group.element(system.distribution.in_body(system.g)[0][l]),
        )
        assert abs(left - force) < 1e-7
    forces = reduction.constraint_force(
        system.g,
        velocity(system),
        system.g @ group.element(system.distribution.in_body(system.g)[0]),
    )
    assert np.max(np.abs(forces)) > 1e-3


def test_the_reduced_momentum_equation_holds_along_motions(rng: np.random.Generator) -> None:
    """(*), (**): Φ* = pr 𝓘Φ = pr 𝓜, and its rate is [Φ*, Φ]."""
    for system in systems(rng):
        if system.potential:
            continue
        reduction, distribution = ChaplyginReduction(system), system.distribution
        group, inertia = distribution.group, system.inertia

        def projected(g: Any, omega: Any) -> Any:
            W, _ = distribution.in_body(g)  # noqa: B023 - called at once
            return (W @ inertia(omega)) @ W  # noqa: B023

        phi_star = reduction.momentum(system.g, velocity(system))
        assert np.allclose(
            group.coordinates(phi_star), projected(system.g, system.omega), atol=1e-12
        )
        assert np.allclose(
            reduction.velocity(system.g, phi_star), group.element(system.omega), atol=1e-11
        )
        assert np.allclose(
            group.coordinates(reduction.momentum_rate(system.g, phi_star)),
            rate(system, projected),
            atol=1e-10,
        )
        M = system.derive("momentum", system.start)[0]
        assert np.allclose(phi_star, M, atol=1e-12)  # on D all of 𝓜 is its 𝔡-part


def test_everything_depends_on_the_orbit_alone(rng: np.random.Generator) -> None:
    """g and hg, h ∈ H, have the same 𝒳, Φ, L, E, Φ*, forces; and a velocity along the orbit is
    none.
    """
    for system in systems(rng):
        reduction, distribution = ChaplyginReduction(system), system.distribution
        group, g = distribution.group, system.g
        vertical = distribution.space[distribution.rank :]
        h = expm(group.element(rng.normal(size=len(vertical)) @ vertical))
        omega, xi = group.element(rng.normal(size=(2, group.dimension)))
        along = group.element(rng.normal(size=len(vertical)) @ vertical) @ g
        names = ("momentum_map", "lagrangian", "energy", "momentum")
        for name in names:
            function = getattr(reduction, name)
            assert np.allclose(
                function(h @ g, h @ g @ omega), function(g, g @ omega + along), atol=1e-11
            ), name
        assert np.allclose(reduction.coordinates(h @ g), reduction.coordinates(g), atol=1e-12)
        assert np.allclose(reduction.projector(h @ g), reduction.projector(g), atol=1e-12)
        assert np.isclose(np.trace(reduction.projector(g)), distribution.rank)
        force = reduction.constraint_force(g, g @ omega, g @ xi)
        assert np.isclose(
            force,
            reduction.constraint_force(h @ g, h @ g @ omega + h @ along, h @ g @ xi),
            atol=1e-10,
        )
        phi = reduction.momentum_map(g, g @ omega)
        assert np.allclose(reduction.momentum_map(g, g @ phi), phi, atol=1e-12)


def test_the_curvature_is_the_vertical_part_of_brackets_in_space(rng: np.random.Generator) -> None:
    """B(X_1, X_2) = g pr_{g⁻¹𝔥g}[φ(X_1^h), φ(X_2^h)]: in space, the same two-form of
    𝔡 everywhere.
    """
    for system in systems(rng):
        reduction, distribution = ChaplyginReduction(system), system.distribution
        u, v = rng.normal(size=(2, distribution.rank)) @ distribution.space[: distribution.rank]
        X, Y = distribution.group.element(np.stack([u, v]))
        spatial = system.g @ reduction.curvature(system.g, X @ system.g, Y @ system.g) @ system.g.T
        bracket = X @ Y - Y @ X
        h = distribution.group.element(distribution.space[distribution.rank :])
        expected = sum((np.sum(bracket * x) / np.sum(x * x) * x for x in h), np.zeros_like(X))
        assert np.allclose(spatial, expected, atol=1e-11)


@pytest.mark.parametrize(("n", "rank"), [(3, 1), (4, 2), (5, 1)])
def test_the_reduced_equations_integrated_are_the_projected_motion(
    n: int, rank: int, rng: np.random.Generator
) -> None:
    """(1.2) as a second-order equation on H\\G, from any g over q: 𝒳 = (e_1 … e_r) comes out as in
    the full system.
    """
    system = random_lr(rng, n, rank)
    reduction, distribution = ChaplyginReduction(system), system.distribution
    group, vertical = distribution.group, distribution.space[distribution.rank :]
    h = expm(group.element(rng.normal(size=len(vertical)) @ vertical))
    start = h @ system.g  # another representative of the same point

    def field(_t: float, state: Any) -> Any:
        g, u = state[: n * n].reshape(n, n), state[n * n :]
        g_dot = g @ group.element(u @ distribution.in_body(g)[0])
        return np.concatenate([g_dot.ravel(), reduction.acceleration(g, g_dot)])

    u = distribution.components(start, system.omega)[0]
    answer = solve_ivp(
        field, (0, 3), np.concatenate([start.ravel(), u]), method="DOP853", rtol=1e-11, atol=1e-12
    )
    X = reduction.coordinates(answer.y[: n * n, -1].reshape(n, n))
    assert X.shape == (n, rank)
    assert np.max(np.abs(X - solve(system, [3.0]).frame[0][:, :rank])) < 1e-9


@pytest.mark.parametrize(("n", "rank"), [row if row[0] < 5 else slow(*row) for row in RANKS])
def test_ad_invariants_of_the_momentum_are_integrals(
    n: int, rank: int, rng: np.random.Generator
) -> None:
    """The algebra 𝒜 has dim pr_𝔡(ann ξ) independent functions, the rank of the differentials of the
    traces on 𝔡.
    """
    system = random_lr(rng, n, rank)
    reduction, distribution = ChaplyginReduction(system), system.distribution
    group = distribution.group
    trajectory = solve(system, np.linspace(0, 8, 5), method="taylor")
    g, omega = np.swapaxes(trajectory.frame, 1, 2), trajectory.omega
    momenta = np.array([reduction.momentum(a, a @ b) for a, b in zip(g, omega, strict=True)])
    values = reduction.invariants(momenta)
    assert values.shape == (5, max(1, n // 2))
    assert np.max(np.abs(values - values[0])) < 1e-12 * max(1.0, np.max(np.abs(values)))
    assert np.ptp(momenta[:, 0, 1]) > 1e-3 or n == 2
    xi = group.element(rng.normal(size=distribution.rank) @ distribution.space[: distribution.rank])
    slopes = [
        group.coordinates(np.linalg.matrix_power(xi, 2 * k - 1))[: distribution.rank]
        for k in range(1, n // 2 + 1)
    ]
    slopes = [slope / np.linalg.norm(slope) for slope in slopes]
    assert np.linalg.matrix_rank(np.array(slopes), tol=1e-7) == reduction.independent_invariants
    assert reduction.independent_invariants == (min(rank, n // 2) if rank < n - 1 else n // 2)
