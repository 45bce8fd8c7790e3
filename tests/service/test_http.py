"""The HTTP door, through a real server process."""

from __future__ import annotations

import json
import signal
import socket
import threading
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import httpx2
import numpy as np
import pytest

from conftest import PATIENCE, Server, processor_seconds, running_server, wait_until
from hostile import BUDGET_S, ENDLESS, GOOD, INVALID, MALFORMED, PROBLEM
from veselova import RubberBall, compare, solve, torus
from veselova.service.http.routes import RESOURCES

JSON = {"content-type": "application/json"}


def post(server: Server, path: str, body: Any, **headers: str) -> httpx2.Response:
    content = body if isinstance(body, (bytes, str)) else json.dumps(body)
    return server.ask("POST", path, content=content, headers={**JSON, **headers})


def is_problem(response: httpx2.Response, status: int, code: str) -> dict[str, Any]:
    assert response.status_code == status, response.text[:500]
    assert response.headers["content-type"] == "application/problem+json"
    document: dict[str, Any] = response.json()
    assert document["type"] == f"urn:veselova:problem:{code}"
    assert document["status"] == status
    assert document["title"]
    assert document["detail"]
    assert len(response.content) < 5000
    return document


@pytest.mark.parametrize("engine", ["analytic", "numeric"])
def test_a_trajectory_is_the_one_of_the_library(server: Server, engine: str) -> None:
    response = post(server, "/v1/trajectories", {**GOOD, "engine": engine})
    assert response.status_code == 200
    assert response.headers["content-type"] == "application/json"
    document, expected = response.json(), solve(PROBLEM, [0, 1], engine)
    assert document["engine"] == engine
    assert document["times"] == [0, 1]
    assert set(document["series"]) == set(PROBLEM.outputs)
    for name in PROBLEM.outputs:
        assert np.array_equal(np.array(document["series"][name]), expected.series(name))
    assert document["error"] == expected.error.tolist()
    assert document["integrals"]["energy"]["drift"] < 1e-11
    assert document["provenance"]["engine"] == engine


def test_a_ball_over_a_sphere_is_served_and_refused_by_its_field(server: Server) -> None:
    given: Any = ([0.4, 0.6, 0.9], 0.5, 0.6, [0.6, 0, 0.8], [0.8, 1, -0.6])
    ball = RubberBall(*given, sphere=0.3, side="around")
    request = {"problem": ball.as_request(), "times": [0, 1.5], "outputs": ["position"]}
    answer = post(server, "/v1/trajectories", request).json()
    expected = solve(ball, [0, 1.5])
    assert answer["engine"] == "analytic"
    assert np.array_equal(answer["series"]["position"], expected.position)
    request["problem"] = {**ball.as_request(), "radius": 0.2}
    document = is_problem(post(server, "/v1/trajectories", request), 422, "invalid-input")
    assert document["errors"][0]["pointer"] == "/problem/radius"


def test_outputs_and_uniform_times_are_the_callers_choice(server: Server) -> None:
    request = {**GOOD, "times": {"start": -1, "stop": "1/2", "count": 4}, "outputs": ["tau1", "q"]}
    document = post(server, "/v1/trajectories", request).json()
    assert document["times"] == [-1, -0.5, 0, 0.5]
    assert list(document["series"]) == ["tau1", "q"]


def test_a_comparison_has_both_engines_and_their_differences(server: Server) -> None:
    document = post(server, "/v1/comparisons", {**GOOD, "outputs": ["q"]}).json()
    expected = compare(PROBLEM, [0, 1])
    assert document["deviation"]["q"] == expected.deviation["q"]
    assert set(document["deviation"]) == set(PROBLEM.outputs)
    assert document["agrees"] is True
    assert set(document["seconds"]) == {"analytic", "numeric"}
    assert list(document["analytic"]["series"]) == ["q"]
    assert is_problem(
        post(server, "/v1/comparisons", {**GOOD, "engine": "numeric"}), 422, "invalid-input"
    )


def test_a_torus_is_the_one_of_the_library(server: Server) -> None:
    document = post(server, "/v1/tori", {"problem": GOOD["problem"]}).json()
    assert document == torus(PROBLEM).as_dict()


def test_the_openapi_document_describes_and_exemplifies_every_resource(server: Server) -> None:
    document = server.get("/openapi.json").json()
    assert set(RESOURCES) < set(document["paths"])
    for path in RESOURCES:
        operation = document["paths"][path]["post"]
        body = operation["requestBody"]["content"]["application/json"]
        schema = document["components"]["schemas"][body["schema"]["$ref"].split("/")[-1]]
        assert post(server, path, schema["examples"][0]).status_code == 200
        assert {"200", "400", "413", "415", "422", "503", "504"} <= set(operation["responses"])


def test_systems_health_and_readiness(server: Server) -> None:
    systems = server.get("/v1/systems").json()
    assert systems["systems"][0]["system"] == "veselova"
    assert systems["systems"][0]["outputs"] == list(PROBLEM.outputs)
    assert systems["limits"]["max_values"] == 16_000_000
    assert server.get("/healthz").json()["status"] == "ok"
    assert server.get("/readyz").json() == {"status": "ready"}


@pytest.mark.parametrize(
    ("body", "pointer"), [row[1:] for row in INVALID], ids=[row[0] for row in INVALID]
)
def test_invalid_input_gets_422_with_a_pointer(server: Server, body: str, pointer: str) -> None:
    document = is_problem(post(server, "/v1/trajectories", body), 422, "invalid-input")
    fault = document["errors"][0]
    assert fault["pointer"] == pointer
    assert ": required " in fault["detail"]
    assert "; given " in fault["detail"]
    assert "\n" not in fault["detail"]


@pytest.mark.parametrize("body", [row[1] for row in MALFORMED], ids=[row[0] for row in MALFORMED])
def test_what_is_not_json_gets_400(server: Server, body: bytes) -> None:
    is_problem(post(server, "/v1/tori", body), 400, "malformed-json")


@pytest.mark.parametrize("chunked", [False, True])
def test_a_body_of_200_megabytes_is_refused(server: Server, chunked: bool) -> None:
    def chunks() -> Any:
        for _ in range(200):
            yield b" " * 1_000_000

    content: Any = chunks() if chunked else b" " * 200_000_000
    try:
        response = server.ask("POST", "/v1/tori", content=content, headers=JSON)
    except (httpx2.WriteError, httpx2.ReadError, httpx2.RemoteProtocolError):
        pass  # the server may close the connection while the body is still on its way
    else:
        is_problem(response, 413, "body-too-large")
    assert server.get("/healthz").status_code == 200


@pytest.mark.parametrize("media_type", ["text/plain", "application/x-www-form-urlencoded", ""])
def test_another_media_type_gets_415(server: Server, media_type: str) -> None:
    is_problem(
        post(server, "/v1/tori", GOOD, **{"content-type": media_type}),
        415,
        "unsupported-media-type",
    )


@pytest.mark.parametrize(
    "accept",
    ["text/html", "image/png", "application/json;q=0, application/x-npz;q=0", "text/*;q=0"],
)
def test_what_cannot_be_served_gets_406(server: Server, accept: str) -> None:
    is_problem(post(server, "/v1/trajectories", GOOD, accept=accept), 406, "not-acceptable")


def test_unknown_paths_and_methods_are_problems_too(server: Server) -> None:
    is_problem(server.get("/v2"), 404, "not-found")
    response = server.get("/v1/tori")
    is_problem(response, 405, "method-not-allowed")
    assert response.headers["allow"] == "POST"


#: A motion into a separatrix.
UMBILIC = {"A": ["1", "1/10", "1/26"], "q": ["3/5", 0, "4/5"], "q_dot": ["4/5", 1, "-3/5"]}


@pytest.mark.parametrize(
    ("path", "problem", "times", "outcome"),
    [
        ("trajectories", {}, {"times": [1e40]}, "too-far"),
        ("trajectories", {}, {"times": [1e308]}, "too-far"),
        ("trajectories", UMBILIC, {"times": [90]}, "no-digit-left"),
        ("tori", {"q_dot": [0, 0, 0]}, {}, "at-rest"),
    ],
)
def test_a_named_outcome_is_a_problem_with_its_name(
    server: Server, path: str, problem: Any, times: Any, outcome: str
) -> None:
    body = {"problem": {**GOOD["problem"], **problem}, **times, "budget_s": BUDGET_S}
    refused = is_problem(post(server, f"/v1/{path}", body), 422, "unsolved")
    assert refused["outcome"] == outcome


def test_work_over_its_budget_is_stopped(server: Server) -> None:
    stopped = server.ask(
        "POST", "/v1/trajectories", json={**ENDLESS, "budget_s": 0.5}, timeout=BUDGET_S / 2
    )
    is_problem(stopped, 504, "over-budget")
    wait_until(lambda: server.at_work() == (0, 0))
    assert post(server, "/v1/trajectories", GOOD).status_code == 200


#: The same for as long as a test may wait, on a machine that has other things to do.
LASTING = {**ENDLESS, "budget_s": 2 * PATIENCE}
PATIENT = {"max_budget_s": str(2 * PATIENCE)}


def ask_meanwhile(server: Server, count: int = 1) -> tuple[list[Any], list[httpx2.Response]]:
    """Return threads that ask for work that lasts, and the list that their answers come into."""
    answers: list[httpx2.Response] = []
    threads = [
        threading.Thread(target=lambda: answers.append(post(server, "/v1/trajectories", LASTING)))
        for _ in range(count)
    ]
    for thread in threads:
        thread.start()
    return threads, answers


@pytest.mark.daily(4)
def test_work_ends_when_its_client_has_gone(tmp_path: Path) -> None:
    with running_server(tmp_path, **PATIENT) as own:
        (worker,) = own.workers()
        used = processor_seconds(worker)
        address = urlsplit(own.url)
        with socket.create_connection((address.hostname, address.port)) as connection:
            body = json.dumps(LASTING).encode()
            head = b"POST /v1/trajectories HTTP/1.1\r\nHost: localhost\r\n"
            head += b"Content-Type: application/json\r\nContent-Length: %d\r\n\r\n" % len(body)
            connection.sendall(head + body)
            wait_until(lambda: own.at_work() == (1, 0))
            # A task whose client goes before its worker has it is dropped, and the worker lives on.
            wait_until(lambda: processor_seconds(worker) > used + 0.1)
        wait_until(lambda: own.at_work() == (0, 0))
        assert post(own, "/v1/trajectories", GOOD).status_code == 200
        assert worker not in own.workers()


@pytest.mark.parametrize(
    "body",
    [
        json.dumps({**GOOD, "outputs": ["x"] * 150_000}),
        json.dumps({**GOOD, **{f"field{i}": 1 for i in range(50_000)}}),
        json.dumps({**GOOD, "x" * 900_000: 1}),
    ],
)
def test_large_nonsense_gets_a_short_answer_soon(server: Server, body: str) -> None:
    before = processor_seconds(server.process.pid)
    is_problem(post(server, "/v1/trajectories", body), 422, "invalid-input")
    assert processor_seconds(server.process.pid) - before < 5


@pytest.mark.daily(4)
def test_requests_beyond_the_queue_get_503_with_retry_after(tmp_path: Path) -> None:
    with running_server(tmp_path, **PATIENT, max_waiting="1") as own:
        threads, answers = ask_meanwhile(own, 4)
        wait_until(lambda: len(answers) == 2)
        for refused in answers:
            assert is_problem(refused, 503, "overloaded")
            assert refused.headers["retry-after"] == "2"
        assert own.at_work() == (1, 1)
        assert own.get("/healthz").status_code == 200
        assert own.at_work() == (1, 1)  # nobody had to end for that answer
        own.process.send_signal(signal.SIGTERM)
        for thread in threads:
            thread.join(PATIENCE)
        for ended in answers[2:]:
            assert is_problem(ended, 503, "shutting-down")


@pytest.mark.daily(4)
@pytest.mark.parametrize("from_terminal", [False, True])
def test_work_in_flight_is_ended_after_its_grace(from_terminal: bool, tmp_path: Path) -> None:
    with running_server(tmp_path, **PATIENT) as own:
        workers = own.workers()
        (thread,), answers = ask_meanwhile(own)
        wait_until(lambda: own.at_work() == (1, 0))
        own.interrupt() if from_terminal else own.process.send_signal(signal.SIGTERM)
        assert own.process.wait(PATIENCE) == 0
        thread.join(PATIENCE)
        is_problem(answers[0], 503, "shutting-down")
        assert "Traceback" not in own.log.read_text()
        assert "Application shutdown complete" in own.log.read_text()
        wait_until(lambda: not any(Path(f"/proc/{worker}").exists() for worker in workers))


@pytest.mark.daily(3)
def test_the_server_stays_small(tmp_path: Path) -> None:
    """Memory of a server of its own and its worker after the first answers, without the files of
    libraries, of which the system keeps in memory what it likes: below 250 MB.
    """

    def private(pid: int) -> int:
        status = Path(f"/proc/{pid}/status").read_text().split()
        return int(status[status.index("RssAnon:") + 1]) // 1024

    with running_server(tmp_path, workers="1") as own:
        for engine in ("analytic", "numeric"):
            assert post(own, "/v1/trajectories", {**GOOD, "engine": engine}).status_code == 200
        with_one_worker = private(own.process.pid) + max(map(private, own.workers()))
    assert with_one_worker < 250
