"""Problems of every system, and what each refuses: field, changes to the problem, and words of the
message. Each row runs in Python (mechanics/test_refusals.py), the first two of a system at every
other door (service/test_refusals_at_doors.py).
"""

from __future__ import annotations

from typing import Any

_BODY = {"inertia": [1, 2, 3], "gamma": [0, "0.6", "0.8"], "Omega": [1, "0.4", "-0.3"]}

GOOD: dict[str, dict[str, Any]] = {
    "veselova": {"A": [3, 2, 1], "q": ["0.6", 0, "0.8"], "q_dot": ["0.8", 1, "-0.6"]},
    "neumann": {"A": [3, 2, 1], "q": ["0.6", 0, "0.8"], "q_prime": [0, 1, 0]},
    "ellipsoid-geodesic": {"A": [4, 2, 1], "X": [2, 0, 0], "X_dot": [0, 1, 0]},
    "veselova-so3": _BODY,
    "euler-poisson": _BODY,
    "rubber-ball": {
        "inertia": [1, "1.5", 2],
        "mass": 1,
        "radius": 1,
        "gamma": ["0.6", 0, "0.8"],
        "Omega": ["0.8", 1, "-0.6"],
    },
    "chaplygin-ball": {
        "inertia": {"special": [1.6, 1.2, 0.9, 0.5]},
        "mass": 0.3,
        "radius": 0.8,
        "gamma": [1, 0, 0, 0],
        "Omega": [0.1, 0.2, 0.3, 0, 0, 0],
    },
    "separable": {
        "A": [1, 2, 3],
        "q": ["0.6", "0.8", 0],
        "q_dot": [0, 0, 1],
        "potential": {"quartic": 1},
    },
    "lr": {
        "n": 3,
        "rank": 1,
        "inertia": {"special": [3, 2, 1]},
        "omega": [[0, 1, "0.5"], [-1, 0, "0.3"], ["-1/2", "-0.3", 0]],
    },
    "stiefel": {
        "inertia": {"special": [3, 2, 1]},
        "X": [[1, 0], [0, 1], [0, 0]],
        "P": [[0, 1], [-1, 0], ["0.5", 2]],
    },
}

_UNIT = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
_TURNED = [[1, 0, 0], [0, 1, 1e-6], [0, 0, 1]]


def monomial(*powers: Any, coefficient: Any = 1) -> list[dict[str, Any]]:
    return [{"coefficient": coefficient, "powers": list(powers)}]


Row = tuple[str, dict[str, Any], str]


def require_sentence(message: str, field: str, words: str) -> None:
    """Assert that a refusal names its field, what is required and what was given, in one line."""
    assert message.startswith(f"{field}: required ")
    assert "; given " in message
    assert words in message
    assert "\n" not in message


#: Of both systems with an inertia, gamma and Omega in space.
_IN_SPACE: list[Row] = [
    ("inertia[1]", {"inertia": [1, -2, 3]}, "greater than 0"),
    ("Omega", {"Omega": [1, 2]}, "a list of 3 numbers"),
    ("inertia", {"inertia": [1, 2]}, "3 positive principal moments"),
    ("inertia", {"inertia": [[1, 0], [0, 1]]}, "given 2 rows"),
    ("inertia[2]", {"inertia": [1, 2, 1e-310]}, "a size from 1e-30 to 1e30"),
    ("inertia", {"inertia": [[1, 2, 0], [2, 1, 0], [0, 0, 1]]}, "a positive definite matrix"),
    ("inertia[0][1]", {"inertia": [[1, 0.1, 0], [0, 1, 0], [0, 0, 1]]}, "a symmetric matrix"),
    ("inertia[1]", {"inertia": [[1, 0, 0], [0, 1], [0, 0, 1]]}, "a list of 3 numbers"),
    ("gamma", {"gamma": [0, 1.2, 1.6]}, "a vector of unit length"),
    ("gamma", {"gamma": [0, 0, 0], "normalize": True}, "other than zero; given the zero"),
    ("Omega", {"Omega": [1e200, 0, 0]}, "a size from 1e-30 to 1e30"),
    ("frame", {"frame": [[0, 1, 1], [0.6, 0, 0], [0.8, 0, 1]]}, "an orthogonal matrix"),
    ("frame", {"frame": _UNIT}, "first column e_1 equal to gamma"),
    ("potential", {"potential": {}}, "an object"),
    ("potential.gravity", {"potential": {"gravity": 1}}, "no field but"),
    ("potential.family", {"potential": {"family": [1, 2]}}, "a list of 5 numbers"),
    ("potential.polynomial", {"potential": {"polynomial": "x"}}, "a list of 1 to 64 terms"),
    ("potential.polynomial", {"potential": {"polynomial": []}}, "given 0 of them"),
    ("potential.polynomial[0].powers", {"potential": {"polynomial": monomial(1, 0)}}, "3 whole"),
    (
        "potential.polynomial[0].powers[2]",
        {"potential": {"polynomial": monomial(1, 0, 25)}},
        "a whole number",
    ),
    ("potential", {"potential": {"clebsch": 1e308}}, "finite at the start"),
]

#: Of both balls.
_BALL: list[Row] = [
    ("mass", {"mass": 0}, "greater than 0; given 0"),
    ("position", {"position": [1, 2, 3, 4]}, "given 4 entries"),
    ("radius", {"radius": "-1/2"}, "greater than 0"),
    ("mass", {"mass": "1e-300"}, "a size from 1e-30 to 1e30"),
    ("strict", {"strict": "yes"}, "true or false"),
]

REFUSED: dict[str, list[Row]] = {
    "veselova": [
        ("A[1]", {"A": [3, -2, 1]}, "greater than 0"),
        ("q_dot", {"q_dot": [0.8, 1, 0.6]}, "orthogonal to q"),
        ("A[2]", {"A": [3, 2, "1e999"]}, ""),
        ("A[2]", {"A": [3, 2, "1/0"]}, ""),
        ("A", {"A": [3]}, ""),
        ("A", {"A": {3, 2, 1}}, "a list of numbers"),
        ("A[0][1]", {"A": [[3, 1, 0], [0, 2, 0], [0, 0, 1]]}, "symmetric"),
        ("A", {"A": [[1, 2], [2, 1]], "q": [1, 0], "q_dot": [0, 1]}, "positive definite"),
        ("q", {"q": [0.6, 0, 0.9]}, "unit length"),
        ("q", {"q": [0.6, 0.8]}, ""),
        ("frame", {"frame": [[1, 0], [0, 1]]}, ""),
        ("frame", {"frame": [[2, 0, 0], [0, 2, 0], [0, 0, 2]]}, ""),
        ("frame[1][2]", {"frame": [[1, 0, 0], [0, 1, "x"], [0, 0, 1]]}, ""),
        ("normalize", {"normalize": 1}, "true or false"),
        ("q_dot", {"q_dot": [0.8e200, 1e200, -0.6e200]}, ""),
    ],
    "neumann": [
        ("A[1]", {"A": [3, 0, 1]}, "greater than 0"),
        ("q_prime", {"q_prime": [0.6, 0, 0.8]}, "orthogonal to q"),
        ("A[0]", {"A": [1e-200, 1, 1]}, ""),
        ("q", {"q": [1, 1, 0]}, "unit length"),
        ("q_prime", {"q_prime": [0, 1e200, 0]}, ""),
        ("q_prime", {"q_prime": [0]}, ""),
    ],
    "ellipsoid-geodesic": [
        ("A[2]", {"A": [3, 2, -1]}, "greater than 0"),
        ("X", {"X": [1.9, 0, 0]}, ""),
        ("X", {"X": [0, 0, 0]}, ""),
        ("X_dot", {"X_dot": [0, 2, 0]}, ""),
        ("X_dot", {"X_dot": [1, 0, 0]}, ""),
        ("X_dot", {"X_dot": [1, 0, 0], "normalize": True}, ""),
    ],
    "veselova-so3": _IN_SPACE,
    "euler-poisson": _IN_SPACE,
    "rubber-ball": [
        *_BALL,
        ("inertia", {"inertia": [1, 1, 3]}, "moments of a body"),
        ("inertia", {"inertia": [1, 2]}, "3 positive principal moments"),
        ("gamma", {"gamma": [1, 2, 3]}, "a vector of unit length"),
    ],
    "chaplygin-ball": [
        *_BALL,
        ("position", {"position": [[0, 0, 0]] * 2}, "a list of 3 numbers"),
        ("inertia", {"inertia": [1, 1, 1, 1, 1, 2]}, "special"),
        ("inertia.special", {"mass": 10}, "above ma²"),
        ("Omega", {"Omega": [0.1, 0.2, 0.3, 0.4, 0, 0]}, "without momentum"),
        ("Omega", {"Omega": [0.1, 0.2, 0.3]}, "6 numbers"),
        ("Omega[0][0]", {"Omega": [[1] * 4] * 4}, "skew"),
        ("inertia.special", {"inertia": {"special": [1, 1, 1]}}, "4 numbers"),
        ("inertia.other", {"inertia": {"other": [1, 1, 1, 1]}}, ""),
        ("gamma", {"gamma": [1] + [0] * 64}, "64"),
        ("frame", {"frame": _UNIT}, "4 rows"),
    ],
    "separable": [
        ("A[2]", {"A": [1, 2, 2]}, ""),
        ("potential.cubic", {"potential": {"cubic": 1}}, ""),
        ("potential.quartic", {"potential": {"quartic": "x"}}, ""),
        ("potential.centrifugal", {"potential": {"centrifugal": [1, 2]}}, ""),
        ("q_dot", {"q_dot": [1, 0, 0]}, "orthogonal to q"),
    ],
    "lr": [
        ("rank", {"rank": 3}, "given 3"),
        ("omega", {"omega": _TURNED}, "of its largest entry"),
        ("n", {"n": True}, "from 2 to 64"),
        ("inertia", {"inertia": {"special": [3, 2, 1], "matrix": _UNIT}}, '{"special"'),
        ("inertia.special", {"inertia": {"special": ["1e20", 1, 1]}}, "ratios up to 1e+14"),
        (
            "inertia.matrix",
            {"inertia": {"matrix": [[1, 0, 0], [0, 1, 0], [0, 0, -1]]}},
            "given one with eigenvalue -1",
        ),
        ("g", {"g": _TURNED}, "off it by 1e-06"),
        ("omega", {"homogeneous": True}, "off them by 0.3"),
        ("potential[0].powers", {"potential": [{"coefficient": 1}]}, "this field"),
        ("potential[0].powers[0][1]", {"potential": monomial([1, 4, 1])}, "from 1 to 3"),
        ("potential[0].powers[0][2]", {"potential": monomial([1, 2, 65])}, "power"),
        ("potential", {"potential": monomial([1, 2, -2])}, "finite at the start"),
    ],
    "stiefel": [
        ("X", {"X": [[1, 0], [0, 1.1], [0, 0]]}, "|XᵀX − 1| up to 0.21"),
        ("P", {"P": [[0, 1], [1, 0], [0, 0]]}, "skew"),
        ("P", {"P": None}, "neither"),
        ("P", {"X_dot": [[0, 1], [-1, 0], [0, 0]]}, "both"),
        ("X[2]", {"X": [[1, 0], [0, 1], [0]]}, "1 entries"),
        ("X", {"X": [[1, 2], [1, 2], [0, 0]], "normalize": True}, "linearly independent"),
        ("P", {"P": [[0, 1], [-1, 0]]}, "2 rows"),
        ("P", {"P": [[0, 1e308], [-1e308, 0], [0, 0]]}, "from 1e-30 to 1e30"),
        ("inertia.special[1]", {"inertia": {"special": [3, -2, 1]}}, "greater than 0"),
    ],
}

#: Requests for geodesics that are refused: field, changes to GEODESIC, words of the message.
GEODESIC: dict[str, Any] = {"ellipsoid": "Haumea", "P": [10, 20], "Q": [-35, 160]}
GEODESICS_REFUSED: list[Row] = [
    ("ellipsoid", {"ellipsoid": "Vesta"}, "given"),
    ("ellipsoid[1]", {"ellipsoid": [3, 0, 1]}, "greater than 0"),
    ("P", {"P": [10, 20, 30]}, "shape (…, 2)"),
    ("P", {"P": [91, 0]}, "latitude"),
    ("Q[1]", {"Q": [[0, 0], [-90.5, 0]]}, "latitude"),
    ("Q", {"Q": [["x", 0]]}, "finite numbers"),
    (
        "Q",
        {"ellipsoid": [3, 2, 1], "P": [3, 0, 0], "Q": [0, 2.1, 0], "coordinates": "cartesian"},
        "",
    ),
    ("P", {"P": [[0, 0]] * 3, "Q": [[0, 0]] * 2}, "broadcast"),
    ("s12", {"Q": None, "azi1": 30, "s12": "far"}, "finite numbers"),
    ("P", {"Q": None, "azi1": [1, 2], "s12": [1, 2, 3]}, "broadcast"),
    ("azi1", {"azi1": 30}, "beside P and Q"),
    ("the request", {"Q": None}, "given P"),
    ("at", {"P": None, "Q": None, "points": [[0, 0]] * 3, "at": [1]}, "beside points"),
    ("coordinates", {"coordinates": "geocentric"}, "geodetic"),
    ("at[0]", {"at": ["far"]}, "number"),
    ("digits", {"digits": 1001}, "1000"),
    ("count", {"count": 0}, "1"),
    ("digits", {"count": 2, "digits": 20}, "beside P and Q and count"),
    ("certified", {"Q": None, "azi1": 30, "s12": 1, "certified": True}, "beside P and azi1"),
    ("P[0]", {"P": ["east", 20], "digits": 20}, "finite real number"),
]
