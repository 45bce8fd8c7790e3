"""Pictures of a motion. The one place that knows matplotlib, imported when a picture
is asked for.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.errors import BackendMissing
from veselova.mechanics.core.problem import Problem

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["Portrayable", "picture"]

Array = NDArray[np.float64]

#: One colour per body axis or coordinate, told apart in print and by colour-blind readers (Okabe
#: and Ito).
_COLOURS = ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#F0E442"]

#: Differences of zero are drawn at the bottom of the logarithmic axis.
_LEAST_DRAWN = 1e-17


class Portrayable(Protocol):
    """A motion as pictures need it, its times (N,) in increasing order."""

    @property
    def problem(self) -> Problem:
        """Return the problem."""

    @property
    def times(self) -> Array:
        """Return the times, (N,)."""

    @property
    def integrals(self) -> Mapping[str, Array]:
        """Return the integrals of motion at each time, by name."""

    @property
    def provenance(self) -> Any:
        """Return the provenance, which has ``engine`` and ``method``."""

    def series(self, name: str) -> Array:
        """Return one of the problem's outputs by name."""


def picture(
    motion: Portrayable,
    differences: Mapping[str, Array] | None = None,
    errors: Mapping[str, Array] | None = None,
    floor: Array | None = None,
) -> Figure:
    """Return the picture of a motion.

    First the series that the problem calls its portrait: a curve on the sphere with the frame axes
    at a few times where it has three components, else the components. Then the spheroconic
    coordinates, or where there are none the drift of the integrals.
    For a comparison: the ``differences`` of each output, the ``errors`` of each engine and the
    conditioning ``floor``, (N,) each, on a logarithmic axis.
    """
    try:
        from matplotlib.figure import Figure
    except ImportError:
        raise BackendMissing("matplotlib", "a picture", "pip install matplotlib") from None
    rows = 2 if differences is None else 3
    problem = motion.problem
    figure = Figure(figsize=(9, 3.2 * rows), layout="constrained")
    portrait = motion.series(problem.portrait).reshape(motion.times.size, -1)
    if portrait.shape[1] == 3:
        grid = figure.add_gridspec(rows, 1, height_ratios=[2] + [1] * (rows - 1))
        _draw_sphere(figure.add_subplot(grid[0], projection="3d"), motion)
        axes = [figure.add_subplot(grid[row]) for row in range(1, rows)]
    else:
        axes = list(np.atleast_1d(figure.subplots(rows, 1, sharex=True)))
        _draw_lines(
            axes[0], motion.times, portrait, problem.portrait, f"components of {problem.portrait}"
        )
        axes = axes[1:]
    if "spheroconic" in problem.outputs:
        _draw_lines(
            axes[0],
            motion.times,
            motion.series("spheroconic"),
            r"\lambda",
            "spheroconic coordinates",
        )
    else:
        _draw_drift(axes[0], motion)
    if differences is not None:
        _draw_difference(axes[1], motion.times, differences, errors or {}, floor)
    axes[-1].set_xlabel(f"time {problem.time}")
    figure.suptitle(f"{problem.title} ({motion.provenance.engine}, {motion.provenance.method})")
    return figure


def _draw_drift(axes: Axes, motion: Portrayable) -> None:
    for i, (name, values) in enumerate(motion.integrals.items()):
        change = np.max(
            np.abs(values - values[:1]).reshape(values.shape[0], -1), axis=1, initial=0.0
        )
        axes.semilogy(
            motion.times,
            np.maximum(change, _LEAST_DRAWN),
            color=_COLOURS[i % len(_COLOURS)],
            linewidth=1,
            label=name,
        )
    axes.set_ylabel("change of the integrals")
    axes.legend(loc="lower right", ncols=3, fontsize="small", framealpha=0.9)


def _draw_lines(axes: Axes, times: Any, values: Any, symbol: str, label: str) -> None:
    for i in range(values.shape[1]):
        axes.plot(
            times,
            values[:, i],
            color=_COLOURS[i % len(_COLOURS)],
            linewidth=1.1,
            label=f"${symbol}_{{{i + 1}}}$",
        )
    axes.set_ylabel(label)
    axes.legend(loc="upper right", ncols=min(8, values.shape[1]), fontsize="small", framealpha=0.9)


def _draw_sphere(axes: Any, motion: Portrayable) -> None:
    """Draw the curve on its sphere or ellipsoid and, where there is a frame, its vectors at six
    times, standing on the curve.
    """
    latitude, longitude = np.mgrid[0 : np.pi : 25j, 0 : 2 * np.pi : 49j]
    name = motion.problem.portrait
    curve = motion.series(name).reshape(-1, 3)
    radii = motion.problem.semiaxes
    a, b, c = np.full(3, np.max(np.linalg.norm(curve, axis=1))) if radii is None else radii
    x = np.sin(latitude) * np.cos(longitude)
    y = np.sin(latitude) * np.sin(longitude)
    z = np.cos(latitude)
    axes.plot_wireframe(a * x, b * y, c * z, color="0.85", linewidth=0.4)
    axes.plot(*curve.T, color=_COLOURS[0], linewidth=1.2)
    title = f"{name}({motion.problem.time})"
    if "frame" in motion.problem.outputs:
        title += ", with $e_1$ (blue), $e_2$ (red), $e_3$ (green) at six times"
        frame = motion.series("frame")
        for i in np.unique(np.linspace(0, motion.times.size - 1, 6).astype(int)):
            for k, colour in enumerate(_COLOURS[i] for i in (0, 1, 2)):
                axes.quiver(*curve[i], *(0.3 * frame[i, :, k]), color=colour, linewidth=1.4)
    axes.set_aspect("equal")
    axes.set_xlabel(f"{name}_1")
    axes.set_ylabel(f"{name}_2")
    axes.set_zlabel(f"{name}_3")
    axes.set_title(title, fontsize="medium")


def _draw_difference(
    axes: Axes,
    times: Array,
    differences: Mapping[str, Array],
    errors: Mapping[str, Array],
    floor: Array | None,
) -> None:
    for (name, values), colour in zip(differences.items(), _COLOURS, strict=False):
        axes.semilogy(
            times, np.maximum(values, _LEAST_DRAWN), color=colour, linewidth=1, label=f"|Δ {name}|"
        )
    for (name, values), style in zip(errors.items(), ("--", ":"), strict=False):
        axes.semilogy(
            times, values, color="0.4", linestyle=style, linewidth=1, label=f"error, {name}"
        )
    if floor is not None:
        axes.semilogy(times, floor, color="0.7", linewidth=1, label="conditioning floor")
    axes.set_ylabel("difference of engines")
    axes.legend(loc="lower right", ncols=3, fontsize="small", framealpha=0.9)
