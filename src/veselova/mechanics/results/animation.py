"""A motion as a film: the body in space, or the ball on its plane, frame by frame by matplotlib."""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.budget import Progress, iterate, limits
from veselova.mechanics.core.errors import BackendMissing, InvalidInput, install_extra, show
from veselova.mechanics.core.exact_input import positive_number
from veselova.mechanics.results.sampled_motion import SampledMotion
from veselova.mechanics.results.table import located

__all__ = ["FILMS", "animate"]

Array = NDArray[np.float64]

#: What draws frame k of a film into axes.
Draw = Callable[[Any, int], None]

#: The endings of films.
FILMS = (".gif", ".mp4")

#: Colours of Ω and of tracks (Okabe and Ito).
_OMEGA = "#E69F00"
_TRAIL = "#0072B2"

#: The longest half axis of the body's ellipsoid, where the longest Ω is 1.
_SIZE = 0.75

#: Half the width of the picture of a ball, in radii.
_WINDOW = 4.0

#: Frames of the longest film.
_MOST_FRAMES = 10_000

#: The slowest film, in frames a second: a GIF shows a frame for at most 655 seconds.
_FEWEST_A_SECOND = 0.01


def animate(
    motion: SampledMotion,
    path: str | Path,
    seconds: float,
    frames_per_second: float,
    progress: Progress,
) -> None:
    """Write a film of a motion of a body in three dimensions, or of a ball; its ending says which
    kind: .gif by pillow, .mp4 by ffmpeg.

    Raises InvalidInput for another ending, another dimension or a film without frames, and
    BackendMissing without matplotlib or ffmpeg.
    """
    if not isinstance(path, (str, os.PathLike)):
        raise InvalidInput(("path",), "the path of a file", show(path))
    film, problem = located(path), motion.problem
    if film.suffix.lower() not in FILMS:
        raise InvalidInput(("path",), f"a file name ending in {' or '.join(FILMS)}", str(film))
    if problem.inverse_inertia is None or "frame" not in problem.outputs:
        raise InvalidInput(("problem",), "a body in three dimensions, or a ball", problem.title)
    length = float(positive_number(seconds, ("seconds",)))
    rate = float(positive_number(frames_per_second, ("frames_per_second",)))
    if rate < _FEWEST_A_SECOND:
        required = f"at least {_FEWEST_A_SECOND} frames a second"
        raise InvalidInput(("frames_per_second",), required, show(frames_per_second))
    if length * rate > _MOST_FRAMES:
        given = f"{length * rate:.6g}"
        raise InvalidInput(("seconds",), f"a film of at most {_MOST_FRAMES} frames", given)
    writer = _writer(film, rate)
    shown = _frames(motion, max(2, round(length * rate)))
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.4, 6.4), dpi=80)
    FigureCanvasAgg(figure)
    axes: Any = figure.add_subplot(projection="3d", position=(0.0, 0.0, 1.0, 0.94))
    figure.suptitle(problem.title, fontsize=9)
    label = figure.text(0.03, 0.03, "", fontsize=10)
    draw = _draw_body(shown) if problem.rolling_radius is None else _draw_ball(shown)
    with limits(None, progress), writer.saving(figure, str(film), 80):
        for k, t in enumerate(iterate(shown.times.tolist(), "film")):
            axes.clear()
            axes.set_axis_off()
            draw(axes, k)
            label.set_text(f"{problem.time} = {t:.4g}")
            writer.grab_frame()


def _writer(film: Path, frames_per_second: Any) -> Any:
    """Return what writes films of this kind, by ffmpeg in PATH or that of the extra ``film``."""
    try:
        import matplotlib as mpl
        from matplotlib.animation import FFMpegWriter, PillowWriter
    except ImportError:
        raise BackendMissing("matplotlib", "a film", install_extra("film")) from None
    if film.suffix.lower() == ".gif":
        return PillowWriter(fps=frames_per_second)
    if not FFMpegWriter.isAvailable():
        with suppress(ImportError):
            from imageio_ffmpeg import get_ffmpeg_exe

            mpl.rcParams["animation.ffmpeg_path"] = get_ffmpeg_exe()
    if not FFMpegWriter.isAvailable():
        install = f"{install_extra('film')}, or write a .gif"
        raise BackendMissing("ffmpeg", "a film in .mp4", install)
    return FFMpegWriter(fps=frames_per_second, codec="h264", extra_args=["-pix_fmt", "yuv420p"])


def _frames(motion: SampledMotion, count: int) -> SampledMotion:
    """Return the motion at so many times in equal steps, or at its own where these are all."""
    first, last = (float(motion.times.min()), float(motion.times.max()))
    if motion.times.size < 2 or first == last:
        raise InvalidInput(
            ("times",), "two different times or more", f"{motion.times.size} time(s)"
        )
    return motion.dense(np.linspace(first, last, count)) if motion.dense else motion


def _in_space(frame: Array) -> Array:
    """Return the rotations (…, 3, 3) from the body to the picture, whose axes are e_2, e_3, e_1."""
    return np.swapaxes(frame[..., [1, 2, 0]], -1, -2)


def _surface(columns: Array) -> Array:
    """Return a grid on the ellipsoid whose half axes are these columns, (3, 13, 25)."""
    height, around = np.meshgrid(np.linspace(0, np.pi, 13), np.linspace(0, 2 * np.pi, 25))
    unit = [np.sin(height) * np.cos(around), np.sin(height) * np.sin(around), np.cos(height)]
    return np.tensordot(columns, np.array(unit).swapaxes(1, 2), 1)


def _Omega(shown: SampledMotion) -> Array:
    """Return the angular velocity in the body, (N, 3)."""
    if "Omega" in shown.problem.outputs:
        return shown.series("Omega")
    omega = shown.series("omega")
    return np.stack([omega[:, 2, 1], omega[:, 0, 2], omega[:, 1, 0]], axis=1)


def _draw_body(shown: SampledMotion) -> Draw:
    """Return what draws the body's ellipsoid (x,𝓘x) = 1 in space with its axes; e_1 points
    upwards.
    """
    turns = _in_space(shown.series("frame"))
    squares, principal = np.linalg.eigh(np.asarray(shown.problem.inverse_inertia))
    # E_k is the axis of the body nearest to the k-th coordinate axis.
    order = np.argsort(np.argmax(np.abs(principal), axis=0), kind="stable")
    half = _SIZE * np.sqrt(squares / squares.max())[order]
    principal = principal[:, order]
    principal = principal * np.where(np.diag(principal) < 0, -1, 1)
    columns = turns @ (principal * half)
    tips = turns @ (principal * (half + 0.2))
    longest = int(np.argmax(half))
    omega = np.einsum("nij,nj->ni", turns, _Omega(shown))
    omega = omega / (float(np.linalg.norm(omega, axis=1).max(initial=0.0)) or 1.0)

    def draw(axes: Any, k: int) -> None:
        axes.set(xlim=(-1, 1), ylim=(-1, 1), zlim=(-1, 1))
        axes.set_box_aspect((1, 1, 1), zoom=1.35)
        axes.view_init(elev=22, azim=-55)
        surface = _surface(columns[k])
        axes.plot_surface(*surface, color="#9FB4CC", alpha=0.35, linewidth=0.2, edgecolor="0.4")
        fixed = zip(("$e_2$", "$e_3$", "$e_1$"), np.eye(3), strict=True)
        moving = ((f"$E_{axis + 1}$", tip) for axis, tip in enumerate(tips[k].T))
        arrows = [*((*arrow, "0.6") for arrow in fixed), *((*arrow, "0.2") for arrow in moving)]
        for name, tip, colour in [*arrows, ("ω", omega[k], _OMEGA)]:
            axes.plot(*zip((0, 0, 0), tip, strict=True), color=colour, linewidth=1.4)
            axes.text(*(1.1 * tip), name, color=colour)
        tracks = {"ω in space": omega, f"track of $E_{longest + 1}$": tips[:, :, longest]}
        for (caption, points), colour in zip(tracks.items(), (_OMEGA, _TRAIL), strict=True):
            axes.plot(*points[: k + 1].T, color=colour, linewidth=1.2, label=caption)
        axes.legend(loc="upper left", fontsize=9, frameon=False)

    return draw


def _draw_ball(shown: SampledMotion) -> Draw:
    """Return what draws the ball on its plane, which the picture follows, with the path of its
    contact point.
    """
    radius = float(shown.problem.rolling_radius or 1.0)
    columns = radius * _in_space(shown.series("frame"))
    path = shown.series("position")
    way = path[-1] - path[0]
    half = _WINDOW * radius
    octants = np.arange(12)[:, None] // 6 + np.arange(24)[None, :] // 6
    colours = np.where(octants % 2 == 0, "#56B4E9", "#F4F7FA")

    def draw(axes: Any, k: int) -> None:
        low, high = path[k] - half, path[k] + half
        axes.set(
            xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(radius - half, radius + half)
        )
        axes.set_box_aspect((1, 1, 1), zoom=1.5)
        # From the side, a little from the front: the path is not hidden behind the ball.
        axes.view_init(elev=24, azim=float(np.degrees(np.arctan2(way[1], way[0]))) - 60)
        surface = np.array([*path[k], radius])[:, None, None] + _surface(columns[k])[:, :, ::-1]
        axes.plot_surface(*surface, facecolors=colours, linewidth=0, antialiased=False)
        for axis in (0, 1):
            for place in np.arange(np.ceil(low[axis] / radius), high[axis] / radius):
                ends = np.array([low, high])
                ends[:, axis] = place * radius
                axes.plot(*ends.T, [0, 0], color="0.82", linewidth=0.7)
        behind = path[: k + 1]
        near = np.all(np.abs(behind - path[k]) <= half, axis=1)
        trail = np.where(near, behind.T, np.nan)
        axes.plot(*trail, np.zeros(k + 1), color=_TRAIL, linewidth=1.4)

    return draw
