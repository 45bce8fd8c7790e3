"""The curve of a motion on its sphere or ellipsoid, drawn in space."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["COLOURS", "LONG", "draw_portrait", "is_dense"]

Array = NDArray[np.float64]

#: One colour per body axis or coordinate, told apart in print and by colour-blind readers (Okabe
#: and Ito).
COLOURS = ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#F0E442"]

#: Turns from which lines would fill the picture, and the points that a density needs.
LONG = 40.0
_POINTS_OF_DENSITY = 2000

#: Steps longer than this part of the radius are not joined by a line.
_WIDE_STEP = 0.7

#: What is left of a colour on the side away from the viewer.
_FAR = 0.22

#: Where the viewer stands, in degrees.
_ELEVATION = 24.0
_AZIMUTH = -52.0

#: Frames that are drawn along a curve.
_FRAMES = 6

#: How dark one point of a density is.
_SHADE = 0.15


def turns_of(curve: Array, semiaxes: Array | None = None) -> float:
    """Return how many great circles a curve (N, 3) is long, as far as its points show."""
    unit = _on_unit_sphere(curve, semiaxes)
    steps = np.linalg.norm(np.diff(unit, axis=0), axis=1)
    return float(np.sum(steps) / (2 * np.pi))


def is_dense(curve: Array, semiaxes: Array | None = None) -> bool:
    """Return whether a curve (N, 3) is drawn as the density of its points."""
    return len(curve) >= _POINTS_OF_DENSITY and turns_of(curve, semiaxes) > LONG


def draw_portrait(
    axes: Any,
    curve: Array,
    semiaxes: Array | None,
    frames: Array | None,
    name: str,
    width: float,
) -> None:
    """Draw a curve (N, 3) on the sphere or the ellipsoid of ``semiaxes``, above its wireframe and
    dim on the far side.

    A curve of many turns is drawn as the density of its points, seen from the viewer's side. Frames
    (N, 3, 3) stand on the curve at six times where it is a line. ``width``: of lines, in points.
    """
    radii = semiaxes
    if radii is None:
        radii = np.full(3, max(float(np.max(np.linalg.norm(curve, axis=1))), 1e-300))
    axes.view_init(elev=_ELEVATION, azim=_AZIMUTH)
    axes.computed_zorder = False
    axes.locator_params(nbins=4)
    view = _direction_of_view()
    _draw_wireframe(axes, radii, view, width)
    if is_dense(curve, radii):
        _draw_density(axes, curve, radii, view)
    else:
        _draw_curve(axes, curve, radii, view, width)
        if frames is not None:
            _draw_frames(axes, curve, frames, float(np.max(radii)), width)
    axes.set_aspect("equal")
    size = axes.title.get_fontsize()
    for set_label, i in ((axes.set_xlabel, 1), (axes.set_ylabel, 2), (axes.set_zlabel, 3)):
        set_label(f"${name}_{i}$", labelpad=0.4 * size)
    axes.tick_params(pad=0.1 * size)
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.set_pane_color((1.0, 1.0, 1.0, 0.0))
        axis._axinfo["grid"]["linewidth"] = 0.3


def _direction_of_view() -> Array:
    """Return the unit vector towards the viewer."""
    up, around = np.radians([_ELEVATION, _AZIMUTH])
    return np.array([np.cos(up) * np.cos(around), np.cos(up) * np.sin(around), np.sin(up)])


def _on_unit_sphere(curve: Array, radii: Array | None) -> Array:
    scaled = curve if radii is None else curve / radii
    sizes = np.linalg.norm(scaled, axis=1, keepdims=True)
    return np.asarray(scaled / np.where(sizes > 0, sizes, 1.0))


def _faces_viewer(points: Array, radii: Array, view: Array) -> NDArray[np.bool_]:
    """Return which points of the ellipsoid have a normal that points towards the viewer."""
    return np.asarray((points / radii**2) @ view >= 0)


def _draw_wireframe(axes: Any, radii: Array, view: Array, width: float) -> None:
    around = np.linspace(0, 2 * np.pi, 121)
    lines: list[Array] = []
    for latitude in np.linspace(-np.pi / 2, np.pi / 2, 13)[1:-1]:
        ring = np.cos(latitude)
        height = np.full_like(around, np.sin(latitude))
        lines.append(np.stack([ring * np.cos(around), ring * np.sin(around), height], axis=1))
    half = np.linspace(-np.pi / 2, np.pi / 2, 61)
    for longitude in np.linspace(0, 2 * np.pi, 25)[:-1]:
        along = np.cos(half)
        lines.append(
            np.stack([along * np.cos(longitude), along * np.sin(longitude), np.sin(half)], axis=1)
        )
    scaled = [line * radii for line in lines]
    _add_lines(axes, _runs(scaled, radii, view, False), "0.93", 0.3 * width, 1)
    _add_lines(axes, _runs(scaled, radii, view, True), "0.80", 0.35 * width, 3)


def _draw_curve(axes: Any, curve: Array, radii: Array, view: Array, width: float) -> None:
    steps = np.linalg.norm(np.diff(_on_unit_sphere(curve, radii), axis=0), axis=1)
    if steps.size and np.median(steps) <= _WIDE_STEP:
        _add_lines(axes, _runs([curve], radii, view, False), _dimmed(COLOURS[0]), width, 2)
        _add_lines(axes, _runs([curve], radii, view, True), COLOURS[0], width, 4)
        return
    near = _faces_viewer(curve, radii, view)
    for part, colour, order in ((~near, _dimmed(COLOURS[0]), 2), (near, COLOURS[0], 4)):
        axes.scatter(*curve[part].T, s=4 * width, color=colour, zorder=order, depthshade=False)


def _dimmed(colour: str) -> tuple[float, ...]:
    """Return a colour mixed with white."""
    from matplotlib.colors import to_rgb

    return tuple(1 - _FAR * (1 - part) for part in to_rgb(colour))


def _runs(lines: Sequence[Array], radii: Array, view: Array, near: bool) -> list[Array]:
    """Return the parts of lines (N, 3) on one side of the surface."""
    found: list[Array] = []
    for line in lines:
        flags = _faces_viewer((line[:-1] + line[1:]) / 2, radii, view)
        ends = np.flatnonzero(np.diff(flags)) + 1
        parts = np.split(np.arange(flags.size), ends)
        found += [line[p[0] : p[-1] + 2] for p in parts if p.size and flags[p[0]] == near]
    return found


def _add_lines(axes: Any, lines: list[Array], colour: Any, width: float, order: int) -> None:
    from mpl_toolkits.mplot3d.art3d import Line3DCollection

    drawn = Line3DCollection(lines, colors=[colour], linewidths=width, zorder=order)
    drawn.set_capstyle("round")
    axes.add_collection3d(drawn, autolim=False)
    if lines:
        axes.auto_scale_xyz(*np.concatenate(lines).T)


def _draw_frames(axes: Any, curve: Array, frames: Array, size: float, width: float) -> None:
    for i in np.unique(np.linspace(0, len(curve) - 1, _FRAMES).astype(int)):
        for k in range(3):
            axes.quiver(
                *curve[i],
                *(0.3 * size * frames[i, :, k]),
                color=COLOURS[k],
                linewidth=1.3 * width,
                zorder=5,
                label=f"$e_{k + 1}$" if i == 0 else None,
            )


def _draw_density(axes: Any, curve: Array, radii: Array, view: Array) -> None:
    """Draw the points of a curve on the side of the viewer: darker where they are more."""
    near = curve[_faces_viewer(curve, radii, view)]
    axes.scatter(*near.T, s=4, color=COLOURS[0], alpha=_SHADE, linewidths=0, depthshade=False)
