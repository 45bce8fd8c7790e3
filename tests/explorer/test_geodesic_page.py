"""The page of geodesics, against numbers of Python: links, dragging, the keyboard, refusals."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from explorer_browser import PIXELS, Visit, needs_chromium, visiting

import veselova as vs
from conftest import Server

pytestmark = needs_chromium

HAUMEA = "#ellipsoid=Haumea&P=10,20&Q=-35,160"

#: Where a point is on the screen: the middle of the pixels of its colour.
_PLACE = """([canvas, colour]) => PIXELS
  let [count, x, y] = [0, 0, 0];
  for (let k = 0; k < data.length; k += 4) {
    if (colour.some((part, i) => Math.abs(part - data[k + i]) > 3)) continue;
    [count, x, y] = [count + 1, x + ((k / 4) % width), y + Math.floor(k / 4 / width)];
  }
  const box = canvas.getBoundingClientRect();
  return [box.left + (x / count / width) * box.width, box.top + (y / count / height) * box.height];
}""".replace("PIXELS", PIXELS)

VERMILION = [213, 94, 0]


@pytest.fixture
def geodesics(browser: Any, server: Server) -> Any:
    with visiting(browser, server.url) as visit:
        visit.page.goto(f"{server.url}/geodesics{HAUMEA}")
        visit.wait_for("document.querySelector('#facts td')")
        yield visit


def ends(visit: Visit) -> tuple[list[float], list[float]]:
    """Return P and Q as the address has them."""
    state = visit.state()
    one, two = ([float(x) for x in state[name].split(",")] for name in "PQ")
    return one, two


def require_line(visit: Visit, ellipsoid: Any) -> None:
    """Wait until the page shows the line of the points in its address, which is written later."""
    for _ in range(300):
        length = float(vs.geodesics.Ellipsoid(ellipsoid).inverse(*ends(visit)).s12)
        shown = float(visit.text("#facts td"))
        if abs(shown - length) < 1e-9 * length:
            return
        visit.page.wait_for_timeout(100)
    raise AssertionError(f"{shown} is shown, and it is {length}")


def test_a_link_shows_the_shortest_way(geodesics: Visit) -> None:
    require_line(geodesics, "Haumea")
    geodesics.wait_for_ink("geodesic", 100, 0.1)
    assert "Another way" not in geodesics.text(".twin")
    geodesics.page.evaluate("location.hash = '#ellipsoid=3,2,1&P=0,0&Q=0,180'")
    geodesics.wait_for("document.querySelector('.twin').textContent.includes('Another way')")
    require_line(geodesics, (3, 2, 1))


def test_a_point_is_dragged(geodesics: Visit) -> None:
    mouse = geodesics.page.mouse
    geodesics.wait_for_ink("geodesic", 100, 0.1)
    canvas = geodesics.page.locator("canvas").first.element_handle()
    x, y = geodesics.page.evaluate(_PLACE, [canvas, VERMILION])
    mouse.move(x, y)
    mouse.down()
    mouse.move(x + 40, y - 50, steps=4)
    mouse.up()
    geodesics.wait_for("!location.hash.includes('P=10%2C20')")
    P, Q = ends(geodesics)
    assert np.hypot(P[0] - 10, P[1] - 20) > 5
    assert Q == [-35, 160]
    require_line(geodesics, "Haumea")
    moved = geodesics.page.evaluate(_PLACE, [canvas, VERMILION])
    assert np.hypot(moved[0] - x - 40, moved[1] - y + 50) < 6


def test_the_keyboard_moves_a_point(geodesics: Visit) -> None:
    geodesics.page.focus("#slider-Q-0")
    geodesics.page.keyboard.press("ArrowRight")
    geodesics.wait_for("location.hash.includes('Q=-34.9')")
    require_line(geodesics, "Haumea")
    geodesics.enter("#text-Q-1", "-150.25", "Tab")
    geodesics.wait_for("location.hash.includes('Q=-34.9%2C-150.25')")
    require_line(geodesics, "Haumea")


def test_what_is_no_ellipsoid_or_point_is_said(geodesics: Visit) -> None:
    geodesics.allowed = ("status of 422",)
    geodesics.enter("#semiaxes", "3, 0, 1", "Tab")
    geodesics.wait_for("document.querySelector('#message').textContent.startsWith('ellipsoid[1]')")
    geodesics.enter("#semiaxes", "3, 2, 1", "Tab")
    geodesics.wait_for("!document.querySelector('#message').textContent")
    geodesics.enter("#text-P-0", "91", "Tab")
    assert "latitude of P" in geodesics.text("#message")
    assert ends(geodesics)[0] == [10, 20]


@pytest.mark.daily(3)
@pytest.mark.parametrize("scheme", ["dark", "light"])
def test_a_phone_has_one_column_and_axe_finds_no_barrier(
    browser: Any, server: Server, scheme: str
) -> None:
    size = {"width": 390, "height": 844}
    with visiting(browser, server.url, viewport=size, color_scheme=scheme) as visit:
        visit.page.goto(f"{server.url}/geodesics")
        visit.wait_for("document.querySelector('#facts td')")
        visit.wait_for_ink("geodesic", 100, 0.1)
        assert visit.page.evaluate("document.documentElement.scrollWidth") <= 390
        visit.require_no_barrier()
