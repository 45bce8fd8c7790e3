"""Conditioning is an output that can be asked for: over HTTP, in files, in tables, in sweeps."""

from __future__ import annotations

import io
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import veselova as vs
from conftest import Server
from veselova.mechanics.results.trajectory import Trajectory
from veselova.service.answers.cache_entry import Entry, read_entry
from veselova.service.api.json_documents import trajectory_document, trajectory_of
from veselova.service.api.request_models import TrajectoryRequest, read_request
from veselova.service.cli.main import main
from veselova.service.workers.tasks import solve_request

BODY = {"system": "neumann", "A": ["1", "1/2"], "q": [1, 0], "q_prime": [0, 1]}
REQUEST: dict[str, Any] = {
    "problem": BODY,
    "times": [-5, 0, 5, 20],
    "outputs": ["q", "conditioning"],
}


@pytest.fixture(scope="module", params=[15, 30])
def motion(request: Any) -> Trajectory:
    problem = vs.NeumannSystem(BODY["A"], BODY["q"], BODY["q_prime"])
    return vs.solve(problem, REQUEST["times"], digits=request.param)


def test_files_have_it_where_it_is_named(motion: Trajectory) -> None:
    expected = motion.conditioning
    assert expected[3] > 1e-9
    for outputs, named in ((["q", "conditioning"], True), (["q"], False), (None, False)):
        archive, table = io.BytesIO(), io.BytesIO()
        motion.to_npz(archive, outputs)
        motion.to_csv(table, outputs)
        columns = table.getvalue().decode().splitlines()
        names = columns[0].split(",")
        dataset = motion.to_xarray(outputs)
        found = np.load(io.BytesIO(archive.getvalue()))
        assert ("conditioning" in found) is named
        assert ("conditioning" in names) is named
        assert ("conditioning" in dataset) is named
        assert ("conditioning" in motion.columns(outputs)) is named
        if named:
            place = names.index("conditioning")
            assert np.array_equal(found["conditioning"], expected)
            assert [float(line.split(",")[place]) for line in columns[1:]] == expected.tolist()
            assert dataset["conditioning"].dims == ("time",)
            assert "frame" not in dataset


def test_a_document_has_it_beside_the_error(motion: Trajectory) -> None:
    document = trajectory_document(motion, [*motion.problem.outputs, "conditioning"])
    assert "conditioning" not in document["series"]
    assert np.array_equal(document["conditioning"], motion.conditioning)
    plain = json.loads(json.dumps(document, default=lambda values: values.tolist()))
    again = trajectory_of(motion.problem, plain)
    assert vars(again)["conditioning"].tolist() == motion.conditioning.tolist()
    assert "conditioning" not in trajectory_document(motion)


def test_an_entry_of_the_cache_keeps_it(tmp_path: Path) -> None:
    asked = read_request(TrajectoryRequest, REQUEST)
    solved = solve_request(asked)
    entry = Entry(str(tmp_path / "kept"), str(tmp_path / "part"), 10**6)
    assert entry.write(REQUEST, solved)
    _, kept = read_entry(entry.path)
    assert np.array_equal(vars(kept)["conditioning"], solved.conditioning)


def test_the_service_gives_it_where_it_is_asked_for(server: Server, motion: Trajectory) -> None:
    digits = motion.provenance.digits
    for _ in range(2):  # computed, then from the cache
        response = server.ask("POST", "/v1/trajectories", json={**REQUEST, "digits": digits})
        document = response.json()
        assert list(document["series"]) == ["q"]
        assert document["conditioning"] == motion.conditioning.tolist()
    body = {**REQUEST, "digits": digits, "outputs": ["q"]}
    assert "conditioning" not in server.ask("POST", "/v1/trajectories", json=body).json()
    schema = server.get("/v1/schemas/Trajectory").json()
    assert "conditioning" in schema["properties"]
    assert "conditioning" not in schema["required"]


def test_a_comparison_has_it_of_both_engines(server: Server) -> None:
    document = server.ask("POST", "/v1/comparisons", json=REQUEST).json()
    assert document["analytic"]["conditioning"] == document["numeric"]["conditioning"]
    assert set(document["analytic"]["series"]) == {"q"}


@pytest.mark.parametrize("option", [[], ["--json"]])
def test_the_command_line_prints_it(
    option: list[str], tmp_path: Any, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    path = tmp_path / "request.json"
    path.write_text(json.dumps(REQUEST))
    monkeypatch.setattr("sys.argv", ["veselova", "solve", str(path), *option])
    with pytest.raises(SystemExit) as ended:
        main()
    assert not ended.value.code
    text = capsys.readouterr().out
    assert "conditioning" in text
    path.write_text(json.dumps({**REQUEST, "outputs": ["q"]}))
    with pytest.raises(SystemExit):
        main()
    assert "conditioning" not in capsys.readouterr().out


def test_a_misspelt_name_has_the_nearest() -> None:
    with pytest.raises(vs.InvalidInput, match="did you mean conditioning"):
        read_request(TrajectoryRequest, {**REQUEST, "outputs": ["conditionning"]})
