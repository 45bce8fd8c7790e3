"""What the client asks: a call is one request, and what its answer becomes; whatever is no result
becomes an exception with a name. Loads neither engine.
"""

from __future__ import annotations

import math
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from io import TextIOBase
from numbers import Real
from pathlib import Path
from tempfile import SpooledTemporaryFile
from typing import IO, Any, BinaryIO, Generic, TypeVar

import httpx2 as httpx
import numpy as np
import orjson

from veselova.mechanics.core.curve_arguments import (
    curve_arguments,
    curve_outputs,
    points_with_sheets,
    torus_points,
)
from veselova.mechanics.core.decimals import FEWEST_DIGITS
from veselova.mechanics.core.errors import InvalidInput, ProblemResponse, ServiceError, show
from veselova.mechanics.core.exact_input import plain
from veselova.mechanics.core.folders import expand_home
from veselova.mechanics.core.names import require_name
from veselova.mechanics.core.problem import Problem
from veselova.mechanics.core.theta_arguments import ThetaArguments
from veselova.mechanics.core.times import as_request
from veselova.mechanics.results.closed_form import ClosedForm, require_accuracy
from veselova.mechanics.results.comparison import Comparison
from veselova.mechanics.results.curve import CurveData
from veselova.mechanics.results.ensemble import Ensemble
from veselova.mechanics.results.provenance import Provenance
from veselova.mechanics.results.scaled_theta import ScaledTheta
from veselova.mechanics.results.table import Target
from veselova.mechanics.results.torus import Torus
from veselova.mechanics.results.trajectory import Trajectory
from veselova.service.api.atomic_file import atomic_file
from veselova.service.api.complex_numbers import to_pairs
from veselova.service.api.json_documents import comparison_of, ensemble_of, torus_of, trajectory_of
from veselova.service.api.media_types import MEDIA_TYPES

__all__ = [
    "Call",
    "atomic_target",
    "begin_body",
    "closed_form_call",
    "compare_call",
    "curve_call",
    "download_call",
    "encode_body",
    "read_answer",
    "reading",
    "solve_many_call",
    "target_of",
    "theta_call",
    "torus_call",
    "trajectory_call",
]

T = TypeVar("T")

#: Bytes of a download to a stream that are held in memory until it is whole.
_IN_MEMORY = 10_000_000


@dataclass(frozen=True)
class Call(Generic[T]):
    """One request: where it goes, its body in JSON, how long it may take, what its answer becomes.

    The body of the answer to a call with a target is written there, and ``result`` is given the
    header. ``accept`` is the media type of a result, empty where it has no body.
    """

    path: str
    result: Callable[[Any], T]
    content: bytes | None = None
    budget_s: float = 0.0
    accept: str = "application/json"
    target: Path | BinaryIO | None = None
    method: str = "POST"


def _call(
    path: str,
    body: Mapping[str, Any],
    budget_s: float,
    result: Callable[[Any], T],
    accept: str = "application/json",
    target: Path | BinaryIO | None = None,
) -> Call[T]:
    """Return the call with a body and a budget; raises InvalidInput as ``encode_body`` does, and
    for a budget that bounds no wait.
    """
    is_number = isinstance(budget_s, Real) and not isinstance(budget_s, bool)
    if not is_number or not 0 < budget_s < math.inf:
        raise InvalidInput(("budget_s",), "a finite number of seconds above 0", show(budget_s))
    content = encode_body({**body, "budget_s": budget_s})
    return Call(path, result, content, float(budget_s), accept, target)


def encode_body(body: Mapping[str, Any]) -> bytes:
    """Return a body in JSON; raises InvalidInput, located at the field that JSON cannot hold."""
    parts = []
    for name, value in body.items():
        try:
            item = orjson.dumps(value, option=orjson.OPT_SERIALIZE_NUMPY)
        except TypeError as error:
            raise InvalidInput((name,), "what JSON can hold", f"{show(value)} ({error})") from None
        parts.append(orjson.dumps(name) + b":" + item)
    return b"{" + b",".join(parts) + b"}"


def target_of(target: Target) -> Path | BinaryIO:
    """Return where a download goes, a path or a binary stream; raises InvalidInput for anything
    else, and for a path that leads to no folder.
    """
    if isinstance(target, (str, Path)):
        path = expand_home(target, "target")
        if path.parent.is_dir() and not path.is_dir():
            return path
    elif hasattr(target, "write") and not isinstance(target, TextIOBase):
        return target
    required = "a file in an existing folder, or a binary stream"
    raise InvalidInput(("target",), required, show(target))


def _problem(problem: Problem | Mapping[str, Any]) -> Problem:
    """Return the problem of a call; a mapping is the JSON of the HTTP request, and is validated
    here already.
    """
    if isinstance(problem, Problem):
        return problem
    if not isinstance(problem, Mapping):
        raise InvalidInput(
            ("problem",),
            "a problem, such as veselova.Veselova(A, q, q_dot), or a mapping with its JSON fields",
            show(problem),
        )
    from veselova.service.api.request_models import TorusRequest, read_request

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
    options = {"engine": engine, "method": method, "formulation": formulation}
    body = _motion(asked, times, **options, digits=digits, certified=certified)
    return _call("/v1/trajectories", body, budget_s, partial(trajectory_of, asked))


def download_call(
    problem: Problem | Mapping[str, Any],
    times: Any,
    target: Target,
    format: str = "npz",  # noqa: A002
    engine: str | None = None,
    method: str | None = None,
    *,
    outputs: Sequence[str] | None = None,
    digits: int = FEWEST_DIGITS,
    certified: bool = False,
    formulation: str | None = None,
    budget_s: float = 10.0,
) -> Call[Provenance]:
    """Write the motion to a path or a binary stream as it comes, as ``json``, ``csv``, ``npz``,
    ``arrow`` or ``parquet``, and return its provenance; ``outputs`` names the series, all of the
    system when left out. A file appears when it is whole.
    """
    options = {"engine": engine, "method": method, "formulation": formulation}
    body = _motion(_problem(problem), times, **options, digits=digits, certified=certified)
    accept = MEDIA_TYPES[require_name(format, ("format",), list(MEDIA_TYPES))]
    body["outputs"] = outputs
    return _call("/v1/trajectories", body, budget_s, _provenance, accept, target_of(target))


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
    body = _motion(asked, times, method=method, formulation=formulation)
    return _call("/v1/comparisons", body, budget_s, partial(comparison_of, asked))


def solve_many_call(
    problems: Mapping[str, Any] | Sequence[Problem],
    times: Any,
    outputs: Sequence[str] | None = None,
    *,
    budget_s: float = 10.0,
) -> Call[Ensemble]:
    """Return the motions of many Veselova problems at the same times (see ``veselova.solve_many``):
    arrays by name, or a list of problems given by doubles, with natural frames.
    """
    from veselova.ensemble_starts import Starts

    starts = Starts.of(problems)
    inertia: Any
    if not isinstance(problems, Mapping):
        for i in np.flatnonzero(~(starts.surely & starts.are_natural)).tolist():
            required = "a Veselova problem that moves, given by doubles, with its natural frame"
            raise InvalidInput(("problems", i), required, show(starts.problem(i)))
        inertia = starts.A[:, :, None] * np.eye(starts.n)
    elif starts.system.system != "veselova" or "frame" in problems:
        required = "arrays of Veselova problems with natural frames (the service takes no others)"
        raise InvalidInput(
            ("problems",), required, f"{starts.system.system}: {', '.join(problems)}"
        )
    else:
        inertia = problems["A"]
    A, q, q_dot = (np.array(x, dtype=np.float64) for x in (inertia, starts.q, starts.q_dot))
    body = {
        "A": A,
        "starts": {"q": q, "q_dot": q_dot},
        "normalize": starts.normalize,
        "times": as_request(times),
        "outputs": outputs,
    }
    return _call("/v1/ensembles", body, budget_s, partial(ensemble_of, starts.n))


def torus_call(problem: Problem | Mapping[str, Any], *, budget_s: float = 10.0) -> Call[Torus]:
    """Return the invariant torus of a motion (see ``veselova.torus``)."""
    return _call("/v1/tori", {"problem": _problem(problem).as_request()}, budget_s, torus_of)


def closed_form_call(
    problem: Problem | Mapping[str, Any],
    accuracy: float | None = None,
    *,
    budget_s: float = 10.0,
) -> Call[ClosedForm]:
    """Return the motion of a problem as data (see ``veselova.closed_form``)."""
    if accuracy is not None:
        require_accuracy(accuracy)
    body = {"problem": _problem(problem).as_request(), "accuracy": accuracy}
    return _call("/v1/closed-forms", body, budget_s, ClosedForm)


def curve_call(
    branch_points: Any,
    sign: int = -1,
    points: Any = None,
    w: Any = None,
    *,
    z: Any = None,
    outputs: Sequence[str] = (),
    digits: int = FEWEST_DIGITS,
    certified: bool = False,
    budget_s: float = 10.0,
) -> Call[CurveData]:
    """Return the data of a hyperelliptic curve with real branch points (see
    ``veselova.curves.RealHyperelliptic``), with the images of points (λ, w), and the places of
    points z of the real torus, where they are given.

    - outputs: ``quasi_periods``, ``thomae``
    - digits, certified: ``decimals`` of the answer has the numbers with radii
    """
    exact, sign = curve_arguments(branch_points, sign)
    body = {
        "branch_points": plain(exact),
        "sign": sign,
        "outputs": list(curve_outputs(outputs)),
        "digits": digits,
        "certified": certified,
    }
    if points is not None or w is not None:
        places, sheets = points_with_sheets(points, w)
        body["points"] = [_in_json(place) for place in places]
        body["w"] = to_pairs(sheets).tolist()
    if z is not None:
        body["z"] = plain(torus_points(z, (len(exact) - 1) // 2)[0])
    return _call("/v1/curves", body, budget_s, CurveData.from_dict)


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
    asked = ThetaArguments.of(z, tau, characteristic, derivatives)
    take = 0 if asked.single_characteristic else slice(None)
    body = {
        "z": to_pairs(asked.points).tolist(),
        "tau": to_pairs(asked.tau).tolist(),
        "characteristic": asked.characteristics[take].tolist(),
        "derivatives": asked.derivatives,
    }
    return _call("/v1/theta", body, budget_s, partial(_theta_of, asked.single_point))


def _theta_of(single_point: bool, document: Mapping[str, Any]) -> ScaledTheta:
    found = ScaledTheta.from_dict(document)
    if not single_point:
        return found
    return ScaledTheta(found.mantissa[0], found.exponent[0], found.error[0])


def _in_json(point: Any) -> Any:
    return [point.real, point.imag] if isinstance(point, complex) else plain(point)


def _motion(problem: Problem, times: Any, **options: Any) -> dict[str, Any]:
    return {
        "problem": problem.as_request(),
        "times": as_request(times),
        "outputs": list(problem.stored),
        **options,
    }


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
def atomic_target(target: Path | BinaryIO | None) -> Iterator[IO[bytes] | None]:
    """Give the file to write, where there is a target; at the end of the block, and not before, it
    is the target, or is copied to that stream.
    """
    if target is None:
        yield None
        return
    if isinstance(target, Path):
        with atomic_file(target) as part, part.open("xb") as file:
            yield file
        return
    with SpooledTemporaryFile(_IN_MEMORY) as copied:
        yield copied
        copied.seek(0)
        shutil.copyfileobj(copied, target)


def begin_body(file: IO[bytes], response: httpx.Response) -> None:
    """Prepare a file for the body of an answer: the rest of what is there, or all anew."""
    if response.status_code != httpx.codes.PARTIAL_CONTENT:
        file.seek(0)
        file.truncate()


def read_answer(call: Call[T], response: httpx.Response) -> T:
    """Return the result of an answer; raises ServiceError for another media type than that of the
    call, ProblemResponse for a refusal.

    The body of a download is not read yet: its header alone says whether it is one.
    """
    if not response.is_success:
        raise _refusal(response)
    with reading(str(response.url)):
        media_type = response.headers.get("content-type", "").partition(";")[0].strip().lower()
        if call.accept != media_type:
            raise ValueError(f"{media_type or 'no media type'}, not {call.accept}")
        return call.result(
            orjson.loads(response.content or b"null") if call.target is None else response.headers
        )


def _refusal(response: httpx.Response) -> ProblemResponse:
    """Return the exception of an answer that is no success: a problem document, or the beginning
    of its text where it has none.
    """
    document: Any = None
    with suppress(orjson.JSONDecodeError):
        document = orjson.loads(response.content)
    if not isinstance(document, dict):
        # a foreign server can name a charset that is none of texts
        text = response.content.decode("utf-8", "replace")
        if "location" in response.headers:
            text = f"a redirect to {response.headers['location']}, which is not followed"
        title = response.reason_phrase
        document = {"title": title, "status": response.status_code, "detail": show(text)}
    pause = response.headers.get("retry-after", "")
    seconds = float(pause) if pause.isascii() and pause.isdecimal() else None
    return ProblemResponse(response.status_code, document, seconds)
