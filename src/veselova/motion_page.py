"""A motion as a page: one file that plays in a browser without a server or a network.

The page is the explorer's own, which the build of the package makes as one file (``explorer/``). It
contains the closed-form document of the motion, or its series where there is none.
"""

from __future__ import annotations

import base64
import hashlib
import html
import re
import shutil
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import orjson
from numpy.typing import NDArray

from veselova.engines import closed_form, solve, torus
from veselova.mechanics.core.errors import BackendMissing, InvalidInput, Unsolved
from veselova.mechanics.core.problem import Problem
from veselova.mechanics.results.table import Target, open_target
from veselova.mechanics.results.trajectory import Trajectory
from veselova.mechanics.systems.catalogue import read_problem

__all__ = ["BUNDLE", "FORMAT", "page", "write_page", "write_site"]

Array = NDArray[np.float64]

#: Where the build of the package puts the page (``explorer/build.py``); no commit has it.
BUNDLE = Path(__file__).parent / "explorer" / "file" / "index.html"

#: The version of what the page carries; ``explorer/src/page/file_source.ts`` reads it.
FORMAT = "veselova.motion/1"

#: The largest genus that the evaluator of the page has.
_LARGEST_GENUS = 3

#: Samples of a series: radians that the body turns between two of them, the longest step, and the
#: budget of a page. The page interpolates by cubics, to some 1e-7.
_RADIANS = 0.05
_LONGEST_STEP = 0.05
_MOST_SAMPLES = 10_000

#: Units of time of a page whose trajectory has the start alone.
_SPAN_OF_ONE_TIME = 20.0

#: Times at which the page compares itself with the trajectory.
_COMPARED = 400

#: Series that the page draws, and the digits behind the point that a picture takes.
_DRAWN = ("frame", "q", "gamma", "X", "position", "Omega")
_PLACES = 9

#: Times of the examples of a site.
_TIMES_OF_EXAMPLES = np.linspace(0.0, 60.0, 241)

#: Scripts and styles by their hashes, no address of any origin.
_POLICY = (
    "default-src 'none'; script-src {script}; style-src {style}; font-src data:; "
    "img-src data: blob:; worker-src blob:; base-uri 'none'; form-action 'none'"
)


def write_page(trajectory: Trajectory, target: Target) -> None:
    """Write the page of a motion to a path or a binary stream; raises as ``page`` does."""
    text = page(trajectory).encode()
    with open_target(target) as stream:
        stream.write(text)


def write_site(folder: Path) -> None:
    """Write the explorer with the motions of its examples into a folder, for any web host.

    Links are relative, so that the site works below any path. Raises BackendMissing where the
    explorer was not built with this installation.
    """
    bundle = BUNDLE.parent.parent
    try:
        index = (bundle / "index.html").read_text(encoding="utf-8")
        examples = orjson.loads((bundle / "presets.json").read_bytes())
    except OSError:
        raise _bundle_missing("the explorer as a site") from None
    # The pages of the HTTP API and of geodesics stay with the server.
    leave_out = shutil.ignore_patterns("docs-*", "geodesics-*")
    shutil.copytree(bundle / "explorer", folder / "explorer", ignore=leave_out, dirs_exist_ok=True)
    (folder / "motions").mkdir(exist_ok=True)
    for example in examples:
        trajectory = solve(read_problem(example["problem"]), _TIMES_OF_EXAMPLES)
        carried = orjson.dumps(_carried(trajectory), option=orjson.OPT_SERIALIZE_NUMPY)
        (folder / "motions" / f"{example['name']}.json").write_bytes(carried)
    index = index.replace("<html ", "<html data-site ", 1)
    (folder / "index.html").write_text(index, encoding="utf-8")


def page(trajectory: Trajectory) -> str:
    """Return the page of a motion as HTML.

    Motions with a closed form of genus 1 … 3 play at any time. Others play between the first and
    the last of the trajectory's times, from series that are solved anew, with a step of at most
    0.05 units of time. Raises BackendMissing where the explorer was not built with this
    installation, and InvalidInput where the times of a series are too far apart.
    """
    template, policy = _template()
    carried = orjson.dumps(_carried(trajectory), option=orjson.OPT_SERIALIZE_NUMPY).decode()
    # No text of a problem ends the element that carries it.
    carried = carried.replace("<", "\\u003c")
    head = f'<meta http-equiv="Content-Security-Policy" content="{html.escape(policy)}" />'
    before, after = template.split('id="motion">null<', 1)
    before = before.replace("<head>", f"<head>\n    {head}", 1)
    return f'{before}id="motion">{carried}<{after}'


@lru_cache(maxsize=1)
def _template() -> tuple[str, str]:
    """Return the page without a motion, and the policy that lets it run."""
    try:
        text = BUNDLE.read_text(encoding="utf-8")
    except OSError:
        raise _bundle_missing("a motion as a page") from None
    script = re.search(r'<script type="module"[^>]*>(.*?)</script>', text, re.DOTALL)
    style = re.search(r"<style[^>]*>(.*?)</style>", text, re.DOTALL)
    assert script, "the build puts the script into the page"
    assert style, "the build puts the style sheet into the page"
    return text, _POLICY.format(script=_hash(script[1]), style=_hash(style[1]))


def _bundle_missing(purpose: str) -> BackendMissing:
    way = "python explorer/build.py in the folder of this project"
    return BackendMissing("the bundle of the explorer", purpose, way)


def _hash(text: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"


def _carried(trajectory: Trajectory) -> dict[str, Any]:
    """Return what the page is to show, JSON-ready but for arrays."""
    problem = trajectory.problem
    provenance = trajectory.provenance
    largest = float(np.max(trajectory.error, initial=0.0))
    story = f"{problem.title}. Solved by {provenance.method}, with errors up to {largest:.2g}."
    documents = _documents(problem)
    compared = "analytic" if provenance.engine == "analytic" else "numeric"
    return {
        "format": FORMAT,
        "title": problem.title,
        "story": story,
        "problem": trajectory.facts.get("problem", {"system": problem.system}),
        "t": repr(float(trajectory.times.min())),
        **documents,
        "series": None if documents["document"] else _series(trajectory),
        "engines": {"analytic": None, "numeric": None, compared: _compared(trajectory)},
    }


def _documents(problem: Problem) -> dict[str, Any]:
    """Return the closed form and the torus, each None where the page cannot play by them."""
    nothing = {"document": None, "torus": None}
    try:
        found = torus(problem)
        if found.regime == "separatrix" or found.n > _LARGEST_GENUS + 1:
            return nothing
        document = closed_form(problem).document
    except (InvalidInput, Unsolved):
        return nothing
    return {"document": document, "torus": found.as_dict()}


def _series(trajectory: Trajectory) -> dict[str, Any]:
    """Return the series between the first and the last time, in equal steps."""
    problem = trajectory.problem
    first, last = (float(trajectory.times.min()), float(trajectory.times.max()))
    if first == last:
        first, last = (min(first, 0.0), max(last, 0.0))
    if first == last:
        last = _SPAN_OF_ONE_TIME
    step = min(_LONGEST_STEP, _RADIANS / max(problem.turning, 1e-300))
    if last - first > step * _MOST_SAMPLES:
        raise InvalidInput(
            ("times",),
            f"times within {step * _MOST_SAMPLES:.4g} of each other, for a page of a motion that "
            "it cannot evaluate in closed form",
            f"times from {first:.6g} to {last:.6g}",
        )
    times = np.linspace(first, last, max(4, int(np.ceil((last - first) / step)) + 1))
    dense = trajectory.dense
    found = dense(times) if dense else solve(problem, times, trajectory.provenance.engine)
    drawn = [name for name in _DRAWN if name in problem.outputs]
    return {
        "times": times,
        "series": {name: _rounded(found.series(name)) for name in drawn},
    }


def _rounded(values: Array) -> Array:
    return np.ascontiguousarray(np.round(values, _PLACES))


def _compared(trajectory: Trajectory) -> dict[str, Any] | None:
    """Return the frame of the trajectory at some of its times, with their errors."""
    if "frame" not in trajectory.problem.outputs or trajectory.times.size < 2:
        return None
    order = np.argsort(trajectory.times, kind="stable")
    count = min(_COMPARED, order.size)
    chosen = order[np.linspace(0, order.size - 1, count).astype(int)]
    return {
        "times": trajectory.times[chosen],
        "frame": np.ascontiguousarray(trajectory.series("frame")[chosen]),
        "error": trajectory.error[chosen],
    }
