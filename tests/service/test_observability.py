"""What a server tells of itself: lines of the log, request ids, metrics, traces, readiness, through
real requests.
"""

from __future__ import annotations

import asyncio
import io
import json
import logging
import os
import re
import signal
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import anyio
import httpx2
import pytest
from fastapi import FastAPI
from test_http import is_problem, post

from conftest import PATIENCE, Server, interpreter, running_server, samples, wait_until
from hostile import ENDLESS, GOOD
from veselova.service.api.problem_details import Refused
from veselova.service.api.settings import Settings
from veselova.service.http.app import create_app
from veselova.service.observability.logs import line_formatter
from veselova.service.observability.metrics import Metrics
from veselova.service.workers.pool import Workers
from veselova.version import __version__


@pytest.fixture(scope="module")
def own(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A server of these tests alone, so that what it counts is known."""
    with running_server(
        tmp_path_factory.mktemp("observed"), workers="1", max_waiting="1"
    ) as running:
        yield running


def lines(server: Server) -> list[dict[str, Any]]:
    whole = server.log.read_text().rpartition("\n")[0]  # the last may be half written
    return [json.loads(line) for line in whole.splitlines()]


def line_of(server: Server, response: httpx2.Response) -> dict[str, Any]:
    """Return the one line that the server wrote of a request, once it is there."""

    def found() -> list[dict[str, Any]]:
        return [
            line
            for line in lines(server)
            if line.get("request_id") == response.headers["x-request-id"]
        ]

    wait_until(found)
    (line,) = found()
    return line


def in_process(app: FastAPI, path: str, method: str = "GET", **headers: str) -> httpx2.Response:
    async def ask() -> httpx2.Response:
        transport = httpx2.ASGITransport(app, raise_app_exceptions=False)
        async with httpx2.AsyncClient(transport=transport, base_url="http://localhost") as client:
            return await client.request(method, path, headers=headers)

    return asyncio.run(ask())


@pytest.mark.parametrize(
    ("path", "change", "expected"),
    [
        (
            "/v1/trajectories",
            {},
            {"status": 200, "system": "veselova", "engine": "analytic", "outcome": "solved"},
        ),
        (
            "/v1/trajectories",
            {"engine": "numeric"},
            {"status": 200, "engine": "numeric", "outcome": "solved"},
        ),
        ("/v1/comparisons", {}, {"status": 200, "engine": "both", "outcome": "solved"}),
        (
            "/v1/trajectories",
            {"times": [1e40]},
            {"status": 422, "engine": "analytic", "outcome": "too-far"},
        ),
        ("/v1/trajectories", {"engine": "magic"}, {"status": 422, "outcome": "invalid-input"}),
        (
            "/v1/trajectories",
            {**ENDLESS, "budget_s": 0.2},
            {"status": 504, "engine": "numeric", "outcome": "over-budget"},
        ),
    ],
)
def test_each_request_is_one_line(
    own: Server, path: str, change: dict[str, Any], expected: dict[str, Any]
) -> None:
    line = line_of(own, post(own, path, {**GOOD, **change}))
    assert expected.items() <= line.items()
    assert (line["event"], line["level"], line["method"], line["route"]) == (
        "request",
        "info",
        "POST",
        path,
    )
    assert line["client"] == "127.0.0.1"
    assert 0 < line["seconds"] < 60
    assert line["timestamp"].endswith("Z")


def test_every_line_is_json_those_of_the_server_library_too(own: Server) -> None:
    assert any(line["logger"].startswith("uvicorn") for line in lines(own))
    assert all({"event", "level", "logger", "timestamp"} <= line.keys() for line in lines(own))


def test_ids_of_clients_are_echoed_and_others_are_made(own: Server) -> None:
    answer = own.get("/v1/systems", headers={"x-request-id": "run-7.part_2"})
    assert answer.headers["x-request-id"] == "run-7.part_2"
    assert line_of(own, answer)["outcome"] == "answered"
    made = {own.get("/v1/systems").headers["x-request-id"] for _ in range(3)}
    assert len(made) == 3


@pytest.mark.parametrize(
    "given", ["two words", "x" * 65, '"}{', "<script>", "é".encode("latin-1"), "a,b"]
)
def test_an_id_that_could_harm_a_log_is_replaced(own: Server, given: Any) -> None:
    answer = own.get("/v1/systems", headers={"x-request-id": given})
    assert answer.status_code == 200
    assert len(answer.headers["x-request-id"]) == 32
    assert line_of(own, answer)["status"] == 200


def test_a_path_cannot_write_lines_of_its_own(own: Server) -> None:
    answer = own.get("/none%0A%7B%22event%22%3A%22forged%22%7D%1b[31m" + "x" * 500)
    line = line_of(own, answer)
    assert "route" not in line
    assert line["path"].startswith("/none%0A%7B")
    assert len(line["path"]) == 100
    assert line["outcome"] == "no-such-resource"


def test_no_secret_is_logged(own: Server) -> None:
    secret = "vsl_0123456789ab_" + "S" * 43
    headers = {"authorization": f"Bearer {secret}", "cookie": "session=TTTTTTTT"}
    answer = own.get("/v1/systems?token=UUUUUUUU", headers=headers)
    assert line_of(own, answer)
    log = own.log.read_text()
    assert not [part for part in ("SSSSSSSS", "TTTTTTTT", "UUUUUUUU") if part in log]


@pytest.mark.parametrize("text", [False, True])
def test_an_exception_that_quotes_a_key_is_logged_without_it(text: bool) -> None:
    stream = io.StringIO()
    handler = logging.StreamHandler(stream)
    handler.setFormatter(line_formatter(text))
    logger = logging.Logger("trial")
    logger.addHandler(handler)
    try:
        raise RuntimeError("header Bearer vsl_0123456789ab_" + "S" * 43)
    except RuntimeError:
        logger.exception("failed", extra={"engine": "analytic", "authorization": "SSSSSSSS"})
    written = stream.getvalue()
    assert "SSSS" not in written
    assert "vsl_0123456789ab_…" in written
    assert "RuntimeError" in written
    assert "analytic" in written
    if not text:
        assert json.loads(written)["event"] == "failed"


def test_probes_are_no_lines(own: Server) -> None:
    assert not {line.get("route") for line in lines(own)} & {"/readyz", "/healthz", "/metrics"}


def test_what_is_counted_is_what_was_asked(own: Server) -> None:
    before = own.metrics()
    for _ in range(2):
        post(own, "/v1/trajectories", {**GOOD, "times": [0, 0.4711]})
    post(own, "/v1/trajectories", {**GOOD, "times": [1e40]})
    post(own, "/v1/tori", {"problem": GOOD["problem"]})
    post(own, "/v1/tori", {"problem": GOOD["problem"]}, accept="text/html")
    own.get(f"/nowhere-{time.time()}")
    after = own.metrics()
    grown = {key: value - before.get(key, 0) for key, value in after.items()}
    assert grown[("veselova_outcomes_total", "analytic", "trajectory", "solved")] == 2
    assert grown[("veselova_outcomes_total", "analytic", "trajectory", "too-far")] == 1
    assert grown[("veselova_outcomes_total", "analytic", "torus", "solved")] == 1
    assert grown[("veselova_work_seconds_count", "analytic", "trajectory")] == 3
    assert 0 < grown[("veselova_work_seconds_sum", "analytic", "trajectory")] < 20
    assert grown[("veselova_refusals_total", "not-acceptable")] == 1
    assert grown[("http_requests_total", "/v1/trajectories", "POST", "200")] == 2
    assert grown[("http_requests_total", "/v1/trajectories", "POST", "422")] == 1
    assert grown[("http_requests_total", "none", "GET", "404")] == 1  # whatever the path
    assert grown[("http_request_duration_seconds_count", "/v1/tori", "POST")] == 2
    assert after[("veselova_info", __version__)] == 1
    assert after[("process_resident_memory_bytes",)] > 1e7


@pytest.mark.daily(3)
def test_busy_workers_and_the_queue_are_shown(own: Server) -> None:
    before = own.metrics()
    works, waits = (
        threading.Thread(target=post, args=(own, "/v1/trajectories", {**ENDLESS, "budget_s": s}))
        for s in (60, 3)
    )
    works.start()
    wait_until(lambda: own.at_work() == (1, 0))
    waits.start()
    wait_until(lambda: own.at_work() == (1, 1))
    os.kill(own.workers()[0], signal.SIGKILL)
    works.join(PATIENCE)
    waits.join(PATIENCE)
    assert own.at_work() == (0, 0)
    grown = {key: value - before.get(key, 0) for key, value in own.metrics().items()}
    assert grown[("veselova_outcomes_total", "numeric", "trajectory", "over-budget")] == 1
    assert grown[("veselova_outcomes_total", "numeric", "trajectory", "worker-lost")] == 1


def test_below_a_prefix_addresses_begin_with_it_and_redirects_are_relative(tmp_path: Path) -> None:
    settings = Settings(data_dir=tmp_path, cors_origins="https://a.example", root_path="/veselova")
    app = create_app(settings, loopback=True)
    assert in_process(app, "/guide").headers["location"] == "guide/"
    assert in_process(app, "/openapi.json").json()["servers"] == [{"url": "/veselova"}]
    response = in_process(app, "/healthz", origin="https://a.example")
    assert "Veselova-Provenance" in response.headers["access-control-expose-headers"]
    asked = {"access-control-request-method": "POST", "origin": "https://a.example"}
    asked["access-control-request-headers"] = "traceparent, tracestate, baggage, content-type"
    assert in_process(app, "/v1/tori", "OPTIONS", **asked).status_code == 200


def test_a_failure_of_ours_is_answered_with_the_id_of_its_line(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    app = create_app(Settings(data_dir=tmp_path, cors_origins="https://a.example"), loopback=True)

    @app.get("/failing")
    async def failing() -> None:
        raise RuntimeError("the reason, which is nobody's business")

    with caplog.at_level(logging.INFO, "veselova"):
        response = in_process(
            app, "/failing", **{"x-request-id": "case-1", "origin": "https://a.example"}
        )
    document = is_problem(response, 500, "internal-error")
    assert "business" not in document["detail"]
    assert response.headers["x-request-id"] == "case-1"
    assert response.headers["x-content-type-options"] == "nosniff"
    assert response.headers["access-control-allow-origin"] == "https://a.example"
    record = next(record for record in caplog.records if record.name == "veselova.service.requests")
    assert (record.__dict__["outcome"], record.__dict__["status"]) == ("internal-error", 500)
    counted = samples(in_process(app, "/metrics").text)
    assert counted[("http_requests_total", "/failing", "GET", "500")] == 1


@pytest.mark.daily(4)
@pytest.mark.parametrize("busy", [True, False])
def test_a_worker_that_is_gone_is_replaced(busy: bool, tmp_path: Path) -> None:
    """It is killed when its budget is over, or dies while it has nothing to do."""
    workers = Workers(Settings(data_dir=tmp_path, workers=1, max_waiting=0), Metrics())

    async def run() -> None:
        assert not workers.ready()
        async with workers.running():
            first = await workers.run(os.getpid, budget_s=PATIENCE)
            assert workers.ready()
            if busy:
                began = time.monotonic()
                with pytest.raises(Refused, match="budget"):
                    await workers.run(time.sleep, PATIENCE, budget_s=0.2)
                assert time.monotonic() - began < PATIENCE
            else:
                os.kill(first, signal.SIGKILL)
                while workers.ready():
                    await anyio.sleep(0.02)
            second = await workers.run(os.getpid, budget_s=PATIENCE)
            assert second != first
            with anyio.move_on_after(0.2):  # its client has gone
                await workers.run(time.sleep, PATIENCE, budget_s=PATIENCE)
            assert await workers.run(os.getpid, budget_s=PATIENCE) != second
            assert workers.ready()

    asyncio.run(run())


def test_traces_follow_the_standard_switch() -> None:
    script = """
import asyncio, httpx2
from opentelemetry import trace
from opentelemetry.sdk.trace import TracerProvider
from opentelemetry.sdk.trace.export import SimpleSpanProcessor
from opentelemetry.sdk.trace.export.in_memory_span_exporter import InMemorySpanExporter
from veselova.service.http.app import create_app
from veselova.service.api.settings import Settings

exporter, provider = InMemorySpanExporter(), TracerProvider()
provider.add_span_processor(SimpleSpanProcessor(exporter))
trace.set_tracer_provider(provider)

async def ask():
    transport = httpx2.ASGITransport(create_app(Settings(), loopback=True))
    async with httpx2.AsyncClient(transport=transport, base_url="http://localhost") as client:
        parent = "00-" + "a" * 32 + "-" + "b" * 16 + "-01"
        headers = {"traceparent": parent, "authorization": "Bearer SSSS"}
        await client.get("/v1/systems", headers=headers)
        await client.get("/healthz")

asyncio.run(ask())
spans = exporter.get_finished_spans()
assert {f"{span.context.trace_id:x}" for span in spans} == {"a" * 32}, spans
assert "GET /v1/systems" in {span.name for span in spans}, [span.name for span in spans]
assert not any("SSSS" in span.to_json() for span in spans)
"""
    answer = interpreter("-c", script)
    assert answer.returncode == 0, answer.stderr


def test_the_documentation_names_settings_and_metrics_that_exist(own: Server) -> None:
    folder = Path(__file__).parent.parent.parent / "docs"
    pages = ("service", "http", "sweeps", "clients", "reference/errors")
    text = "".join((folder / f"{page}.md").read_text() for page in pages)
    settings = set(re.findall(r"VESELOVA_([A-Z_]+[A-Z])", text)) - {"API_KEY"}
    assert settings >= {"DATA_DIR", "ALLOWED_HOSTS"}
    passed = set(re.findall(r"VESELOVA_([A-Z_]+): ", (folder.parent / "compose.yaml").read_text()))
    assert passed >= {"KEYS", "ALLOWED_HOSTS", "ROOT_PATH"}
    settings |= passed
    assert {name.lower() for name in settings} <= set(Settings.model_fields)
    metrics = set(re.findall(r"`((?:veselova|http)_\w+)`", text))
    assert own.ask("BREW", "/docs").status_code == 405
    shown = own.get("/metrics").text
    assert "BREW" not in shown
    assert len(metrics) > 8
    assert not [name for name in metrics if f"# TYPE {name.removesuffix('_total')}" not in shown]
