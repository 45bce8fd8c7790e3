"""A motion in a notebook: ``Trajectory.view``, its widget and the part in the browser."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from explorer_browser import FILE, needs_chromium, numbers, visiting

import veselova as vs
from veselova import notebook
from veselova.motion_page import page

BODY = vs.Veselova(["3", "2", "1"], ["0.5", "0.5", "0.7"], ["0.4", "0.3", "-0.1"], normalize=True)

#: A notebook of one cell: the model keeps what both sides set, and tells who listens.
HOST = """<!doctype html>
<title>notebook</title>
<p id="status"></p>
<div id="cell"></div>
<script type="module">
%(front)s
</script>
"""

MODEL = """
const values = %(values)s;
const listeners = new Map();
window.model = {
  get: (name) => values[name],
  set: (name, value) => {
    if (values[name] === value) return;
    values[name] = value;
    for (const act of listeners.get(`change:${name}`) ?? []) act();
  },
  save_changes: () => (window.saved = (window.saved ?? 0) + 1),
  on: (event, act) => listeners.set(event, [...(listeners.get(event) ?? []), act]),
  off: (event, act) => listeners.set(event, listeners.get(event).filter((one) => one !== act)),
};
const close = widget.render({ model: window.model, el: document.getElementById("cell") });
window.closeWidget = () => { close(); return [...listeners.values()].flat().length; };
document.getElementById("status").textContent = "here";
"""


pytestmark = pytest.mark.usefixtures("bundle")


def test_the_widget_holds_the_page_and_its_time() -> None:
    pytest.importorskip("anywidget")
    trajectory = vs.solve(BODY, [2, 5])
    widget = trajectory.view(height=400)
    assert widget.page == page(trajectory)
    assert (widget.t, widget.speed, widget.playing, widget.height) == ("2.0", 1.0, True, 400)
    assert widget._esm == notebook.FRONT
    state = widget.get_state()
    assert {"page", "t", "speed", "playing", "height", "title"} <= set(state)


@pytest.mark.parametrize("height", [0, 99, 10_001, 4.5, True, "tall"])
def test_a_height_that_shows_nothing_is_refused(height: Any) -> None:
    with pytest.raises(vs.InvalidInput, match="height: required a whole number from 100 to 10000"):
        vs.solve(BODY, [2]).view(height=height)


@pytest.mark.daily(4)
@needs_chromium
def test_the_page_and_the_widget_follow_each_other(browser: Any, tmp_path: Path) -> None:
    trajectory = vs.solve(BODY, [2, 5])
    values = {"t": "2.0", "speed": 1, "playing": True, "height": 500, "title": "veselova"}
    values["page"] = page(trajectory)
    model = MODEL % {"values": json.dumps(values).replace("<", "\\u003c")}
    front = notebook.FRONT.replace("export default", "const widget =") + model
    (tmp_path / "notebook.html").write_text(HOST % {"front": front})
    with visiting(browser, FILE, offline=True) as visit:
        visit.open(f"{tmp_path}/notebook.html".lstrip("/"))
        visit.wait_for("window.saved > 1 && Number(model.get('t')) > 2.1")
        inner = visit.page.frames[1]
        assert inner.evaluate("window.origin") == "null"
        visit.page.evaluate("model.set('playing', false)")
        visit.wait_for("model.get('playing') === false")
        visit.page.evaluate("model.set('t', '1000/7')")
        deadline = 600
        while inner.input_value("#time") != "1000/7" and deadline:
            visit.page.wait_for_timeout(100)
            deadline -= 1
        truth = vs.solve(BODY, ["1000/7"]).q[0]
        assert numbers(inner.text_content("#facts td")) == pytest.approx(truth, abs=2e-4)
        inner.click("#play")
        visit.wait_for("model.get('playing') === true")
        visit.page.evaluate("model.set('height', 420)")
        assert visit.page.locator("iframe").bounding_box()["height"] == 420
        assert visit.page.evaluate("closeWidget()") == 0
