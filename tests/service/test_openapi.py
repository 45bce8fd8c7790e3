"""The OpenAPI document as generators of clients read it, and its JSON schemas."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import jsonschema_rs
import pytest

from conftest import Server
from veselova.service.api.examples import BODY4, BODY4_PROBLEM
from veselova.service.api.problem_models import SYSTEMS
from veselova.service.api.settings import Settings
from veselova.service.http.app import create_app
from veselova.service.http.routes import RESOURCES

#: Names of functions in generated clients: programs of users call them, so that none may change or
#: go.
OPERATIONS = {
    "cancel_job",
    "check_health",
    "check_readiness",
    "compare_engines",
    "compute_closed_form",
    "compute_curve",
    "compute_geodesics",
    "compute_torus",
    "create_sweep",
    "evaluate_theta",
    "get_job",
    "get_job_result",
    "get_job_trajectories",
    "list_jobs",
    "list_systems",
    "solve_ensemble",
    "solve_trajectory",
    "watch_job",
}


@pytest.fixture(scope="module")
def document(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """The OpenAPI document of a server that is not running."""
    return create_app(Settings(data_dir=tmp_path_factory.mktemp("data")), loopback=True).openapi()


def parts(value: Any, place: str = "#") -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield all objects within a document and where they stand."""
    if isinstance(value, dict):
        yield place, value
    children = (
        value.items()
        if isinstance(value, dict)
        else enumerate(value)
        if isinstance(value, list)
        else ()
    )
    for name, child in children:
        yield from parts(child, f"{place}/{str(name).replace('~', '~0').replace('/', '~1')}")


def test_every_operation_has_its_own_name_for_good(document: dict[str, Any]) -> None:
    names = [
        operation["operationId"]
        for operations in document["paths"].values()
        for operation in operations.values()
    ]
    assert len(names) == len(set(names))
    assert set(names) == OPERATIONS


def test_every_reference_resolves_and_every_schema_is_referred_to(document: dict[str, Any]) -> None:
    known = {place for place, _ in parts(document)}
    found = {part["$ref"] for _, part in parts(document) if isinstance(part.get("$ref"), str)}
    targets = {
        target
        for _, part in parts(document)
        for target in part.get("discriminator", {}).get("mapping", {}).values()
    }
    assert found | targets <= known
    assert found == {"#/components/schemas/" + name for name in document["components"]["schemas"]}


def test_bodies_and_parameters_can_be_refused(document: dict[str, Any]) -> None:
    for path in (*RESOURCES, "/v1/sweeps"):
        assert {"400", "413", "415", "422"} < set(document["paths"][path]["post"]["responses"]), (
            path
        )


def test_all_refusals_are_problem_documents(document: dict[str, Any]) -> None:
    for path, operations in document["paths"].items():
        for method, operation in operations.items():
            for status, response in operation["responses"].items():
                if status >= "400" and method != "head":
                    assert list(response["content"]) == ["application/problem+json"], (
                        path,
                        method,
                        status,
                    )


def validator(document: dict[str, Any], name: str) -> Any:
    """Return what validates by one schema of the OpenAPI document."""
    schema = {"$ref": f"#/components/schemas/{name}", "components": document["components"]}
    return jsonschema_rs.Draft202012Validator(schema)


def test_every_schema_is_one(document: dict[str, Any]) -> None:
    schemas = document["components"]["schemas"]
    assert len(schemas) > 30
    for name, schema in schemas.items():
        jsonschema_rs.meta.validate(schema)
        assert validator(document, name)


def test_schemas_tell_requests_from_what_is_none(document: dict[str, Any]) -> None:
    request = validator(document, "TrajectoryRequest")
    assert request.is_valid(BODY4)
    assert not request.is_valid({**BODY4, "no_such_field": 1})
    assert not request.is_valid({"problem": BODY4_PROBLEM})
    sweep = validator(document, "SweepRequest")
    for value in (["7/2", 4], {"start": 3, "stop": 4, "count": 11}, {"uniform": [3, 4]}):
        assert sweep.is_valid({"problem": BODY4_PROBLEM, "vary": {"/A/0": value}})
    for value in ([], 3, {"start": 3}):
        assert not sweep.is_valid({"problem": BODY4_PROBLEM, "vary": {"/A/0": value}})


def test_systems_name_their_schemas(server: Server) -> None:
    schemas = server.get("/openapi.json").json()["components"]["schemas"]
    systems = server.get("/v1/systems").json()["systems"]
    for item in systems:
        # A whole sentence, not the first line of one.
        assert item["title"].endswith(".")
        assert 30 < len(item["title"]) < 300
        schema = schemas[item["schema"].removeprefix("/openapi.json#/components/schemas/")]
        assert schema["properties"]["system"]["const"] == item["system"]
        assert set(schema["properties"]) == {"system", *item["fields"]}
    assert len(systems) == len(SYSTEMS)
