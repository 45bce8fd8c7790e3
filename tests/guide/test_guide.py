"""The guide: built without a warning, complete, served with its own policy, searched offline."""

from __future__ import annotations

import ast
import re
import shutil
import sys
from base64 import b64decode
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

import pytest
from fastapi import FastAPI
from guide_site import ROOT, build_or_skip
from starlette.testclient import TestClient

import veselova
from conftest import Server, running_server
from veselova import curves, geodesics, theta
from veselova.service.api.problem_details import REFUSALS
from veselova.service.api.settings import Settings
from veselova.service.http import pages

CHROMIUM = shutil.which("chromium")


@pytest.fixture(scope="module")
def site() -> Path:
    """Return the folder of the site."""
    return build_or_skip()


class _Page(HTMLParser):
    """The links of a page, what it loads, and its anchors."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.links: list[str] = []
        self.loaded: list[str] = []
        self.anchors: set[str] = set()
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Note an element."""
        values = {name: value or "" for name, value in attrs}
        self.anchors |= {values[name] for name in ("id", "name") if name in values}
        if tag == "a" and "href" in values:
            self.links.append(values["href"])
        elif tag in ("img", "script", "source") and "src" in values:
            self.loaded.append(values["src"])
        elif tag == "link" and values.get("rel") in ("stylesheet", "icon", "preload"):
            self.loaded.append(values["href"])


def test_every_link_inside_the_site_leads_somewhere(site: Path) -> None:
    pages = {path.resolve(): _Page(path) for path in site.rglob("*.html")}
    assert len(pages) > 40
    for path, page in pages.items():
        for link in page.links + page.loaded:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            assert target.is_file(), f"{path.relative_to(site)} links to {link}"
            if parts.fragment and target in pages:
                anchors = pages[target].anchors
                assert unquote(parts.fragment) in anchors, f"{path.name} links to {link}"


def test_nothing_is_loaded_from_another_site(site: Path) -> None:
    for path in site.rglob("*.html"):
        for address in _Page(path).loaded:
            assert not urlsplit(address).netloc, f"{path.name} loads {address}"
    for path in site.rglob("*.css"):
        assert not re.search(r"(url\(|@import)\s*['\"]?(https?:)?//", path.read_text()), path


def test_formulas_are_set_when_the_site_is_built(site: Path) -> None:
    text = (site / "docs" / "toolkit.html").read_text()
    assert 'class="katex-display"' in text
    assert not [path for path in site.rglob("*.html") if "katex-error" in path.read_text()]
    fonts = list((site / "_static" / "katex" / "fonts").glob("*.woff2"))
    assert len(fonts) > 10


def test_every_public_name_has_its_entry(site: Path) -> None:
    pages = [_Page(path) for path in (site / "docs" / "reference").glob("api*.html")]
    anchors = set().union(*(page.anchors for page in pages))
    modules = {"theta", "curves", "geodesics"}  # of which every name has one
    public = set(veselova.__all__) - modules - {"__version__"}
    names = [f"veselova.{name}" for name in public]
    names += [f"veselova.theta.{name}" for name in theta.__all__]
    names += [f"veselova.curves.{name}" for name in curves.__all__]
    names += [f"veselova.geodesics.{name}" for name in geodesics.__all__]
    assert not {name for name in names if name not in anchors}


def test_functions_that_the_paper_page_names_are_links(site: Path) -> None:
    page = (site / "docs" / "paper.html").read_text()
    rows = [re.findall(r"<td.*?</td>", row, re.S) for row in re.findall(r"<tr.*?</tr>", page, re.S)]
    functions = [cells[2] for cells in rows if len(cells) == 4]
    assert len(functions) > 100
    for cell in functions:
        if re.search(r"paper\.|Chaplygin(Multiplier|Reduction)", cell):
            continue  # functions of tests/paper, which are no part of the package
        unlinked = re.sub(r"<a .*?</a>", "", cell, flags=re.S)
        names = re.findall(r'<span class="pre">(.*?)</span>', unlinked)
        # Names of integrals and formulations are none of functions.
        assert not [name for name in names if "." in name], cell


def test_tables_of_the_reference_come_from_the_program(site: Path) -> None:
    reference = site / "docs" / "reference"
    errors = (reference / "errors.html").read_text()
    assert {f"VESELOVA_{name.upper()}" for name in Settings.model_fields} <= _words(errors)
    assert {*REFUSALS, "invalid-input", "method-not-allowed"} <= _words(errors)
    commands = _words((site / "docs" / "command-line.html").read_text())
    assert {"--require-keys", "--expires", "--animate"} <= commands


def _words(page: str) -> set[str]:
    return set(re.findall(r'<span class="pre">([^<]*?),?</span>', page))


DRAWING = [
    path.stem
    for path in sorted((ROOT / "docs").glob("*.md"))
    if re.search(r'savefig\(".*\.png"\)', path.read_text())
]


@pytest.mark.parametrize("name", DRAWING)
def test_pages_show_the_pictures_that_their_code_draws(name: str, site: Path) -> None:
    source = (ROOT / "docs" / f"{name}.md").read_text()
    page = (site / "docs" / f"{name}.html").read_text()
    for picture in re.findall(r'savefig\("(.*?\.png)"\)', source):
        assert picture in page
        assert (site / "_images" / picture).stat().st_size > 5000


def test_outcomes_of_the_program_have_their_row() -> None:
    text = (ROOT / "docs" / "reference" / "errors.md").read_text()
    section = text[text.index("## Outcomes") : text.index("## Over HTTP")]
    rows = set(re.findall(r"^\| `([a-z-]+)` \|", section, re.MULTILINE))
    sources = [path.read_text() for path in (ROOT / "src").rglob("*.py")]
    raised: set[str] = set()
    for node in (node for text in sources for node in ast.walk(ast.parse(text))):
        if isinstance(node, ast.Call) and ast.unparse(node.func).endswith("Unsolved"):
            first = ast.walk(node.args[0]) if node.args else ()
            raised |= {str(part.value) for part in first if isinstance(part, ast.Constant)}
    assert raised <= rows
    strings = set(re.findall(r'"([a-z]+(?:-[a-z]+)+|separatrix|collision)"', "".join(sources)))
    assert rows <= strings


EXAMPLES = sorted((ROOT / "examples" / "gallery").glob("plot_*.py"))


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_examples_are_short_and_have_a_picture(path: Path, site: Path) -> None:
    text = path.read_text()
    assert text.count("\n") <= 120
    imported = re.findall(r"^(?:import|from) (\w+)", text, re.MULTILINE)
    assert {*imported} <= {*sys.stdlib_module_names, "matplotlib", "numpy", "scipy", "veselova"}
    title = (ast.get_docstring(ast.parse(text)) or "").splitlines()[0]
    page = (site / "docs" / "gallery" / f"{path.stem}.html").read_text()
    assert title in page
    download = re.search(rf'download="{path.name}" href="data:text/x-python;base64,(.*?)"', page)
    assert download
    assert b64decode(download[1]).decode() == text
    pictures = re.findall(rf"_images/(sphx_glr_{path.stem}_\d+\.png)", page)
    assert pictures
    assert all((site / "_images" / name).stat().st_size > 10_000 for name in pictures)


def test_the_site_is_public_and_has_its_own_policy(site: Path, tmp_path: Path) -> None:
    with running_server(tmp_path, "--require-keys", awaited="/healthz") as server:
        assert server.get("/guide").headers["location"] == "guide/"
        assert server.get("/guide/").text == (site / "index.html").read_text()
        page = server.get("/guide/docs/index.html")
        assert page.status_code == 200
        policy = page.headers["content-security-policy"]
        scripts = re.search(r"script-src ([^;]*)", policy)
        assert scripts
        assert "unsafe" not in scripts[1]
        assert "default-src 'none'" in policy
        assert server.get("/guide/_static/guide.css").headers["content-type"].startswith("text/css")
        for name in ("%2e%2e/version.py", "nothing.html", "..%2f..%2fpyproject.toml", "docs"):
            assert server.get(f"/guide/{name}").status_code == 404


def test_without_a_site_one_sentence_says_how_to_get_it(tmp_path: Path) -> None:
    app = FastAPI()
    pages.add_guide(app, tmp_path)
    answer = TestClient(app, "http://localhost").get("/guide/docs/index.html")
    assert answer.status_code == 404
    assert answer.text.count(".\n") == 1
    assert "docs/build" in answer.text


@pytest.fixture(scope="module")
def browser(site: Path) -> Iterator[Any]:
    """Return chromium, without a window and without a network beyond this machine."""
    playwright = pytest.importorskip("playwright.sync_api", reason="needs playwright")
    if CHROMIUM is None:
        pytest.skip("needs chromium: apt-get install chromium")
    arguments = ["--no-sandbox", "--disable-gpu", "--disable-background-networking"]
    with playwright.sync_playwright() as tool:
        running = tool.chromium.launch(executable_path=CHROMIUM, args=arguments)
        yield running
        running.close()


#: Words of users → the page that the search finds by them.
SYNONYMS = {
    "video": "output",
    "movie": "output",
    "gravity": "python",
    "heavy body": "python",
    "histogram": "many-starts",
    "export csv": "output",
    "jupyter": "output",
}


@pytest.mark.daily(4)
def test_search_finds_the_riemann_matrix_and_synonyms_offline(browser: Any, server: Server) -> None:
    faults: list[str] = []
    page = browser.new_page()
    page.set_default_timeout(60_000)
    page.on("console", lambda said: faults.append(said.text) if said.type == "error" else None)
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.on(
        "request", lambda sent: None if sent.url.startswith(server.url) else faults.append(sent.url)
    )
    page.goto(f"{server.url}/guide/")
    page.wait_for_url("**/docs/index.html")
    page.keyboard.press("Control+k")
    page.locator("#pst-search-dialog input[type=search]").fill("Riemann matrix")
    page.keyboard.press("Enter")
    page.wait_for_url("**/search.html?q=Riemann*")
    found = page.locator("#search-results a[href*='toolkit.html']").first
    found.wait_for()
    found.click()
    page.wait_for_url("**/docs/toolkit.html*")
    assert "Riemann matrix" in page.inner_text("article")
    for words, name in SYNONYMS.items():
        page.goto(f"{server.url}/guide/search.html?q={words}")
        page.locator(f"#search-results a[href*='{name}.html']").first.wait_for()
    page.close()
    assert not faults
