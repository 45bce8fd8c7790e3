"""The explorer in a real browser: Debian's chromium, driven by playwright."""

from __future__ import annotations

import io
import json
import signal
from contextlib import closing
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest
from explorer_browser import FILE, Visit, needs_chromium, numbers, visiting
from explorer_bundle import PRESETS
from PIL import Image

import veselova as vs
from conftest import Server, running_server
from veselova.mechanics.systems.catalogue import read_problem
from veselova.service.access.keys import open_keys
from veselova.service.api.settings import Settings

pytestmark = [needs_chromium, pytest.mark.daily(4)]

#: The problem in the address.
PROBLEM = "JSON.parse(new URLSearchParams(location.hash.slice(1)).get('problem'))"


@pytest.mark.daily(1)
def test_every_view_draws_and_the_motion_plays(browser: Any, server: Server) -> None:
    with visiting(browser, server.url) as visit:
        visit.open()
        for view in ("body", "sphere", "torus", "ellipsoid"):
            visit.wait_for_ink(view, colours=300, part=0.2)
        for view in ("curve", "constants"):
            visit.wait_for_ink(view, colours=20, part=0.01)
        visit.wait_for("document.querySelectorAll('.plot canvas').length >= 3")
        visit.wait_for_ink("engines", colours=10, part=0.01)
        before = visit.time()
        visit.wait_for(f"Number(document.getElementById('time').value) > {before} + 0.3")
        visit.page.click("#play")
        assert visit.text("#play") == "Play"
        still = visit.time()
        visit.page.wait_for_timeout(300)
        assert visit.time() == still
        for view in ("body", "sphere", "torus", "curve", "constants", "engines"):
            assert len(visit.text(f"#twin-{view}")) > 20


def test_the_three_engines_agree_in_the_plot(visit: Visit) -> None:
    visit.open("#preset=generic&play=0")
    visit.wait_for("document.getElementById('twin-engines').textContent.includes('integration')")
    words = visit.text("#twin-engines").split()
    closed = float(words[words.index("form") + 5].rstrip(".").replace("−", "-"))
    assert closed < 1e-11


@pytest.mark.parametrize("preset", PRESETS)
def test_every_preset_moves(visit: Visit, preset: str) -> None:
    visit.open(f"#preset={preset}&play=0")
    assert visit.text("#message") == ""
    assert visit.page.input_value("#preset") == preset
    ball = preset in ("ball", "drift", "chaplygin", "spin")
    visit.wait_for_ink("ball" if ball else "body", colours=100, part=0.03)
    first = visit.fact()
    visit.enter("#time", "7/10")
    assert visit.fact(besides=first)
    assert visit.time() == 0.7


def test_a_slider_changes_the_motion(visit: Visit) -> None:
    visit.open("#preset=generic&t=3&play=0")
    before = visit.fact()
    visit.page.evaluate(
        """() => {
          const slider = document.getElementById("slider-A-0");
          slider.value = "4";
          slider.dispatchEvent(new Event("input", { bubbles: true }));
        }"""
    )
    visit.fact(besides=before)
    assert visit.page.input_value("#text-A-0") == "4"
    visit.wait_for(f"{PROBLEM}?.A.join() === '4,2,1'")


def test_the_address_holds_the_whole_state(visit: Visit, browser: Any) -> None:
    visit.open("#preset=ball&play=0")
    for name, value in (("time", "12345.6789"), ("text-gamma-1", "1/7")):
        before = visit.fact()
        visit.enter(f"#{name}", value)
        shown = visit.fact(besides=before)
    visit.wait_for("document.getElementById('story').textContent === 'A start of your own.'")
    visit.page.click('[data-view="ball"] button:has-text("⤢")')
    visit.wait_for("location.hash.includes('view=ball') && location.hash.includes('12345')")
    wanted = visit.state()
    assert wanted["t"] == "12345.6789"
    assert wanted["view"] == "ball"
    with visiting(browser, visit.origin) as other:
        other.open(f"#{urlsplit(visit.page.url).fragment}")
        other.wait_for(f"document.querySelector('#facts td').textContent === {shown!r}")
        assert other.state() == wanted
        assert other.page.input_value("#text-gamma-1") == "1/7"


@pytest.mark.parametrize(
    ("name", "value", "place", "part"),
    [
        ("text-A-2", "-1", "#fault-A-2", "A₃: required a number greater than 0; given -1."),
        ("text-q-1", "x", "#fault-q-1", "q₂: required a number; given x."),
        ("text-q-1", "1,2,3", "#fault-q-1", "q₂: required a number; given 1,2,3."),
        ("time", "soon", "#time-fault", "t: required a number such as 7/10; given soon."),
        ("time", "1e13", "#time-fault", "at most 10¹²"),
        ("time", "1e400", "#time-fault", "at most 10¹²"),
    ],
)
def test_bad_input_is_named_at_its_field(
    visit: Visit, name: str, value: str, place: str, part: str
) -> None:
    visit.allowed = ("422",)
    visit.open("#preset=generic&play=0")
    visit.enter(f"#{name}", value)
    visit.wait_for(f"document.querySelector({place!r}).textContent.includes({part!r})")
    assert len(visit.text(place).split()) <= 10
    assert visit.page.get_attribute(f"#{name}", "aria-invalid") is not None
    # What is shown is not of this problem.
    opacity = "getComputedStyle(document.querySelector('[data-view=body] canvas')).opacity"
    visit.wait_for(f"{opacity} === {'1' if name == 'time' else '0.3'!r}")
    if name == "time":
        # The text stays beside the reason, and both go.
        visit.page.click("#play")
        assert visit.text(place) == ""
        assert visit.page.input_value("#time") != value


def test_a_broken_link_says_which_part_is_broken(visit: Visit) -> None:
    visit.open("#preset=generix&t=soon&speed=-1&view=torus")
    said = visit.text("#message")
    for part, given in (("preset", "generix"), ("t", "soon"), ("speed", "-1")):
        assert f"The link's {part} is broken" in said
        assert f"given {given}." in said
    assert "view" not in said
    visit.open("#problem={system&play=0")
    assert "The link's problem is broken" in visit.text("#message")


def test_a_body_at_rest_is_drawn_at_rest(visit: Visit) -> None:
    visit.allowed = ("422",)
    problem = PRESETS["generic"] | {"q_dot": ["0", "0", "0"]}
    visit.open(f"#problem={json.dumps(problem)}&play=0&t=3")
    assert "rests" in visit.text("#message")
    assert visit.text("#status").endswith("nothing moves, so there is neither a curve nor a torus.")
    visit.wait_for_ink("body", colours=100, part=0.05)
    assert visit.fact() == "0.5025, 0.5025, 0.7035"
    assert visit.text("#facts tr:nth-child(2) td") == "0"


def test_far_times_say_that_their_digits_are_few(visit: Visit) -> None:
    visit.open("#preset=generic&play=0")
    visit.page.click('[data-time="1000000000000"]')
    visit.wait_for("document.getElementById('status').textContent.includes('has 15 digits')")
    assert visit.time() == 1e12
    truth = vs.solve(read_problem(PRESETS["generic"]), [10**12], digits=20).series("q")[0]
    assert numbers(visit.fact()) == pytest.approx(truth, abs=1e-2)


def test_the_map_of_constants_gives_a_new_start(visit: Visit) -> None:
    visit.open("#preset=generic&play=0")
    visit.page.locator('[data-view="constants"] canvas').click(position={"x": 250, "y": 40})
    visit.wait_for("document.getElementById('story').textContent === 'A start of your own.'")
    visit.wait_for("document.getElementById('twin-constants').textContent.includes('generic')")
    assert visit.text("#facts").split("constants c")[1]
    visit.wait_for(f"({PROBLEM}?.q[0] ?? '0.5') !== '0.5'")


def test_files_leave_the_page(visit: Visit, tmp_path: Path) -> None:
    visit.open("#preset=generic&play=0")
    visit.wait_for("document.querySelectorAll('.plot canvas').length >= 3")

    def download(selector: str) -> bytes:
        return visit.download(selector, tmp_path).read_bytes()

    table = download("#csv").decode().splitlines()
    stream = io.BytesIO()
    times = {"start": 0, "stop": float(table[-1].split(",")[0]), "count": len(table) - 1}
    vs.solve(read_problem(PRESETS["generic"]), times).to_csv(stream)
    assert table == stream.getvalue().decode().splitlines()
    assert table[-1].startswith("200.0,")
    for view in ("body", "curve", "engines"):
        assert download(f'[data-view="{view}"] button:has-text("PNG")')[:4] == b"\x89PNG"


def test_everything_is_reached_by_keyboard(visit: Visit) -> None:
    visit.open("#preset=generic&play=0")
    reached = set()
    name = "at.id || at.closest('[data-view]')?.dataset.view || at.tagName"
    for _ in range(90):
        visit.page.keyboard.press("Tab")
        reached.add(visit.page.evaluate(f"(at => {name})(document.activeElement)"))
    wanted = {"preset", "link", "play", "time", "speed", "system", "slider-A-0", "text-A-0"}
    assert wanted | {"body", "torus", "constants"} <= reached
    visit.page.focus('[data-view="body"] canvas')
    picture = "document.querySelector('[data-view=body] canvas').toDataURL()"
    visit.page.evaluate(f"window.before = {picture}")
    visit.page.keyboard.press("ArrowLeft")
    visit.wait_for(f"{picture} !== window.before")
    visit.page.keyboard.press(" ")
    assert visit.text("#play") == "Pause"


@pytest.mark.parametrize("scheme", ["dark", "light"])
def test_no_barrier_is_found_by_axe(browser: Any, server: Server, scheme: str) -> None:
    with visiting(browser, server.url, color_scheme=scheme) as visit:
        visit.open("#preset=generic&play=0")
        visit.wait_for("document.querySelectorAll('.plot canvas').length >= 3")
        visit.require_no_barrier()


def test_a_narrow_page_has_one_column(browser: Any, server: Server) -> None:
    size = {"width": 390, "height": 844}
    with visiting(browser, server.url, viewport=size, has_touch=True) as visit:
        visit.open("#preset=ball&play=0")
        visit.wait_for_ink("ball", colours=200, part=0.1)
        boxes = [card.bounding_box() for card in visit.page.locator(".card:visible").all()]
        assert len({round(box["x"]) for box in boxes}) == 1
        assert all(box["x"] >= 0 and box["x"] + box["width"] <= 390 for box in boxes)
        assert visit.page.evaluate("document.documentElement.scrollWidth") <= 390
        # The motion comes first: problem and numbers are folded, and open by a key.
        assert min(box["y"] for box in boxes) < 500
        assert visit.page.is_hidden("#text-gamma-1")
        visit.page.focus("#data > summary")
        visit.page.keyboard.press("Enter")
        assert visit.page.is_visible("#text-gamma-1")
        visit.page.set_viewport_size({"width": 1000, "height": 640})
        visit.wait_for("document.getElementById('data').open")


def test_a_motion_without_a_closed_form_has_no_empty_plots(visit: Visit) -> None:
    visit.open("#preset=chaos&play=0")
    assert "Engines: Without a closed form there is nothing to compare." in visit.text("#absent")
    assert visit.page.is_hidden('[data-view="engines"]')
    assert visit.page.is_hidden("#formulas")
    visit.page.select_option("#preset", "generic")
    visit.wait_for("document.querySelectorAll('.plot canvas').length >= 3")
    visit.wait_for("document.querySelectorAll('#formulas .katex').length === 2")


def test_who_wants_less_motion_gets_a_page_that_waits(browser: Any, server: Server) -> None:
    with visiting(browser, server.url, reduced_motion="reduce") as visit:
        visit.open()
        assert visit.text("#play") == "Play"
        assert visit.time() == 0


def test_without_webgl_the_plots_work(browser: Any, server: Server) -> None:
    with visiting(browser, server.url, allowed=("WebGL",)) as visit:
        visit.page.add_init_script(
            """const original = HTMLCanvasElement.prototype.getContext;
            HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
              return kind.startsWith("webgl") ? null : original.call(this, kind, ...rest);
            };"""
        )
        visit.open()
        assert visit.text("#absent").startswith("This browser has no WebGL")
        visit.wait_for_ink("curve", colours=20, part=0.01)


def test_where_keys_are_required_the_page_asks_for_one(browser: Any, tmp_path: Path) -> None:
    with closing(open_keys(Settings(data_dir=tmp_path / "data"))) as known:
        _, key = known.create("browser")
    with (
        running_server(tmp_path, "--require-keys", awaited="/healthz") as server,
        visiting(browser, server.url, allowed=("401",)) as visit,
    ):
        visit.page.goto(server.url)
        visit.page.wait_for_selector("#key-text")
        visit.page.fill("#key-text", key)
        visit.page.click("#key button")
        visit.wait_for("document.getElementById('status').textContent !== ''")
        assert visit.page.is_hidden("#key")
        assert visit.page.evaluate("Object.keys(localStorage).length") == 0


def test_when_the_server_goes_the_motion_goes_on(browser: Any, tmp_path: Path) -> None:
    with (
        running_server(tmp_path) as server,
        visiting(browser, server.url, allowed=("Failed to load", "ERR_")) as visit,
    ):
        visit.open("#preset=generic")
        server.process.send_signal(signal.SIGKILL)
        server.process.wait()
        visit.enter("#text-A-0", "4")
        visit.wait_for("!document.getElementById('banner').hidden")
        assert "The server does not answer." in visit.text("#banner")
        before = visit.time()
        visit.wait_for(f"Number(document.getElementById('time').value) > {before} + 0.2")


def test_the_page_of_the_api_works_offline(browser: Any, server: Server) -> None:
    with visiting(browser, server.url) as visit:
        visit.page.goto(f"{server.url}/docs")
        visit.wait_for("document.querySelectorAll('.opblock').length >= 15")
        assert "veselova" in visit.text(".info .title")
        visit.page.click('.opblock:has-text("/v1/systems") button.opblock-summary-control')
        visit.page.click(".try-out__btn")
        visit.page.click("button.execute")
        visit.wait_for("document.querySelector('.live-responses-table tbody .response-col_status')")
        assert "200" in visit.text(".live-responses-table tbody .response-col_status")
        assert "ellipsoid-geodesic" in visit.text(".live-responses-table")


def test_a_film_leaves_the_page(visit: Visit, browser: Any, tmp_path: Path) -> None:
    visit.open("#preset=generic&t=3&play=0")
    visit.wait_for_ink("body", colours=300, part=0.2)
    button = '[data-view="body"] .card-tools button[aria-label^="WebM"]'
    visit.page.click(button)
    visit.wait_for("document.getElementById('play').textContent === 'Pause'")
    assert visit.text(button) == "Stop"
    visit.wait_for("Number(document.getElementById('time').value) > 3.4")
    film = visit.download(button, tmp_path)
    assert film.read_bytes()[:4] == b"\x1a\x45\xdf\xa3"
    assert b"V_VP" in film.read_bytes()
    (tmp_path / "film.html").write_text("<p id='status'>.</p><video src='body.webm' muted></video>")
    with visiting(browser, FILE) as other:
        other.open(f"{tmp_path}/film.html".lstrip("/"))
        other.wait_for("document.querySelector('video').readyState >= 2")
        video = other.page.locator("video")
        width = visit.page.locator('[data-view="body"] canvas').evaluate("(one) => one.width")
        assert video.evaluate("(one) => one.videoWidth") == width
        shown = Image.open(io.BytesIO(video.screenshot())).convert("RGB")
        assert len(shown.getcolors(1 << 24)) > 300
    visit.page.click(button)
    shortest = visit.download(button, tmp_path)
    assert b"V_VP" in shortest.read_bytes()
