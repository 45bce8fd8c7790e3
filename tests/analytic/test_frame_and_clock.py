"""The closed frame on the torus, and the two clocks."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
import pytest

from draws import adversarial_start, near_unstable_circle, random_problem
from generic_torus import GenericTorus, fastest
from problems import near_separatrix, tagged
from veselova import Veselova, solve
from veselova.analytic.numerics.monotone_root import increasing_root
from veselova.analytic.solve import solve as solve_analytic
from veselova.analytic.time_map.fourier import FourierTimeMap
from veselova.analytic.time_map.linear_flow import LinearFlow
from veselova.analytic.time_map.modes import ColumnsForModes, find_significant_modes
from veselova.analytic.time_map.panels import ChebyshevTimeMap
from veselova.mechanics.core.errors import InternalContradiction, Unsolved

DIMENSIONS = range(2, 9)


@pytest.mark.parametrize("n", DIMENSIONS)
def test_the_closed_frame_is_orthonormal_everywhere_on_the_torus(
    n: int, rng: np.random.Generator
) -> None:
    solution = GenericTorus(random_problem(rng, n))
    at = solution.attitude(rng.uniform(-2, 2, (100, n - 1)))
    frame = np.concatenate([at.q[:, :, None], at.normals], axis=2)
    assert np.max(np.abs(np.swapaxes(frame, 1, 2) @ frame - np.eye(n))) < 1e-13


@pytest.mark.parametrize("n", DIMENSIONS)
def test_the_last_bits_of_a_natural_frame_change_no_number_of_a_motion(
    n: int, rng: np.random.Generator
) -> None:
    drawn, times = random_problem(rng, n), [0, 0.5, 7]
    problem = Veselova(drawn.A, drawn.q, drawn.q_dot, normalize=True)
    natural = solve(problem, times)  # before the last bits are asked for
    given = solve(Veselova(drawn.A, drawn.q, drawn.q_dot, problem.frame, normalize=True), times)
    assert np.max(np.abs(natural.frame[0] - problem.frame)) <= natural.error[0]
    assert np.all(
        np.abs(natural.frame - given.frame) <= (natural.error + given.error)[:, None, None]
    )


@pytest.mark.parametrize("n", DIMENSIONS)
def test_the_normals_are_eigenvectors_of_mosers_matrix(n: int, rng: np.random.Generator) -> None:
    solution = GenericTorus(random_problem(rng, n, 10.0))
    at = solution.attitude(rng.uniform(0, 1, (10, n - 1)))
    inverse = np.array([float(x) for x in solution.spectrum.inverse])
    constants = [
        float(c) for c in [*solution.spectrum.constants[1:], solution.spectrum.constants[0]]
    ]
    for q, v, normals in zip(at.q, at.q_prime, at.normals, strict=True):
        projector = np.eye(n) - np.outer(q, q)
        matrix = projector @ (np.diag(inverse) - np.outer(v, v)) @ projector
        assert np.allclose(matrix @ normals, normals * constants, atol=1e-12 * inverse[-1])
        assert abs(q @ v) < 1e-13 * np.linalg.norm(v)


@pytest.mark.parametrize("n", DIMENSIONS)
def test_the_frame_turns_with_the_body_along_the_flow(n: int, rng: np.random.Generator) -> None:
    """dE/dτ₁ = −(q∧q')E for the natural frame, by a difference along z⁰ + fτ₁."""
    solution = GenericTorus(random_problem(rng, n, 5.0))
    step, f = 1e-5, solution.in_tau1.rates
    z = rng.uniform(0, 1, (5, n - 1))

    def frames(z: Any) -> Any:
        at = solution.attitude(z)
        return np.concatenate([at.q[:, :, None], at.normals], axis=2)

    rate = (frames(z + step * f) - frames(z - step * f)) / (2 * step)
    at = solution.attitude(z)
    omega = at.q[:, :, None] * at.q_prime[:, None, :]
    omega = omega - np.swapaxes(omega, 1, 2)
    assert np.max(np.abs(rate + omega @ frames(z))) < 1e-7 * np.max(np.abs(omega))


@pytest.mark.parametrize("n", [3, 4])
def test_normals_change_sign_analytically_with_their_cycles(
    n: int, rng: np.random.Generator
) -> None:
    solution = GenericTorus(random_problem(rng, n))
    z = rng.uniform(0, 1, (5, n - 1))
    before = solution.attitude(z)
    for s in range(n - 1):
        after = solution.attitude(z + np.eye(n - 1)[s])
        signs = after.q / before.q
        assert np.allclose(np.abs(signs), 1, atol=1e-9)
        ends = [solution.curve.origins[i] for i in (2 * s + 1, 2 * s + 2)]
        flipped = {end.index for end in ends if end.kind == "I"}
        assert all((signs[:, i] < 0).all() == (i in flipped) for i in range(n))


@pytest.mark.parametrize("n", range(2, 6))
def test_both_clocks_tell_the_same_time(n: int, rng: np.random.Generator) -> None:
    for _ in range(3):
        solution = GenericTorus(random_problem(rng, n))
        times = np.sort(rng.uniform(-80, 80, 30))
        fourier, panels = (solution.time_map(times, name) for name in ("fourier", "panels"))
        (tau_fourier, z_fourier), (tau_panels, z_panels) = fourier.tau1(times), panels.tau1(times)
        scale = np.max(np.abs(tau_panels))
        assert np.allclose(tau_fourier, tau_panels, atol=4e-14 * scale)
        assert np.allclose(np.mod(z_fourier - z_panels + 1, 2), 1, atol=1e-12)
        assert isinstance(fourier, FourierTimeMap)
        assert isinstance(panels, ChebyshevTimeMap)
        passed = time_of(fourier, solution, tau_fourier), panels.panels.at(tau_panels)
        assert np.allclose(passed, times, atol=1e-13 * scale)


def time_of(clock: FourierTimeMap, solution: GenericTorus, tau1: Any) -> Any:
    """Return t at Neumann times by the modes of a time map."""
    sums = clock._sums
    return clock._mean * tau1 + sums._at(solution.in_tau1.phases(tau1))[0] - sums._at_start


@pytest.mark.parametrize("n", [2, 3, 4])
def test_the_fourier_series_is_the_rate_of_the_clock(n: int, rng: np.random.Generator) -> None:
    """Σ F_m e^{2πi m·z} against dt/dτ₁ = √((q,Aq)/2h det A) at random points: every determinant at
    once.
    """
    solution = GenericTorus(random_problem(rng, n))
    clock = solution.time_map(np.array([1.0]), "fourier")
    assert isinstance(clock, FourierTimeMap)
    z = rng.uniform(-1, 1, (40, n - 1))
    series = clock._mean + clock._sums._at(z)[1]
    q = solution.attitude(z).q
    A = np.array([float(a) for a in solution.moving.A])
    start = np.array([float(x) for x in solution.spectrum.q]) ** 2 @ A
    expected = np.sqrt(np.sum(A * q * q, axis=1) / start) / float(solution.spectrum.time_rate)
    assert np.allclose(series, expected, rtol=1e-12)
    assert np.allclose(solution.rate.at(solution.inversion.invert(z)), expected, rtol=1e-13)


def test_the_mean_rate_is_an_average_over_the_orbit() -> None:
    solution = GenericTorus(tagged("generic")[1].problem())
    tau1 = np.linspace(-2e4, 2e4, 40_001)
    rates = solution.rate.at(solution.inversion.invert(solution.in_tau1.phases(tau1)))
    assert np.isclose(np.mean(rates), solution.mean_rate, rtol=1e-4)


@pytest.mark.parametrize("gap", [1e-3, 1e-5])
def test_clocks_work_where_a_gap_nearly_closes(gap: float) -> None:
    solution = GenericTorus(near_separatrix(gap).problem())
    times = np.linspace(-30, 30, 41)
    tau_fourier, tau_panels = (
        solution.time_map(times, name).tau1(times)[0] for name in ("fourier", "panels")
    )
    assert np.allclose(tau_fourier, tau_panels, atol=1e-12)


def test_panels_stretch_to_the_wanted_times() -> None:
    solution = GenericTorus(tagged("generic")[3].problem())
    clock, times = solution.time_map([-0.5, 33.0], "panels"), np.array([-0.5, 0.0, 33.0])
    assert isinstance(clock, ChebyshevTimeMap)
    assert np.allclose(clock.panels.at(clock.tau1(times)[0]), times, atol=1e-13)


def test_phases_far_out_are_reduced_without_losing_digits() -> None:
    with mpmath.workdps(60):
        rates = np.sqrt(2) / 3, np.pi / 7
        flow = LinearFlow(np.array([0.25, 0.5]), np.array(rates))
        for x in (1e3, 1e9 + 0.125, 1.5e15, -7e12):
            found = flow.phases(np.array([x]))[0]
            for rate, start, phase in zip(rates, flow.start, found, strict=True):
                exact = mpmath.mpf(x) * rate + start
                distance = (mpmath.mpf(float(phase)) - exact) / 2
                assert abs(distance - mpmath.nint(distance)) < 4e-16 * (1 + abs(x) * 1e-16)


def test_inversion_of_an_increasing_function_needs_no_good_guess() -> None:
    def steep(x: Any, _: Any) -> Any:
        return np.tanh(50 * (x - 0.3)) + 0.01 * (x - 0.3), 50 / np.cosh(50 * (x - 0.3)) ** 2 + 0.01

    roots = increasing_root(
        steep, np.array([-4.0, 0.31, 4.0]), np.full(3, -5.0), np.full(3, 5.0), 1e-9
    )
    assert np.allclose(roots, 0.3, atol=1e-15)
    flat = increasing_root(
        lambda x, _: (x, np.where(np.abs(x) > 0.5, -1.0, 1.0)),
        np.full(1, 0.9),
        -np.ones(1),
        np.ones(1),
        1e-9,
    )
    assert flat == 0  # a slope that is wrong, or none, is not followed
    with pytest.raises(InternalContradiction):
        increasing_root(
            lambda x, _: (x * np.nan, x * np.nan), np.zeros(1), -np.ones(1), np.ones(1), 1e-9
        )


def test_settled_roots_are_left_alone() -> None:
    """Of a thousand entries that one step settles and one that takes several, the thousand are not
    looked at again.
    """
    exponents, looked_at = np.append(np.ones(1000), 9.0), []

    def power(x: Any, rows: Any) -> Any:
        looked_at.append(x.size)
        k = exponents[rows]
        return x**k - 0.5, k * x ** (k - 1)

    roots = increasing_root(power, np.ones(1001), np.zeros(1001), np.full(1001, 2.0), 1e-8)
    assert np.allclose(roots, 0.5 ** (1 / exponents), rtol=0, atol=1e-15)
    assert looked_at[:2] == [1001, 1001]
    assert set(looked_at[2:]) == {1}


def test_a_bracket_settles_what_no_step_does() -> None:
    """Without a slope at the zero, at a jump, and where values are rough."""
    one = np.ones(1)
    assert increasing_root(lambda x, _: (x**3, 3 * x * x), np.zeros(1), -one, one, 1e-9) == 0
    jump = increasing_root(lambda x, _: (np.sign(x - 0.3), 0 * x), np.zeros(1), -one, one, 1e-9)
    assert abs(jump[0] - 0.3) <= 1e-9

    def values(x: Any, _: Any) -> Any:
        return x - 0.3 + 1e-6 * np.sign(np.sin(1e9 * x)), 0 * x + 1

    assert abs(increasing_root(values, -one, -one, one, 1e-8)[0] - 0.3) <= 2e-6


@pytest.mark.parametrize("spread", [5.0, 100.0])
@pytest.mark.parametrize("n", [2, 3, 4])
def test_the_inverse_clock_leaves_rounding(n: int, spread: float) -> None:
    """t(τ₁(t)) = t to rounding wherever the last step was allowed to end."""
    rng = np.random.default_rng(8)
    for _ in range(12):
        solution = GenericTorus(random_problem(rng, n, spread))
        clock = solution.time_map(np.array([1.0]), "fourier")
        assert isinstance(clock, FourierTimeMap)
        times = np.sort(rng.uniform(-20, 20, 40))
        together, _ = clock.tau1(times)
        off = time_of(clock, solution, together) - times
        assert np.max(np.abs(off)) < 40 * np.finfo(float).eps * (1 + np.max(np.abs(times)))
        for time, tau1 in zip(times[:20], together, strict=False):
            alone, _ = clock.tau1(np.array([time]))
            assert abs(alone[0] - tau1) < 40 * np.finfo(float).eps * (1 + abs(tau1))


@pytest.mark.slow
def test_errors_of_the_clock_count_by_the_rate_where_they_fall() -> None:
    """A's over seven orders: dt/dτ₁ is thirty times smaller at one of the times than its mean, and
    τ₁ as much less certain.
    """
    name, problem = adversarial_start(np.random.default_rng([510, 275]), 4)
    assert name == "wide A's"
    times = np.array([-10, -3, 0.1, 1, 4, 10]) * 0.3 / np.max(np.abs(problem.q_dot))
    found = solve_analytic(problem, times, time_map="panels")
    finer = solve(problem, times, digits=25)
    error = np.max(np.abs(found.frame - finer.frame), axis=(1, 2))
    assert np.all(error <= found.error)
    assert np.max(found.error) < 1e-11


@pytest.mark.parametrize(
    ("A", "q", "q_dot"),
    [
        (
            ["250/513", "500/373", "50850250/375909129"],
            ["1/250942", "-451/1000", "114/125"],
            ["-461/1000", "36/125", "-189/200"],
        ),
        (
            [14147.070577173487, 34.19169315663742, 29.082953358331732],
            [-0.842449710659526, 0.10501640977494625, 0.5284411402300748],
            [0.4135965941419627, 0.7546201635355326, 0.509397944734541],
        ),
    ],
)
def test_modes_that_are_met_again_are_not_taken_again(
    A: list[object], q: list[object], q_dot: list[object]
) -> None:
    """Next to the edge of the set a mode may be found large, or not, by the rounding of the nodes
    at hand.
    """
    problem = Veselova(A, q, q_dot, normalize=True)
    times = np.array([0.3, 1.0, 5.0]) / fastest(problem)
    fourier, panels = (
        solve_analytic(problem, times, time_map=clock) for clock in ("fourier", "panels")
    )
    difference = np.max(np.abs(fourier.frame - panels.frame), axis=(1, 2))
    assert np.all(difference <= fourier.error + panels.error)


@pytest.mark.parametrize("gap", [1e-4, 3e-6, 1e-7, 2e-9])
@pytest.mark.parametrize("n", [3, 4, 5])
def test_modes_of_nearly_coinciding_phases_are_found(
    n: int, gap: float, rng: np.random.Generator
) -> None:
    """With all A's nearly equal the modes with Σm = 1 count, as far as slow differences reach, and
    neither Σm = 0 nor 2 does.
    """
    A = 1.7 * (1 + gap * np.cumsum(rng.uniform(0.5, 2, n)))
    solution = GenericTorus(Veselova(A, rng.normal(size=n), rng.normal(size=n), normalize=True))
    clocks = [solution.time_map(np.array([0.0, 30.0]), name) for name in ("fourier", "panels")]
    fourier, panels = (clock.tau1(np.linspace(0, 30, 50))[0] for clock in clocks)
    assert np.max(np.abs(fourier - panels)) < 1e-13


def test_no_mode_is_looked_at_twice() -> None:
    """One that does not count is met again round a wall, in a batch in which it would."""
    looked_at: list[tuple[int, ...]] = []
    wall = {(2, 1), (2, -1), (2, 2), (2, -2)}

    def coefficients(modes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        rows = list(map(tuple, modes.tolist()))
        large = [
            max(map(abs, m)) <= 6 and m not in wall and (m != (2, 0) or m in looked_at)
            for m in rows
        ]
        looked_at.extend(rows)
        return np.ones(len(rows)), np.array(large)

    modes, _, _ = find_significant_modes(2, coefficients, most=2000)
    assert len(set(looked_at)) == len(looked_at)
    assert len(set(map(tuple, modes.tolist()))) == len(modes) == (13 * 13 - 1) // 2 - 5


NEAR_A_SEPARATRIX = [
    ("3.735e-9", "3.758e-11"),
    ("2.029e-11", "2.01e-10"),
    ("1.352e-10", "3.89e-13"),
    ("9.861674590037209e-11", "5.331159891578705e-13"),
]


@pytest.mark.parametrize(("q_2", "q_dot_2"), NEAR_A_SEPARATRIX)
def test_next_to_a_separatrix_panels_serve_where_modes_do_not(q_2: str, q_dot_2: str) -> None:
    problem = near_unstable_circle(q_2, q_dot_2)
    found, finer = solve(problem, [2000.0]), solve(problem, [2000.0], digits=20, budget_s=600)
    assert found.provenance.details["time_map"] == "panels"
    assert np.max(np.abs(found.frame - finer.frame)) <= found.error[0] < 1e-9
    with pytest.raises(Unsolved, match="too-far"):
        solve(problem, [1e6])


def test_nodes_follow_modes_where_forms_are_steep() -> None:
    """Next to a separatrix e^{−2πi m·G} turns far faster than the entries of m say, and too few
    nodes take it for a slow wave.
    """
    rate = GenericTorus(near_unstable_circle(*NEAR_A_SEPARATRIX[-1])).rate
    columns = ColumnsForModes(rate, lambda weights, G, _: (weights, G))
    for modes in (np.array([[1, 0]]), np.array([[20, 36], [16, 42], [14, 50], [58, 32], [0, 86]])):
        for (weights, G), (finer, finer_G) in zip(columns(modes), rate.columns(4000), strict=True):
            found, expected = (
                w @ np.cos(2 * np.pi * g @ modes.T) for w, g in ((weights, G), (finer, finer_G))
            )
            assert np.max(np.abs(found - expected)) < 3e-14 * np.max(np.abs(finer).sum(axis=1))
