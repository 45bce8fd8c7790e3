"""The closed form of the Veselova system on T SO(3) without potential: the default, exact data,
many digits, tori, every door.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest

import veselova as vs
from conftest import Server, slow
from deviations import apart, decimals_of, enclosed
from veselova import InvalidInput, Unsolved, VeselovaSO3

#: A body stated in decimals, and the same in doubles.
TEXTS = (["1", "2", "3"], ["0.6", "0", "0.8"], ["0.8", "1", "-0.6"])
DOUBLES = ([1, 2, 3], [0.6, 0, 0.8], [0.8, 1, -0.6])
DOCUMENT = {"system": "veselova-so3", "inertia": TEXTS[0], "gamma": TEXTS[1], "Omega": TEXTS[2]}

#: Nothing to add to it, (3.5) with (Ω,γ) = 0; and what has no closed form.
CLEBSCH = {"clebsch": 0.3}
SERVED: list[dict[str, Any]] = [{}, {"clebsch": 0.3}, {"family": [0.1, 0.2, 0, 0, 0]}]
USERS = {"polynomial": [{"coefficient": 0.1, "powers": [1, 0, 0]}]}


@pytest.mark.parametrize("potential", SERVED)
def test_the_closed_form_is_the_default_where_there_is_one(potential: dict[str, Any]) -> None:
    problem = VeselovaSO3(*DOUBLES, potential or None)
    found = vs.solve(problem, [1.0, 20.0])
    assert (problem.default_engine, found.provenance.engine) == ("analytic", "analytic")
    assert found.provenance.method == "angles"
    assert vs.compare(problem, [1.0, 20.0]).agrees


@pytest.mark.parametrize(
    ("Omega", "potential", "reason"),
    [([0.8, 1, -0.5], CLEBSCH, r"\(Ω,γ\) = 0, here 0.08"), (DOUBLES[2], USERS, "3.5")],
)
def test_where_there_is_none_integration_is_the_default_and_the_reason_has_a_name(
    Omega: Any, potential: Any, reason: str
) -> None:
    problem = VeselovaSO3(DOUBLES[0], DOUBLES[1], Omega, potential)
    assert vs.solve(problem, [1.0]).provenance.engine == problem.default_engine == "numeric"
    for asked in ({"engine": "analytic"}, {"digits": 30}, {"certified": True}):
        refusal = f"not-separable: .*{reason}|(digits|certified): required "
        with pytest.raises((Unsolved, InvalidInput), match=refusal):
            vs.solve(problem, [1.0], **asked)  # type: ignore[arg-type]
    with pytest.raises(Unsolved, match="not-rank-one"):
        vs.torus(problem)


def test_before_a_collision_the_default_answers() -> None:
    attracting = {"family": [0, 0.1, -1, 0, 0]}
    problem = VeselovaSO3([1, 1.7, 2.6], [0.6, 0.48, 0.64], [0.3, -0.7, 0.24375], attracting)
    assert vs.solve(problem, [-0.2, 0.7]).provenance.engine == "numeric"
    with pytest.raises(Unsolved, match=r"collision: .* gamma\[0\] = 0 at about t = "):
        vs.solve(problem, [0.5, 9.0])
    with pytest.raises(Unsolved, match=r"collision: .* integrate numerically"):
        vs.solve(problem, [-0.2, 0.7], "analytic")


def test_the_rank_one_problem_of_texts_is_exact() -> None:
    exact = VeselovaSO3(*TEXTS).rank_one().exact
    assert (1, Fraction(1, 2), Fraction(1, 3)) == exact.A
    assert exact.q == (Fraction(3, 5), 0, Fraction(4, 5))
    assert exact.q_dot == (Fraction(-4, 5), 1, Fraction(3, 5))
    assert exact.frame is None


@pytest.mark.daily(4)
@pytest.mark.parametrize(("certified", "early"), [(False, -70), (True, -2), slow(True, -20)])
def test_every_output_has_the_digits_asked_for_and_radii_that_hold(
    certified: bool, early: int
) -> None:
    problem = VeselovaSO3(
        *TEXTS, frame=[["0.6", "0.8", "0"], ["0", "0", "1"], ["0.8", "-0.6", "0"]]
    )
    times = [str(early), 0.5]
    motion = vs.solve(problem, times, digits=30, certified=certified, budget_s=600)
    few = decimals_of(motion)
    assert float(max(few.error)) < 1e-30
    finer = vs.solve(problem, times, digits=60, certified=certified, budget_s=600)
    enclosed(few, decimals_of(finer), problem.outputs)
    double = vs.solve(problem, [float(early), 0.5])
    for name in problem.outputs:
        assert np.max(np.abs(double.series(name) - few.midpoints[name].astype(float))) < 1e-12
    assert np.all(apart(double, motion, ["frame"]) <= double.error)


def test_decimals_obey_the_equations_that_define_them() -> None:
    """Ω = γ̇×γ, 𝔪 = 𝓘Ω − (𝓘Ω,γ)γ of constant length, and λ of (la), in exact rationals of the
    midpoints.
    """
    problem, to_rational = VeselovaSO3(*TEXTS), np.vectorize(Fraction, otypes=[object])
    decimals = decimals_of(vs.solve(problem, [3.0], digits=50))
    found = {name: to_rational(decimals.midpoints[name])[0] for name in problem.outputs}
    Omega, gamma, moments = found["Omega"], found["gamma"], to_rational([1, 2, 3])
    M = moments * Omega
    small = Fraction(1, 10**49)
    assert abs(Omega @ gamma) < small
    assert np.max(np.abs(M - (M @ gamma) * gamma - found["momentum"])) < small
    force = np.array([M[i - 2] * Omega[i - 1] - M[i - 1] * Omega[i - 2] for i in range(3)])
    normal = gamma / moments
    assert abs(found["multiplier"] * (gamma @ normal) + force @ normal) < small
    assert abs(found["momentum"] @ found["momentum"] - Fraction("6.9584")) < 10 * small


def test_digits_of_a_full_tensor_are_refused_for_its_axes_are_doubles() -> None:
    problem = VeselovaSO3([["1", "0.5", "0"], ["0.5", "1", "0"], ["0", "0", "2"]], *TEXTS[1:])
    for asked, field in (({"digits": 30}, "digits"), ({"certified": True}, "certified")):
        with pytest.raises(InvalidInput, match=f"{field}: required inertia as 3 principal moments"):
            vs.solve(problem, [1.0], **asked)  # type: ignore[arg-type]


def test_its_torus_is_that_of_the_rank_one_problem() -> None:
    problem = VeselovaSO3(*DOUBLES)
    found, expected = vs.torus(problem), vs.torus(problem.rank_one())
    assert np.array_equal(found.frequencies_t, expected.frequencies_t)
    assert np.isclose(found.energy, vs.solve(problem, [0.0]).integrals["energy"][0], rtol=1e-14)


def test_the_doors_of_the_service_answer_in_closed_form(server: Server) -> None:
    ask = {"problem": DOCUMENT, "times": [1.0, 2.0]}
    motion = server.ask("POST", "/v1/trajectories", json=ask).json()
    assert (motion["engine"], motion["provenance"]["method"]) == ("analytic", "angles")
    many = server.ask("POST", "/v1/trajectories", json={**ask, "digits": 30}).json()
    assert set(many["radii"]) == set(VeselovaSO3.outputs)
    assert server.ask("POST", "/v1/comparisons", json=ask).json()["agrees"]
    torus = server.ask("POST", "/v1/tori", json={"problem": DOCUMENT}).json()
    assert torus["frequencies_t"] == vs.torus(VeselovaSO3(*TEXTS)).frequencies_t.tolist()
    off = {**ask, "problem": {**DOCUMENT, "Omega": [0.8, 1, -0.5], "potential": CLEBSCH}}
    assert server.ask("POST", "/v1/trajectories", json=off).json()["engine"] == "numeric"
    refused = server.ask("POST", "/v1/trajectories", json={**off, "engine": "analytic"})
    assert (refused.status_code, "(Ω,γ) = 0" in refused.text) == (422, True)
    assert server.ask("POST", "/v1/tori", json={"problem": off["problem"]}).status_code == 422
