"""Balls, and bodies with an area constant, in a real browser."""

from __future__ import annotations

import httpx2
import numpy as np
import pytest
from explorer_browser import Visit, needs_chromium, numbers
from explorer_bundle import PRESETS

import veselova as vs
from veselova.mechanics.systems.catalogue import read_problem

pytestmark = [needs_chromium, pytest.mark.daily(4)]


@pytest.mark.parametrize("preset", ["chaplygin", "spin"])
def test_an_area_constant_is_evaluated_in_the_page(visit: Visit, preset: str) -> None:
    visit.open(f"#preset={preset}&play=0")
    assert visit.text("#status").startswith("Closed form")
    for view in ("ball", "body", "sphere", "torus"):
        visit.wait_for_ink(view, colours=100, part=0.1)
    visit.wait_for_ink("curve", colours=20, part=0.01)
    assert "Constants: With an area constant" in visit.text("#absent")
    name = "energy h" if preset == "chaplygin" else "Jacobi integral h"
    assert name in visit.text("#facts")
    visit.wait_for("document.getElementById('twin-engines').textContent.includes('integration')")
    for part in visit.text("#twin-engines").split("differ by at most ")[1:]:
        assert numbers(part.split(" ")[0].rstrip("."))[0] < 1e-10
    before = visit.fact()
    visit.enter("#time", "1e6")
    shown = numbers(visit.fact(besides=before))
    request = {"problem": PRESETS[preset], "times": [10**6], "outputs": ["gamma", "position"]}
    series = httpx2.post(f"{visit.origin}/v1/trajectories", json=request).json()["series"]
    assert shown == pytest.approx(series["gamma"][0], abs=2e-4)
    visit.wait_for("document.getElementById('twin-ball').textContent.includes('e+')")
    assert visit.vectors("#twin-ball")[0] == pytest.approx(series["position"][0], rel=2e-4)


@pytest.mark.parametrize("preset", ["ball", "drift", "chaplygin"])
def test_a_ball_shows_its_momentum_and_how_it_goes_on(visit: Visit, preset: str) -> None:
    data, ball = PRESETS[preset], read_problem(PRESETS[preset])
    frame, Omega = (vs.solve(ball, [5.0]).series(name)[0] for name in ("frame", "Omega"))
    added = float(data["mass"]) * float(data["radius"]) ** 2
    momentum = (frame.T @ (np.diag(np.array(data["inertia"], float) + added) @ Omega))[1:]
    visit.open(f"#preset={preset}&play=0")
    visit.wait_for("document.getElementById('twin-ball').textContent.includes('momentum K is')")
    twin = visit.text("#twin-ball")
    for name, truth in (("momentum K is", momentum), ("velocity is", ball.drift.velocity)):
        found = numbers(twin.split(f"{name} (")[1].split(")")[0])
        assert found == pytest.approx(truth, rel=2e-3, abs=1e-12 if preset == "drift" else 1e-4)
    caption = visit.text('[data-view="ball"] .caption').replace("−", "-")
    if preset == "drift":
        drift = float(caption.split("along K, by ")[1].split(" ")[0])
        along = ball.drift.velocity @ momentum / np.linalg.norm(momentum)
        assert drift == pytest.approx(along, rel=2e-3)
    else:
        assert caption.endswith("across K and keeps to a strip.")


def test_a_ball_over_a_sphere_rolls_on_it(visit: Visit) -> None:
    visit.open("#preset=shell&t=5&play=0")
    assert visit.text("#status").startswith("Closed form")
    visit.wait_for_ink("shell", colours=100, part=0.1)
    visit.wait_for("document.getElementById('twin-shell').textContent.includes('on the sphere')")
    motion = vs.solve(read_problem(PRESETS["shell"]), [5.0])
    for found, truth in zip(
        visit.vectors("#twin-shell"), (motion.position, motion.gamma), strict=True
    ):
        assert found == pytest.approx(truth[0], rel=2e-3, abs=1e-4)
