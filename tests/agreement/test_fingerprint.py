"""Results belong to a version: caches, sweeps and clusters trust it."""

from __future__ import annotations

import copy
import json

import stored_results
from stored_results import FILE, TIMES, differences
from veselova.version import __version__

ADVICE = "bump src/veselova/version.py, then run: python benchmarks/fingerprint.py"


def test_results_are_those_of_the_version() -> None:
    stored, found = json.loads(FILE.read_text()), stored_results.results()
    assert stored["times"] == list(TIMES), f"the times have changed; {ADVICE}"
    changed = differences(stored["results"], found)
    assert not changed, "\n".join(
        [f"results are not those of version {stored['version']}; {ADVICE}", *changed]
    )
    assert stored["version"] == __version__, (
        "the fingerprint is of another version; run: python benchmarks/fingerprint.py"
    )


def test_every_kind_of_change_is_seen() -> None:
    stored = json.loads(FILE.read_text())["results"]
    assert differences(stored, stored) == []
    for name in stored:
        changed = copy.deepcopy(stored)
        series = next(iter(changed[name]["series"]))
        changed[name]["series"][series][-1][0] += 2.5 * changed[name]["error"][-1]
        assert [line.split(": ")[0] for line in differences(stored, changed)] == [name]
        changed[name]["series"][series][-1][0] = float("nan")
        assert len(differences(stored, changed)) == 1
        del changed[name]
        assert len(differences(stored, changed)) == 1
