"""What functions refuse: one table of calls, each with the field and words of its message."""

from __future__ import annotations

import io
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import veselova as vs
from refusals import require_sentence
from veselova import InvalidInput, MatrixGroup, curves, theta
from veselova.geodesics import Ellipsoid
from veselova.mechanics.core.exact_input import exact_number

Row = tuple[str, str, Callable[[], Any]]


def changed(function: Callable[..., Any], good: dict[str, Any], *rows: Any) -> list[Row]:
    """Return calls with changes to good arguments, from field, words and changes."""
    function(**good)
    return [
        (field, words, lambda changes=changes: function(**{**good, **changes}))
        for field, words, changes in rows
    ]


def given(field: str, words: str, function: Callable[..., Any], *values: Any) -> list[Row]:
    """Return calls with one argument, which are refused alike."""
    return [(field, words, lambda value=value: function(value)) for value in values]


Q, V = np.array([[0.6, 0.48, 0.64]]), np.array([[0.8, -0.36, -0.48]])
BODY = vs.Veselova([3, 2, 1], Q[0], V[0])
MOTION = vs.solve(BODY, [0, 1])
LINE = vs.EllipsoidGeodesic.from_angles("WGS84", 1, 2, 3)
NAN = float("nan")


def solve(times: Any = (0, 1), *arguments: Any, **options: Any) -> Any:
    return vs.solve(BODY, times, *arguments, **options)


def masked(*numbers: float) -> Any:
    return np.ma.array(numbers, mask=[1] + [0] * (len(numbers) - 1))


TIMES: list[Row] = [
    row
    for engine in ("analytic", "numeric")
    for row in (
        *given("times", "", lambda x, e=engine: solve(x, e), [], NAN, "0,1", None, np.ma.masked),
        *given("times[0]", "", lambda x, e=engine: solve(x, e), [NAN], ["a"], [True], [[0, 1]]),
        ("times[1]", "", lambda e=engine: solve([0, float("inf")], e)),
        ("times.stop", "", lambda e=engine: solve({"start": 0}, e)),
    )
]

NAMES: list[Row] = [
    ("engine", "", lambda: solve([0], "other")),
    ("method", "", lambda: solve([0], "analytic", "taylor")),
    ("method", "", lambda: solve([0], "numeric", "theta")),
    ("problem", "", lambda: vs.solve([3, 2, 1], [0, 1])),  # type: ignore[arg-type]
    *given("x", "", lambda x: exact_number(x, ("x",)), "", "0x10", "١", "nan", "1//2", "--1"),
    *given("x", "", lambda x: exact_number(x, ("x",)), "9" * 3000),
]
NAMES += changed(
    solve,
    {},
    *(("digits", "", {"digits": digits}) for digits in (14, 1001, True, 20.0)),
    ("digits", "", {"digits": 20, "engine": "numeric"}),
    ("certified", "", {"certified": 1}),
    ("certified", "", {"certified": True, "engine": "numeric"}),
    ("method", "", {"certified": True, "method": "theta"}),
    ("method", "", {"digits": 20, "method": "products"}),
)
for wrong in (np.zeros((2, 3)), ["q"]):
    NAMES += given("engine", "", lambda x: solve([0], x), wrong)
    NAMES += given("formulation", "", lambda x: solve([0], "numeric", formulation=x), wrong)
    NAMES += given("method", "", lambda x: vs.compare(BODY, [0], x), wrong)
    NAMES += given("digits", "", lambda x: solve([0], digits=(x, x)), wrong)
    NAMES += given("coordinates", "", lambda x: LINE.geographic(None, x), wrong)
    NAMES += given("scalar_first", "", lambda x: MOTION.quaternions(scalar_first=x), wrong)
    NAMES += given("outputs[0]", "", lambda x: MOTION.to_csv(io.BytesIO(), [x]), wrong)
for wrong in (None, 3, io.StringIO("{"), Q):
    NAMES += given("source", "", vs.Trajectory.from_npz, wrong)
    NAMES += given("document", "", vs.ClosedForm.from_json, wrong)
    for write in (MOTION.to_csv, MOTION.to_npz, MOTION.to_parquet, MOTION.to_arrow):
        NAMES += given("target", "", write, wrong)


def many(**changes: Any) -> vs.Ensemble:
    return vs.solve_many({"A": [3, 2, 1], "q": Q, "q_dot": V, **changes}, [0.0])


#: Numbers that would be changed.
NUMBERS: list[Row] = [
    ("A", "", lambda: many(A=masked(3.0, 2, 1))),
    ("q_dot", "", lambda: many(q_dot=np.ma.array(V, mask=[[0, 0, 1]]))),
    ("A", "", lambda: many(A=np.array([3 + 1j, 2, 1]))),
    ("q", "", lambda: many(q=Q.astype(np.longdouble) / 3)),
    ("A", "", lambda: vs.FlowMap(masked(3.0, 2, 1))),
    ("A[0]", "", lambda: vs.FlowMap([True, 2, 3])),
    ("A", "", lambda: vs.from_torus([], 0.7, [0.7], [0.1, 0.2], [1, 1, 1])),
    ("ellipsoid[0]", "", lambda: vs.EllipsoidGeodesic.from_angles([1e200, 1, 1], 1, 1, 1)),
    ("y", "", lambda: BODY.rhs(0, "x")),
    ("z[0]", "", lambda: theta.riemann_theta(masked(0.1, 0.2), 1j * np.eye(2))),
    ("indent", "", lambda: vs.closed_form(BODY).to_json(np.nan)),  # type: ignore[arg-type]
    ("basis", "", lambda: MatrixGroup(np.array(3))),
    ("most_bytes", "", lambda: vs.solve_many([BODY], [0], most_bytes=np.ones(2))),  # type: ignore[arg-type]
]

ROWS, TURNS = [[0.6, 0.0, 0.8], [0.8, 0.0, 0.6]], [[0.8, 1.0, -0.6], [0.1, 0.2, 0.3]]
BALL = {"mass": 1.5, "radius": [0.5, 0.7], "gamma": ROWS, "Omega": TURNS}
FOUR = {"A": [3, 2, 1], "q": np.ones((4, 3)), "q_dot": np.ones((3, 3))}
NONE = {"A": [3, 2, 1], "q": np.ones((0, 3)), "q_dot": np.ones((0, 3))}
SPACE = {"inertia": [3, 4, 5], "gamma": ROWS}

ENSEMBLES: list[Row] = [
    (field, words, lambda x=x: vs.solve_many(x, [1.0]))
    for field, words, x in (
        ("problems", "one problem at least", []),
        ("problems[0]", "a problem", [3]),
        ("q_dot", "shape (3, 3)", FOUR),
        ("q", "one row at least", NONE),
        ("problems.Omega", "this field", SPACE),
        ("gamma", "an array", {**SPACE, "gamma": ROWS[0], "Omega": TURNS[0]}),
        ("problems.A", "no", {**SPACE, "Omega": TURNS, "A": 1}),
        ("problems.system", "", {"system": "lr", **BALL}),
    )
]

TORI = changed(
    vs.from_torus,
    {"A": [3, 2, 1], "energy": 1, "constants": ["0.6"], "phases": [0.1, 0.2], "signs": [1, 1, -1]},
    ("A[1]", "", {"A": [3, 3, 1]}),
    ("energy", "", {"energy": 0}),
    ("constants[0]", "", {"constants": [2]}),
    ("constants[0]", "", {"constants": ["1/2"]}),
    ("phases[1]", "", {"phases": [0.1, NAN]}),
    ("signs[2]", "", {"signs": [1, 1, 0]}),
)

SPHERES = changed(
    vs.RubberBall,
    {
        "inertia": [0.4, 0.6, 0.9],
        "mass": 1,
        "radius": 0.7,
        "gamma": [0.6, 0, 0.8],
        "Omega": [0.8, 1, -0.6],
    },
    ("side", "", {"sphere": 1, "side": "below"}),
    ("side", "", {"side": "inside"}),
    ("sphere", "", {"sphere": 0, "side": "inside"}),
    ("radius", "", {"sphere": 0.5, "side": "inside"}),
    ("radius", "", {"sphere": 2, "side": "around"}),
    ("radius", "", {"sphere": 0.7, "side": "around"}),
    ("position", "", {"sphere": 1, "position": [1, 0]}),
    ("Omega", "", {"sphere": 1, "Omega": [0.6, 0, 0.8]}),
)

J = [[0, 1], [-1, 0]]
SO3 = MatrixGroup.so(3)
X = SO3.basis[0]
GROUPS: list[Row] = [
    *given("basis", "a list of square matrices", MatrixGroup, [], 3),
    *given("basis[0]", "|X + Xᵀ| up to 2", MatrixGroup, [np.eye(2)], [[[0, 1j], [-1j, 0]]]),
    *given("basis[0]", "given zero", MatrixGroup, [np.zeros((2, 2))]),
    *given("basis[1]", "one within", MatrixGroup, [J, [[0, 2], [-2, 0]]]),
    *given("basis", "leaves their span by 1", MatrixGroup, list(SO3.basis[:2])),
    *given("basis[1]", "2 rows", MatrixGroup, [J, np.zeros((3, 3))]),
    *given("basis[0]", "a square matrix", MatrixGroup, [[[0, 1], [-1, 0], [0, 0]]]),
    *given("basis[0][0][1]", "finite", MatrixGroup, [[[0, NAN], [1, 0]]]),
    *given("basis[0][0][1]", "finite", MatrixGroup, [[[0, complex(0, float("inf"))], [1, 0]]]),
    *given("basis[0]", "a finite real number", MatrixGroup, ["ab"]),
    ("group", "", lambda: vs.LRSystem.on("SO(3)", np.eye(3), [], None, X)),  # type: ignore[arg-type]
    ("inertia", "", lambda: vs.LRSystem.on(SO3, np.diag([1, 1, 0]), [], None, X)),
    ("h", "", lambda: vs.LRSystem.on(SO3, np.eye(3), 3, None, X)),
    ("h[1]", "", lambda: vs.LRSystem.on(SO3, np.eye(3), [X, 2 * X], None, X)),
    ("h[0]", "", lambda: vs.LRSystem.on(SO3, np.eye(3), [np.eye(3)], None, X)),
    ("omega", "", lambda: vs.LRSystem.on(SO3, np.eye(3), [], None, None)),
    (
        "omega",
        "Lie algebra to 1e-9 of its largest entry",
        lambda: vs.LRSystem.on(MatrixGroup.su(2), np.eye(3), [], None, 1j * np.eye(2)),
    ),
]

Hyperelliptic = curves.RealHyperelliptic
CURVE = Hyperelliptic([0, 1, 2, 3, 4])
FINE = Hyperelliptic([0, 1, 2, 3, 4], digits=20)
CURVES: list[Row] = [
    *given("branch_points[2]", "distinct numbers", Hyperelliptic, [0, 1, 1, 2, 3]),
    *given("branch_points[1]", "distinct numbers", Hyperelliptic, ["0.5", "1/2", 1]),
    *given("branch_points", "3 to 34", Hyperelliptic, [0, 1], "012", list(range(60))),
    *given("branch_points[1]", "a finite real number", Hyperelliptic, [0, 1j, 2], [0, NAN, 2]),
    *given("branch_points[0]", "a finite real number", Hyperelliptic, np.array([0, 1j, 2])),
    *given("branch_points", "1e-100", Hyperelliptic, [0, 1e-200, 1]),
    ("digits", "", lambda: Hyperelliptic([0, 1, 2], digits=30.5)),  # type: ignore[arg-type]
    ("sign", "", lambda: Hyperelliptic([0, 1, 2], 0)),
    ("z", "", lambda: CURVE.invert([0.5])),
    ("z[1]", "", lambda: CURVE.invert([0.5, float("inf")])),
    ("w", "", lambda: CURVE.abel([1.5, 2], [1])),
    ("points[0]", "", lambda: CURVE.abel([NAN], [1])),
    ("points[0][0]", "", lambda: CURVE.torus([0.5, 3.5], [1, 1])),
    ("points", "", lambda: CURVE.torus([1.5], [1])),
    ("points", "", lambda: CURVE.torus([[1.5, 3.5], [1.5]], [[1, 1], [1, 1]])),
    ("points", "", lambda: CURVE.torus([[1.5, 3.5], 2], [1, 1])),
    ("z", "", lambda: FINE.invert_decimals([0.5])),
    ("z[0]", "", lambda: FINE.invert_decimals(["x", 0.5])),
    ("z[1]", "", lambda: FINE.invert([[0.5, 0.5], [0.5]])),
    ("z", "", lambda: FINE.invert("ab")),
    ("w", "", lambda: FINE.abel_decimals([1.5, 2], [1])),
    ("outputs[0]", "", lambda: FINE.data(outputs=["zeta"])),
]

THETA: list[Row] = [
    (field, "", lambda arguments=arguments: theta.riemann_theta(*arguments))
    for field, arguments in (
        ("z", ([1, 2], [[1j]])),
        ("z[0]", ([NAN], [[1j]])),
        ("tau", ([1, 1], [[1j, 1], [0, 1j]])),
        ("tau", ([1] * 9, np.eye(9) * 1j)),
        ("characteristic", ([1], [[1j]], [0])),
        ("characteristic[0][0]", ([1], [[1j]], [["x"], [0]])),
        ("derivatives", ([1], [[1j]], None, True)),
        ("derivatives", ([1], [[1j]], None, 3)),
        ("tau", ([0], [[-1j]])),
    )
]

HAUMEA, KARNEY, PLAIN = Ellipsoid("Haumea"), Ellipsoid(("1.5", 1, "0.5")), Ellipsoid((3, 2, 1))
INFINITE = float("inf")
GEODESICS: list[Row] = [
    ("ellipsoid", "", lambda: Ellipsoid("Pluto")),
    ("ellipsoid", "", lambda: Ellipsoid((1, 2))),
    ("ellipsoid[1]", "", lambda: Ellipsoid((1, -2, 3))),
    ("P", "", lambda: HAUMEA.inverse([91, 0], [0, 0])),
    ("P[1]", "", lambda: HAUMEA.inverse([[0, 0], [99, 1]], [0, 0])),
    ("Q", "", lambda: HAUMEA.inverse([0, 0], [1, 2, 3])),
    ("Q", "", lambda: HAUMEA.inverse([0, 0], [0, NAN])),
    ("Q", "", lambda: HAUMEA.inverse([0, 0], [0, INFINITE])),
    ("Q", "", lambda: HAUMEA.inverse(np.zeros((2, 2)), np.zeros((3, 2)))),
    ("P", "", lambda: HAUMEA.inverse([9, 0, 0], [0, 0, 9], "cartesian")),
    ("coordinates", "", lambda: HAUMEA.inverse([0, 0], [0, 1], "polar")),
    ("azi1", "", lambda: HAUMEA.direct([0, 0], "north", 1)),
    ("s12", "", lambda: HAUMEA.direct([0, 0], 0, INFINITE)),
    ("points", "", lambda: HAUMEA.polygon([[0, 0], [1, 1]])),
    ("s", "", lambda: HAUMEA.inverse([0, 0], [1, 1]).at([[1.0]])),
    ("normalize", "required true", lambda: HAUMEA.inverse([0, 0], [0, 1], normalize=1)),
    ("normalize", "", lambda: HAUMEA.cartesian([0, 0], normalize="yes")),
    ("P", "text only where digits > 15", lambda: HAUMEA.inverse(["1", 2], [0, 0])),
    ("P", "", lambda: PLAIN.inverse([0, 0, 0], [0, 2, 0], "cartesian", normalize=True)),
    ("azi1", "", lambda: PLAIN.direct([10, 20], [0, 1, 2], [1, 2])),
    ("count", "", lambda: PLAIN.geodesics_between([10, 20], [-35, 160], 101)),
    ("digits", "", lambda: KARNEY.inverse([0, 0], [0, 1], digits=14)),
    ("digits", "", lambda: KARNEY.inverse([0, 0], [0, 1], digits=1001)),
    ("digits", "", lambda: KARNEY.direct([0, 0], 0, 1, digits=251)),
    ("certified", "", lambda: KARNEY.inverse([0, 0], [0, 1], certified="yes")),
    ("Q", "given [91, 1]", lambda: KARNEY.inverse([0, 0], ["91", 1], digits=20)),
    ("P", "text only where digits > 15", lambda: KARNEY.inverse(["1", 2], [0, 0])),
    ("normalize", "true or false", lambda: KARNEY.cartesian([0, 0], normalize=1)),  # type: ignore[arg-type]
    ("Q[0][1]", "", lambda: KARNEY.inverse([0, 0], [[0, NAN]], digits=20)),
    ("normalize", "", lambda: KARNEY.inverse([0, 0], [0, 1], digits=20, normalize=True)),
    ("azi1", "", lambda: KARNEY.direct([0, 0], "north", 1, digits=20)),
    ("count", "", lambda: KARNEY.geodesics_between([0, 0], [0, 1], 0)),
    ("P", "", lambda: KARNEY.geodesics_between([[0, 0]], [0, 1], 2)),
]

from_angles = vs.EllipsoidGeodesic.from_angles
MISORDERED = vs.EllipsoidGeodesic([1, 2, 3], [1, 1, 1], [1, -1, 0.2], normalize=True)
RESONANCE = vs.torus(BODY).resonance
OTHERS: list[Row] = [
    ("ellipsoid", "did you mean WGS84", lambda: from_angles("WGS48", 0, 0, 0)),
    ("ellipsoid", "a name, or three semiaxes", lambda: from_angles((1, 2, 3), 0, 0, 0)),
    ("ellipsoid", "", lambda: from_angles((3, 2), 0, 0, 0)),
    ("latitude", "from −90 to 90", lambda: from_angles("WGS84", 91, 0, 0)),
    ("latitude", "", lambda: from_angles("WGS84", "north", 0, np.nan)),
    (
        "coordinates",
        "one of geodetic, ellipsoidal",
        lambda: from_angles("WGS84", 0, 0, 0, coordinates="geocentric"),
    ),
    ("A", "three numbers that do not increase", MISORDERED.geographic),
    ("y", "an array of 13 numbers", lambda: BODY.rhs(0.0, np.zeros(3))),
    ("states", "an array (N, 13)", lambda: BODY.series_of(np.zeros((13, 4)))),
    ("formulation", "one of reduced", lambda: BODY.rhs(0.0, BODY.initial_state(), "redced")),
    ("max_order", "", lambda: RESONANCE(max_order=0)),
    ("max_order", "at most 999 for 2 frequencies; given 2000", lambda: RESONANCE(max_order=2000)),
    ("tolerance", "between 0 and 0.1; given 0", lambda: RESONANCE(tolerance=0)),
    ("tolerance", "", lambda: RESONANCE(tolerance="x")),  # type: ignore[arg-type]
]

TABLES = (TIMES, NAMES, NUMBERS, ENSEMBLES, TORI, SPHERES, GROUPS, CURVES, THETA, GEODESICS, OTHERS)


@pytest.mark.parametrize(("field", "words", "call"), [row for table in TABLES for row in table])
def test_a_call_is_refused_by_its_field(field: str, words: str, call: Callable[[], Any]) -> None:
    with pytest.raises((InvalidInput, vs.InvalidRequest)) as raised:
        call()
    fault = raised.value.faults[0]
    assert fault.field == field
    require_sentence(str(fault), field, words)


def test_digits_that_are_none_choose_no_engine() -> None:
    at: Any = {"sphere": 1, "side": "outside", "normalize": True}
    ball = vs.RubberBall([1, 1.4, 2], 1, 0.7, [0.6, 0, 0.8], [0.3, 1, 0.5], **at)
    with pytest.raises(vs.InvalidInput, match=r"^digits"):
        vs.solve(ball, [0], method="dop853", digits=5, certified=True)
    with pytest.raises(vs.InvalidRequest, match=r"^digits.* certified: required true or false"):
        vs.solve(ball, [0], digits=5, certified=at)
