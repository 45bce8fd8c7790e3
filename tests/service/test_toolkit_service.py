"""Motions as data, curves and theta functions over HTTP, by the clients and the command line."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import jsonschema_rs
import numpy as np
import pytest
from test_http import is_problem, post
from test_openapi import validator

import veselova as vs
from conftest import Server, command_line
from deviations import decimals_of
from hostile import BUDGET_S
from veselova import curves, theta
from veselova.mechanics.results.closed_form_schema import SCHEMA
from veselova.service.api.examples import CURVE, THETA, example_request

#: A body whose motion as data is 4 kB (examples/body3.json has it too).
BODY3_PROBLEM: dict[str, Any] = {
    "system": "veselova",
    "A": ["3", "2", "1.5"],
    "q": ["0.6", "0", "0.8"],
    "q_dot": ["0.3", "1", "-0.225"],
}
BODY3 = vs.Veselova(BODY3_PROBLEM["A"], BODY3_PROBLEM["q"], BODY3_PROBLEM["q_dot"])
MOTION = {"problem": BODY3_PROBLEM, "budget_s": BUDGET_S}
POINTS = [0.25 + 0.5j, "1.2", 2]
SHEETS = [1, -1, 1j]


def pairs(values: Any) -> Any:
    """Return complex numbers of a document."""
    array = np.array(values)
    return array[..., 0] + 1j * array[..., 1]


def same_decimals(one: Any, other: Any) -> None:
    """Assert that two have the same decimals, to the last digit."""
    found, known = decimals_of(one), decimals_of(other)
    for numbers, expected in ((found.midpoints, known.midpoints), (found.radii, known.radii)):
        for name, values in expected.items():
            assert np.array_equal(numbers[name], values), name


def schema_of(server: Server, name: str) -> Any:
    """Return what validates by a schema of the OpenAPI document."""
    return validator(server.get("/openapi.json").json(), name)


def test_a_document_over_http_is_the_one_of_the_library(server: Server) -> None:
    document = post(server, "/v1/closed-forms", MOTION).json()
    assert document == json.loads(vs.closed_form(BODY3).to_json())
    jsonschema_rs.validator_for(SCHEMA).validate(document)
    coarse = post(server, "/v1/closed-forms", {**MOTION, "accuracy": 1e-5}).json()
    assert coarse == json.loads(vs.closed_form(BODY3, 1e-5).to_json())


def test_the_schema_of_documents_is_published(server: Server) -> None:
    schema = schema_of(server, "ClosedForm")
    document = json.loads(vs.closed_form(BODY3).to_json())
    schema.validate(document)
    assert not schema.is_valid({**document, "genus": "2"})
    assert not schema.is_valid({k: v for k, v in document.items() if k != "modes"})


def test_a_curve_over_http_is_the_one_of_the_library(server: Server) -> None:
    found = post(server, "/v1/curves", {**CURVE, "budget_s": BUDGET_S}).json()
    curve = curves.RealHyperelliptic(CURVE["branch_points"])
    assert np.array_equal(found["riemann_matrix"], curve.riemann_matrix.imag)
    assert np.array_equal(found["a_periods"], curve.periods.a)
    assert np.array_equal(found["b_periods"], curve.periods.b.imag)
    assert np.array_equal(found["characteristics"], np.array(curve.characteristics))
    assert np.array_equal(pairs(found["abel"]), curve.abel(["1.2", 2], [1, 1j]))
    bare = post(server, "/v1/curves", {"branch_points": [3, 0, 1], "sign": 1}).json()
    assert bare["genus"] == 1
    assert "abel" not in bare


@pytest.mark.parametrize("derivatives", [0, 1, 2])
def test_theta_functions_over_http_are_those_of_the_library(
    server: Server, derivatives: int
) -> None:
    body = {**THETA, "derivatives": derivatives, "budget_s": BUDGET_S}
    found = post(server, "/v1/theta", body).json()
    tau = [[0.3 + 0.9j, 0.2], [0.2, 1.1j]]
    expected = theta.riemann_theta([[0.1, 0.2j], [0, 0]], tau, THETA["characteristic"], derivatives)
    assert np.allclose(pairs(found["values"]), expected, rtol=1e-15, atol=0)
    assert found["exponent"] == [0, 0]
    assert np.max(found["error"]) < 1e-10


def test_a_curve_to_many_digits_comes_through_every_door(server: Server) -> None:
    points = ["0", "1", "1.7", "3", "4.5"]
    given: dict[str, Any] = {
        "points": ["1.2", 0.25 + 0.5j, 2],
        "w": [1, 1, 1j],
        "z": [["0.3", "1/3"]],
        "outputs": ["quasi_periods"],
    }
    options: dict[str, Any] = {"digits": 30, "certified": True}
    expected = curves.RealHyperelliptic(points, **options).data(**given)
    body = {
        "branch_points": points,
        **given,
        **options,
        "points": ["1.2", [0.25, 0.5], 2],
        "w": [1, 1, [0, 1]],
        "budget_s": BUDGET_S,
    }
    found = post(server, "/v1/curves", body).json()
    assert found == json.loads(json.dumps(expected.as_dict()))
    assert len(found["riemann_matrix"][0][0]) > 30
    assert found["radii"]["abel"][0][0][0].endswith(tuple(f"E-{k}" for k in range(30, 50)))
    schema_of(server, "Curve").validate(found)
    with vs.Client(server.url) as client:
        data = client.curve(points, **given, **options, budget_s=BUDGET_S)
    same_decimals(data, expected)
    assert data.quasi_periods is not None
    assert np.allclose(data.points, expected.points, rtol=1e-14, atol=0)
    assert np.allclose(data.abel, expected.abel, rtol=1e-13, atol=1e-14)


#: A ball that twists, whose document has the digits of doubles.
SPUN = example_request("chaplygin-ball")["problem"]

FAULTS: list[tuple[str, dict[str, Any], list[str], str]] = [
    (
        "curves",
        {"branch_points": [0, 1, 1, 2, 2]},
        ["/branch_points/2", "/branch_points/4"],
        "drop",
    ),
    ("curves", {"branch_points": [0, [1, 2], 2]}, ["/branch_points/1"], "real number"),
    (
        "curves",
        {"branch_points": [0, "x", None], "sign": 2},
        ["/branch_points/1", "/branch_points/2", "/sign"],
        "",
    ),
    ("curves", {**CURVE, "w": None}, ["/w"], "together"),
    ("curves", {}, ["/branch_points"], "this field"),
    ("curves", {**CURVE, "digits": 14, "certified": 1}, ["/digits", "/certified"], ""),
    ("curves", {**CURVE, "z": [[None, 1], [1, "y"]]}, ["/z/0/0", "/z/1/1"], ""),
    ("curves", {**CURVE, "outputs": ["zeta", {}]}, ["/outputs/0", "/outputs/1"], "quasi_periods"),
    ("curves", {**CURVE, "outputs": "quasi_periods"}, ["/outputs"], "list"),
    (
        "theta",
        {**THETA, "tau": [[[0, 1], [0, 1.5]], [[0, 1.5], [0, 1]]]},
        ["/tau"],
        "least eigenvalue -0.5",
    ),
    ("theta", {**THETA, "z": [[1, "x"], [None, 1]]}, ["/z/0/1", "/z/1/0"], ""),
    ("theta", {**THETA, "z": [1, 2]}, ["/z"], "list of points"),
    ("theta", {**THETA, "T": [[1]]}, ["/tau"], "not both"),
    ("theta", {"z": [[0]], "T": [[-1]]}, ["/T"], "least eigenvalue -1"),
    (
        "theta",
        {"z": [["x"]], "tau": [["y"]], "characteristic": [["u"], [0]], "derivatives": True},
        ["/tau/0/0", "/z/0/0", "/characteristic/0/0", "/derivatives"],
        "",
    ),
    ("closed-forms", {**MOTION, "accuracy": 1}, ["/accuracy"], "1e-15"),
    ("closed-forms", {"problem": SPUN, "digits": 20}, ["/digits"], ""),
    (
        "closed-forms",
        {
            "problem": {
                "system": "lr",
                "n": 3,
                "rank": 1,
                "inertia": {"special": [3, 2, 1]},
                "omega": [[0, 1, 0], [-1, 0, 0], [0, 0, 0]],
            }
        },
        ["/problem"],
        "torus",
    ),
    ("closed-forms", {**MOTION, "times": [0]}, ["/times"], "no field of this name"),
]


@pytest.mark.parametrize(("path", "body", "pointers", "words"), FAULTS)
def test_faults_come_back_by_their_places(
    server: Server, path: str, body: Any, pointers: list[str], words: str
) -> None:
    document = is_problem(post(server, f"/v1/{path}", body), 422, "invalid-input")
    assert [error["pointer"] for error in document["errors"]] == pointers
    assert words in document["detail"]


@pytest.mark.parametrize(
    ("path", "body", "outcome"),
    [
        ("theta", {"z": [[[0, 1e300]]], "tau": [[[0, 1]]]}, "beyond-floats"),
        ("theta", {"z": [[0]], "tau": [[[0, 1e-300]]]}, "beyond-floats"),
        ("closed-forms", {"problem": {**BODY3_PROBLEM, "q_dot": [0, 0, 0]}}, "at-rest"),
        ("closed-forms", {"problem": {**BODY3_PROBLEM, "q": [1, 0, 0], "q_dot": [0, 1, 0]}}, None),
    ],
)
def test_what_cannot_be_served_is_named(
    server: Server, path: str, body: Any, outcome: str | None
) -> None:
    answer = post(server, f"/v1/{path}", body)
    if outcome is None:
        assert answer.status_code == 200
    else:
        assert is_problem(answer, 422, "unsolved")["outcome"] == outcome


def test_more_numbers_than_an_answer_has_are_refused_before_the_work(server: Server) -> None:
    genus = 8
    body = {
        "z": [[0] * genus] * 5000,
        "T": np.eye(genus).tolist(),
        "characteristic": [[[0] * genus] * 2] * 100,
        "derivatives": 2,
    }
    document = is_problem(post(server, "/v1/theta", body), 422, "invalid-input")
    assert document["errors"][0]["pointer"] == "/z"
    assert "16000000" in document["detail"]


def test_work_ends_with_its_budget(server: Server) -> None:
    body = {"z": [[0.1] * 6] * 5000, "T": (0.05 * np.eye(6) + 0.05).tolist(), "budget_s": 0.05}
    is_problem(post(server, "/v1/theta", body), 504, "over-budget")


def test_the_systems_page_says_which_have_documents(server: Server) -> None:
    page = server.get("/v1/systems").json()
    served = {item["system"] for item in page["systems"] if item["closed_form"]}
    assert served >= {"veselova", "neumann", "ellipsoid-geodesic", "veselova-so3", "rubber-ball"}
    assert "chaplygin-ball" in served
    assert not served & {"lr", "stiefel", "euler-poisson", "separable"}


def test_the_clients_give_what_the_library_gives(server: Server) -> None:
    curve = curves.RealHyperelliptic(CURVE["branch_points"], 1)
    with vs.Client(server.url) as client:
        motion = client.closed_form(BODY3, budget_s=BUDGET_S)
        data = client.curve(CURVE["branch_points"], sign=1, points=POINTS, w=SHEETS)
        single = client.theta([0.1, 0.2j], curve.riemann_matrix)
        several = client.theta([[0.1, 0.2j]], curve.riemann_matrix, [[[0.5, 0], [0, 0]]], 1)
        with pytest.raises(vs.InvalidInput, match="least eigenvalue"):
            client.theta([0], [[-1j]])
    assert isinstance(motion, vs.ClosedForm)
    assert motion.to_json() == vs.closed_form(BODY3).to_json()
    expected = curve.data(POINTS, SHEETS)
    for name, value in vars(expected).items():
        assert np.array_equal(getattr(data, name), value), name
    tau = curve.riemann_matrix
    assert np.allclose(single.values, theta.riemann_theta([0.1, 0.2j], tau), rtol=1e-14, atol=0)
    assert single.values.shape == ()
    gradients = theta.riemann_theta([[0.1, 0.2j]], tau, [[[0.5, 0], [0, 0]]], 1)
    assert several.values.shape == (1, 1, 2)
    assert np.allclose(several.values, gradients, rtol=1e-13, atol=1e-14)


def test_the_command_line_gives_the_document(tmp_path: Path) -> None:
    body = {"problem": BODY3_PROBLEM, "times": [0, 1]}  # the file of a motion serves as well

    def run(*options: Any) -> Any:
        return command_line("closed-form", "-", *options, stdin=body)

    document = json.loads(run().stdout)
    assert document == json.loads(vs.closed_form(BODY3).to_json())
    file = tmp_path / "motion.json"
    assert "ClosedForm(veselova, genus 2" in run("--output", file).stdout
    assert vs.ClosedForm.from_json(file.read_text()).document == document
    for name in ("x.csv", tmp_path / "no" / "x.json"):
        refused = run("--output", name)
        assert refused.returncode
        assert "--output" in refused.stderr


# Geodesics

HAUMEA = vs.geodesics.Ellipsoid("Haumea")
PAIRS: dict[str, Any] = {"P": [10, 20], "Q": [[-35, 160], [0, 0], [-10, -160]]}


def same(line: Any, document: Any) -> None:
    """Assert that a document, or other geodesics, has the fields of geodesics to the last bit."""
    for name, value in vars(line).items():
        if name not in ("ellipsoid", "coordinates", "decimals"):
            found = document[name] if isinstance(document, dict) else getattr(document, name)
            assert np.array_equal(np.array(found, dtype=float), np.array(value, dtype=float), True)


def by_http_and_client(server: Server, body: Any, **more: Any) -> tuple[Any, Any]:
    """Return the document of geodesics, and the geodesics of the client."""
    found = post(server, "/v1/geodesics", {**body, **more}).json()
    schema_of(server, "Geodesics").validate(found)
    with vs.Client(server.url) as client:
        return found, client.geodesics(**body)


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        (PAIRS, HAUMEA.inverse(**PAIRS)),
        ({"P": [10, 20], "Q": [-35, 160]}, HAUMEA.inverse([10, 20], [-35, 160])),
        (
            {"P": [[10, 20], [None, 0]], "Q": [1, 2], "coordinates": "ellipsoidal"},
            HAUMEA.inverse([[10, 20], [np.nan, 0]], [1, 2], "ellipsoidal"),
        ),
        (
            {"P": [10, 20], "azi1": [[0], [30]], "s12": [1e5, -2e6], "normalize": True},
            HAUMEA.direct([10, 20], [[0], [30]], [1e5, -2e6]),
        ),
    ],
)
def test_geodesics_over_http_are_those_of_the_library(
    server: Server, body: Any, expected: Any
) -> None:
    body = {"ellipsoid": "Haumea", **body, "budget_s": BUDGET_S}
    found, line = by_http_and_client(server, body, at=[0, 1e5])
    assert found["ellipsoid"] == [1161000, 852000, 513000]
    same(expected, found)
    assert np.array_equal(np.array(found["points"], float), expected.at([0, 1e5]), equal_nan=True)
    same(expected, line)
    assert np.array_equal(line.at([0, 1e5]), expected.at([0, 1e5]), equal_nan=True)
    printed = command_line("geodesic", "-", "--json", stdin=body)
    same(expected, json.loads(printed.stdout))


def test_a_polygon_comes_through_every_door(server: Server) -> None:
    corners = [[0, 0], [0, 90], [90, 0]]
    expected = HAUMEA.polygon(corners)
    body = {"ellipsoid": ["1161000", 852000, 513000], "points": corners}
    found = post(server, "/v1/geodesics", body).json()
    assert found == vars(expected)
    with vs.Client(server.url) as client:
        assert client.geodesics(**body) == expected
    printed = command_line("geodesic", "-", stdin=body).stdout
    assert printed.splitlines()[0] == f"area: {expected.area:.12g}"


BODY = ["1.5", 1, "1/2"]
MANY: dict[str, Any] = {"P": ["10", "20"], "Q": [["-35", "160"], ["1/3", 2]], "digits": 40}
UMBILIC: dict[str, Any] = {"P": [90, 0], "Q": [10, 20], "coordinates": "ellipsoidal"}


@pytest.mark.daily(4)
@pytest.mark.parametrize(
    ("method", "body"),
    [
        ("inverse", MANY),
        ("inverse", {"P": ["10", 20], "Q": ["-35", "160"], "digits": 30, "certified": True}),
        ("inverse", {**UMBILIC, "digits": 16}),
        ("direct", {"P": [10, "20"], "azi1": "0.1", "s12": [["0.3"], [-1]], "digits": 20}),
        ("geodesics_between", {"P": [10, 20], "Q": [-35, 160], "count": 4}),
    ],
)
def test_digits_and_counts_of_geodesics_come_through_every_door(
    server: Server, method: str, body: Any
) -> None:
    expected = getattr(vs.geodesics.Ellipsoid(BODY), method)(**body)
    body = {"ellipsoid": BODY, **body, "budget_s": BUDGET_S}
    found, line = by_http_and_client(server, body)
    printed = command_line("geodesic", "-", "--json", stdin=body)
    assert json.loads(printed.stdout) == found
    same(expected, line)
    if expected.decimals is None:
        assert (line.decimals, "radii" in found) == (None, False)
        return
    same_decimals(line, expected)
    assert repr(line.decimals) == repr(expected.decimals)
    assert line.decimals.midpoints.keys() == expected.decimals.midpoints.keys()
    for document, known in (
        (found, expected.decimals.midpoints),
        (found["radii"], expected.decimals.radii),
    ):
        for name, values in known.items():
            assert document[name] == np.vectorize(str, otypes=[object])(values).tolist()


@pytest.mark.parametrize(
    ("pointer", "body"),
    [
        ("/normalize", {**MANY, "normalize": True}),
        ("/digits", {"P": [1, 2], "azi1": 3, "s12": 4, "digits": 251}),
        ("/P", {"P": [[1, 2]], "Q": [3, 4], "count": 2}),
        ("/Q", {"P": [1, 2], "Q": [3, 4], "azi1": 3, "s12": 4}),
        ("/digits", {"P": [1, 2], "Q": [3, 4], "count": 2, "digits": 20}),
    ],
)
def test_what_geodesics_in_python_refuse_a_worker_refuses(
    server: Server, pointer: str, body: Any
) -> None:
    body = {"ellipsoid": BODY, **body}
    document = is_problem(post(server, "/v1/geodesics", body), 422, "invalid-input")
    assert [fault["pointer"] for fault in document["errors"]] == [pointer]
    printed = command_line("geodesic", "-", stdin=body).stderr
    assert printed == f"veselova: {document['detail']}\n"


def test_geodesics_in_digits_end_with_their_budget(server: Server) -> None:
    body = {"ellipsoid": BODY, **MANY, "Q": [[1, k] for k in range(90)], "budget_s": 0.5}
    is_problem(post(server, "/v1/geodesics", body), 504, "over-budget")


def test_more_pairs_than_an_answer_has_are_refused(server: Server) -> None:
    body = {"ellipsoid": "Mars", "P": [[[0, 0]]] * 1000, "Q": [[1, 1]] * 1000}
    fault = is_problem(post(server, "/v1/geodesics", body), 422, "invalid-input")["errors"][0]
    assert (fault["pointer"], "16000000" in fault["detail"]) == ("/P", True)
