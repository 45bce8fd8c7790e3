"""The OpenAPI document that the framework makes of the models, completed by the refusals of this
service.
"""

from __future__ import annotations

from typing import Any

from fastapi import FastAPI

from veselova.service.api.answers import Problem
from veselova.service.api.problem_details import MEDIA_TYPE

#: The content of an answer that is a file.
FILE = {"schema": {"type": "string", "format": "binary"}}


def refusals(*statuses: int) -> dict[int | str, dict[str, Any]]:
    """Return the refusals of a route as it describes them: of all routes, and of some statuses."""
    return {status: {"model": Problem} for status in (401, 403, 422, 429, 500, 503, *statuses)}


def complete_openapi(app: FastAPI) -> dict[str, Any]:
    """Return the OpenAPI document of an application, built once."""
    if app.openapi_schema is None:
        document = FastAPI.openapi(app)
        for operations in document["paths"].values():
            for operation in operations.values():
                for status, response in operation["responses"].items():
                    if status >= "400":  # the framework names the type of a good answer
                        (content,) = response["content"].values()
                        response["content"] = {MEDIA_TYPE: content}
        document["components"]["securitySchemes"] = {"key": {"type": "http", "scheme": "bearer"}}
        document["security"] = [{}, {"key": []}]  # a server on loopback asks for none
    assert app.openapi_schema is not None
    return app.openapi_schema
