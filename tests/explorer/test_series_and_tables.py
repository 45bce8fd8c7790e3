"""Series that do not reach a time, tables in all digits, and rows of cards, in a real browser."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from explorer_browser import needs_chromium, visiting
from explorer_bundle import PRESETS

import veselova as vs
from conftest import Server
from veselova.mechanics.systems.catalogue import read_problem

pytestmark = [needs_chromium, pytest.mark.daily(4)]


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
        visit.wait_for("document.getElementById('time-fault').textContent")
        assert "t: too far to integrate this motion; back at " in visit.text("#time-fault")
        assert visit.time() == pytest.approx(float(visit.text("#time-fault")[:-1].split("at ")[1]))
        assert visit.time() < 60
        starts = [json.loads(text)["times"]["start"] for text in asked if "times" in text]
        assert starts.count(1e12) >= 1
        visit.page.wait_for_timeout(2500)
        again = [json.loads(text)["times"]["start"] for text in asked if "times" in text]
        assert again.count(1e12) == starts.count(1e12)
        visit.page.click('[data-time="0"]')
        visit.wait_for("document.getElementById('status').textContent.startsWith('Series')")


def test_tables_have_all_digits_at_far_times(browser: Any, server: Server, tmp_path: Path) -> None:
    with visiting(browser, server.url) as visit:
        visit.open("#preset=ball&t=1000000&play=0")
        table = visit.download("#csv", tmp_path)
    rows = list(csv.DictReader(table.read_text().splitlines()))[::100]
    truth = vs.solve(read_problem(PRESETS["ball"]), [float(row["t"]) for row in rows])
    places, frames = (
        np.array([[float(row[name]) for name in row if name.startswith(series)] for row in rows])
        for series in ("position_", "frame_")
    )
    bound = 4 * float(truth.error.max())
    assert np.abs(frames.reshape(-1, 3, 3) - truth.series("frame")).max() < bound
    # Single precision has 0.06 there.
    assert np.abs(places - truth.series("position")).max() < 1e-5
