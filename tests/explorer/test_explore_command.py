"""``veselova explore``: a server on a free port, and the address of the page."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path
from urllib.parse import parse_qs, urlsplit

import httpx2
import pytest

from conftest import PATIENCE
from veselova.mechanics.core.errors import InvalidInput
from veselova.service.cli.explore import address_of

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
