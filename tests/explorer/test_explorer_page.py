"""The explorer as a server gives it: policy, compression, without keys, without a bundle."""

from __future__ import annotations

import gzip
import re
from pathlib import Path

import pytest
from starlette.testclient import TestClient

from veselova.mechanics.systems.catalogue import class_of
from veselova.service.api.settings import Settings
from veselova.service.http import pages
from veselova.service.http.app import create_app

#: Bytes of the first load, with what the page imports at once, in gzip.
LARGEST_FIRST_LOAD = 350_000


#: Files that come when they are asked for: the API's page.
LATER = ("docs-",)


def test_the_page_has_the_systems_of_python() -> None:
    text = (Path(__file__).parents[2] / "explorer" / "src" / "page" / "systems.ts").read_text()
    entries = re.findall(r'^  "?([\w-]+)"?: \{\n    title(.*?)^  \},', text, re.M | re.S)
    assert len(entries) == text.count('className: "')
    for system, entry in entries:
        assert f'className: "{class_of(system).__name__}"' in entry
        assert ("integrated: true" in entry) == ("analytic" not in class_of(system).engines)


@pytest.fixture
def client(tmp_path: Path) -> TestClient:
    """Return a client of the application, without its workers."""
    settings = Settings(data_dir=tmp_path, keys="required")
    return TestClient(create_app(settings, loopback=True), "http://localhost")


def test_the_page_and_its_files_need_no_key(bundle: Path, client: TestClient) -> None:
    page = client.get("/")
    assert page.status_code == 200
    assert page.headers["content-type"].startswith("text/html")
    names = re.findall(r'(?:src|href)="\./(explorer/[\w.-]+)"', page.text)
    assert any(name.endswith(".js") for name in names)
    for name in names:
        file = client.get(f"/{name}")
        assert file.status_code == 200, name
        assert "immutable" in file.headers["cache-control"]
    assert client.post("/v1/tori", json={}).status_code == 401
    assert client.get("/explorer").status_code == 401


def test_the_policy_lets_nothing_but_its_own_files_run(bundle: Path, client: TestClient) -> None:
    for path in ("/", f"/explorer/{next((bundle / 'explorer').glob('*.js')).name}"):
        policy = dict(
            entry.split(" ", 1)
            for entry in client.get(path).headers["content-security-policy"].split("; ")
        )
        assert policy["default-src"] == "'none'"
        assert policy["script-src"] == policy["worker-src"] == policy["connect-src"] == "'self'"
        assert "unsafe" not in str(policy)
    text = client.get("/").text
    assert not re.search(r"<script(?![^>]*\bsrc=)|<style|\sstyle=|\son\w+=", text)
    assert "://" not in re.sub(r'href="data:[^"]*"', "", text)


def test_the_page_of_the_api_runs_its_own_files_alone(bundle: Path, client: TestClient) -> None:
    page = client.get("/docs")
    assert page.status_code == 200
    policy = page.headers["content-security-policy"]
    assert policy.startswith("default-src 'none'; script-src 'self'; style-src 'self'")
    assert "unsafe" not in policy
    assert "http" not in policy
    for header, value in (("x-content-type-options", "nosniff"), ("x-frame-options", "DENY")):
        assert page.headers[header] == value
    names = re.findall(r'(?:src|href)="\./(explorer/[\w.-]+)"', page.text)
    assert len(names) == 2
    assert all(client.get(f"/{name}").status_code == 200 for name in names)
    assert not re.search(r"<script(?![^>]*\bsrc=)|<style|\sstyle=|\son\w+=", page.text)


def test_files_are_compressed_and_known_again(bundle: Path, client: TestClient) -> None:
    plain = client.get("/", headers={"Accept-Encoding": "identity"})
    assert "content-encoding" not in plain.headers
    packed = client.get("/", headers={"Accept-Encoding": "gzip"})
    assert packed.headers["content-encoding"] == "gzip"
    assert packed.content == plain.content
    again = client.get("/", headers={"If-None-Match": plain.headers["etag"]})
    assert again.status_code == 304
    assert not again.content
    head = client.head("/")
    assert head.status_code == 200
    assert not head.content


def test_the_first_load_is_small(bundle: Path) -> None:
    """All scripts and styles together, and the fonts that the formulas of the page take."""
    folder = bundle / "explorer"
    files = [
        path
        for path in folder.iterdir()
        if path.suffix in (".js", ".css") and not path.name.startswith(LATER)
    ]
    assert len(files) >= 5
    size = sum(len(gzip.compress(path.read_bytes())) for path in files)
    fonts = ("KaTeX_Main-Regular", "KaTeX_Math-Italic", "KaTeX_Size1", "KaTeX_Size2")
    size += sum(path.stat().st_size for name in fonts for path in folder.glob(f"{name}-*"))
    assert size < LARGEST_FIRST_LOAD
    assert not [path for path in folder.iterdir() if path.suffix in (".ttf", ".woff")]


def test_without_a_bundle_the_page_says_how_to_get_it(tmp_path: Path) -> None:
    from fastapi import FastAPI

    app = FastAPI(docs_url=None)
    pages.add_explorer(app, tmp_path)
    for path in ("/", "/docs"):
        answer = TestClient(app, "http://localhost").get(path)
        assert answer.status_code == 404
        assert answer.text.count(".\n") == 1
        assert "explorer/build.py" in answer.text
