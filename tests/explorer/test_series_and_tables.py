"""Series that do not reach a time, tables in all digits, and rows of cards, in a real browser."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
from explorer_browser import Visit, needs_chromium, visiting
from explorer_bundle import EXPLORER

import veselova as vs
from conftest import Server

pytestmark = needs_chromium

PROBLEMS = {
    preset["name"]: preset["problem"]
    for preset in json.loads((EXPLORER / "src/presets.json").read_text())
}

#: What the browser says of a refusal, which is meant here.
REFUSED = ("status of 422",)


def test_a_time_that_no_series_reaches_is_said_and_asked_for_once(
    browser: Any, server: Server
) -> None:
    with visiting(browser, server.url, allowed=REFUSED) as visit:
        asked: list[str] = []
        visit.open("#preset=chaos&play=0")
        visit.page.on("request", lambda request: asked.append(request.post_data or ""))
        visit.page.click('[data-time="1000000000000"]')
        visit.wait_for("document.getElementById('status').textContent.includes('stays at')")
        assert "too-far" in visit.text("#status")
        starts = [json.loads(text)["times"]["start"] for text in asked if "times" in text]
        assert 1e12 in starts
        visit.page.wait_for_timeout(2500)
        again = [json.loads(text)["times"]["start"] for text in asked if "times" in text]
        assert again.count(1e12) == 1
        visit.page.click('[data-time="0"]')
        visit.wait_for("document.getElementById('status').textContent.startsWith('Series')")


def test_the_trail_has_series_that_come_late(browser: Any, server: Server, tmp_path: Path) -> None:
    with visiting(browser, server.url) as visit:
        visit.open("#preset=umbilic&t=35&play=0")
        visit.wait_for("document.getElementById('status').textContent.startsWith('Series')")
        visit.page.wait_for_timeout(1500)
        lines = visit.download('[data-view="engines"] button:has-text("SVG")', tmp_path)
        curve = lines.read_text().split('points="')[1].split('"')[0].split()
        heights = [float(place.split(",")[1]) for place in curve]
        # A stretch that is missing stands still in the plot, for 600 of 1200 points.
        assert max(np.diff([k for k, step in enumerate(np.diff(heights)) if step])) < 300


def test_tables_have_all_digits_at_far_times(browser: Any, server: Server, tmp_path: Path) -> None:
    with visiting(browser, server.url) as visit:
        visit.open("#preset=ball&t=1000000&play=0")
        table = visit.download("#csv", tmp_path)
    rows = list(csv.DictReader(table.read_text().splitlines()))[::100]
    problem = {key: value for key, value in PROBLEMS["ball"].items() if key != "system"}
    truth = vs.solve(vs.RubberBall(**problem), [float(row["t"]) for row in rows])
    places = [[float(row["position_1"]), float(row["position_2"])] for row in rows]
    frames = [
        [[float(row[f"frame_{i}_{j}"]) for j in (1, 2, 3)] for i in (1, 2, 3)] for row in rows
    ]
    bound = 4 * float(truth.error.max())
    assert np.abs(np.array(frames) - truth.frame).max() < bound
    # Single precision has 0.06 there.
    assert np.abs(np.array(places) - truth.position).max() < 1e-5


def test_rows_of_cards_end_without_a_hole(first_visit: Visit) -> None:
    visit = first_visit
    for preset in ("generic", "ball", "planar"):
        visit.open(f"#preset={preset}&play=0")
        for width in (1440, 1000):
            visit.page.set_viewport_size({"width": width, "height": 800})
            visit.wait_for(f"window.innerWidth === {width}")
            boxes = [card.bounding_box() for card in visit.page.locator(".card:visible").all()]
            ends: dict[int, float] = {}
            for box in boxes:
                row = round(box["y"])
                ends[row] = max(ends.get(row, 0.0), box["x"] + box["width"])
            assert len(ends) >= 3
            assert max(ends.values()) - min(ends.values()) < 2, (width, preset, ends)


def test_the_file_of_a_scene_says_where_series_end(
    browser: Any, server: Server, tmp_path: Path
) -> None:
    with visiting(browser, server.url) as visit:
        visit.open("#preset=chaos&t=1&play=0&speed=100")
        visit.download('[data-view="body"] button:has-text("GLB")', tmp_path)
        assert "The file ends at t = " in visit.text("#message")
