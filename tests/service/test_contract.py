"""The OpenAPI document against the server: requests drawn from it are answered as it says."""

from __future__ import annotations

from typing import Any

import pytest
import schemathesis
from hypothesis import HealthCheck, given, settings
from schemathesis.checks import not_a_server_error
from schemathesis.specs.openapi.checks import (
    content_type_conformance,
    response_headers_conformance,
    response_schema_conformance,
    status_code_conformance,
)

from conftest import Server, slow

CHECKS = [
    not_a_server_error,
    status_code_conformance,
    content_type_conformance,
    response_headers_conformance,
    response_schema_conformance,
]


@pytest.mark.daily(4)
@pytest.mark.parametrize(
    ("path", "method"),
    [
        ("/v1/trajectories", "POST"),
        ("/v1/comparisons", "POST"),
        ("/v1/ensembles", "POST"),
        ("/v1/tori", "POST"),
        ("/v1/closed-forms", "POST"),
        ("/v1/curves", "POST"),
        ("/v1/theta", "POST"),
        ("/v1/geodesics", "POST"),
        ("/v1/sweeps", "POST"),
        ("/v1/jobs", "GET"),
        ("/v1/jobs/{job_id}", "GET"),
        ("/v1/jobs/{job_id}", "DELETE"),
        ("/v1/jobs/{job_id}/result", "GET"),
        ("/v1/jobs/{job_id}/trajectories", "GET"),
        ("/v1/systems", "GET"),
        ("/healthz", "GET"),
        ("/readyz", "GET"),
    ],
)
@pytest.mark.parametrize("examples", [25, slow(200)])
def test_answers_are_what_the_document_says(
    server: Server, path: str, method: str, examples: int
) -> None:
    operation = schemathesis.openapi.from_url(f"{server.url}/openapi.json")[path][method]

    @given(case=operation.as_strategy())
    @settings(max_examples=examples, suppress_health_check=list(HealthCheck))
    def conforms(case: Any) -> None:
        if isinstance(case.body, dict):
            # what is drawn shall not be refused for the seconds of a busy machine
            case.body = {**case.body, "budget_s": 3.0}
        case.validate_response(case.call(timeout=60), checks=CHECKS)

    conforms()
