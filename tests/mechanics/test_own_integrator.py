"""Fields of problems under an integrator that is not ours."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from test_files_and_attitude import PROBLEMS, START

import veselova as vs
from veselova import Unsolved

CASES = [(name, form) for name, problem in PROBLEMS.items() for form in problem.formulations]


@pytest.mark.parametrize(("system", "formulation"), CASES)
def test_every_field_gives_the_motion_under_another_integrator(
    system: str, formulation: str
) -> None:
    problem = PROBLEMS[system]
    start = problem.initial_state(formulation)
    options = {"method": "LSODA", "rtol": 1e-11, "atol": 1e-12, "args": (formulation,)}
    found = solve_ivp(problem.rhs, (0, 2), start, t_eval=[0, 1, 2], **options)
    states = problem.series_of(found.y.T, formulation)
    truth = vs.solve(problem, [0, 1, 2])
    assert list(states) == list(problem.outputs)
    for name in problem.outputs:
        scale = 1 + np.max(np.abs(truth[name]))
        assert np.max(np.abs(states[name] - truth[name])) < 1e-8 * scale, name


def test_a_problem_in_other_axes_and_units_keeps_its_own_time() -> None:
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    A = turn @ np.diag([3e6, 2e6, 1e6]) @ turn.T
    problem = vs.Veselova((A + A.T) / 2, turn @ START[0], 1e3 * turn @ START[1], normalize=True)
    found = solve_ivp(
        problem.rhs, (0, 2e-3), problem.initial_state(), method="DOP853", rtol=1e-12, atol=1e-12
    )
    q = problem.series_of(found.y.T)["q"][-1]
    assert np.allclose(q, vs.solve(problem, 2e-3).q[0], atol=1e-9)


def test_a_body_at_rest_has_no_state_to_start_from() -> None:
    with pytest.raises(Unsolved, match="at-rest"):
        vs.Veselova([2, 1], [1, 0], [0, 0]).initial_state()
