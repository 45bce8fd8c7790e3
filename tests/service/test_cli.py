"""The command line: output, files, exit statuses, one-sentence errors."""

from __future__ import annotations

import json
import signal
import socket
import subprocess
import sys
import time
from io import BytesIO
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from conftest import PATIENCE, command_line, wait_until
from hostile import BUDGET_S, GOOD, MALFORMED
from veselova import __version__, solve
from veselova.curves import RealHyperelliptic
from veselova.service.api.examples import BODY4
from veselova.service.cli.main import main
from veselova.theta import riemann_theta

BODY4_FILE = Path(__file__).parent.parent.parent / "examples" / "body4.json"


def run(*arguments: str, cwd: Path | None = None) -> subprocess.CompletedProcess[bytes]:
    """Run ``veselova …`` in a process of its own."""
    command = [sys.executable, "-m", "veselova", *arguments]
    return subprocess.run(command, capture_output=True, cwd=cwd, timeout=PATIENCE)


def request(**changes: Any) -> bytes:
    return json.dumps({**GOOD, **changes}).encode()


def test_the_example_file_is_the_worked_example() -> None:
    assert json.loads(BODY4_FILE.read_text()) == BODY4


def test_demo_shows_how_the_engines_agree(tmp_path: Path) -> None:
    answer = run("demo", "--plot", "motion.png", cwd=tmp_path)
    text = answer.stdout.decode()
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
    assert answer.stderr == b""


def test_tables_have_no_negative_zeros_and_count_times() -> None:
    told = command_line("solve", "-", stdin=request(times=[-1e-12])).stdout.decode()
    assert "one time, -1e-12" in told
    assert "-0.000000000" not in told
    assert " 0.000000000 " in told
    assert (
        "2 times from 0 to 1"
        in command_line("solve", "-", stdin=request(times=[0, 1])).stdout.decode()
    )
    assert "one time, 0;" in command_line("solve", "-", stdin=request(times=[-0.0])).stdout.decode()


@pytest.mark.parametrize("command", ["solve", "compare", "torus"])
def test_files_and_standard_input_are_the_same(command: str, tmp_path: Path) -> None:
    (tmp_path / "body.json").write_bytes(request())
    from_file, from_pipe = (
        command_line(command, "body.json", cwd=tmp_path),
        command_line(command, "-", stdin=request()),
    )
    assert from_file.returncode == from_pipe.returncode == 0, from_file.stderr
    assert from_file.stdout.splitlines()[-1] == from_pipe.stdout.splitlines()[-1]


def test_json_is_the_answer_of_the_http_api() -> None:
    answer = command_line("solve", "-", "--json", stdin=request(outputs=["q", "tau1"]))
    document = json.loads(answer.stdout)
    expected = solve_good()
    assert list(document["series"]) == ["q", "tau1"]
    assert np.array_equal(document["series"]["q"], expected.q)
    assert set(json.loads(command_line("torus", "-", "--json", stdin=request()).stdout)) >= {
        "periods",
        "riemann_matrix",
        "phases",
    }


def solve_good() -> Any:
    from veselova import Veselova

    return solve(
        Veselova(GOOD["problem"]["A"], GOOD["problem"]["q"], GOOD["problem"]["q_dot"]),
        GOOD["times"],
    )


@pytest.mark.parametrize("suffix", [".npz", ".csv", ".parquet", ".arrow", ".json"])
def test_motions_are_written_to_files(suffix: str, tmp_path: Path) -> None:
    answer = command_line(
        "solve", "-", "--output", f"motion{suffix}", stdin=request(), cwd=tmp_path
    )
    assert answer.returncode == 0, answer.stderr
    assert (tmp_path / f"motion{suffix}").stat().st_size > 200


def test_a_motion_is_plotted_beside_its_file(tmp_path: Path) -> None:
    answer = command_line(
        "solve",
        "-",
        "--output",
        "motion.npz",
        "--plot",
        "motion.svg",
        stdin=request(),
        cwd=tmp_path,
    )
    assert answer.returncode == 0, answer.stderr
    assert (tmp_path / "motion.npz").exists()
    assert (tmp_path / "motion.svg").stat().st_size > 1000


@pytest.mark.parametrize("body", [row[1] for row in MALFORMED], ids=[row[0] for row in MALFORMED])
def test_what_is_not_json_exits_2(
    body: bytes, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    assert_refused(body, monkeypatch, capsys, "required one JSON document")


def test_what_a_file_says_does_not_steer_the_terminal(
    monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    monkeypatch.setattr(
        sys,
        "stdin",
        SimpleNamespace(buffer=BytesIO(b'{"problem": {"system": "x\\u001b[31m\\u0000"}}')),
    )
    monkeypatch.setattr(sys, "argv", ["veselova", "solve", "-"])
    with pytest.raises(SystemExit):
        main()
    told = capsys.readouterr().err
    assert "\\x1b[31m" in told
    assert told.rstrip("\n").isprintable()


def assert_refused(body: bytes, monkeypatch: pytest.MonkeyPatch, capsys: Any, part: str) -> None:
    monkeypatch.setattr(sys, "stdin", SimpleNamespace(buffer=BytesIO(body)))
    monkeypatch.setattr(sys, "argv", ["veselova", "solve", "-"])
    with pytest.raises(SystemExit) as raised:
        main()
    assert raised.value.code == 2
    message = capsys.readouterr().err
    assert message.startswith("veselova: ")
    assert part in message
    assert message.count("\n") == 1


@pytest.mark.parametrize(
    "arguments",
    [
        ("solve", "no-such-file.json"),
        ("solve", str(BODY4_FILE), "--output", "motion.xls"),
        ("solve", str(BODY4_FILE), "--animate", "motion.avi"),
        ("solve", str(BODY4_FILE), "--output", "no/such/folder/motion.npz"),
        ("no-such-command",),
        ("compare", str(BODY4_FILE), "--method", "euler"),
    ],
)
def test_bad_arguments_exit_2_without_a_traceback(
    arguments: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["veselova", *arguments])
    with pytest.raises(SystemExit) as raised:  # what has a traceback is another exception
        main()
    assert raised.value.code == 2
    assert capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_what_cannot_be_solved_exits_1() -> None:
    answer = command_line("solve", "-", stdin=request(times=[1e40]))
    assert answer.returncode == 1
    assert answer.stderr.startswith(b"veselova: too-far: ")
    assert answer.stderr.count(b"\n") == 1


@pytest.mark.parametrize(
    ("arguments", "status", "words"),
    [
        (
            ("solve", str(BODY4_FILE), "--output", "{folder}"),
            2,
            b"--output: required a file name ending",
        ),
        (
            ("solve", str(BODY4_FILE), "--output", "{folder}/folder.csv"),
            2,
            b"--output: required a file that can be written",
        ),
        (("solve", str(BODY4_FILE), "--output", "/proc/x.csv"), 1, b"writing /proc/x.csv failed"),
        (("demo", "--plot", "{folder}/full.png"), 1, b"writing the answer failed"),
        (
            ("serve", "--host", "nonsense.invalid"),
            2,
            b"--host: required an address of this machine",
        ),
        (("solve", "{folder}"), 2, b"FILE: required a readable file"),
    ],
)
def test_files_and_addresses_that_fail_are_named(
    arguments: tuple[str, ...], status: int, words: bytes, tmp_path: Path
) -> None:
    (tmp_path / "folder.csv").mkdir()
    (tmp_path / "full.png").symlink_to("/dev/full")
    answer = command_line(*(argument.format(folder=tmp_path) for argument in arguments))
    assert answer.returncode == status
    assert words in answer.stderr
    assert answer.stderr.count(b"\n") == 1


def test_a_busy_port_is_named() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        answer = run("serve", "--port", str(taken.getsockname()[1]))
    assert answer.returncode == 2
    assert b"--port: required an address and a port to bind" in answer.stderr


@pytest.mark.parametrize("stream", ["<&-", ">&-", ">/dev/full"])
def test_streams_that_are_closed_or_full_end_without_a_traceback(stream: str) -> None:
    for command in ("solve - --json", f"solve {BODY4_FILE}"):
        answer = subprocess.run(
            ["bash", "-c", f"{sys.executable} -m veselova {command} {stream}"],
            capture_output=True,
            input=request(),
            timeout=PATIENCE,
        )
        assert answer.returncode in ((0, 2) if stream == "<&-" else (1,))
        assert b"Traceback" not in answer.stderr


def test_a_stated_budget_is_kept() -> None:
    began = time.monotonic()
    answer = command_line("solve", "-", stdin=request(times=[0, 1e7], engine="numeric", budget_s=1))
    assert answer.returncode == 1
    assert b"stopped after its budget of 1 s" in answer.stderr
    # of one second, not of that which every other test states
    assert time.monotonic() - began < BUDGET_S


def test_bad_limits_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("VESELOVA_WORKERS", "many")
    answer = run("serve")
    assert answer.returncode == 2
    assert b"VESELOVA_WORKERS" in answer.stderr


def test_settings_are_printed_with_their_meaning() -> None:
    text = run("serve", "--settings").stdout.decode()
    assert "VESELOVA_MAX_VALUES=16000000" in text
    assert "# longest budget_s" in text


def test_version_and_help() -> None:
    assert run("--version").stdout.decode().strip() == __version__
    for command in ("", "demo", "solve", "compare", "torus", "sweep", "serve"):
        answer = command_line(*filter(None, [command, "--help"]))
        assert answer.returncode == 0
        assert b"Usage" in answer.stdout


def test_interruption_is_not_a_traceback() -> None:
    endless = request(engine="numeric", times=[0, 1e7])
    command = [sys.executable, "-m", "veselova", "solve", "-"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdin
        assert process.stderr
        process.stdin.write(endless)
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
    text = shown.stdout.decode()
    if kind == "curve":
        curve = RealHyperelliptic([0, 1, "1.7", 3, "4.5"])
        assert np.array_equal(document["riemann_matrix"], curve.riemann_matrix.imag)
        assert document["points"]
        for heading in ("riemann_matrix", "abel 1", "quasi_periods eta", "thomae"):
            assert heading in text
        assert f"{curve.riemann_matrix[0, 1].imag:.12g}" in text
    else:
        stated = json.loads(file.read_text())
        tau = [[0.3 + 0.9j, 0.2], [0.2, 1.1j]]
        value = complex(riemann_theta([0.1, 0.2j], tau, [[0.5, 0], [0, 0.5]]))
        assert stated["characteristic"] == [[0.5, 0], [0, 0.5]]
        assert document["values"][0] == pytest.approx([value.real, value.imag], rel=1e-14)
        assert f"{value.real:.12g}" in text


def test_commands_of_the_toolkit_refuse_in_a_sentence_and_keep_digits() -> None:
    wrong = command_line("curve", "-", stdin=b'{"branch_points": [0, 1, 1, 2, 3], "sgn": 1}')
    assert wrong.returncode == 2
    assert b"Traceback" not in wrong.stderr
    assert b"branch_points" in wrong.stderr
    both = command_line("theta", "-", stdin=b'{"z": [[0]], "tau": [[[0, 1]]], "T": [[1]]}')
    assert both.returncode == 2
    assert b"tau: required tau, or T of " in both.stderr
    precise = command_line("curve", "-", stdin=b'{"branch_points": [0, 1, 2], "digits": 40}')
    assert precise.returncode == 0, precise.stderr
    assert "1.0000000000000000000000000000000000000000" in precise.stdout.decode()
    gradient = command_line(
        "theta", "-", stdin=b'{"z": [[0.1], [0.2]], "T": [[1]], "derivatives": 1}'
    )
    assert gradient.returncode == 0, gradient.stderr
    assert b"values 2" in gradient.stdout
