"""LR systems: input, the two formulations against the paper and each other, integrals, closed
forms, and every door.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

from conftest import slow
from deviations import agree
from lr_draws import GROUPS, RANKS, group_named, random_lr, random_lr_on, random_potential
from refusals import GOOD, monomial
from veselova import LRSystem, Unsolved, Veselova, solve
from veselova.mechanics.core.flow import FLOATS

pytestmark = pytest.mark.daily(3)

#: What issue 4 asks of every system over t = 100, by the default method, and by Taylor's.
DRIFT, TAYLOR_DRIFT = 1e-12, 2e-14

HUNDRED = np.linspace(0, 100, 41)


@pytest.mark.parametrize("name", GROUPS)
def test_both_fields_are_the_euler_poincare_equations(name: str, rng: np.random.Generator) -> None:
    """(EPS): 𝓘ω̇ − [𝓘ω,ω] + y(v) lies in g⁻¹𝔥g and ω̇ keeps the constraints; for any 𝔥, constants
    and potential.
    """
    group = group_named(name)
    for constraints in (group.dimension // 3, 2 * group.dimension // 3):
        system = random_lr_on(
            rng, group, constraints, random_potential(rng, group.size, group.size)
        )
        flow, other, distribution, inertia = (
            system.flow(),
            system.flow("multipliers"),
            system.distribution,
            system.inertia,
        )
        # ω̇ of the momentum formulation: a complex step along its field.
        step = flow.initial + 1e-30j * flow.field(flow.initial, flow.parameters, FLOATS)
        g, along = step[: group.size**2].reshape(group.size, -1), step[group.size**2 :]
        operator = flow.inertia.inverse if distribution.uses_inverse else flow.inertia.operator
        rate = (
            distribution.velocity(operator, *distribution.in_body(g), along, flow.across).imag
            / 1e-30
            / flow.time_unit**2
        )
        field = other.field(other.initial, other.parameters, FLOATS) / flow.time_unit**2
        assert np.allclose(rate, field[: group.dimension], rtol=1e-11, atol=1e-11)
        assert system.potential is not None
        force = inertia(rate) - group.bracket(inertia(system.omega), system.omega)
        force = force + numerical_gradient(system)
        W, F = distribution.in_body(system.g)
        assert np.allclose(W @ force, 0, atol=1e-6)
        assert np.allclose(F @ rate, 0, atol=1e-10)
        assert np.allclose(system.derive("multipliers", system.start)[0], F @ force, atol=1e-6)


def numerical_gradient(system: LRSystem) -> Any:
    """The derivatives y_a(v) of v along the left-invariant fields, by differences."""
    group, v = system.distribution.group, system.potential
    assert v is not None
    turns = [expm(1e-6 * Y) for Y in group.basis]
    changes = [float(v.value(system.g @ turn) - v.value(system.g @ turn.T)) for turn in turns]
    return np.array(changes) / 2e-6


@pytest.mark.parametrize(("n", "rank"), RANKS)
def test_the_momentum_equation_and_its_projections_hold_on_so_n(
    n: int, rank: int, rng: np.random.Generator
) -> None:
    """(mom_eq), (1.4), (mom_eq1), (4.1c)–(4.2a): 𝓜̇ = [𝓜,ω], Γ̇ = [Γ,ω], 𝓜 = ω + (𝓘ω−ω)Γ + Γ(𝓘ω−ω)
    − Γ(𝓘ω−ω)Γ.
    """
    system = random_lr(rng, n, rank, homogeneous=False)
    group, distribution, inertia = system.distribution.group, system.distribution, system.inertia
    flow = system.flow("multipliers")
    step = flow.initial + 1e-30j * flow.field(flow.initial, flow.parameters, FLOATS)

    def at(state: Any) -> dict[str, Any]:
        omega, g = state[: group.dimension] / flow.time_unit, state[group.dimension :].reshape(n, n)
        X, momentum = group.element(omega), group.element(inertia(omega))
        Gamma = g[:rank].T @ g[:rank]
        excess = momentum - X
        M = X + excess @ Gamma + Gamma @ excess - Gamma @ excess @ Gamma
        along = Gamma @ momentum + momentum @ Gamma - Gamma @ momentum @ Gamma
        return {
            "M": M,
            "Gamma": Gamma,
            "along": along,
            "across": X - (Gamma @ X + X @ Gamma - Gamma @ X @ Gamma),
            "omega": X,
        }

    here, rate = at(flow.initial), at(step)
    assert np.allclose(here["M"], system.derive("momentum", system.start)[0], atol=1e-13)
    for name in ("M", "Gamma", "along", "across"):
        bracket = here[name] @ here["omega"] - here["omega"] @ here[name]
        assert np.allclose(rate[name].imag / 1e-30 / flow.time_unit, bracket, atol=1e-11), name
    W, _ = distribution.in_body(system.g)
    expected = system.omega + ((inertia(system.omega) - system.omega) @ W.T) @ W
    assert np.allclose(group.coordinates(here["M"]), expected, atol=1e-13)
    again = distribution.momentum(inertia, system.g, system.omega)
    assert np.allclose(again, expected, atol=1e-13)


@pytest.mark.parametrize(("n", "rank"), [(n, r) for n, r in RANKS if r < n - 1])
def test_the_distribution_is_where_omega_wedge_e_1_to_e_r_vanishes(
    n: int, rank: int, rng: np.random.Generator
) -> None:
    """(D): of the components of ω∧e_1∧…∧e_r only (n−r)(n−r−1)/2 are independent, and they vanish on
    𝒟_r.
    """
    system = random_lr(rng, n, rank)
    group, X = system.distribution.group, system.g[:rank].T

    def wedge(omega: Any) -> Any:
        """ω contracted with the complement of e_1 … e_r: equivalent to ω∧e_1∧…∧e_r."""
        return (np.eye(n) - X @ X.T) @ omega @ (np.eye(n) - X @ X.T)

    columns = np.array([wedge(Y).ravel() for Y in group.basis])
    assert np.linalg.matrix_rank(columns, tol=1e-10) == (n - rank) * (n - rank - 1) // 2
    assert np.allclose(wedge(group.element(system.omega)), 0, atol=1e-14)
    assert np.allclose(wedge(system.derive("momentum", system.start)[0]), 0, atol=1e-13)
    energy = np.sum(system.derive("momentum", system.start)[0] * group.element(system.omega)) / 4
    # ½⟨𝓜,ω⟩ = ½⟨𝓘ω,ω⟩ on D
    assert np.isclose(energy, system.inertia(system.omega) @ system.omega / 2)


@pytest.mark.parametrize(
    ("n", "rank", "homogeneous"), [(3, 1, True), (4, 2, False), slow(5, 1, True), slow(6, 3, False)]
)
def test_two_formulations_and_two_methods_agree_and_keep_every_integral(
    n: int, rank: int, homogeneous: bool, rng: np.random.Generator
) -> None:
    system = random_lr(rng, n, rank, homogeneous=homogeneous, special=n == 5)
    default = solve(system, HUNDRED)
    assert default.provenance.details["formulation"] == "momentum"
    energy = "energy" if homogeneous else "jacobi_integral"
    assert set(default.integrals) == {energy, "constraint", "momentum", "traces", "group"}
    assert max(default.drift.values()) < DRIFT
    assert np.max(np.abs(np.swapaxes(default.frame, 1, 2) @ default.frame - np.eye(n))) < 1e-14
    other = solve(system, HUNDRED, method="taylor", formulation="multipliers")
    assert max(other.drift.values()) < TAYLOR_DRIFT
    difference = np.max(np.abs(default.frame - other.frame), axis=(1, 2))
    assert np.all(difference <= default.error + other.error)
    assert np.all(difference <= np.maximum(1e-9, default.error))
    assert np.max(np.abs(default.omega - other.omega)) <= 10 * np.max(default.error + other.error)
    if homogeneous:
        assert np.max(np.abs(default.integrals["constraint"])) < 1e-14


@pytest.mark.parametrize(
    ("name", "constraints"),
    [("su-2", 1), ("su-3", 3), ("so3xsu2", 2), ("irreducible", 2), ("g2", 1)],
)
def test_systems_on_other_groups_agree_and_stay_on_the_group(
    name: str, constraints: int, rng: np.random.Generator
) -> None:
    system = random_lr_on(rng, group_named(name), constraints)
    times = np.linspace(-5, 5, 5)
    default, other = solve(system, times), solve(system, times, formulation="multipliers")
    assert max(default.drift.values()) < DRIFT
    assert np.max(default.integrals["group"]) < 1e-14
    agree(default, other, "frame")


@pytest.mark.parametrize(("n", "rank", "rows"), [(3, 1, 1), (4, 2, 2)])
def test_a_potential_of_the_frame_adds_its_energy_and_takes_the_momentum(
    n: int, rank: int, rows: int, rng: np.random.Generator
) -> None:
    """v is a function of e_1 … e_r, H-invariant: the Jacobi–Painlevé integral holds with any
    constants of the constraints.
    """
    system = random_lr(rng, n, rank, homogeneous=False, potential=random_potential(rng, n, rows))
    times = np.linspace(0, 10, 6)
    default, other = (
        solve(system, times),
        solve(system, times, method="taylor", formulation="multipliers"),
    )
    assert {system.energy_name, "constraint"} <= set(default.integrals)
    assert "traces" not in default.integrals
    assert max(default.drift.values()) < DRIFT
    assert max(other.drift.values()) < 1e-13
    agree(default, other, "frame")


def test_with_constants_the_kinetic_energy_changes_and_the_jacobi_painleve_integral_does_not(
    rng: np.random.Generator,
) -> None:
    system = random_lr(rng, 4, 1, homogeneous=False)
    trajectory = solve(system, np.linspace(0, 10, 11), method="taylor")
    omega = system.distribution.group.coordinates(trajectory.omega)
    kinetic = np.sum(system.inertia(omega) * omega, axis=-1) / 2
    assert np.ptp(kinetic) > 1e-3
    assert trajectory.drift["jacobi_integral"] < TAYLOR_DRIFT


@pytest.mark.parametrize("formulation", LRSystem.formulations)
@pytest.mark.parametrize("method", ["dop853", "taylor"])
def test_collisions_with_a_singular_potential_are_named(formulation: str, method: str) -> None:
    attracting = LRSystem(**GOOD["lr"], potential=monomial([1, 1, -2], coefficient=-0.1))
    assert np.all(
        np.isfinite(solve(attracting, [1.0], method=method, formulation=formulation).frame)
    )
    with pytest.raises(
        Unsolved, match=r"collision: the motion runs into g_11 = 0 at about t = 1\.059035,"
    ):
        solve(attracting, [0.5, 1.2], method=method, formulation=formulation)
    repelling = LRSystem(**GOOD["lr"], potential=monomial([1, 1, -2], coefficient=0.1))
    trajectory = solve(repelling, [0.0, 3.0], method=method, formulation=formulation)
    assert trajectory.frame[1, 0, 0] > 0
    assert trajectory.drift["jacobi_integral"] < DRIFT


@pytest.mark.parametrize(("n", "rank"), [row if row < (4, 3) else slow(*row) for row in RANKS])
def test_a_body_with_equal_moments_turns_uniformly_in_space(
    n: int, rank: int, rng: np.random.Generator
) -> None:
    """𝓘 = 2: g(t) = exp(Ω t) g(0) with any constants, whatever the constraints: a closed form."""
    draw = random_lr(rng, n, rank, homogeneous=False)
    inertia = {"matrix": 2 * np.eye(n * (n - 1) // 2)}
    omega = draw.distribution.group.element(draw.omega)
    trajectory = solve(LRSystem(n, rank, inertia, draw.g, omega), [-7, 0, 11], method="taylor")
    for t, frame, error in zip(trajectory.times, trajectory.frame, trajectory.error, strict=True):
        assert np.max(np.abs(frame.T - draw.g @ expm(t * omega))) <= error
    # For n = 2 it is 0.9e-12 to 1.3e-12 over seeds: eight times what 32 roundings become.
    assert np.max(trajectory.error) < 1.5e-12


@pytest.mark.parametrize("n", [3, 4, 6])
@pytest.mark.parametrize("method", ["dop853", "taylor"])
def test_rank_one_with_the_special_inertia_is_the_veselova_problem(
    n: int, method: str, rng: np.random.Generator
) -> None:
    A = np.exp(rng.uniform(0, 1, n))
    frame = np.linalg.qr(rng.normal(size=(n, n)))[0]
    q_dot = frame[:, 1:] @ rng.normal(size=n - 1)
    problem = Veselova(A, frame[:, 0], q_dot, frame, normalize=True)
    omega = np.outer(problem.q, problem.q_dot) - np.outer(problem.q_dot, problem.q)
    system = LRSystem(n, 1, {"special": A}, problem.frame.T, omega)
    times = np.linspace(-5, 5, 5)
    found, expected = solve(system, times, method=method), solve(problem, times)
    agree(found, expected, "frame")
    assert np.allclose(found.omega, expected.omega, atol=1e-9 * np.linalg.norm(q_dot))
    assert np.allclose(found.integrals["energy"], problem.energy)


def test_a_body_at_rest_stays_and_a_torque_along_the_constraints_moves_nothing() -> None:
    rest = LRSystem(3, 1, {"special": [3, 2, 1]}, None, np.zeros((3, 3)))
    held = LRSystem(3, 1, {"special": [3, 2, 1]}, None, np.zeros((3, 3)), monomial([2, 3, 1]))
    pushed = LRSystem(3, 1, {"special": [3, 2, 1]}, None, np.zeros((3, 3)), monomial([1, 3, 1]))
    assert [problem.moves for problem in (rest, held, pushed)] == [False, False, True]
    assert np.array_equal(solve(rest, [0, 9]).frame[1], np.eye(3))
    trajectory = solve(pushed, [0, 2])
    assert np.max(np.abs(trajectory.omega[1])) > 0.1
    assert max(trajectory.drift.values()) < DRIFT


@pytest.mark.parametrize("scale", [1e-25, 1e-9, 1e9, 1e25])
def test_motions_do_not_depend_on_the_units(scale: float, rng: np.random.Generator) -> None:
    system = random_lr(rng, 4, 2, homogeneous=False)
    omega, matrix = (
        system.distribution.group.element(system.omega),
        np.array(system.given["inertia"]["matrix"]),
    )
    scaled = LRSystem(4, 2, {"matrix": matrix / scale}, system.g, scale * omega)
    one, other = solve(system, [0, 3.0]), solve(scaled, [0, 3.0 / scale])
    assert np.allclose(one.frame, other.frame, atol=1e-11)
    assert np.max(list(other.drift.values())) < DRIFT


def test_omega_off_the_constraints_is_an_inhomogeneous_system_unless_it_must_not_be(
    rng: np.random.Generator,
) -> None:
    system = random_lr(rng, 4, 1, homogeneous=False)
    spatial = system.g @ system.distribution.group.element(system.omega) @ system.g.T
    assert np.allclose(system.constraint, [spatial[1, 2], spatial[1, 3], spatial[2, 3]])
    near = random_lr(rng, 4, 1)
    assert not np.any(near.constraint)
    noise = 1e-12 * np.triu(rng.normal(size=(4, 4)), 1)
    omega = near.distribution.group.element(near.omega) + noise - noise.T
    given = (4, 1, near.given["inertia"], near.g, omega)
    assert 0 < np.max(np.abs(LRSystem(*given).constraint)) < 1e-11
    assert not np.any(LRSystem(*given, homogeneous=True).constraint)
