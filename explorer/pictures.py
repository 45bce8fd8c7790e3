"""Make docs/explorer.png: python explorer/pictures.py, with playwright and chromium. Colours are
reduced to some 220, so that it has some hundred kilobytes.
"""

from __future__ import annotations

import io
import shutil
import socket
import subprocess
import sys
from pathlib import Path
from typing import Any

from PIL import Image
from playwright.sync_api import sync_playwright

PICTURE = Path(__file__).resolve().parent.parent / "docs" / "explorer.png"

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
    """Start a server, and take the picture."""
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
            take(browser, f"http://127.0.0.1:{port}/#preset=body&t=4.6&play=0")
            browser.close()
    finally:
        server.terminate()
        server.wait()


def take(browser: Any, address: str) -> None:
    """Save the page once its motion, its trail and its plots are there."""
    page = browser.new_page(viewport={"width": 1440, "height": 900}, color_scheme="dark")
    page.goto(address)
    compared = page.locator("#twin-engines", has_text="integration")
    compared.wait_for(state="attached", timeout=90_000)
    page.wait_for_timeout(1500)
    save(page.screenshot())


def save(picture: bytes) -> None:
    """Write a picture in 128 colours."""
    image = Image.open(io.BytesIO(picture)).convert("RGB")
    # The colours of points and arrows are few pixels, which no palette of averages keeps.
    common = image.quantize(200, Image.Quantize.MEDIANCUT).getpalette() or []
    palette = Image.new("P", (1, 1))
    palette.putpalette(common[:600] + [entry for colour in ACCENTS for entry in colour])
    reduced = image.quantize(palette=palette, dither=Image.Dither.NONE)
    reduced.save(PICTURE, optimize=True)


if __name__ == "__main__":
    main()
