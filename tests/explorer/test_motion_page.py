"""A motion as one page: ``Trajectory.to_html``, opened from the disk."""

from __future__ import annotations

import io
import json
import re
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from explorer_browser import FILE, PATIENCE_S, Visit, needs_chromium, numbers, visiting

import veselova as vs
from veselova import motion_page

Q = {"q": ["0.5", "0.5", "0.7"], "q_dot": ["0.4", "0.3", "-0.1"], "normalize": True}
BODY = vs.Veselova(["3", "2", "1"], **Q)
#: A ball on a separatrix, which has no document, and one with an area constant, which has one.
BALL = vs.RubberBall([1, 2, 5], 1, 1, [0, 1, 0], [-3, 0, 1], strict=False)
TWISTING = vs.ChaplyginBall([0.4, 0.6, 0.9], 0.2, 1, [0.6, 0, 0.8], [0.8, 1, -0.3])

pytestmark = pytest.mark.usefixtures("bundle")


def carried(page: str) -> dict[str, Any]:
    """Return what a page carries."""
    found = re.search(r'<script type="application/json" id="motion">(.*?)</script>', page)
    assert found
    return dict(json.loads(found[1]))


def test_a_page_carries_the_closed_form_and_its_policy() -> None:
    trajectory = vs.solve(BODY, [0, 5, 20])
    page = motion_page.page(trajectory)
    found = carried(page)
    assert found["document"] == json.loads(vs.closed_form(BODY).to_json())
    assert found["series"] is None
    assert found["engines"]["analytic"]["times"] == [0, 5, 20]
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', page)
    assert policy
    assert policy[1].startswith("default-src &#x27;none&#x27;")
    assert "unsafe" not in policy[1]
    assert "http" not in policy[1]


def test_a_page_carries_the_document_of_an_area_constant() -> None:
    found = carried(motion_page.page(vs.solve(TWISTING, [0, 1e7])))
    assert found["document"]["format"] == "veselova.closed-form/2"
    assert found["document"] == json.loads(vs.closed_form(TWISTING).to_json())
    assert found["torus"]["regime"] == "generic"
    assert found["series"] is None


def test_a_motion_without_a_document_carries_its_series() -> None:
    times = np.linspace(-2, 6, 9)
    trajectory = vs.solve(BALL, times)
    stream = io.BytesIO()
    trajectory.to_html(stream)
    found = carried(stream.getvalue().decode())
    assert found["document"] is None
    series = found["series"]
    assert series["times"][0] == -2
    assert series["times"][-1] == 6
    assert np.diff(series["times"]).max() <= 0.05 + 1e-12
    places = [int(np.argmin(np.abs(np.array(series["times"]) - t))) for t in (-2, 6)]
    for name in ("frame", "position"):
        ends = np.array(series["series"][name])[places]
        assert ends == pytest.approx(trajectory.series(name)[[0, -1]], abs=1e-8)


def test_nothing_in_a_problem_ends_the_script(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(type(BODY), "title", property(lambda _: "</script><b>"))
    page = motion_page.page(vs.solve(BODY, [1]))
    assert "</script><b>" not in page
    assert carried(page)["title"] == "</script><b>"


def test_without_a_bundle_one_sentence_says_how_to_get_it(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(motion_page, "BUNDLE", tmp_path / "none")
    motion_page._template.cache_clear()
    with pytest.raises(vs.BackendMissing, match=r"explorer/build\.py"):
        vs.solve(BODY, [1]).to_html(tmp_path / "motion.html")
    assert not list(tmp_path.iterdir())


@pytest.mark.daily(4)
@needs_chromium
def test_a_file_plays_without_a_server(browser: Any, tmp_path: Path) -> None:
    vs.solve(BODY, np.linspace(0, 30, 61)).to_html(tmp_path / "motion.html")
    with visiting(browser, FILE, offline=True) as visit:
        visit.open(f"{tmp_path}/motion.html".lstrip("/"))
        for view in ("body", "sphere", "torus", "ellipsoid"):
            visit.wait_for_ink(view, colours=300, part=0.2)
        before = visit.time()
        visit.wait_for(f"Number(document.getElementById('time').value) > {before} + 0.2")
        visit.page.click("#play")
        shown(visit, "1000/7", vs.solve(BODY, ["1000/7"]).q[0])
        visit.wait_for("document.getElementById('twin-engines').textContent.includes('differ by')")
        for hidden in ("#preset", "#system", "#link", "#curl", "#slider-A-0"):
            assert visit.page.is_hidden(hidden)
        assert visit.page.input_value("#text-A-1") == "2"
        assert visit.page.get_attribute("#text-A-1", "readonly") is not None
        table = np.genfromtxt(visit.download("#csv", tmp_path), delimiter=",", names=True)
    truth = vs.solve(BODY, table["t"]).columns()
    assert set(table.dtype.names) > {"t", "error", "q_1", "q_dot_3", "frame_3_2", "spheroconic_2"}
    for name in set(table.dtype.names) - {"error"}:
        assert table[name] == pytest.approx(truth[name], abs=1e-10), name


@pytest.mark.daily(4)
@needs_chromium
def test_a_series_plays_between_its_ends(browser: Any, tmp_path: Path) -> None:
    trajectory = vs.solve(BALL, {"start": 0, "stop": 12, "count": 49})
    trajectory.to_html(tmp_path / "ball.html")
    with visiting(browser, FILE, offline=True) as visit:
        visit.open(f"{tmp_path}/ball.html#t=11&play=0&speed=0.01".lstrip("/"))
        visit.wait_for_ink("ball", colours=100, part=0.1)
        shown(visit, "7.33", trajectory.at([7.33]).frame[0, :, 0])
        visit.enter("#time", "13")
        assert "from 0 to 12" in visit.text("#time-fault")
        assert visit.page.is_hidden('[data-time="1000"]')
        visit.enter("#time", "11.999")
        visit.page.click("#play")
        visit.wait_for("document.getElementById('play').textContent === 'Play'")
        assert visit.time() == 12
        visit.page.click("#play")
        visit.wait_for("Number(document.getElementById('time').value) < 6")


def shown(visit: Visit, t: str, q: Any) -> None:
    """Go to a time, and compare the vector that the table shows."""
    visit.enter("#time", t)
    # A picture of the time before may still come.
    deadline = time.monotonic() + PATIENCE_S
    found: list[float] = []
    while found != pytest.approx(q, abs=2e-4) and time.monotonic() < deadline:
        found = numbers(visit.fact())
    assert found == pytest.approx(q, abs=2e-4)
