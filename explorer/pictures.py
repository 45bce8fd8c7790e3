"""Make the pictures of docs/explorer.md: python explorer/pictures.py, with playwright and chromium.

Every view is shown by a preset that suits it, at two sizes: as a card of a broad page and of a
telephone's. Colours are reduced to some 220, so that a picture has some tens of kilobytes.
"""

from __future__ import annotations

import io
import shutil
import socket
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

from PIL import Image
from playwright.sync_api import sync_playwright

DOCS = Path(__file__).resolve().parent.parent / "docs"

#: View → the preset that shows it, and the time.
VIEWS = {
    "body": ("body", "4.6"),
    "sphere": ("body", "4.6"),
    "torus": ("body", "4.6"),
    "ball": ("ball", "20"),
    "ellipsoid": ("body", "6.2"),
    "curve": ("body", "4.6"),
    "constants": ("body", "4.6"),
    "engines": ("body", "4.6"),
}

#: Name → width and height of the page.
SIZES = {"broad": (1280, 860), "narrow": (390, 844)}

#: The colours of Okabe and Ito, and two shades of each.
ACCENTS = [
    tuple(round(part * shade) for part in colour)
    for colour in (
        (230, 159, 0),
        (86, 180, 233),
        (0, 158, 115),
        (213, 94, 0),
        (204, 121, 167),
        (255, 255, 255),
    )
    for shade in (1.0, 0.75, 0.5)
]

ARGUMENTS = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader"]
ARGUMENTS += ["--enable-unsafe-swiftshader", "--disable-background-networking"]


def main() -> None:
    """Start a server, and take the pictures."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    command = [sys.executable, "-m", "veselova", "explore", "--no-browser", "--port", str(port)]
    server = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    try:
        assert server.stdout
        assert server.stdout.readline().startswith("The explorer is at")
        with sync_playwright() as tool:
            browser = tool.chromium.launch(executable_path=shutil.which("chromium"), args=ARGUMENTS)
            take_all(browser, f"http://127.0.0.1:{port}/")
            browser.close()
    finally:
        server.terminate()
        server.wait()


def take_all(browser: Any, address: str) -> None:
    """Take the picture of the whole page, and two of each view."""
    whole = open_page(browser, address, 1440, 900, "#preset=body&t=4.6&play=0")
    save(whole.screenshot(), "explorer.png")
    whole.context.close()
    for size, (width, height) in SIZES.items():
        for view, (preset, t) in VIEWS.items():
            large = f"&view={view}" if size == "broad" and view != "engines" else ""
            fragment = f"#preset={preset}&t={t}&play=0{large}"
            page = open_page(browser, address, width, height, fragment)
            card = page.locator(f'[data-view="{view}"]')
            card.scroll_into_view_if_needed()
            page.wait_for_timeout(1500)
            save(card.screenshot(), f"explorer-{view}-{size}.png")
            page.context.close()


def open_page(browser: Any, address: str, width: int, height: int, fragment: str) -> Any:
    """Return a page once its motion, its trail and its plots are there."""
    context = browser.new_context(viewport={"width": width, "height": height}, color_scheme="dark")
    page = context.new_page()
    page.goto(f"{address}{fragment}")
    deadline = time.monotonic() + 90
    ready = "document.getElementById('twin-engines')?.textContent.includes('integration')"
    while not page.evaluate(f"Boolean({ready})") and time.monotonic() < deadline:
        page.wait_for_timeout(100)
    page.wait_for_timeout(1500)
    return page


def save(picture: bytes, name: str) -> None:
    """Write a picture in 128 colours."""
    image = Image.open(io.BytesIO(picture)).convert("RGB")
    # The colours of points and arrows are few pixels, which no palette of averages keeps.
    common = image.quantize(200, Image.Quantize.MEDIANCUT).getpalette() or []
    palette = Image.new("P", (1, 1))
    palette.putpalette(common[:600] + [entry for colour in ACCENTS for entry in colour])
    reduced = image.quantize(palette=palette, dither=Image.Dither.NONE)
    reduced.save(DOCS / name, optimize=True)
    print(f"{name}: {(DOCS / name).stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
