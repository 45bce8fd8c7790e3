"""``veselova explore``: a server on a free port, and the address of the page."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from typing import Any
from urllib.parse import parse_qs, urlsplit

import httpx2
import pytest
from explorer_browser import needs_chromium, visiting

from conftest import PATIENCE
from veselova import motion_page
from veselova.mechanics.core.errors import InvalidInput
from veselova.service.cli.explore import address_of, export

ROOT = Path(__file__).parent.parent.parent


def test_the_command_serves_and_prints_its_address(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "veselova", "explore", "--no-browser"]
    process = subprocess.Popen(
        [*command, str(ROOT / "examples" / "ball.json")],
        env={**os.environ, "VESELOVA_DATA_DIR": str(tmp_path / "data")},
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )
    try:
        assert process.stdout
        line = next(line for line in process.stdout if line.startswith("The explorer is at"))
        address = line.split()[4]
        problem = json.loads(parse_qs(urlsplit(address).fragment)["problem"][0])
        assert problem == json.loads((ROOT / "examples" / "ball.json").read_text())["problem"]
        parts = urlsplit(address)
        answer = httpx2.get(f"{parts.scheme}://{parts.netloc}/", timeout=PATIENCE)
        assert answer.status_code in (200, 404)
        assert "xplorer" in answer.text
    finally:
        process.send_signal(signal.SIGTERM)
        process.wait(PATIENCE)
        if process.stdout:
            process.stdout.close()


def test_a_file_without_a_problem_is_refused() -> None:
    assert address_of(8000) == "http://127.0.0.1:8000/"
    for document in ([], {"problem": {}}, {"problem": {"system": 3}}, {"times": [1]}):
        with pytest.raises(InvalidInput, match="FILE: required a request with a problem"):
            address_of(8000, document)


@pytest.mark.daily(4)
@needs_chromium
def test_an_exported_site_plays_below_a_path_and_says_what_needs_the_server(
    browser: Any, bundle: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Fewer examples, without digits for far times: those of the others take seconds each.
    names = ("generic", "ball", "umbilic")
    read = motion_page.orjson.loads
    monkeypatch.setattr(
        motion_page.orjson, "loads", lambda text: [x for x in read(text) if x["name"] in names]
    )
    export(tmp_path / "any" / "path", None)
    handler = partial(SimpleHTTPRequestHandler, directory=tmp_path)
    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as host:
        Thread(target=host.serve_forever, daemon=True).start()
        address = f"http://127.0.0.1:{host.server_port}"
        with visiting(browser, address) as visit:
            for name in names:
                visit.open(f"any/path/#preset={name}")
                assert visit.text("#message") == ""
                visit.wait_for("Number(document.getElementById('time').value) > 0.2")
                visit.page.click("#play")
            visit.open("any/path/#preset=generic&play=0")
            visit.enter("#text-A-0", "4")
            visit.wait_for("document.getElementById('message').textContent.includes('no server')")
            assert visit.page.is_hidden("#curl")
        host.shutdown()


def test_an_export_needs_a_folder_and_takes_no_problem(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(InvalidInput, match="--export: required a folder"):
        export(tmp_path / "file", None)
    with pytest.raises(InvalidInput, match="FILE: required no file beside --export"):
        export(tmp_path / "site", {"problem": {}})
