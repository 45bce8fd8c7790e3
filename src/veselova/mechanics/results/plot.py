"""Pictures of a motion. This file and ``portrait`` alone know matplotlib, imported when a picture
is asked for.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.arguments import require_name, require_names
from veselova.mechanics.core.errors import InvalidInput, needs, show
from veselova.mechanics.results.portrait import COLOURS, LONG, draw_portrait, is_dense
from veselova.mechanics.results.sampled_motion import SampledMotion

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["STYLES", "picture"]

Array = NDArray[np.float64]

#: Differences of zero are drawn at the bottom of the logarithmic axis.
_LEAST_DRAWN = 1e-17

#: Panels besides the series of a problem.
_PANELS = ("portrait", "path", "drift", "error", "difference")

#: Style → settings of matplotlib. ``print`` is one column of a journal, 86 mm, with its text at 8
#: points; fonts are embedded as outlines that journals take.
STYLES: Mapping[str, Mapping[str, Any]] = {
    "screen": {"figure.figsize": (9.0, 3.2), "font.size": 10.0, "lines.linewidth": 1.2},
    "print": {
        "figure.figsize": (3.39, 1.6),
        "font.size": 8.0,
        "axes.labelsize": 8.0,
        "axes.titlesize": 8.0,
        "legend.fontsize": 6.5,
        "xtick.labelsize": 7.0,
        "ytick.labelsize": 7.0,
        "figure.titlesize": 8.0,
        "axes.linewidth": 0.5,
        "lines.linewidth": 0.8,
        "pdf.fonttype": 42,
        "figure.dpi": 300.0,
    },
}

#: Names of series in formulas.
_SYMBOLS = {
    "gamma": r"\gamma",
    "Omega": r"\Omega",
    "omega": r"\omega",
    "tau1": r"\tau_1",
    "spheroconic": r"\lambda",
    "q_dot": r"\dot q",
    "q_prime": "q'",
    "X_dot": r"\dot X",
    "frame": r"\mathrm{frame}",
}

#: Components that a legend lists.
_LISTED = 12


def picture(
    motion: SampledMotion,
    ax: Axes | None,
    outputs: Iterable[str] | None,
    style: Any,
    compared: Any = None,
) -> Figure:
    """Return the picture of a motion, one panel for each of ``outputs``; ``Trajectory.plot`` says
    what they are. The ``Comparison`` that the motion is the first of makes the panel
    ``difference``.
    """
    with needs("matplotlib", "a picture"):
        import matplotlib as mpl
        from matplotlib.axes import Axes
        from matplotlib.figure import Figure
    settings = STYLES[require_name(style, ("style",), list(STYLES))]
    if ax is not None and not isinstance(ax, Axes):
        raise InvalidInput(("ax",), "axes of matplotlib, or None", show(ax))
    panels = _panels(motion, outputs, ax, compared is not None)
    named: Any = dict(settings)
    with mpl.rc_context(named):
        if ax is not None:
            found: Any = ax.figure
            all_axes = [ax]
        else:
            found, all_axes = _layout(Figure, panels, _section(motion) == slice(None))
            problem = motion.problem
            how = f"{motion.provenance.engine}, {motion.provenance.method}"
            found.suptitle(f"{problem.title} ({how})", wrap=True)
        for axes, panel in zip(all_axes, panels, strict=True):
            if panel == "portrait":
                _draw_curve(axes, motion)
            elif panel == "path":
                _draw_path(axes, motion.series("position"))
            elif panel == "difference":
                _draw_difference(axes, compared)
            else:
                _draw_in_time(axes, motion, panel)
    return found  # type: ignore[no-any-return]


def _panels(
    motion: SampledMotion, outputs: Iterable[str] | None, ax: Any, compared: bool
) -> list[str]:
    """Return the panels that are asked for; raises InvalidInput for others."""
    problem = motion.problem
    in_space = motion.series(problem.portrait)[:1].size == 3
    on_plane = "position" in problem.outputs and motion.series("position")[:1].size == 2
    if outputs is None and ax is not None:
        return ["portrait" if ax.name == "3d" else problem.portrait]
    if outputs is None:
        last = ["difference"] if compared else []
        middle = "spheroconic" if "spheroconic" in problem.outputs else "drift"
        first = [*(["portrait"] if in_space else []), *(["path"] if on_plane else [])]
        return [*first, problem.portrait, middle, *last]
    known = [*problem.outputs, *(_PANELS if compared else _PANELS[:-1])]
    named = [outputs] if isinstance(outputs, str) else outputs
    chosen = list(require_names(named, ("outputs",), known))
    if ax is not None and len(chosen) > 1:
        raise InvalidInput(("outputs",), f"one of {', '.join(known)}", show(chosen))
    if "path" in chosen and not on_plane:
        required = "a ball in three dimensions for the panel path"
        raise InvalidInput(("outputs",), required, problem.title)
    if "portrait" in chosen and not in_space:
        required = "a series of three components for the panel portrait"
        given = f"{problem.portrait} of {motion.series(problem.portrait)[:1].size}"
        raise InvalidInput(("outputs",), required, given)
    if ax is not None and (chosen == ["portrait"]) != (ax.name == "3d"):
        required = "axes in space (projection='3d') for the panel portrait, plane ones for others"
        raise InvalidInput(("ax",), required, f"{ax.name} axes for {chosen[0]}")
    return chosen


def _layout(figure_class: Any, panels: list[str], shared: bool) -> tuple[Figure, list[Any]]:
    """Return a figure with one panel below the other; one in space is twice as high, and those in
    time may share their axis.
    """
    import matplotlib as mpl

    heights = [2 if panel == "portrait" else 1 for panel in panels]
    width, height = mpl.rcParams["figure.figsize"]
    figure = figure_class(figsize=(width, height * sum(heights)), layout="constrained")
    grid = figure.add_gridspec(len(panels), 1, height_ratios=heights)
    found: list[Any] = []
    first: Any = None
    for place, panel in zip(grid, panels, strict=True):
        if panel in ("portrait", "path"):
            kind = "3d" if panel == "portrait" else None
            found.append(figure.add_subplot(place, projection=kind))
        else:
            found.append(figure.add_subplot(place, sharex=first))
            first = found[-1] if shared else None
    return figure, found


def _draw_curve(axes: Any, motion: SampledMotion) -> None:
    import matplotlib as mpl

    problem = motion.problem
    curve = motion.series(problem.portrait).reshape(-1, 3)
    frames = motion.series("frame") if "frame" in problem.outputs else None
    symbol = _SYMBOLS.get(problem.portrait, problem.portrait)
    width = float(mpl.rcParams["lines.linewidth"])
    draw_portrait(axes, curve, problem.semiaxes, frames, symbol, width)
    title = f"${symbol}({_SYMBOLS.get(problem.time, problem.time)})$"
    if is_dense(curve, problem.semiaxes):
        title += ", darker where it is more often"
    elif frames is not None:
        title += " and frames at six times"
        _add_legend(axes)
    axes.set_title(title)


def _draw_path(axes: Axes, position: Array) -> None:
    """Draw the path of the contact point in its plane, seen from above, its long side across."""
    across, up = position.T
    names = ("e_2", "e_3")
    if np.ptp(across) < np.ptp(up):
        across, up, names = -up, across, ("-e_3", "e_2")
    axes.plot(across, up, color=COLOURS[0])
    for k, marker in ((0, "o"), (-1, "s")):
        axes.plot(across[k], up[k], marker, color=COLOURS[1], markersize=4)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_title("path of the contact point, from the circle to the square")
    axes.set_xlabel(f"along ${names[0]}$")
    axes.set_ylabel(f"along ${names[1]}$")


def _draw_in_time(axes: Axes, motion: SampledMotion, panel: str) -> None:
    """Draw components of a series, the drift of the integrals, or the error, over time."""
    times = motion.times
    if panel == "drift":
        _draw_drift(axes, motion)
    elif panel == "error":
        axes.semilogy(times, np.maximum(motion.error, _LEAST_DRAWN), color=COLOURS[0])
        axes.set_ylabel("error bound")
    else:
        rows = _section(motion)
        _draw_lines(axes, times[rows], motion.series(panel)[rows], panel)
    problem = motion.problem
    axes.set_xlabel(f"${_SYMBOLS.get(problem.time, problem.time)}$")
    axes.margins(x=0)
    if _section(motion) == slice(None):
        axes.label_outer()
    elif panel not in ("drift", "error"):
        axes.set_title(f"the first {len(times[rows])} of {len(times)} times", loc="right")


def _section(motion: SampledMotion) -> slice:
    """Return the times over which components are drawn: all, or the first of a long motion."""
    turning = motion.problem.turning / (2 * np.pi)
    times = motion.times
    if turning * float(times[-1] - times[0]) <= LONG:
        return slice(None)
    return slice(0, max(2, int(np.searchsorted(times, times[0] + LONG / 2 / turning))))


def _draw_lines(axes: Axes, times: Array, values: Array, name: str) -> None:
    symbol = _SYMBOLS.get(name, name)
    indices = list(np.ndindex(values.shape[1:]))
    for i, index in enumerate(indices):
        digits = ("" if len(index) <= 1 or max(values.shape[1:]) < 10 else ",").join(
            str(part + 1) for part in index
        )
        subscript = f"_{{{digits}}}" if index else ""
        axes.plot(
            times,
            values[(slice(None), *index)],
            color=COLOURS[i % len(COLOURS)],
            linestyle=("-", "--", ":")[i // len(COLOURS) % 3],
            label=f"${symbol}{subscript}$" if i < _LISTED else None,
        )
    axes.set_ylabel(f"${symbol}$")
    _add_legend(axes)


def _add_legend(axes: Any) -> None:
    """List what is drawn beside the axes, where it hides nothing."""
    axes.legend(
        loc="upper left",
        bbox_to_anchor=(1.0, 1.0),
        frameon=False,
        handlelength=1.2,
        borderaxespad=0.3,
        labelspacing=0.25,
    )


def _draw_drift(axes: Axes, motion: SampledMotion) -> None:
    """Draw the largest change of each integral against its size at the first time, or against 1
    where it vanishes.
    """
    for name, colour in zip(motion.integrals, itertools.cycle(COLOURS), strict=False):
        change = np.maximum(motion.relative_change(name), _LEAST_DRAWN)
        axes.semilogy(motion.times, change, color=colour, label=name.replace("_", " "))
    axes.set_ylabel("relative drift")
    _add_legend(axes)


def _draw_difference(axes: Axes, compared: Any) -> None:
    """Draw how far the motions of a comparison are apart, and what both errors allow."""
    first, second = compared.first, compared.second
    for name, colour in zip(first.problem.outputs, COLOURS, strict=False):
        values = np.maximum(compared.difference(name), _LEAST_DRAWN)
        symbol = _SYMBOLS.get(name, name.replace("_", r"\_"))
        axes.semilogy(first.times, values, color=colour, label=rf"$|\Delta {symbol}|$")
    allowed, floor = first.error + second.error, compared.conditioning_floor
    axes.semilogy(first.times, allowed, color="0.4", linestyle="--", label="sum of both bounds")
    axes.semilogy(first.times, floor, color="0.7", label="conditioning floor")
    axes.set_ylabel("difference")
    axes.set_xlabel("time")
    axes.margins(x=0)
    _add_legend(axes)
