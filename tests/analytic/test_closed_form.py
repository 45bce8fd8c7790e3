"""A closed-form document is the motion: states made from it alone are those of the engine."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import jsonschema_rs
import numpy as np
import pytest

import veselova as vs
from deviations import agree, apart
from veselova.mechanics.results.closed_form_schema import SCHEMA

EXAMPLES = Path(__file__).parent.parent.parent / "examples" / "closed_form"

BODY3 = vs.Veselova(["3", "2", "1.5"], ["0.6", "0", "0.8"], ["0.3", "1", "-0.225"])

TIMES = [-1000.0, -2.5, 0.0, 0.125, 37.0, 10_000.0]


START: Any = [0.6, 0, 0.8], [0.8, 1, -0.6]
IN_FOUR: Any = [0.6, 0, 0.8, 0], [0.3, 1, -0.225, 0.4]

#: Problems of every system and regime that theta functions serve.
PROBLEMS: dict[str, Any] = {
    "symmetric body": vs.Veselova([3, 3, 1], [0.6, 0, 0.8], [0.3, 1, -0.225]),
    "two equal of four": vs.Veselova([3, 2, 1, 1], *IN_FOUR),
    "body in SO(3)": vs.VeselovaSO3(["1", "2", "3"], ["0.6", "0", "0.8"], ["0.8", "1", "-0.6"]),
    "its tensor": vs.VeselovaSO3([[1, 0.5, 0], [0.5, 1, 0], [0, 0, 2]], *START),
    "frozen direction": vs.Veselova([3, 2, 1, 1.5], [0.6, 0, 0.8, 0], [0.3, 1, -0.225, 0]),
    "matrix A": vs.Veselova([[2, 0.3, 0], [0.3, 1, 0.1], [0, 0.1, 3]], *START),
    "beside a separatrix": vs.Veselova(
        [3, 2, 1], [0.5, 1e-9, 0.75**0.5], [0.3, 0.8, -0.1], normalize=True
    ),
}
for n in (2, 3, 4, 5):
    for system in (vs.Veselova, vs.NeumannSystem, vs.EllipsoidGeodesic):
        start = np.random.default_rng([34, n]).normal(size=(2, n)).tolist()
        made = system(np.linspace(3, 1, n).tolist(), *start, normalize=True)
        PROBLEMS[f"{system.system}-{n}"] = made


@pytest.mark.parametrize("problem", PROBLEMS.values(), ids=PROBLEMS)
def test_states_from_the_document_alone_are_those_of_the_engine(problem: Any) -> None:
    text = vs.closed_form(problem).to_json()
    found, wanted = vs.ClosedForm.from_json(text).at(TIMES), vs.solve(problem, TIMES)
    agree(found, wanted, "frame")
    cycles = np.maximum(1, np.abs(found.times) / 100)
    assert (apart(found, wanted, ["frame"]) <= 1e-12 * cycles).all()
    for series in found.series:
        other = wanted.series(series)
        scale = max(1.0, float(np.max(np.abs(other))))
        assert np.max(np.abs(getattr(found, series) - other)) <= 1e-10 * scale, series


CHAPLYGIN = vs.ChaplyginBall(["0.4", "0.6", "0.9"], 1, 1, ["0.6", 0, "0.8"], ["0.8", 1, "-0.3"])


@pytest.mark.parametrize(("n", "most"), [(3, 8_000), (4, 100_000), (5, 1_000_000)])
def test_documents_are_small(n: int, most: int) -> None:
    random = np.random.default_rng([35, n])
    for _ in range(3):
        problem = vs.Veselova(np.linspace(3, 1, n), *random.normal(size=(2, n)), normalize=True)
        assert len(vs.closed_form(problem).to_json()) < most


def test_the_document_obeys_its_schema() -> None:
    validator = jsonschema_rs.validator_for(SCHEMA)
    for problem in PROBLEMS.values():
        validator.validate(json.loads(vs.closed_form(problem).to_json()))
    document = json.loads(vs.closed_form(CHAPLYGIN).to_json())
    assert document["format"] == "veselova.closed-form/2"
    validator.validate(document)
    with pytest.raises(jsonschema_rs.ValidationError):
        validator.validate(json.loads(broken(characteristics=[[[0.25], [0]]])))


#: The rotation number is 3/2 to the last digit, and 3:4 for the ball.
RESONANT = vs.Veselova(
    ["3", "2", "1"],
    ["0.2904864139762759", "0.8674450580193938", "0.4039266203321272"],
    ["1.0045500492021733", "-0.15371043620197616", "-0.39233062448995715"],
    normalize=True,
)
DRIFTING = vs.RubberBall(
    ["0.8", "1.2", "2.1"],
    "0.3",
    "0.5",
    ["0.3635365676813111", "0.8642994867575062", "0.3476025908263671"],
    ["0.5539945786260123", "-0.500559004251878", "0.6652298024858441"],
    strict=False,
    normalize=True,
)


@pytest.mark.parametrize("problem", [RESONANT, DRIFTING])
def test_documents_of_resonant_motions_are_the_motion(problem: Any) -> None:
    times = [0.0, 1.0, 20.0, -1e3, 1e4]
    found, wanted = vs.closed_form(problem).at(times), vs.solve(problem, times)
    agree(found, wanted, "frame")
    if problem is DRIFTING:
        agree(found, wanted, "position")


def standing(document: dict[str, Any]) -> dict[str, Any]:
    """Return a document whose first two modes stand still, and whose others are fewer."""
    return document | {
        "frequencies": [1.5, 1.0],
        "modes": [[2, -3], [-4, 6], [1, 1]],
        "coefficients": [0.02, 0.01, 0.03],
        "mean_rate": 0.7,
    }


def deviation(language: str, files: list[Path], folder: Path) -> float:
    """Return the largest deviation that the evaluator of a language prints; skips without it."""
    command = {
        "python": [sys.executable, str(EXAMPLES / "evaluate.py")],
        "node": ["node", str(EXAMPLES / "evaluate.mjs")],
        "cc": [str(folder / "evaluate")],
    }
    if language != "python" and shutil.which(language) is None:
        pytest.skip(f"{language} is not installed")
    if language == "cc" and not Path(*command["cc"]).exists():
        source = str(EXAMPLES / "evaluate.c")
        subprocess.run(["cc", "-O2", "-o", *command["cc"], source, "-lm"], check=True)
    answer = subprocess.run(
        [*command[language], *map(str, files)], capture_output=True, text=True, check=True
    ).stdout
    assert answer.startswith("largest deviation ")
    return float(answer.split()[-1])


def written(folder: Path, document: Any, values: Any) -> list[Path]:
    """Return the files of a document and of the values that are to be compared with it."""
    paths = [folder / "document.json", folder / "values.json"]
    for path, content in zip(paths, (document, values), strict=True):
        path.write_text(json.dumps(content, separators=(",", ":")))
    return paths


@pytest.mark.parametrize("name", ["body3", "body4", "chaplygin"])
@pytest.mark.parametrize("language", ["python", "node", "cc"])
def test_evaluators_in_other_languages_agree(name: str, language: str, tmp_path: Path) -> None:
    files = [EXAMPLES / f"{name}.json", EXAMPLES / f"{name}.values.json"]
    assert deviation(language, files, tmp_path) < 5e-12


@pytest.mark.parametrize("language", ["python", "node", "cc"])
def test_evaluators_refuse_shells_by_name(language: str, tmp_path: Path) -> None:
    files = written(tmp_path, standing(json.loads(vs.closed_form(BODY3).to_json())), {})
    files[0].write_text(files[0].read_text().replace('"modes":', '"shell":{},"modes":', 1))
    with pytest.raises(subprocess.CalledProcessError) as refused:
        deviation(language, files, tmp_path)
    assert "a shell" in refused.value.stderr


@pytest.mark.daily(4)
def test_evaluators_know_every_system_and_regime(tmp_path: Path) -> None:
    """Against ``solve``; their frames are in principal axes."""
    known = dict(PROBLEMS)
    known["constant spin"] = vs.RubberBall([1, 1.4, 2], 1, 0.7, [0.6, 0, 0.8], [0.3, 1, 0.5])
    known["Chaplygin's ball"] = CHAPLYGIN
    installed = [language for language in ("node", "cc") if shutil.which(language)]
    for name, problem in known.items():
        if name.endswith("5"):
            continue  # these take seconds
        document = json.loads(vs.closed_form(problem).to_json())
        frames = vs.solve(problem, TIMES).frame
        axes = np.eye(len(document["A"])) if document["axes"] is None else document["axes"]
        values = {"times": TIMES, "frame": (np.array(axes).T @ frames).tolist()}
        paths = written(tmp_path, document, values)
        # beside a separatrix the sum is that of evaluate.py
        plain = installed if document["reduction"] is None else []
        for language in ("python", *plain):
            assert deviation(language, paths, tmp_path) < 1e-10, (name, language)


@pytest.mark.parametrize("language", ["python", "node", "cc"])
def test_evaluators_know_modes_that_stand_still(language: str, tmp_path: Path) -> None:
    document = standing(json.loads(vs.closed_form(BODY3).to_json()))
    times = [0.5, 3.0, 40.0]
    frames = vs.ClosedForm.from_json(json.dumps(document)).at(times).frame
    values = {"times": times, "frame": frames.tolist()}
    paths = written(tmp_path, document, values)
    assert deviation(language, paths, tmp_path) < 1e-12


def test_the_evaluators_are_short() -> None:
    for path in EXAMPLES.glob("evaluate.*"):
        assert path.read_text().count("\n") <= 65, path.name


def test_the_stored_documents_are_those_of_this_version() -> None:
    stored = vs.ClosedForm.from_json((EXAMPLES / "body3.json").read_text())
    made = vs.closed_form(BODY3)
    assert set(stored.document) == set(made.document)
    assert np.max(np.abs(stored.at(TIMES).frame - made.at(TIMES).frame)) < 1e-11


def broken(**changes: Any) -> str:
    document = json.loads(vs.closed_form(BODY3).to_json()) | changes
    return json.dumps({name: value for name, value in document.items() if value != "missing"})


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("{", "document"),
        ("[1]", "document"),
        (broken(phases="missing"), "phases"),
        (broken(genus=True), "document.genus"),
        (broken(modes=[[1]]), "document."),
        (broken(frequencies=[1, 1e400]), "document.frequencies"),
        (broken(problem=3), "document.problem"),
        (broken(error=None), "document.error"),
        (broken(rate={"characteristic": 1, "constant": 0, "power": 1}), "document.rate.constant"),
        (broken(reduction={"basis": [[1, 0], [1, 0]], "waves": [0, 1]}), "document.reduction"),
        (broken(axes=[[1]]), "document.axes"),
        (broken(phases=[True, 0.1]), "document.phases"),
        (broken(digits=30), "document.digits: required 15; more digits at given times come from "),
        (broken(time="x"), "document.time"),
        (broken(units={"time": float("nan")}), "document.units"),
    ],
)
def test_what_is_no_document_is_refused_in_one_sentence(text: str, named: str) -> None:
    with pytest.raises(vs.InvalidInput) as caught:
        vs.ClosedForm.from_json(text)
    assert named in str(caught.value)


def test_what_has_no_closed_form_is_refused_by_name() -> None:
    with pytest.raises(vs.Unsolved, match="at-rest"):
        vs.closed_form(vs.Veselova([3, 2, 1], [1, 0, 0], [0, 0, 0]))
    with pytest.raises(vs.Unsolved, match="no-closed-form"):
        vs.closed_form(vs.NeumannSystem(["1", "1/2"], [1, 0], [0, 1]))
    with pytest.raises(vs.InvalidInput, match="problem"):
        vs.closed_form(vs.EulerPoisson([1, 2, 3], [0, 0, 1], [1, 0, 0]))
    for accuracy in (1, 1e-20):
        with pytest.raises(vs.InvalidInput, match="accuracy"):
            vs.closed_form(BODY3, accuracy=accuracy)
