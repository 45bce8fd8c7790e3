"""Chromium for the tests of the explorer, driven by playwright.

Every page reports its errors, breaches of its policy and requests to other origins; each test
fails for any of them.
"""

from __future__ import annotations

import re
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, urlsplit

import pytest
from explorer_bundle import EXPLORER, build_or_skip

playwright = pytest.importorskip("playwright.sync_api", reason="needs playwright")
CHROMIUM = shutil.which("chromium")

#: The mark of tests that need it.
needs_chromium = pytest.mark.skipif(
    CHROMIUM is None, reason="needs chromium: apt-get install chromium"
)

#: Seconds that a page may take for what must come; only a failure takes them.
PATIENCE_S = 60.0

#: Graphics are drawn by the processor, and the browser asks nothing of any network.
ARGUMENTS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
]

#: The origin of pages that are files: they ask nothing of any server.
FILE = "file://"

#: Breaches of the policy, collected in the page.
_WATCH = """
window.breaches = [];
document.addEventListener("securitypolicyviolation", (event) =>
  window.breaches.push(`${event.violatedDirective} ${event.blockedURI}`));
"""

#: The first of the facts of a motion, and what is done before another motion is asked for.
_FACT = "document.querySelector('#facts td:not([data-left])')?.textContent"
_LEAVE = """() => {
  const status = document.getElementById("status");
  if (!status) return;
  status.replaceChildren();
  document.querySelector("#facts td")?.setAttribute("data-left", "");
  document.activeElement?.blur();
  history.replaceState(null, "", "#");
}"""

#: Gives the width and height of a canvas, and the data of its pixels, four numbers each.
PIXELS = """{
  const { width, height } = canvas;
  const copy = document.createElement("canvas");
  [copy.width, copy.height] = [width, height];
  const context = copy.getContext("2d");
  context.drawImage(canvas, 0, 0);
  const data = context.getImageData(0, 0, width, height).data;
"""

#: How many different colours a canvas shows, and the part that is not the commonest.
_INK = """(canvas) => PIXELS
  const counts = new Map();
  for (let k = 0; k < data.length; k += 4) {
    const colour = (data[k] << 16) | (data[k + 1] << 8) | data[k + 2];
    counts.set(colour, (counts.get(colour) ?? 0) + 1);
  }
  return [counts.size, 1 - Math.max(...counts.values()) / (data.length / 4)];
}""".replace("PIXELS", PIXELS)


def numbers(text: str) -> list[float]:
    """Return the numbers of a text as the page writes them, with commas between."""
    return [float(entry) for entry in text.replace("−", "-").split(", ")]


@dataclass
class Visit:
    """A page, and what went wrong in it; messages with a text that is allowed are no fault."""

    page: Any
    origin: str
    allowed: tuple[str, ...] = ()
    faults: list[str] = field(default_factory=list)

    def open(self, address: str = "") -> None:
        """Go to an address of the server, and wait until a motion is shown.

        Where a page is open already, it goes on, without loading, to the state in the address.
        """
        self.page.evaluate(_LEAVE)
        self.page.goto(f"{self.origin}/{address}")
        self.wait_for("document.getElementById('status')?.textContent")
        self.wait_for(f"!document.getElementById('facts') || {_FACT}")

    def check(self) -> None:
        """Fail for what went wrong up to now; what was allowed is allowed no longer."""
        found = [*self.faults, *self.page.evaluate("window.breaches.splice(0)")]
        self.faults.clear()
        self.allowed = ()
        assert not found, found

    def enter(self, selector: str, text: str, key: str = "Enter") -> None:
        """Write a text into a field, and leave it by a key."""
        self.page.fill(selector, text)
        self.page.keyboard.press(key)

    def require_no_barrier(self) -> None:
        """Fail for what axe calls serious or critical; skips the test where there is no axe."""
        axe = EXPLORER / "node_modules" / "axe-core" / "axe.min.js"
        if not axe.exists():
            pytest.skip("needs the packages of explorer/package-lock.json")
        self.page.evaluate(axe.read_text())
        found = self.page.evaluate("axe.run()")
        serious = [
            (one["id"], [node["target"] for node in one["nodes"]])
            for one in found["violations"]
            if one["impact"] in ("serious", "critical")
        ]
        assert not serious
        assert len(found["passes"]) > 15

    def fact(self, besides: str = "") -> str:
        """Return the first of the facts, once it is there and another than this."""
        # A motion that has just come has none before its first picture.
        return str(self.value_of(f"[{_FACT}].find((text) => text !== {besides!r})"))

    def wait_for(self, condition: str) -> None:
        """Wait until an expression of JavaScript is true."""
        self.value_of(f"Boolean({condition})")

    def value_of(self, expression: str) -> Any:
        """Return what an expression of JavaScript has, once that is true."""
        # By asking again: the policy of the page forbids what playwright would evaluate in it.
        deadline = time.monotonic() + PATIENCE_S
        while not (found := self.page.evaluate(expression)):
            if time.monotonic() > deadline:
                self.page.goto("about:blank")  # what the next test opens here begins anew
                raise AssertionError(f"{expression} did not come")
            self.page.wait_for_timeout(30)
        return found

    def text(self, selector: str) -> str:
        """Return the text of an element."""
        return str(self.page.text_content(selector))

    def vectors(self, selector: str) -> list[list[float]]:
        """Return the numbers in brackets of the text of an element."""
        found = re.findall(r"\(([-−.,e+\d\s]+)\)", self.text(selector))
        return [numbers(entry) for entry in found]

    def time(self) -> float:
        """Return the time that is shown."""
        return float(Fraction(self.page.input_value("#time")))

    def state(self) -> dict[str, str]:
        """Return the state in the address."""
        fragment = urlsplit(self.page.url).fragment
        return {name: values[0] for name, values in parse_qs(fragment).items()}

    def download(self, selector: str, folder: Path) -> Path:
        """Press a button, and return the file that it gives."""
        with self.page.expect_download() as waiting:
            self.page.click(selector)
        target = folder / waiting.value.suggested_filename
        waiting.value.save_as(target)
        return target

    def ink(self, view: str) -> tuple[int, float]:
        """Return how many colours a view shows, and how much of it is drawn on."""
        canvas = self.page.locator(f'[data-view="{view}"] canvas').first
        canvas.scroll_into_view_if_needed()
        colours, part = canvas.evaluate(_INK)
        return int(colours), float(part)

    def wait_for_ink(self, view: str, colours: int, part: float) -> None:
        """Wait until a view shows so many colours on so much of it."""
        for _ in range(200):
            found = self.ink(view)
            if found[0] >= colours and found[1] >= part:
                return
            self.page.wait_for_timeout(100)
        raise AssertionError(f"{view} shows {found}")


@contextmanager
def running_browser() -> Iterator[Any]:
    """Run chromium, without a window, beside a bundle that is as the sources are."""
    build_or_skip()
    with playwright.sync_playwright() as tool:
        running = tool.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        yield running
        running.close()


@contextmanager
def visiting(browser: Any, origin: str, allowed: tuple[str, ...] = (), **options: Any) -> Any:
    """Open a page in a context of its own; what went wrong in it fails the test."""
    options.setdefault("viewport", {"width": 1000, "height": 640})
    context = browser.new_context(**options)
    context.add_init_script(_WATCH)
    page = context.new_page()
    page.set_default_timeout(1000 * PATIENCE_S)
    visit = Visit(page, origin, allowed)
    page.on("console", lambda message: _note(visit, message))
    page.on("pageerror", lambda error: visit.faults.append(f"uncaught {error}"))
    page.on("request", lambda request: _check_origin(visit, request.url))
    try:
        yield visit
        visit.check()
    finally:
        context.close()


#: What the browser says of a server that has too much to do: the page asks again.
BUSY = ("status of 503", "status of 504")


def _note(visit: Visit, message: Any) -> None:
    allowed = (*visit.allowed, *BUSY)
    if message.type == "error" and not any(text in message.text for text in allowed):
        visit.faults.append(f"console: {message.text}")


def _check_origin(visit: Visit, address: str) -> None:
    parts = urlsplit(address)
    if visit.origin == FILE:
        if parts.scheme not in ("blob", "data", "file"):
            visit.faults.append(f"request to {address}")
    elif (
        parts.scheme not in ("blob", "data") and f"{parts.scheme}://{parts.netloc}" != visit.origin
    ):
        visit.faults.append(f"request to {address}")
