"""The metrics of a server for Prometheus; each application has its own registry."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from fastapi import FastAPI
from prometheus_client import CollectorRegistry, Counter, Gauge, Histogram, ProcessCollector
from prometheus_fastapi_instrumentator import Instrumentator

from veselova.service.api.problem_details import problem_code
from veselova.service.observability.logs import note
from veselova.version import __version__

#: Seconds of work: from a torus that is a millisecond to the longest budget.
_BUCKETS = (0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1, 3, 10, 30, 60)

#: States of a job.
_STATES = ("queued", "running", "finished", "failed", "cancelled")


class Metrics:
    """The counters of one application."""

    def __init__(self) -> None:
        self.registry = CollectorRegistry()
        here: dict[str, Any] = {"registry": self.registry}
        ProcessCollector(registry=self.registry)
        Gauge("veselova_info", "Version of the server", ["version"], **here).labels(
            __version__
        ).set(1)
        self._seconds = Histogram(
            "veselova_work_seconds",
            "Work on one request, waiting included",
            ["kind", "engine"],
            buckets=_BUCKETS,
            **here,
        )
        self._outcomes = Counter(
            "veselova_outcomes", "Work by how it ended", ["kind", "engine", "outcome"], **here
        )
        self._refusals = Counter(
            "veselova_refusals",
            "Requests refused by the service, by problem code",
            ["code"],
            **here,
        )

    @contextmanager
    def work(self, kind: str, system: str, engine: str) -> Iterator[dict[str, str]]:
        """Time the work in the block and count its outcome, which the request's log line has too.
        The block may put the engine that was used into the mapping it is given.
        """
        facts = {"engine": engine}
        outcome = "stopped"
        began = time.perf_counter()
        try:
            yield facts
            outcome = "solved"
        except Exception as error:
            outcome = problem_code(error)
            raise
        finally:
            engine = facts["engine"]
            self._seconds.labels(kind, engine).observe(time.perf_counter() - began)
            self._outcomes.labels(kind, engine, outcome).inc()
            note(system=system, engine=engine, outcome=outcome)

    def count_refused(self, code: str) -> None:
        """Count a request that the service refused with this problem code."""
        self._refusals.labels(code).inc()

    def gauge(self, name: str, meaning: str, value: Callable[[], float]) -> None:
        """Register a gauge whose function is called at every scrape."""
        Gauge(name, meaning, registry=self.registry).set_function(value)

    def jobs(self, counts: Callable[[], Mapping[str, int]]) -> None:
        """Show the numbers of jobs by state, which are asked for at every scrape: they may come
        from the database.
        """
        family = Gauge("veselova_jobs", "Sweeps by state", ["state"], registry=self.registry)
        for state in _STATES:
            family.labels(state).set_function(lambda s=state: counts().get(s, 0))  # type: ignore[misc]

    def serve(self, app: FastAPI) -> None:
        """Time every endpoint of an application, and show all numbers at ``/metrics``."""
        instrumentator = Instrumentator(
            registry=self.registry,
            should_group_status_codes=False,
            excluded_handlers=["^/metrics$", "^/healthz$", "^/readyz$"],
        )
        instrumentator.instrument(app).expose(app, include_in_schema=False)
