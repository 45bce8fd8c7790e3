"""What the client asks: a call is one request, and what its answer becomes. Loads
neither engine.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from numbers import Real
from typing import Any, Generic, TypeVar

import numpy as np
import orjson

from veselova.mechanics.core.curve_arguments import (
    curve_arguments,
    curve_outputs,
    points_with_sheets,
    torus_points,
)
from veselova.mechanics.core.decimals import FEWEST_DIGITS
from veselova.mechanics.core.errors import InvalidInput, show
from veselova.mechanics.core.exact_input import plain
from veselova.mechanics.core.problem import Problem
from veselova.mechanics.core.theta_arguments import ThetaArguments
from veselova.mechanics.core.times import as_request
from veselova.mechanics.results.closed_form import ClosedForm
from veselova.mechanics.results.comparison import Comparison
from veselova.mechanics.results.curve import CurveData
from veselova.mechanics.results.ensemble import Ensemble
from veselova.mechanics.results.provenance import Provenance
from veselova.mechanics.results.scaled_theta import ScaledTheta
from veselova.mechanics.results.table import Target
from veselova.mechanics.results.torus import Torus
from veselova.mechanics.results.trajectory import Trajectory
from veselova.service.api.complex_numbers import to_pairs
from veselova.service.api.json_documents import comparison_of, ensemble_of, torus_of, trajectory_of
from veselova.service.client.download import DownloadTarget, media_type_of, provenance_of, sink_of

__all__ = [
    "Call",
    "closed_form_call",
    "compare_call",
    "curve_call",
    "download_call",
    "solve_many_call",
    "theta_call",
    "torus_call",
    "trajectory_call",
]

T = TypeVar("T")


@dataclass(frozen=True)
class Call(Generic[T]):
    """One request: where it goes, its body, how long it may take, and what its answer becomes.

    A call with a sink writes the body of its answer there, and ``result`` is given the header
    instead, before anything is written. ``accept`` and ``status`` are those of a result.
    ``content`` is the body in JSON. Raises InvalidInput for what no server can be asked.
    """

    path: str
    body: Mapping[str, Any] | None
    budget_s: float
    result: Callable[[Any], T]
    accept: str = "application/json"
    sink: DownloadTarget | None = None
    method: str = "POST"
    status: int = 200
    content: bytes | None = field(init=False)

    def __post_init__(self) -> None:
        content = None if self.body is None else _encode(self.body)
        object.__setattr__(self, "content", content)


def _encode(body: Mapping[str, Any]) -> bytes:
    """Return a body in JSON; raises InvalidInput, located at the field that JSON cannot hold, or at
    a budget that bounds no wait.
    """
    budget = body["budget_s"]
    is_number = isinstance(budget, Real) and not isinstance(budget, bool)
    if not is_number or not 0 < budget < math.inf:
        required = "a finite number of seconds above 0"
        raise InvalidInput(("budget_s",), required, show(budget))
    parts = []
    for name, value in body.items():
        try:
            if isinstance(value, (float, np.floating)) and not np.isfinite(value):
                raise TypeError("JSON has no such number")
            item = orjson.dumps(value, option=orjson.OPT_SERIALIZE_NUMPY)
        except TypeError:
            required = "what JSON can hold (whole characters, finite numbers, integers of 64 bits)"
            raise InvalidInput((name,), required, show(value)) from None
        parts.append(orjson.dumps(name) + b":" + item)
    return b"{" + b",".join(parts) + b"}"


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

    return read_request(TorusRequest, {"problem": plain(problem)}).problem.problem()


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
    chosen = {
        "engine": engine,
        "digits": digits,
        "certified": certified,
        "formulation": formulation,
    }
    body = {**chosen, **_motion(asked, times, method, budget_s)}
    return Call("/v1/trajectories", body, budget_s, partial(trajectory_of, asked))


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
    chosen = {
        "engine": engine,
        "digits": digits,
        "certified": certified,
        "formulation": formulation,
    }
    motion = {
        **_motion(_problem(problem), times, method, budget_s),
        "outputs": _names(outputs),
    }
    accept = media_type_of(format)
    sink = sink_of(target)
    return Call("/v1/trajectories", {**chosen, **motion}, budget_s, provenance_of, accept, sink)


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
    return Call(
        "/v1/comparisons",
        {"formulation": formulation, **_motion(asked, times, method, budget_s)},
        budget_s,
        partial(comparison_of, asked),
    )


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
        fits = starts.surely & starts.are_natural
        for i in np.flatnonzero(~fits).tolist():
            required = "a Veselova problem that moves, given by doubles, with its natural frame"
            raise InvalidInput(("problems", i), required, show(starts.problem(i)))
        inertia = starts.A[:, :, None] * np.eye(starts.n)
    elif starts.system.system != "veselova":
        required = "'veselova' (the service takes arrays of no other system)"
        raise InvalidInput(("problems", "system"), required, repr(starts.system.system))
    else:
        inertia = problems["A"]
    A, q, q_dot = (_listed(x) for x in (inertia, starts.q, starts.q_dot))
    body = {
        "A": A,
        "starts": {"q": q, "q_dot": q_dot},
        "normalize": starts.normalize,
        "times": as_request(times),
        "outputs": _names(outputs),
        "budget_s": budget_s,
    }
    return Call("/v1/ensembles", body, budget_s, partial(ensemble_of, starts.n))


def _listed(numbers: Any) -> Any:
    """Return an array of numbers as lists, null where it has NaN."""
    array = np.asarray(numbers, dtype=np.float64)
    listed = array.astype(object)
    listed[np.isnan(array)] = None
    return listed.tolist()


def torus_call(problem: Problem | Mapping[str, Any], *, budget_s: float = 10.0) -> Call[Torus]:
    """Return the invariant torus of a motion (see ``veselova.torus``)."""
    return Call(
        "/v1/tori",
        {"problem": _problem(problem).as_request(), "budget_s": budget_s},
        budget_s,
        torus_of,
    )


def closed_form_call(
    problem: Problem | Mapping[str, Any],
    accuracy: float | None = None,
    *,
    budget_s: float = 10.0,
) -> Call[ClosedForm]:
    """Return the motion of a problem as data (see ``veselova.closed_form``)."""
    body = {
        "problem": _problem(problem).as_request(),
        "accuracy": accuracy,
        "budget_s": budget_s,
    }
    return Call("/v1/closed-forms", body, budget_s, ClosedForm)


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
        "budget_s": budget_s,
    }
    if points is not None or w is not None:
        places, sheets = points_with_sheets(points, w)
        body["points"] = [_in_json(place) for place in places]
        body["w"] = to_pairs(sheets).tolist()
    if z is not None:
        body["z"] = plain(torus_points(z, (len(exact) - 1) // 2)[0])
    return Call("/v1/curves", body, budget_s, CurveData.from_dict)


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
        "budget_s": budget_s,
    }
    return Call("/v1/theta", body, budget_s, partial(_theta_of, asked.single_point))


def _theta_of(single_point: bool, document: Mapping[str, Any]) -> ScaledTheta:
    found = ScaledTheta.from_dict(document)
    if not single_point:
        return found
    return ScaledTheta(found.mantissa[0], found.exponent[0], found.error[0])


def _names(outputs: Any) -> list[Any] | None:
    if outputs is None:
        return None
    if isinstance(outputs, str) or not isinstance(outputs, Iterable):
        raise InvalidInput(("outputs",), "a list of names", show(outputs))
    return list(outputs)


def _in_json(point: Any) -> Any:
    return [point.real, point.imag] if isinstance(point, complex) else plain(point)


def _motion(problem: Problem, times: Any, method: str | None, budget_s: float) -> dict[str, Any]:
    return {
        "problem": problem.as_request(),
        "times": as_request(times),
        "method": method,
        "outputs": list(problem.stored),
        "budget_s": budget_s,
    }
