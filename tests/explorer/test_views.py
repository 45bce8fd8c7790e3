"""What the views say of a motion, against numbers of Python, and how a class is shown them."""

from __future__ import annotations

import json
from typing import Any
from urllib.parse import quote

import numpy as np
import pytest
from explorer_browser import Visit, needs_chromium
from explorer_bundle import BALLS_IN_R4, ball_in_r4

import veselova as vs
from veselova.mechanics.systems.catalogue import read_problem

pytestmark = [needs_chromium, pytest.mark.daily(4)]

SPACE = {"gamma": ["0.6", 0, "0.8"], "Omega": ["0.8", 1, "-0.6"]}
BODY = {"system": "veselova-so3", "inertia": [1, 2, "2.5"], **SPACE}
NEUMANN = {"system": "neumann", "A": [3, 2, 1], "q": ["0.6", 0, "0.8"]}

#: Motions with A of the ellipsoid on which X = Aq/√(q,Aq) may be a geodesic.
MOTIONS: dict[str, tuple[dict[str, Any], list[float]]] = {
    "body": (BODY, [1, 0.5, 0.4]),
    "potential": ({**BODY, "potential": {"clebsch": "0.5"}}, [1, 0.5, 0.4]),
    "spin": ({**BODY, "Omega": ["0.8", 1, "-0.3"]}, [1, 0.5, 0.4]),
    "Neumann": ({**NEUMANN, "q_prime": ["0.8", "0.5", "-0.6"]}, [3, 2, 1]),
    "Neumann, F_0 = 0": ({**NEUMANN, "q_prime": [0, "0.7071067811865476", 0]}, [3, 2, 1]),
    **{name: (ball_in_r4(name).as_request(), [1.6, 1.2, 0.9, 0.5]) for name in BALLS_IN_R4},
}


def show(visit: Visit, problem: dict[str, Any]) -> None:
    """Open the page with a problem, at rest at t = 0."""
    visit.allowed = ("status of 422",)
    visit.open(f"#problem={quote(json.dumps(problem))}&t=0&play=0")


def part_outside(problem: dict[str, Any], A: Any) -> float:
    """Return the part of X'' that is across X' and the normal: 0 for a geodesic."""
    h = 1e-3
    q = vs.solve(read_problem(problem), [1 - h, 1, 1 + h]).series("frame")[:, :, 0]
    X = np.array(A) * q / np.sqrt(np.sum(A * q * q, axis=1))[:, None]
    second = X[2] - 2 * X[1] + X[0]
    plane = np.array([X[2] - X[0], X[1] / A]).T
    along = plane @ np.linalg.lstsq(plane, second, rcond=None)[0]
    return float(np.linalg.norm(second - along) / np.linalg.norm(second))


@pytest.mark.parametrize("name", MOTIONS)
def test_only_geodesics_are_called_so(visit: Visit, name: str) -> None:
    problem, A = MOTIONS[name]
    show(visit, problem)
    away = part_outside(problem, A)
    assert away < 1e-5 or away > 1e-3
    assert visit.page.is_visible('[data-view="ellipsoid"]') == (away < 1e-5)


@pytest.mark.parametrize(
    ("preset", "said"),
    [
        ("body", ""),
        ("umbilic", "Torus, Curve, Constants: the motion is on a separatrix."),
        ("planar", "Constants: The map shows motions in which every λ swings; here one does not."),
    ],
)
def test_views_that_are_left_out_say_why(visit: Visit, preset: str, said: str) -> None:
    visit.open(f"#preset={preset}&play=0")
    assert visit.text("#absent") == said


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("{bad", "problem: no JSON at the character b, number 2 of line 1."),
        ('{"system": x', "problem: no JSON at the character x."),
        ('{"system": 1,', "problem: the JSON ends too early."),
    ],
)
def test_what_is_no_json_is_said_in_plain_words(visit: Visit, text: str, said: str) -> None:
    visit.open("#play=0")
    visit.page.evaluate("document.querySelector('#fields details').open = true")
    visit.enter("textarea", text, "Tab")
    assert visit.text("#fault-json") == said


def test_a_lecture_shows_two_views_and_is_led_by_keys(visit: Visit) -> None:
    featured = "[...document.querySelectorAll('.card.featured')].length"
    visit.open("#play=0")
    visit.page.click("#lecture")
    visit.wait_for(f"{featured} === 2 && location.hash.includes('lecture=1')")
    assert not visit.page.is_visible("aside")
    assert visit.page.locator(".card:visible").count() == 2
    visit.page.keyboard.press("ArrowRight")
    visit.wait_for("document.getElementById('preset').value === 'generic'")
    visit.page.keyboard.press("PageUp")
    visit.wait_for("document.getElementById('preset').value === 'body'")
    visit.page.keyboard.press("1")
    visit.wait_for(f"{featured} === 1")
    visit.page.keyboard.press("Escape")
    visit.wait_for("!location.hash.includes('lecture')")
    assert visit.page.is_visible("aside")
