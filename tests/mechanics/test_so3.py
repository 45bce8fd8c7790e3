"""The Veselova system on T SO(3) and the Euler–Poisson equations: section 4 of the paper, formula
by formula.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from conftest import slow
from deviations import agree, apart
from duality import dual
from paper import sphere_geodesics
from veselova import EulerPoisson, NeumannSystem, Unsolved, VeselovaSO3, solve
from veselova.mechanics.core.flow import FLOATS
from veselova.mechanics.flows.rigid_body_flow import RigidBodyFlow
from veselova.mechanics.systems.rigid_body import RigidBody
from veselova.mechanics.systems.veselova_so3 import multiplier

#: Potentials by name; those of the family keep away from the planes.
POTENTIALS: dict[str, Any] = {
    "none": None,
    "clebsch": {"clebsch": 0.7},
    "family": {"family": [0.2, -0.3, 0.02, 0.03, 0.01]},
    "polynomial": {
        "polynomial": [
            {"coefficient": 0.3, "powers": [1, 0, 0]},
            {"coefficient": -0.2, "powers": [0, 1, 2]},
        ]
    },
}

#: What the default method may let integrals change by over t = 100, relative to the terms they are
#: sums of.
DRIFT = 1e-12


def draw(
    rng: np.random.Generator,
    system: type[RigidBody] = VeselovaSO3,
    potential: str = "none",
    *,
    on_constraint: bool = True,
) -> Any:
    """Return a problem with moments within a factor of 4, γ away from the planes γ_i = 0, and |Ω|
    near 1.
    """
    moments, Omega = np.exp(rng.uniform(0, np.log(4), 3)), rng.normal(size=3)
    gamma = rng.uniform(0.3, 1.0, 3) * rng.choice([-1.0, 1.0], 3)
    gamma /= np.linalg.norm(gamma)
    frame = np.linalg.qr(np.column_stack([gamma, rng.normal(size=(3, 2))]))[0]
    frame[:, 0] = gamma
    if on_constraint:
        across = gamma if system.constrained else moments * gamma
        Omega -= (Omega @ across) / (gamma @ across) * gamma
    return system(
        moments, gamma, Omega / np.linalg.norm(Omega), POTENTIALS[potential], frame, normalize=True
    )


def relative_drift(problem: Any, trajectory: Any) -> float:
    """Return the largest change of an integral, against the largest size of the terms that it is
    the sum of.
    """
    V, gamma, Omega = problem.potential, trajectory.gamma, trajectory.Omega
    M = Omega @ problem.inertia
    square = np.sum(M * M, axis=1) + (
        0 if V.companion is None else np.abs(V.companion.value(gamma))
    )
    scales = {
        "constraint": problem.turning,
        "i2": problem.turning * problem.inertia.max(),
        "gamma_norm": 1.0,
        problem.energy_name: np.max(np.sum(Omega * M, axis=1) + np.abs(V.terms.value(gamma))),
        "space_momentum": np.sqrt(np.max(square)),
    }
    drifts = [
        np.max(np.abs(v - v[0])) / scales.get(name, np.max(square))
        for name, v in trajectory.integrals.items()
    ]
    return float(max(drifts))


def derivative(function: Any, point: Any, direction: Any) -> Any:
    """The derivative of an analytic function along a direction, by a complex step."""
    return np.imag(function(point + 1e-100j * direction)) / 1e-100


# --- the equations of motion


@pytest.mark.parametrize("potential", POTENTIALS)
@pytest.mark.parametrize("formulation", VeselovaSO3.formulations)
def test_the_field_is_equation_3_1_with_the_multiplier(
    formulation: str, potential: str, rng: np.random.Generator
) -> None:
    problem = draw(rng, VeselovaSO3, potential, on_constraint=False)
    flow = problem.flow(formulation)
    state, rate = flow.initial, flow.vector_field(0.0, flow.initial)
    step = 1e-4
    upper, lower = (flow.unpack((state + s * step * rate)[None]) for s in (1, -1))
    Omega_dot = (upper["Omega"] - lower["Omega"])[0] / (2 * step * flow.time_unit)
    I, Omega, gamma = problem.inertia, problem.Omega, problem.gamma
    torque = np.cross(gamma, problem.potential.terms.gradient(gamma))
    expected = np.cross(I @ Omega, Omega) + torque + multiplier(problem, Omega, gamma) * gamma
    assert np.allclose(I @ Omega_dot, expected, rtol=1e-6, atol=1e-6 * np.max(np.abs(expected)))
    assert abs(Omega_dot @ gamma) < 1e-6
    frame_dot = rate[3:].reshape(3, 3) / flow.time_unit
    assert np.allclose(frame_dot, np.cross(problem.frame.T, Omega).T, rtol=1e-13, atol=1e-14)


def test_the_frame_turns_as_the_conventions_say(rng: np.random.Generator) -> None:
    """ė = −ωe with ω_ij = −ε_ijk Ω_k; on (Ω,γ) = 0 that is ω = γ∧γ̇."""
    problem = draw(rng)
    gamma_dot = np.cross(problem.gamma, problem.Omega)
    omega = np.outer(problem.gamma, gamma_dot) - np.outer(gamma_dot, problem.gamma)
    for e in problem.frame.T:
        assert np.allclose(np.cross(e, problem.Omega), -omega @ e, atol=1e-14)


def test_the_free_body_obeys_equation_3_4(rng: np.random.Generator) -> None:
    problem = draw(rng, EulerPoisson, "family", on_constraint=False)
    flow = problem.flow("velocity")
    Omega_dot = flow.vector_field(0.0, flow.initial)[:3] / flow.time_unit**2
    I, Omega, gamma = problem.inertia, problem.Omega, problem.gamma
    expected = np.cross(I @ Omega, Omega) + np.cross(gamma, problem.potential.terms.gradient(gamma))
    assert np.allclose(I @ Omega_dot, expected, rtol=1e-11, atol=1e-12)


@pytest.mark.parametrize("potential", POTENTIALS)
def test_the_invariant_measure_has_density_root_of_the_inverse_form(
    potential: str, rng: np.random.Generator
) -> None:
    """div(√(𝓘⁻¹γ,γ) field) = 0 on (Ω,γ) ∈ R⁶, off the unit sphere too, whatever V."""
    flow: RigidBodyFlow = draw(rng, VeselovaSO3, potential, on_constraint=False).flow()
    gamma, Omega = rng.uniform(0.4, 1.3, 3), rng.normal(size=3)

    def weighted(point: Any) -> Any:
        E = np.column_stack([point[3:], np.eye(3)[:, 1:]])
        rate = flow.field(np.concatenate([point[:3], E.ravel()]), flow.parameters, FLOATS)
        density = np.sqrt(point[3:] @ flow.inverse @ point[3:])
        return density * np.concatenate([rate[:3], rate[3::3]])

    point = np.concatenate([Omega, gamma])
    terms = np.array([derivative(weighted, point, e)[i] for i, e in enumerate(np.eye(6))])
    assert abs(np.sum(terms)) < 1e-12 * np.sum(np.abs(terms))


# --- motions


@pytest.mark.parametrize("system", [VeselovaSO3, EulerPoisson])
@pytest.mark.daily(3)
@pytest.mark.parametrize("potential", POTENTIALS)
def test_two_formulations_agree_and_keep_the_integrals(
    potential: str, system: Any, rng: np.random.Generator
) -> None:
    for on_constraint in (True, False):
        problem = draw(rng, system, potential, on_constraint=on_constraint)
        times = np.linspace(-3, 10, 6)
        first, second = (
            solve(problem, times, "numeric", formulation=name) for name in system.formulations
        )
        agree(first, second, "frame")
        assert np.max(apart(first, second, ["frame"])) < 1e-9
        assert relative_drift(problem, first) < DRIFT


def test_off_the_constraint_the_integrals_of_the_paper_are_kept(rng: np.random.Generator) -> None:
    problem = draw(rng, on_constraint=False)
    trajectory = solve(problem, np.linspace(0, 100, 11))
    Omega, gamma, I = trajectory.Omega, trajectory.gamma, problem.inertia
    along, M = np.sum(Omega * gamma, axis=1), Omega @ I
    painleve = np.sum(Omega * M, axis=1) / 2 - along * np.sum(M * gamma, axis=1)
    m = M - (np.sum(M * gamma, axis=1) - along)[:, None] * gamma
    assert "energy" not in trajectory.integrals
    assert np.allclose(trajectory.integrals["jacobi_integral"], painleve, rtol=1e-14)
    assert np.allclose(trajectory.momentum, m, rtol=1e-12, atol=1e-14)
    assert np.allclose(trajectory.integrals["F2"], np.sum(m * m, axis=1) / 2, rtol=1e-13)
    kinetic = np.sum(Omega * M, axis=1) / 2
    assert np.ptp(kinetic) > 1e-3  # the energy itself is not kept
    assert relative_drift(problem, trajectory) < DRIFT


def test_the_integrals_named_are_those_that_are_kept(rng: np.random.Generator) -> None:
    cases = [
        ("none", True, ["F2", "space_momentum"]),
        ("none", False, ["F2", "space_momentum"]),
        ("clebsch", False, ["F2"]),
    ]
    cases += [("family", True, ["F2"]), ("family", False, []), ("polynomial", True, [])]
    for potential, on_constraint, more in cases:
        problem = draw(rng, VeselovaSO3, potential, on_constraint=on_constraint)
        energy = "energy" if on_constraint else "jacobi_integral"
        assert f", {energy.replace('_', ' ')} " in problem.title
        names = ["constraint", "gamma_norm", energy, *more]
        assert list(problem.integrals(problem.start)) == names
        assert problem.vanishing == ({"constraint"} if on_constraint else set())


def test_without_potential_the_motion_is_that_of_the_closed_form(rng: np.random.Generator) -> None:
    for _ in range(3):
        problem = draw(rng)
        times = np.linspace(-30, 100, 27)
        numeric, closed = solve(problem, times, "numeric"), solve(problem, times)
        agree(numeric, closed, "frame")
        assert np.max(apart(numeric, closed, ["frame"])) < 1e-10
        assert np.isclose(problem.rank_one().energy, numeric.integrals["energy"][0], rtol=1e-13)


def test_in_neumann_time_gamma_is_a_neumann_motion(rng: np.random.Generator) -> None:
    """Theorem LR→N3, with τ₁(t) from the closed form."""
    problem = draw(rng)
    times = np.linspace(0, 20, 9)
    tau1 = solve(problem.rank_one(), times, "analytic").tau1
    neumann = problem.rank_one().neumann()
    assert isinstance(neumann, NeumannSystem)
    I, v = problem.inertia, np.cross(neumann.q_prime, neumann.q)
    # (3.7)
    assert abs(v @ I @ v - np.linalg.det(I) * (neumann.q @ problem.inverse @ neumann.q)) < 1e-13
    assert np.max(np.abs(solve(problem, times).gamma - solve(neumann, tau1).q)) < 1e-10
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turned = VeselovaSO3(
        (tensor := turn @ I @ turn.T) + 0 * tensor.T,
        turn @ problem.gamma,
        turn @ problem.Omega,
        normalize=True,
    )
    assert np.allclose(np.sort(1 / turned.rank_one().neumann().A), np.sort(np.diag(I)), rtol=1e-12)


@pytest.mark.parametrize("scale", [1e-14, 1e-9, 1e9, 1e14])
def test_units_do_not_matter(scale: float, rng: np.random.Generator) -> None:
    one = draw(rng, VeselovaSO3, "clebsch", on_constraint=False)
    fast = VeselovaSO3(
        np.diag(one.inertia),
        one.gamma,
        one.Omega * scale,
        {"clebsch": 0.7 * scale * scale},
        one.frame,
    )
    heavy = VeselovaSO3(
        np.diag(one.inertia) * scale, one.gamma, one.Omega, {"clebsch": 0.7}, one.frame
    )
    expected = solve(one, [1.0, 5.0])
    assert np.max(np.abs(solve(fast, [1.0 / scale, 5.0 / scale]).frame - expected.frame)) < 1e-11
    assert np.max(np.abs(solve(heavy, [1.0, 5.0]).frame - expected.frame)) < 1e-11


def test_a_body_at_rest_stays_where_no_torque_acts_and_starts_where_one_does() -> None:
    still = VeselovaSO3([1, 2, 3], [0, 0, 1], [0, 0, 0], {"clebsch": 1})
    assert not still.moves
    assert np.array_equal(solve(still, [5.0]).frame[0], still.frame)
    falling = VeselovaSO3([1, 2, 3], [0, 0.6, 0.8], [0, 0, 0], {"clebsch": 1})
    trajectory = solve(falling, np.linspace(0, 20, 9))
    assert np.ptp(trajectory.gamma[:, 1]) > 0.1
    assert relative_drift(falling, trajectory) < DRIFT
    steady = VeselovaSO3([1, 2, 3], [0, 0, 1], [1, 0, 0])
    assert np.max(np.abs(solve(steady, [100.0]).Omega - steady.Omega)) < 1e-12


# --- singular planes


@pytest.mark.daily(3)
@pytest.mark.parametrize("alpha", [1e-2, 1e-6, 1e-10])
def test_motions_turn_back_from_a_repelling_plane(alpha: float) -> None:
    problem = VeselovaSO3(
        [1, 1.7, 2.6], [0.6, 0.48, 0.64], [0.3, -0.7, 0.24375], {"family": [0, 0.1, alpha, 0, 0]}
    )
    times = np.linspace(0, 20, 201)
    trajectory = solve(problem, times, "numeric")
    fine = solve(problem, times, "numeric", "taylor")
    assert np.all(trajectory.gamma[:, 0] > 0)
    # it came near and went away, several times
    assert np.sum(np.diff(np.sign(np.diff(trajectory.gamma[:, 0]))) > 0) >= 3
    agree(trajectory, fine, "frame")
    assert relative_drift(problem, fine) < 1e-13
    assert relative_drift(problem, trajectory) < 1e-10


@pytest.mark.daily(3)
@pytest.mark.parametrize("alpha", [-1e3, -1.0, -1e-6, -1e-14])
@pytest.mark.parametrize("power", [-1, -2, -6])
def test_a_collision_is_a_named_outcome_with_its_time(power: int, alpha: float) -> None:
    potential = {"polynomial": [{"coefficient": alpha, "powers": [0, power, 0]}]}
    problem = VeselovaSO3([1, 1.7, 2.6], [0.6, 0.48, 0.64], [0.3, -0.7, 0.24375], potential)
    said = set()
    for formulation in problem.formulations:
        with pytest.raises(
            Unsolved, match=r"runs into the singular plane gamma\[1\] = 0 at about t = "
        ) as caught:
            solve(problem, [40.0], formulation=formulation)
        assert caught.value.outcome == "collision"
        said.add(str(caught.value))
    assert len(said) == 1
    when = float(said.pop().split("t = ")[1].split(",")[0])
    before = solve(problem, [0.999 * when])
    assert 0 < before.gamma[0, 1] < 0.11
    assert relative_drift(problem, before) < 1e-8


def test_the_time_of_a_collision_is_that_of_energy_where_the_motion_is_plane() -> None:
    """γ in the plane of e_1, e_2 with Ω along e_3: I_3 θ̇²/2 + α/sin²θ = h, so cos θ moves as a
    linear oscillator.
    """
    alpha, I3, theta = -0.5, 2.0, 1.0
    problem = VeselovaSO3(
        [1, 1.5, I3], [np.cos(theta), np.sin(theta), 0], [0, 0, 0], {"family": [0, 0, 0, alpha, 0]}
    )
    # h = α/sin²θ_0 < 0: c = cos θ obeys I₃ċ²/2 = h(1−c²) − α, so c = c_0 cosh(kt), k² = −2h/I₃,
    # until c = 1.
    k = np.sqrt(-2 * alpha / I3) / np.sin(theta)
    when = np.arccosh(1 / np.cos(theta)) / k
    with pytest.raises(Unsolved, match="collision") as caught:
        solve(problem, [10.0], "numeric")
    assert np.isclose(float(str(caught.value).split("t = ")[1].split(",")[0]), when, rtol=1e-6)


# --- reduction, time change, geodesics


def coordinates(q: Any) -> Any:
    """A point of the upper half sphere from (q_1, q_2)."""
    return np.array([q[0], q[1], np.sqrt(1 - q[0] ** 2 - q[1] ** 2)])


def tangent(q: Any, v: Any) -> Any:
    return np.array([v[0], v[1], -(q[0] * v[0] + q[1] * v[1]) / np.sqrt(1 - q[0] ** 2 - q[1] ** 2)])


def local_forms(inertia: Any) -> tuple[Any, Any]:
    """L̃(q, q̇) and Ψ̃(q, q̇, ξ) of (red2) in the local coordinates."""

    def L(q: Any, v: Any) -> Any:
        return sphere_geodesics.reduced_lagrangian(inertia, coordinates(q), tangent(q, v))

    def Psi(q: Any, v: Any, xi: Any) -> Any:
        return sphere_geodesics.gyroscopic_form(
            inertia, coordinates(q), tangent(q, v), tangent(q, xi)
        )

    return L, Psi


def local_field(inertia: Any, q: Any, p: Any) -> tuple[Any, Any]:
    """(q̇, ṗ) of (red2) from (q, p): ṗ_k = ∂L̃/∂q_k − ∂Ψ̃/∂ξ_k."""
    (L, Psi), e = local_forms(inertia), np.eye(2)
    # L̃ is quadratic in the velocity
    mass = np.array([[(L(q, a + b) - L(q, a - b)) / 2 for a in e] for b in e])
    v = np.linalg.solve(mass, p)
    slope = np.array([derivative(lambda x: L(x, v), q, a) for a in e])
    return v, slope - np.array([Psi(q, v, a) for a in e])


def test_the_reduced_equation_in_local_coordinates_is_the_veselova_system(
    rng: np.random.Generator,
) -> None:
    problem = draw(rng)
    I, gamma = problem.inertia, np.abs(problem.gamma)
    Omega = problem.Omega - (problem.Omega @ gamma) * gamma
    moved = VeselovaSO3(I, gamma, Omega, normalize=True)
    q, v = gamma[:2], np.cross(gamma, Omega)[:2]
    (L, _), e = local_forms(I), np.eye(2)

    def momenta(q: Any, v: Any) -> Any:
        return np.array([derivative(lambda w: L(q, w), v, a) for a in e])

    p, step = momenta(q, v), 1e-4
    q_dot, p_dot = local_field(I, q, p)
    near = solve(moved, [-step, step])
    ps = [momenta(g[:2], np.cross(g, W)[:2]) for g, W in zip(near.gamma, near.Omega)]
    assert np.allclose(q_dot, v, rtol=1e-11)
    assert np.allclose(p_dot, (ps[1] - ps[0]) / (2 * step), rtol=1e-6, atol=1e-7)


def test_the_reduced_system_has_the_multiplier_as_density(rng: np.random.Generator) -> None:
    I = np.diag([1.0, 1.7, 2.6])
    x, step = np.concatenate([rng.uniform(0.2, 0.6, 2), rng.normal(size=2)]), 1e-4

    def divergence(power: float) -> float:
        def weighted(y: Any) -> Any:
            density = (
                sphere_geodesics.chaplygin_multiplier(np.linalg.inv(I), coordinates(y[:2])) ** power
            )
            return density * np.concatenate(local_field(I, y[:2], y[2:]))

        slopes = [(weighted(x + step * e) - weighted(x - step * e)) / (2 * step) for e in np.eye(4)]
        return float(sum(slope[i] for i, slope in enumerate(slopes)))

    assert abs(divergence(1.0)) < 1e-6
    assert abs(divergence(0.0)) > 1e-3


@pytest.mark.parametrize("potential", POTENTIALS)
def test_in_time_tau_the_reduced_system_is_hamiltonian(
    potential: str, rng: np.random.Generator
) -> None:
    """Item 2 of the theorem on the multiplier: with m = 𝒩·(projected 𝓘Ω) and dτ = 𝒩dt, Hamilton's
    equations of H* + V.
    """
    problem = draw(rng, VeselovaSO3, potential)
    I, inverse, V = problem.inertia, problem.inverse, problem.potential.terms
    step = 1e-4
    near = solve(problem, [-step, 0.0, step])
    q = near.gamma
    rate = sphere_geodesics.chaplygin_multiplier(inverse, q)[:, None]
    q_prime = np.cross(q, near.Omega) / rate
    m = sphere_geodesics.geodesic_momentum(I, inverse, q, q_prime)
    expected = sphere_geodesics.geodesic_field(inverse, q[1], m[1], V)
    assert np.allclose(q_prime[1], expected[0], rtol=1e-12, atol=1e-13)
    assert np.allclose((m[2] - m[0]) / (2 * step * rate[1]), expected[1], rtol=1e-6, atol=1e-6)
    energy = sphere_geodesics.geodesic_hamiltonian(inverse, q, m) + V.value(q)
    assert np.allclose(energy, near.integrals["energy"], rtol=1e-12)
    lagrangian = sphere_geodesics.rescaled_lagrangian(I, inverse, q, q_prime)
    assert np.allclose(lagrangian, energy - V.value(q), rtol=1e-12)
    F2 = sphere_geodesics.geodesic_integral(I, inverse, q, q_prime)
    assert np.allclose(F2, np.sum(near.momentum**2, axis=1) / 2, rtol=1e-12)


def geodesic_residual(metric: Any, q: Any, v: Any, a: Any) -> Any:
    """The Euler–Lagrange expression of ½(G(q)v,v) for given acceleration, projected on the tangent
    plane.
    """
    slope = np.array([derivative(lambda x: v @ metric(x) @ v / 2, q, e) for e in np.eye(3)])
    rate = metric(q) @ a + derivative(metric, q, v) @ v
    residual = rate - slope
    return residual - (residual @ q) * q


def test_the_geodesic_flow_on_the_sphere_keeps_its_two_integrals(rng: np.random.Generator) -> None:
    from scipy.integrate import solve_ivp

    I = np.diag([1.0, 1.7, 2.6])
    inverse = np.linalg.inv(I)
    q, q_prime = np.array([0.6, 0.48, 0.64]), np.cross([0.6, 0.48, 0.64], rng.normal(size=3))
    m = sphere_geodesics.geodesic_momentum(I, inverse, q, q_prime)

    def field(_: float, y: Any) -> Any:
        return np.concatenate(sphere_geodesics.geodesic_field(inverse, y[:3], y[3:]))

    answer = solve_ivp(
        field,
        (0, 30),
        np.concatenate([q, m]),
        method="DOP853",
        rtol=1e-13,
        atol=1e-14,
        max_step=0.5,
    )
    qs, ms = answer.y[:3].T, answer.y[3:].T
    velocities = sphere_geodesics.geodesic_field(inverse, qs, ms)[0]
    energy = sphere_geodesics.rescaled_lagrangian(I, inverse, qs, velocities)
    F2 = sphere_geodesics.geodesic_integral(I, inverse, qs, velocities)
    metric = sphere_geodesics.geodesic_metric(I, inverse, qs)
    assert np.ptp(energy) < 1e-11 * energy[0]
    assert np.ptp(F2) < 1e-11 * F2[0]
    assert np.allclose(
        energy, np.einsum("ti,tij,tj->t", velocities, metric, velocities) / 2, rtol=1e-12
    )
    for k in (0, -1):
        y, rate = answer.y[:, k], field(0.0, answer.y[:, k])
        acceleration = (field(0.0, y + 1e-6 * rate) - field(0.0, y - 1e-6 * rate))[:3] / 2e-6
        residual = geodesic_residual(
            lambda x: sphere_geodesics.geodesic_metric(I, inverse, x), y[:3], rate[:3], acceleration
        )
        assert np.max(np.abs(residual)) < 1e-8


# --- Euler–Poisson equations and duality


def test_the_euler_case_is_a_geodesic_flow(rng: np.random.Generator) -> None:
    """On (𝒥Ω,γ) = 0 with 𝒱 = 0 γ(t) is a geodesic of ds²_{J,P}, of energy f_1."""
    problem = draw(rng, EulerPoisson)
    J, inverse, step = problem.inertia, problem.inverse, 1e-4
    near = solve(problem, [-step, 0.0, step, 40.0])
    velocity = np.cross(near.gamma, near.Omega)
    metric = sphere_geodesics.euler_metric(J, inverse, near.gamma)
    assert np.allclose(
        np.einsum("ti,tij,tj->t", velocity, metric, velocity) / 2,
        near.integrals["energy"],
        rtol=1e-12,
    )
    acceleration = (velocity[2] - velocity[0]) / (2 * step)
    residual = geodesic_residual(
        lambda x: sphere_geodesics.euler_metric(J, inverse, x),
        near.gamma[1],
        velocity[1],
        acceleration,
    )
    assert np.max(np.abs(residual)) < 1e-6


def completed_by_hand(rng: np.random.Generator) -> VeselovaSO3:
    """V = 2γ_1² + 3γ_2² + γ_3² as a plain polynomial with its companion."""
    moments, gamma = np.array([2.0, 3.0, 1.0]), np.array([0.6, 0.48, 0.64])
    squares = (2 * np.eye(3, dtype=int)).tolist()
    parts = {
        "polynomial": [{"coefficient": m, "powers": p} for m, p in zip(moments, squares)],
        "companion": [
            {"coefficient": -np.prod(moments) / m, "powers": p} for m, p in zip(moments, squares)
        ],
    }
    return VeselovaSO3(moments, gamma, np.cross(gamma, rng.normal(size=3)), parts)


@pytest.mark.parametrize("name", ["none", "clebsch", slow("family"), "by hand"])
def test_the_dual_system_is_integrable_with_the_potentials_exchanged(
    name: str, rng: np.random.Generator
) -> None:
    problem = completed_by_hand(rng) if name == "by hand" else draw(rng, VeselovaSO3, name)
    partner = dual(problem)
    assert isinstance(partner, EulerPoisson)
    assert np.allclose(partner.inertia, problem.inverse, rtol=1e-15)
    assert np.allclose(
        np.cross(partner.gamma, partner.Omega), np.cross(problem.gamma, problem.Omega), atol=1e-14
    )
    assert partner.linear == 0
    points = rng.uniform(0.3, 1, (5, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    assert problem.potential.companion is not None
    assert partner.potential.companion is not None
    assert np.allclose(
        partner.potential.terms.value(points), problem.potential.companion.value(points), rtol=1e-12
    )
    assert np.allclose(
        partner.potential.companion.value(points), problem.potential.terms.value(points), rtol=1e-12
    )
    for system, extra in ((problem, "F2"), (partner, "f2")):
        trajectory = solve(system, np.linspace(0, 20, 9))
        assert extra in trajectory.integrals
        assert relative_drift(system, trajectory) < DRIFT
    again = dual(partner)
    assert isinstance(again, VeselovaSO3)
    assert np.allclose(again.Omega, problem.Omega, atol=1e-13)
    assert np.allclose(again.inertia, problem.inertia, rtol=1e-15)
    assert np.allclose(
        again.potential.terms.value(points), problem.potential.terms.value(points), rtol=1e-12
    )


def test_of_the_euler_poisson_integrals_those_are_named_that_are_kept(
    rng: np.random.Generator,
) -> None:
    common = ["gamma_norm", "i2", "energy"]
    cases = [
        ("none", False, ["f2", "space_momentum"]),
        ("clebsch", False, ["f2"]),
        ("family", True, ["f2"]),
    ]
    for potential, on_constraint, more in [*cases, ("family", False, []), ("polynomial", True, [])]:
        problem = draw(rng, EulerPoisson, potential, on_constraint=on_constraint)
        assert list(problem.integrals(problem.start)) == common + more
