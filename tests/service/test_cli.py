"""The command line: output, files, exit statuses, one-sentence errors."""

from __future__ import annotations

import json
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from conftest import PATIENCE, command_line, interpreter, wait_until
from hostile import BUDGET_S, ENDLESS, GOOD, MALFORMED, PROBLEM
from veselova import __version__, solve
from veselova.curves import RealHyperelliptic
from veselova.theta import riemann_theta

BODY4_FILE = Path(__file__).parent.parent.parent / "examples" / "body4.json"


def run(*arguments: str, **options: Any) -> subprocess.CompletedProcess[str]:
    """Run ``veselova …`` in a process of its own."""
    return interpreter("-m", "veselova", *arguments, **options)


def request(**changes: Any) -> dict[str, Any]:
    return {**GOOD, **changes}


@pytest.mark.daily(3)
def test_demo_shows_how_the_engines_agree(tmp_path: Path) -> None:
    answer = run("demo", "--plot", "motion.png", cwd=tmp_path)
    text = answer.stdout
    assert answer.returncode == 0, answer.stderr
    for word in (
        "frame",
        "omega",
        "conditioning_floor",
        "drift analytic",
        "drift numeric",
        "analytic and numeric agree within",
    ):
        assert word in text
    deviations = {
        line.split()[0]: float(line.split()[1])
        for line in text.splitlines()
        if line.startswith(("q:", "frame:", "omega:"))
    }
    assert deviations
    assert max(deviations.values()) <= 1e-9
    assert (tmp_path / "motion.png").stat().st_size > 20_000
    assert answer.stderr == ""


def test_tables_have_no_negative_zeros_and_count_times() -> None:
    told = command_line("solve", "-", stdin=request(times=[-1e-12])).stdout
    assert "one time, -1e-12" in told
    assert "-0.000000000" not in told
    assert " 0.000000000 " in told
    for times, shown in (([0, 1], "2 times from 0 to 1"), ([-0.0], "one time, 0;")):
        assert shown in command_line("solve", "-", stdin=request(times=times)).stdout


@pytest.mark.parametrize("command", ["solve", "compare", "torus"])
def test_files_and_standard_input_are_the_same(command: str, tmp_path: Path) -> None:
    (tmp_path / "body.json").write_text(json.dumps(request()))
    from_file, from_pipe = (
        command_line(command, "body.json", cwd=tmp_path),
        command_line(command, "-", stdin=request()),
    )
    assert from_file.returncode == from_pipe.returncode == 0, from_file.stderr
    assert from_file.stdout.splitlines()[-1] == from_pipe.stdout.splitlines()[-1]


def test_json_is_the_answer_of_the_http_api() -> None:
    answer = command_line("solve", "-", "--json", stdin=request(outputs=["q", "tau1"]))
    document = json.loads(answer.stdout)
    expected = solve(PROBLEM, GOOD["times"])
    assert list(document["series"]) == ["q", "tau1"]
    assert np.array_equal(document["series"]["q"], expected.q)
    assert set(json.loads(command_line("torus", "-", "--json", stdin=request()).stdout)) >= {
        "periods",
        "riemann_matrix",
        "phases",
    }


@pytest.mark.parametrize("suffix", [".npz", ".csv", ".parquet", ".arrow", ".json"])
def test_motions_are_written_to_files_and_plotted_beside(suffix: str, tmp_path: Path) -> None:
    files = {"--output": f"motion{suffix}", "--plot": "motion.svg"}
    options = [word for pair in files.items() for word in pair]
    answer = command_line("solve", "-", *options, stdin=request(), cwd=tmp_path)
    assert answer.returncode == 0, answer.stderr
    assert all((tmp_path / name).stat().st_size > 200 for name in files.values())


SYSTEM = b'{"problem": {"system": "x\\u001b[31m\\u0000"}}'


@pytest.mark.parametrize(
    ("arguments", "stdin", "status", "words"),
    [
        *(
            pytest.param("solve -", body, 2, "required one JSON document", id=name)
            for name, body in MALFORMED
        ),
        ("solve -", SYSTEM, 2, "\\x1b[31m"),  # what a file says does not steer the terminal
        ("solve -", request(times=[1e40]), 1, "veselova: too-far: "),
        ("solve no-such-file.json", b"", 2, "no-such-file.json"),
        ("solve half.json", b"", 2, "veselova: half.json: required one JSON document"),
        ("solve folder.csv", b"", 2, "FILE: required a readable file"),
        ("solve {file} --output motion.xls", b"", 2, "--output"),
        ("solve {file} --animate motion.avi", b"", 2, "--animate"),
        ("solve {file} --output no/such/folder/motion.npz", b"", 2, "--output"),
        ("solve {file} --output .", b"", 2, "--output: required a file name ending"),
        ("solve {file} --output folder.csv", b"", 2, "--output: required a file that can be"),
        ("solve {file} --output /proc/x.csv", b"", 1, "writing /proc/x.csv failed"),
        ("demo --plot full.png", b"", 1, "writing the answer failed"),
        ("compare {file} --method euler", b"", 2, "euler"),
        ("serve --host nonsense.invalid", b"", 2, "--host: required an address of this machine"),
        (
            "serve --require-keys --insecure",
            b"",
            2,
            "--insecure: required one of --require-keys and --insecure; given both.",
        ),
        ("curve -", {"branch_points": [0, 1, 1, 2, 3], "sgn": 1}, 2, "branch_points"),
        ("theta -", {"z": [[0]], "tau": [[[0, 1]]], "T": [[1]]}, 2, "tau: required tau, or T of "),
    ],
)
def test_what_fails_is_named_in_one_sentence(
    arguments: str, stdin: Any, status: int, words: str, tmp_path: Path
) -> None:
    (tmp_path / "half.json").write_text('{"problem": {')
    (tmp_path / "folder.csv").mkdir()
    (tmp_path / "full.png").symlink_to("/dev/full")
    before = {*tmp_path.iterdir()}
    given = arguments.format(file=BODY4_FILE).split()
    answer = command_line(*given, stdin=stdin, cwd=tmp_path)
    assert answer.returncode == status
    assert answer.stderr.startswith("veselova: ")
    assert words in answer.stderr
    assert answer.stderr.rstrip("\n").isprintable()
    assert {*tmp_path.iterdir()} == before


def test_an_unknown_command_exits_2() -> None:
    assert command_line("no-such-command").returncode == 2


def test_a_busy_port_is_named() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        answer = run("serve", "--port", str(taken.getsockname()[1]))
    assert answer.returncode == 2
    assert "--port: required an address and a port to bind" in answer.stderr


@pytest.mark.daily(4)
@pytest.mark.parametrize("stream", ["<&-", ">&-", ">/dev/full"])
def test_streams_that_are_closed_or_full_end_without_a_traceback(stream: str) -> None:
    for command in ("solve - --json", f"solve {BODY4_FILE}"):
        answer = subprocess.run(
            ["bash", "-c", f"{sys.executable} -m veselova {command} {stream}"],
            capture_output=True,
            input=json.dumps(request()).encode(),
            timeout=PATIENCE,
        )
        assert answer.returncode in ((0, 2) if stream == "<&-" else (1,))
        assert b"Traceback" not in answer.stderr


def test_a_stated_budget_is_kept() -> None:
    began = time.monotonic()
    answer = command_line("solve", "-", stdin={**ENDLESS, "budget_s": 1})
    assert answer.returncode == 1
    assert "stopped after its budget of 1 s" in answer.stderr
    # of one second, not of that which every other test states
    assert time.monotonic() - began < BUDGET_S


def test_bad_limits_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("VESELOVA_WORKERS", "many")
    answer = run("serve")
    assert answer.returncode == 2
    assert "VESELOVA_WORKERS" in answer.stderr


def test_settings_are_printed_with_their_meaning() -> None:
    text = run("serve", "--settings").stdout
    assert "VESELOVA_MAX_VALUES=16000000" in text
    assert "# longest budget_s" in text


def test_version_and_help() -> None:
    assert run("--version").stdout.strip() == __version__
    for command in ("", "demo", "solve", "compare", "torus", "sweep", "serve"):
        answer = command_line(*filter(None, [command, "--help"]))
        assert answer.returncode == 0
        assert "Usage" in answer.stdout


def test_interruption_is_not_a_traceback() -> None:
    command = [sys.executable, "-m", "veselova", "solve", "-"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdin
        assert process.stderr
        process.stdin.write(json.dumps(ENDLESS).encode())
        process.stdin.close()
        wait_until(lambda: "scipy/integrate" in Path(f"/proc/{process.pid}/maps").read_text())
        process.send_signal(signal.SIGINT)
        assert process.wait(PATIENCE) == 130
        assert b"Traceback" not in process.stderr.read()


def test_a_reader_that_goes_away_is_no_failure_of_ours() -> None:
    command = f"{sys.executable} -m veselova solve {BODY4_FILE} --json | head -c 10"
    answer = subprocess.run(["bash", "-c", command], capture_output=True, timeout=PATIENCE)
    assert answer.stderr == b""


@pytest.mark.parametrize("kind", ["curve", "theta"])
def test_curves_and_theta_functions_have_commands(kind: str) -> None:
    file = BODY4_FILE.parent / f"{kind}.json"
    answer = command_line(kind, str(file), "--json")
    assert answer.returncode == 0, answer.stderr
    document = json.loads(answer.stdout)
    shown = command_line(kind, str(file))
    assert shown.returncode == 0, shown.stderr
    text = shown.stdout
    if kind == "curve":
        curve = RealHyperelliptic([0, 1, "1.7", 3, "4.5"])
        assert np.array_equal(document["riemann_matrix"], curve.riemann_matrix.imag)
        assert document["points"]
        for heading in ("riemann_matrix", "abel 1", "quasi_periods eta"):
            assert heading in text
        assert f"{curve.riemann_matrix[0, 1].imag:.12g}" in text
    else:
        stated = json.loads(file.read_text())
        tau = [[0.3 + 0.9j, 0.2], [0.2, 1.1j]]
        value = complex(riemann_theta([0.1, 0.2j], tau, [[0.5, 0], [0, 0.5]]))
        assert stated["characteristic"] == [[0.5, 0], [0, 0.5]]
        assert document["values"][0] == pytest.approx([value.real, value.imag], rel=1e-14)
        assert f"{value.real:.12g}" in text


def test_commands_of_the_toolkit_keep_digits() -> None:
    for command, stdin, shown in (
        ("curve", {"branch_points": [0, 1, 2], "digits": 40}, f"1.{40 * '0'}"),
        ("theta", {"z": [[0.1], [0.2]], "T": [[1]], "derivatives": 1}, "values 2"),
    ):
        answer = command_line(command, "-", stdin=stdin)
        assert answer.returncode == 0, answer.stderr
        assert shown in answer.stdout
