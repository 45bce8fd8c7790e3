"""Sphinx's configuration of the guide: pages as they lie in the repository, none moved.

The source folder is the repository, so that every link between pages is the one a code host
follows. ``docs/build`` builds the site.
"""

from __future__ import annotations

import os
import re
import sys
import time
from base64 import b64encode
from contextlib import suppress
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "src"), str(ROOT / "docs" / "_extensions")]
# One thread, as everywhere in the checks: a gallery example is small.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from sphinxcontrib import katex  # noqa: E402

import veselova  # noqa: E402

project = "veselova"
author = "The veselova developers"
project_copyright = author
version = release = veselova.__version__

root_doc = "docs/index"
include_patterns = ["*.md", "docs/**"]
exclude_patterns = [
    ".*",
    "analytic",
    "benchmarks",
    "build",
    "examples",
    "explorer",
    "numeric",
    "service",
    "src",
    "tests",
    "docs/gallery/images",
]
extensions = [
    "guide_links",
    "guide_pictures",
    "guide_tables",
    "matplotlib.sphinxext.plot_directive",
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx_copybutton",
    "sphinx_design",
    "sphinx_gallery.gen_gallery",
    "sphinxcontrib.katex",
]
myst_enable_extensions = ["amsmath", "colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 4

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_typehints_format = "short"
python_use_unqualified_type_names = True
python_maximum_signature_line_length = 90

#: KaTeX sets the formulas when the site is built, out of the packages that the explorer is locked
#: to. Pages have its style and fonts, which ``docs/build`` copies, and none of its scripts.
katex_prerender = True
katex_js_path = str(ROOT / "explorer" / "node_modules" / "katex" / "dist" / "katex.min.js")
katex_css_path = "katex/katex.min.css"
# Node starts slowly on a busy machine.
katex.STARTUP_TIMEOUT = katex.RENDER_TIMEOUT = 60.0
nodejs_binary = os.environ.get("KATEX_NODE", "node")

sphinx_gallery_conf = {
    "examples_dirs": "examples/gallery",
    "gallery_dirs": "docs/gallery",
    "filename_pattern": r"plot_",
    "within_subsection_order": "FileNameSortKey",
    "abort_on_example_error": True,
    "download_all_examples": False,
    "show_signature": False,
    "write_computation_times": False,
    "capture_repr": (),
    "matplotlib_animations": False,
    "thumbnail_size": (480, 360),
}
plot_formats = [("png", 150)]
plot_html_show_formats = False
plot_html_show_source_link = False

html_theme = "pydata_sphinx_theme"
html_title = f"veselova {veselova.__version__}"
templates_path = ["_templates"]
html_sidebars = {"**": ["guide-contents"]}
html_static_path = ["_static", "../build/guide/static"]
html_favicon = "_static/icon.svg"
html_context = {"default_mode": "auto"}
html_extra_path = ["_extra"]
html_css_files = ["guide.css"]
html_copy_source = False
html_show_sourcelink = False
html_theme_options = {
    "navbar_align": "left",
    # The groups are in the sidebar of every page.
    "navbar_center": [],
    "show_prev_next": True,
    "secondary_sidebar_items": ["page-toc"],
    "footer_start": ["copyright"],
    "footer_end": ["sphinx-version"],
    "navigation_with_keys": False,
    "show_toc_level": 2,
}

#: The sites that links lead to are asked by ``docs/build links``, where there is a network.
linkcheck_timeout = 20
linkcheck_ignore = [r"http://(127\.0\.0\.1|localhost).*", r".*\.example(/.*)?$"]


#: What sphinx-gallery puts around an example for downloads. A folder of scripts in the bundle would
#: be taken for modules of the package, so that a page has its file in a link.
_DOWNLOADS = re.compile(
    r"^\.\. only:: html\n\n    \.\. note::\n        :class: sphx-glr-download-link-note.*?(?=^\S)"
    r"|^\.\. _sphx_glr_download_.*",
    re.MULTILINE | re.DOTALL,
)


def _link_download(app: Any, name: str, source: list[str]) -> None:
    """Put the file of an example into the link that ends its page."""
    if not name.startswith("docs/gallery/"):
        return
    source[0] = _DOWNLOADS.sub("", source[0])
    script = ROOT / "examples" / "gallery" / f"{Path(name).name}.py"
    if script.is_file():
        data = b64encode(script.read_bytes()).decode()
        link = f'<a download="{script.name}" href="data:text/x-python;base64,{data}">'
        source[0] += f"\n.. raw:: html\n\n   <p>{link}Download {script.name}</a></p>\n"


def _link_gallery(app: Any, name: str, source: list[str]) -> None:
    """Link the scripts of the gallery that a page names to their pages."""
    link = r"{doc}`/docs/gallery/\1`"
    source[0] = re.sub(r"`examples/gallery/(plot_\w+)\.py`", link, source[0])


#: Page → words by which the search finds it too.
_SYNONYMS = {
    "docs/output": "video movie animation film mp4 gif html export share csv excel pandas "
    "dataframe parquet save jupyter ipython lab colab widget interactive notebook",
    "docs/python": "gravity weight heavy body top pendulum force",
    "docs/many-starts": "histogram ensemble batch monte carlo statistics random fit data "
    "measurement estimate parameter identification regression",
    "docs/sweeps": "histogram parameter study scan grid",
}


def _add_synonyms(app: Any, name: str, source: list[str]) -> None:
    if name in _SYNONYMS:
        words = ", ".join(_SYNONYMS[name].split())
        words = f"---\nmyst:\n  html_meta:\n    keywords: {words}\n---\n"
        source[0] = words + source[0]


#: A line of a table in a docstring: a name, two spaces or more, what it means.
_ROW = re.compile(r"(\S+(?: \S+)*) {2,}(\S.*)")


def _adapt_docstring(
    app: Any, what: str, name: str, thing: Any, options: Any, lines: list[str]
) -> None:
    """Turn what docstrings have of plain text into reStructuredText: tables of two columns become
    lists, indented formulas stay as they are, and bars around absolute values are escaped.
    """
    adapted: list[str] = []
    in_table = in_formula = False
    for line in lines:
        if line.startswith("    ") and not in_table and (in_formula or not "".join(adapted[-1:])):
            adapted += [] if in_formula else ["::", ""]
            in_formula = True
            adapted.append(line)
            continue
        in_formula = in_formula and not line
        row = _ROW.fullmatch(line)
        if row:
            adapted += [] if in_table or not adapted or not adapted[-1] else [""]
            name_of = row[1] if "``" in row[1] else f"``{row[1]}``"
            line = f"- {name_of}: {row[2]}"
        elif in_table and line.startswith("  "):
            line, row = f"  {line.strip()}", _ROW.match("x  x")
        elif in_table and line:
            adapted.append("")
        in_table = row is not None
        parts = line.split("``")
        parts[::2] = [part.replace("|", "\\|") for part in parts[::2]]
        adapted.append("``".join(parts))
    lines[:] = adapted


def _add_modules_of_the_paper(app: Any, name: str, source: list[str]) -> None:
    """Add the modules whose functions the page of the paper names to that of the inside."""
    if name != "docs/reference/api-internals":
        return
    paper = ROOT / "docs" / "paper.md"
    app.env.note_dependency(str(paper))
    chapters: dict[str, dict[str, None]] = {}
    for part, dotted, named in re.findall(
        r"`([am])((?:\.[a-z_]\w*)+)(?:\.([A-Z]\w*))?", paper.read_text()
    ):
        names = [{"a": "analytic", "m": "mechanics"}[part], *dotted.split(".")[1:]]
        while not (ROOT / "src" / "veselova" / "/".join(names)).with_suffix(".py").is_file():
            names.pop()
        if named not in veselova._HOMES:
            chapters.setdefault(".".join(names[:-1]), {})[".".join(names)] = None
    for chapter, modules in chapters.items():
        source[0] += f"\n## {chapter}\n\n```{{eval-rst}}\n"
        for module in (f"veselova.{each}" for each in modules):
            public = [each for each, home in veselova._HOMES.items() if home == module]
            hidden = f"   :exclude-members: {', '.join(public)}\n" if public else ""
            source[0] += f".. automodule:: {module}\n   :members:\n{hidden}\n"
        source[0] += "```\n"


def _start_katex(app: Any) -> None:
    """Start KaTeX, again where its socket is there before it listens."""
    for _ in range(20):
        with suppress(ConnectionRefusedError):
            katex.KaTeXServer.get()
            return
        time.sleep(0.5)


def setup(app: Any) -> None:
    """Connect what this file adds to Sphinx."""
    app.connect("builder-inited", _start_katex, priority=900)
    app.connect("source-read", _add_modules_of_the_paper)
    app.connect("autodoc-process-docstring", _adapt_docstring)
    app.connect("source-read", _link_download)
    app.connect("source-read", _link_gallery)
    app.connect("source-read", _add_synonyms)
