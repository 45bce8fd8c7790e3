"""The requests of the client and the results of their answers; every failure is a named exception.
Loads neither engine.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import IO, Any, Generic, TypeVar

import httpx2 as httpx
import numpy as np
import orjson

from veselova.mechanics.core.arguments import FEWEST_DIGITS, require_name
from veselova.mechanics.core.errors import InvalidInput, ProblemResponse, ServiceError, show
from veselova.mechanics.core.exact_input import plain
from veselova.mechanics.core.folders import expand_home
from veselova.mechanics.core.problem import Problem
from veselova.mechanics.core.times import as_request
from veselova.mechanics.results.closed_form import ClosedForm
from veselova.mechanics.results.comparison import Comparison
from veselova.mechanics.results.ensemble import Ensemble
from veselova.mechanics.results.sampled_motion import Provenance
from veselova.mechanics.results.toolkit import CurveData, ScaledTheta
from veselova.mechanics.results.torus import Torus
from veselova.mechanics.results.trajectory import Trajectory
from veselova.service.api.json_documents import (
    comparison_of,
    ensemble_of,
    geodesics_of,
    torus_of,
    trajectory_of,
)
from veselova.service.api.media_types import MEDIA_TYPES
from veselova.service.api.private_files import atomic_file
from veselova.service.api.request_models import (
    BudgetedRequest,
    ComparisonRequest,
    EnsembleRequest,
    TorusRequest,
    TrajectoryRequest,
    read_request,
)
from veselova.service.api.toolkit_requests import (
    ClosedFormRequest,
    CurveRequest,
    GeodesicRequest,
    ThetaRequest,
)

T = TypeVar("T")


@dataclass(frozen=True)
class Call(Generic[T]):
    """One request: its path, its JSON body, its timeout, and the function that makes the result of
    its answer.

    The body of the answer to a call with a target is written there, and ``result`` is given the
    header. ``accept`` is the media type of a result, empty where it has no body.
    """

    path: str
    result: Callable[[Any], T]
    content: bytes | None = None
    budget_s: float = 0.0
    accept: str = "application/json"
    target: Path | None = None
    method: str = "POST"


def _call(
    path: str, result: Callable[[Any], T], model: type[BudgetedRequest], **stated: Any
) -> Call[T]:
    """Return the call of a request; raises InvalidRequest for what its model does not take."""
    request = read_request(model, plain(stated))
    content = orjson.dumps(request.model_dump(exclude_unset=True))
    return Call(path, result, content, request.budget_s)


def target_path(target: str | Path) -> Path:
    """Return the file of a download; raises InvalidInput for a path that leads to no folder."""
    if isinstance(target, (str, Path)):
        path = expand_home(target, "target")
        if path.parent.is_dir() and not path.is_dir():
            return path
    raise InvalidInput(("target",), "a file in an existing folder", show(target))


def _problem(problem: Problem | Mapping[str, Any]) -> Problem:
    """Return the problem of a call; a mapping is the JSON of the HTTP request."""
    if isinstance(problem, Problem):
        return problem
    return read_request(TorusRequest, {"problem": plain(problem)}).problem.problem


def trajectory_call(
    problem: Problem | Mapping[str, Any],
    times: Any,
    engine: str | None = None,
    method: str | None = None,
    *,
    digits: int = FEWEST_DIGITS,
    certified: bool = False,
    formulation: str | None = None,
    budget_s: float = 10.0,
) -> Call[Trajectory]:
    """Return the motion at the given times by one engine (see ``veselova.solve``); ``budget_s``
    bounds the server's work.
    """
    asked = _problem(problem)
    body: dict[str, Any] = {"engine": engine, "method": method, "formulation": formulation}
    body |= {"digits": digits, "certified": certified, "budget_s": budget_s}
    body |= _motion(asked, times)
    return _call("/v1/trajectories", partial(trajectory_of, asked), TrajectoryRequest, **body)


def download_call(
    problem: Problem | Mapping[str, Any],
    times: Any,
    target: str | Path,
    format: str = "npz",  # noqa: A002
    **options: Any,
) -> Call[Provenance]:
    """Write the motion to a file as it comes, as ``json``, ``csv``, ``npz``, ``arrow`` or
    ``parquet``, and return its provenance. The file appears when it is whole.

    ``options``: those of ``trajectory``, and ``outputs``, the names of the series; all of the
    system when left out.
    """
    accept = MEDIA_TYPES[require_name(format, ("format",), list(MEDIA_TYPES))]
    body = {**_motion(_problem(problem), times), "outputs": None, **options}
    call = _call("/v1/trajectories", _provenance, TrajectoryRequest, **body)
    return replace(call, accept=accept, target=target_path(target))


def _provenance(headers: Mapping[str, str]) -> Provenance:
    return Provenance(**orjson.loads(headers["veselova-provenance"]))


def compare_call(
    problem: Problem | Mapping[str, Any],
    times: Any,
    method: str | None = None,
    *,
    formulation: str | None = None,
    budget_s: float = 10.0,
) -> Call[Comparison]:
    """Return both engines' motions, or two formulations of a system with one engine, and how they
    agree (see ``veselova.compare``).
    """
    asked = _problem(problem)
    body = {"method": method, "formulation": formulation, "budget_s": budget_s}
    body |= _motion(asked, times)
    return _call("/v1/comparisons", partial(comparison_of, asked), ComparisonRequest, **body)


def solve_many_call(
    problems: Mapping[str, Any],
    times: Any,
    outputs: Sequence[str] | None = None,
    *,
    budget_s: float = 10.0,
) -> Call[Ensemble]:
    """Return the motions of many Veselova problems, given by arrays by name, at the same times (see
    ``veselova.solve_many``).
    """
    if not isinstance(problems, Mapping):
        raise InvalidInput(("problems",), "arrays by name: A, q and q_dot", show(problems))
    body = dict(problems)
    body["starts"] = {name: body.pop(name) for name in ("q", "q_dot") if name in body}
    body |= {"times": as_request(times), "outputs": outputs, "budget_s": budget_s}
    call: Call[Any] = _call("/v1/ensembles", dict, EnsembleRequest, **body)
    return replace(call, result=partial(ensemble_of, np.shape(body["starts"]["q"])[-1]))


def torus_call(problem: Problem | Mapping[str, Any], *, budget_s: float = 10.0) -> Call[Torus]:
    """Return the invariant torus of a motion (see ``veselova.torus``)."""
    body = {"problem": _problem(problem).as_request(), "budget_s": budget_s}
    return _call("/v1/tori", torus_of, TorusRequest, **body)


def closed_form_call(
    problem: Problem | Mapping[str, Any], accuracy: float | None = None, *, budget_s: float = 10.0
) -> Call[ClosedForm]:
    """Return the motion of a problem as data (see ``veselova.closed_form``)."""
    body = {"problem": _problem(problem).as_request(), "accuracy": accuracy, "budget_s": budget_s}
    return _call("/v1/closed-forms", ClosedForm, ClosedFormRequest, **body)


def curve_call(branch_points: Any, **options: Any) -> Call[CurveData]:
    """Return the data of a hyperelliptic curve with real branch points (see
    ``veselova.curves.RealHyperelliptic``), with the images of points (λ, w), and the places of
    points z of the real torus, where they are given.

    ``options``: the fields of CurveRequest

    - sign: of w², −1 when left out
    - points, w, z
    - outputs: ``quasi_periods``
    - digits, certified: ``decimals`` of the answer has the numbers with radii
    - budget_s
    """
    body = {"branch_points": branch_points, **options}
    return _call("/v1/curves", CurveData.from_dict, CurveRequest, **body)


def theta_call(
    z: Any,
    tau: Any,
    characteristic: Any = None,
    derivatives: int = 0,
    *,
    budget_s: float = 10.0,
) -> Call[ScaledTheta]:
    """Return theta functions or their derivatives as mantissas and exponents (see
    ``veselova.theta.scaled_riemann_theta``); ``values`` of the answer multiplies them.
    """
    single = np.asarray(z, dtype=object).ndim < 2
    body = {"z": [z] if single else z, "tau": tau, "characteristic": characteristic}
    body |= {"derivatives": derivatives, "budget_s": budget_s}
    return _call("/v1/theta", partial(_theta_of, single), ThetaRequest, **body)


def _theta_of(single_point: bool, document: Mapping[str, Any]) -> ScaledTheta:
    found, part = ScaledTheta.from_dict(document), 0 if single_point else slice(None)
    return ScaledTheta(found.mantissa[part], found.exponent[part], found.error[part])


def geodesics_call(ellipsoid: Any, **options: Any) -> Call[Any]:
    """Return geodesics of an ellipsoid as ``veselova.geodesics.Ellipsoid`` does: those of P and Q,
    a ``count`` of all between them, those of P, azi1 and s12, or the Polygon of points.

    ``options``: the fields of GeodesicRequest: these arrays, coordinates, normalize, digits,
    certified, budget_s
    """
    made = partial(geodesics_of, plain(ellipsoid))
    return _call("/v1/geodesics", made, GeodesicRequest, ellipsoid=ellipsoid, **options)


def _motion(problem: Problem, times: Any) -> dict[str, Any]:
    """Return what the request for a motion says of it, its stored outputs asked for."""
    stated = {"problem": problem.as_request(), "times": as_request(times)}
    return {**stated, "outputs": list(problem.stored)}


@contextmanager
def reading(source: str) -> Iterator[None]:
    """Raise ServiceError for whatever goes wrong inside the block, which reads what a server sent:
    the server may be a foreign one. A library that is not installed here stays an ImportError.
    """
    try:
        yield
    except ImportError:
        raise
    except Exception as error:
        reason = show(f"{type(error).__name__}: {error}")
        raise ServiceError(
            f"{source} answered with something else than a result ({reason})"
        ) from error


@contextmanager
def part_of(target: Path | None) -> Iterator[IO[bytes] | None]:
    """Give the file to write, where there is a target: at the end of the block it is the target."""
    if target is None:
        yield None
        return
    with atomic_file(target) as part, part.open("xb") as file:
        yield file


def read_answer(call: Call[T], response: httpx.Response, file: IO[bytes] | None) -> T:
    """Return the result of an answer; raises ServiceError for another media type than that of the
    call, ProblemResponse for a refusal.

    The body of a download is not read yet: its header alone says whether it is one. Its ``file`` is
    then to get the rest of what is there, or all anew.
    """
    if not response.is_success:
        raise _refusal(response)
    with reading(str(response.url)):
        media_type = response.headers.get("content-type", "").partition(";")[0].strip().lower()
        if call.accept != media_type:
            raise ValueError(f"{media_type or 'no media type'}, not {call.accept}")
        if file is None:
            return call.result(orjson.loads(response.content or b"{}"))
        result = call.result(response.headers)
    if response.status_code != httpx.codes.PARTIAL_CONTENT:
        file.seek(0)
        file.truncate()
    return result


def _refusal(response: httpx.Response) -> ProblemResponse:
    """Return the exception of an answer that is no success: a problem document, or the beginning
    of its text where it has none.
    """
    status = response.status_code
    document: Any = None
    with suppress(orjson.JSONDecodeError):
        document = orjson.loads(response.content)
    if not isinstance(document, dict):
        # a foreign server can name a charset that is none of texts
        text = response.content.decode("utf-8", "replace")
        if "location" in response.headers:
            text = f"a redirect to {response.headers['location']}, which is not followed"
        document = {"title": response.reason_phrase, "status": status, "detail": show(text)}
    pause = response.headers.get("retry-after", "")
    seconds = float(pause) if pause.isascii() and pause.isdecimal() else None
    return ProblemResponse(status, document, seconds)
