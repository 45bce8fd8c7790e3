"""The JSON of answers, both ways: a result becomes a document, and a document the same result
again.
"""

from __future__ import annotations

import io
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np
import orjson

from veselova.mechanics.core.decimals import Decimals, decimals_of
from veselova.mechanics.core.errors import InternalContradiction
from veselova.mechanics.core.problem import Problem
from veselova.mechanics.results.comparison import Comparison
from veselova.mechanics.results.ensemble import Ensemble
from veselova.mechanics.results.sampled_motion import Provenance
from veselova.mechanics.results.table import row_blocks
from veselova.mechanics.results.torus import Drift, Torus
from veselova.mechanics.results.trajectory import Trajectory
from veselova.mechanics.systems.veselova import Veselova

if TYPE_CHECKING:
    from veselova.geodesics import Geodesics, Polygon


def trajectory_document(
    trajectory: Trajectory, outputs: Iterable[str] | None = None
) -> dict[str, Any]:
    """Return the document of a trajectory with the chosen series; ``integrals`` gives each one's
    start and drift.

    Decimals are strings, and each series has one of radii beside it.
    """
    drift = trajectory.drift
    decimals = trajectory.decimals
    names = tuple(outputs or trajectory.problem.outputs)
    error: Any
    if decimals is None:
        series = {name: trajectory.series(name) for name in names}
        error = trajectory.error
        radii = {}
    else:
        series = {name: decimals.strings(name) for name in names}
        error = [str(error) for error in decimals.error]
        radii = {"radii": {name: decimals.strings(name, radii=True) for name in names}}
    return {
        "engine": trajectory.provenance.engine,
        "times": trajectory.times,
        "series": series,
        "integrals": {
            name: {"initial": values[0], "drift": drift[name]}
            for name, values in trajectory.integrals.items()
        },
        "error": error,
        "provenance": trajectory.provenance.as_dict(),
        **radii,
    }


def trajectory_of(problem: Problem, document: Mapping[str, Any]) -> Trajectory:
    """Return the trajectory of a document that has the stored outputs; numbers come back to the
    last bit or digit.
    """
    provenance = Provenance(**document["provenance"])
    times, error = (np.array(document[name], dtype=np.float64) for name in ("times", "error"))
    if "radii" not in document:
        series = {x: np.array(document["series"][x], dtype=np.float64) for x in problem.stored}
        return Trajectory(problem, times, error, series, provenance)
    midpoints, radii = (
        {name: decimals_of(document[kind][name]) for name in problem.stored}
        for kind in ("series", "radii")
    )
    certified = bool(provenance.details["certified"])
    for name in problem.derived:
        midpoints[name], radii[name] = problem.derive_decimals(
            name, midpoints, radii, provenance.digits
        )
    decimals = Decimals(provenance.digits, certified, midpoints, radii, problem.bounded)
    return Trajectory.of_decimals(problem, times, decimals, provenance)


def ensemble_document(ensemble: Ensemble) -> dict[str, Any]:
    """Return the document of an ensemble: ``rows`` are the problems that were solved, and the
    first axis of the series.
    """
    rows = np.flatnonzero(ensemble.solved)
    return {
        "times": ensemble.times,
        "outcome": ensemble.outcome.tolist(),
        "detail": list(ensemble.detail),
        "together": ensemble.together.tolist(),
        "rows": rows,
        "series": {name: values[rows] for name, values in ensemble.arrays.items()},
        "error": ensemble.error[rows],
        "provenance": ensemble.provenance.as_dict(),
    }


def ensemble_of(n: int, document: Mapping[str, Any]) -> Ensemble:
    """Return the ensemble of a document of bodies of dimension n; what was not solved is NaN."""
    outcome = np.array(document["outcome"])
    times = np.array(document["times"], dtype=np.float64)
    rows = np.array(document["rows"], dtype=np.intp)
    arrays = {}
    for name, values in {**document["series"], "error": document["error"]}.items():
        axes = Veselova.outputs.get(name, ())
        sizes = [n - 1 if axis == "coordinate" else n for axis in axes]
        arrays[name] = np.full((outcome.size, times.size, *sizes), np.nan)
        arrays[name][rows] = np.array(values, dtype=np.float64).reshape(-1, times.size, *sizes)
    error = arrays.pop("error")
    together = np.array(document["together"], dtype=bool)
    provenance = Provenance(**document["provenance"])
    return Ensemble(
        times,
        error,
        outcome,
        tuple(document["detail"]),
        together,
        arrays,
        provenance,
        Veselova.outputs,
    )


def comparison_document(
    comparison: Comparison, outputs: Sequence[str] | None = None
) -> dict[str, Any]:
    """Return the document of a comparison: both trajectories, and the largest deviation of every
    output. Those of two formulations are below ``formulations``.
    """
    both = {
        name: trajectory_document(found, outputs) for name, found in comparison.trajectories.items()
    }
    of_engines = comparison.names == ("analytic", "numeric")
    return {**comparison.summary(), **(both if of_engines else {"formulations": both})}


def comparison_of(problem: Problem, document: Mapping[str, Any]) -> Comparison:
    """Return the comparison of a document whose trajectories have the stored outputs."""
    first, second = document.get("formulations", ("analytic", "numeric"))
    both = document.get("formulations", document)
    return Comparison(
        trajectory_of(problem, both[first]), trajectory_of(problem, both[second]), (first, second)
    )


def torus_of(document: Mapping[str, Any]) -> Torus:
    """Return the torus of a document."""
    values = dict(document)
    if (drift := values.pop("drift", None)) is not None:
        values["drift"] = Drift.from_dict(drift)
    for name, value in values.items():
        if isinstance(value, list) and name != "origins":
            values[name] = np.array(value, dtype=np.int64 if name == "signs" else np.float64)
    return Torus(**{**values, "origins": tuple(values["origins"])})


def geodesics_document(lines: Geodesics, at: Sequence[float]) -> dict[str, Any]:
    """Return the document of geodesics, null for NaN, with their points at lengths, if any.
    Decimals are strings, and have radii beside them.
    """
    values: dict[str, Any] = {**vars(lines), "ellipsoid": lines.ellipsoid.semiaxes}
    decimals: Decimals | None = values.pop("decimals")
    if at:
        values["points"] = lines.at(at)
    # NaN differs from itself
    found = {name: np.asarray(np.where(x == x, x, None)).tolist() for name, x in values.items()}
    if decimals is None:
        return found
    head = {"digits": decimals.digits, "certified": decimals.certified}
    radii = {name: decimals.strings(name, radii=True) for name in decimals.radii}
    return {**found, **{name: decimals.strings(name) for name in radii}, **head, "radii": radii}


def geodesics_of(ellipsoid: Any, document: Mapping[str, Any]) -> Geodesics | Polygon:
    """Return the geodesics of a document, or its polygon. Loads the engine."""
    from veselova.geodesics import Ellipsoid, Geodesics, Polygon

    if "area" in document:
        return Polygon(**document)
    values: dict[str, Any] = {
        field.name: np.array(document[field.name], np.float64 if field.type == "Array" else None)
        for field in fields(Geodesics)
        if field.name in document
    }
    if "radii" in document:
        given = document["radii"].items()
        pairs = {name: (decimals_of(document[name]), decimals_of(x)) for name, x in given}
        for name, (_, radii) in pairs.items():  # of unknown numbers they are infinite
            values[name] = np.where(np.isinf(radii.astype(np.float64)), np.nan, values[name])
        digits, certified = document["digits"], document["certified"]
        values["decimals"] = Decimals.of_geodesics(digits, certified, pairs)
    values |= {"ellipsoid": Ellipsoid(ellipsoid), "coordinates": document["coordinates"]}
    return Geodesics(**values)[()]


def encode(document: Mapping[str, Any]) -> bytes:
    """Return a document as JSON bytes; NaN and infinity, which JSON cannot say and orjson writes as
    null, are our bug.
    """
    stream = io.BytesIO()
    write_document(document, stream)
    return stream.getvalue()


def write_document(document: Mapping[str, Any], stream: BinaryIO) -> None:
    """Write a document as JSON, its arrays block by block, so that the text of large ones is never
    in memory as a whole.
    """
    stream.write(b"{")
    for i, (name, value) in enumerate(document.items()):
        stream.write(b"," * (i > 0) + orjson.dumps(name) + b":")
        if isinstance(value, Mapping):
            write_document(value, stream)
        elif isinstance(value, np.ndarray) and value.ndim:
            _write_array(name, value, stream)
        else:
            _require_finite(value, name)
            stream.write(orjson.dumps(value, option=orjson.OPT_SERIALIZE_NUMPY))
    stream.write(b"}")


def _write_array(name: str, array: Any, stream: BinaryIO) -> None:
    stream.write(b"[")
    for rows in row_blocks(array.shape[0], array[:1].size):
        _require_finite(array[rows], name)
        text = orjson.dumps(np.ascontiguousarray(array[rows]), option=orjson.OPT_SERIALIZE_NUMPY)
        stream.write(b"," * (rows.start > 0) + text[1:-1])
    stream.write(b"]")


def _require_finite(value: Any, place: str) -> None:
    is_number = isinstance(value, (float, np.floating, np.ndarray))
    if is_number and not np.all(np.isfinite(value)):
        raise InternalContradiction(f"{place} holds a number that is not finite")
