"""``veselova explore``: the explorer on a free port of loopback, in the browser of the desktop."""

from __future__ import annotations

import json
import socket
import threading
import time
import webbrowser
from contextlib import suppress
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

from veselova.mechanics.core.errors import InvalidInput, show
from veselova.service.http.pages import EXPLORER, MISSING
from veselova.service.http.server import serve

#: Seconds that the server may take until it answers.
_PATIENCE_S = 60.0

_LOOPBACK = "127.0.0.1"


def export(folder: Path, document: Any) -> None:
    """Write the explorer and its examples as a static site; raises InvalidInput for a folder that
    is a file, and where a problem is given too.
    """
    from veselova.motion_page import write_site

    if document is not None:
        raise InvalidInput(("FILE",), "no file beside --export, which writes the examples", "one")
    folder = folder.expanduser()
    if folder.exists() and not folder.is_dir():
        raise InvalidInput(("--export",), "a folder", f"the file {folder}")
    write_site(folder)
    print(f"The site is in {folder}: any web host serves it.")


def explore(document: Any, port: int, browser: bool) -> None:
    """Serve the explorer until interrupted, with a problem where one is given.

    ``document`` is the body of a request, or None; port 0 takes a free one; ``browser`` opens the
    page. Raises InvalidInput where the document has no problem, and for a port that is taken.
    """
    chosen = port or _free_port()
    address = address_of(chosen, document)
    if not (EXPLORER / "index.html").is_file():
        print(MISSING, end="")
    announce = threading.Thread(target=_announce, args=(chosen, address, browser), daemon=True)
    announce.start()
    serve(_LOOPBACK, chosen, log_level="warning")


def address_of(port: int, document: Any = None) -> str:
    """Return the address of the page, with the problem of a request in its fragment."""
    address = f"http://{_LOOPBACK}:{port}/"
    if document is None:
        return address
    problem = document.get("problem") if isinstance(document, dict) else None
    if not isinstance(problem, dict) or not isinstance(problem.get("system"), str):
        required = "a request with a problem that names its system"
        raise InvalidInput(("FILE",), required, show(document))
    fragment = urlencode({"problem": json.dumps(problem, separators=(",", ":"))})
    return f"{address}#{fragment}"


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind((_LOOPBACK, 0))
        return int(probe.getsockname()[1])


def _announce(port: int, address: str, browser: bool) -> None:
    """Print the address once the server answers, and open it."""
    deadline = time.monotonic() + _PATIENCE_S
    while time.monotonic() < deadline:
        with suppress(OSError), socket.create_connection((_LOOPBACK, port), timeout=2):
            print(f"The explorer is at {address} until you interrupt it (Ctrl-C).", flush=True)
            if browser:
                webbrowser.open(address)
            return
        time.sleep(0.05)
