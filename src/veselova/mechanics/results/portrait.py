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


def is_dense(curve: Array, semiaxes: Array | None = None) -> bool:
    """Return whether a curve (N, 3) is drawn as the density of its points: it is longer than so
    many great circles, as far as its points show.
    """
    steps = np.linalg.norm(np.diff(_on_unit_sphere(curve, semiaxes), axis=0), axis=1)
    return len(curve) >= _POINTS_OF_DENSITY and float(np.sum(steps) / (2 * np.pi)) > LONG


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
    _draw_wireframe(axes, radii, width)
    if is_dense(curve, radii):
        near = curve[_faces_viewer(curve, radii)]  # darker where they are more
        axes.scatter(*near.T, s=4, color=COLOURS[0], alpha=_SHADE, linewidths=0, depthshade=False)
    else:
        _draw_curve(axes, curve, radii, width)
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


def _unit(latitude: Any, longitude: Any) -> Array:
    """Return unit vectors at latitudes and longitudes, (..., 3)."""
    up, around = np.broadcast_arrays(latitude, longitude)
    return np.stack([np.cos(up) * np.cos(around), np.cos(up) * np.sin(around), np.sin(up)], axis=-1)


def _on_unit_sphere(curve: Array, radii: Array | None) -> Array:
    scaled = curve if radii is None else curve / radii
    sizes = np.linalg.norm(scaled, axis=1, keepdims=True)
    return np.asarray(scaled / np.where(sizes > 0, sizes, 1.0))


def _faces_viewer(points: Array, radii: Array) -> NDArray[np.bool_]:
    """Return which points of the ellipsoid have a normal that points towards the viewer."""
    return np.asarray((points / radii**2) @ _unit(*np.radians([_ELEVATION, _AZIMUTH])) >= 0)


def _draw_wireframe(axes: Any, radii: Array, width: float) -> None:
    around, half = np.linspace(0, 2 * np.pi, 121), np.linspace(-np.pi / 2, np.pi / 2, 61)
    rings = [_unit(latitude, around) for latitude in half[5:-1:5]]
    halves = [_unit(half, longitude) for longitude in around[:-1:5]]
    lines = [line * radii for line in (*rings, *halves)]
    _draw_lines(axes, lines, radii, ("0.93", "0.80"), 0.33 * width, 1)


def _draw_curve(axes: Any, curve: Array, radii: Array, width: float) -> None:
    from matplotlib.colors import to_rgb

    dim = tuple(1 - _FAR * (1 - part) for part in to_rgb(COLOURS[0]))
    steps = np.linalg.norm(np.diff(_on_unit_sphere(curve, radii), axis=0), axis=1)
    if steps.size and np.median(steps) <= _WIDE_STEP:
        _draw_lines(axes, [curve], radii, (dim, COLOURS[0]), width, 2)
        return
    near = _faces_viewer(curve, radii)
    for part, colour, order in ((~near, dim, 2), (near, COLOURS[0], 4)):
        axes.scatter(*curve[part].T, s=4 * width, color=colour, zorder=order, depthshade=False)


def _draw_lines(
    axes: Any,
    lines: Sequence[Array],
    radii: Array,
    colours: tuple[Any, Any],
    width: float,
    far: int,
) -> None:
    """Draw lines (N, 3) in two colours: on the far side of the surface, two layers below the near
    one.
    """
    from mpl_toolkits.mplot3d.art3d import Line3DCollection

    steps = np.concatenate([np.stack([line[:-1], line[1:]], axis=1) for line in lines])
    near = _faces_viewer(steps.mean(axis=1), radii)
    for side, colour, order in zip((~near, near), colours, (far, far + 2), strict=True):
        drawn = Line3DCollection(steps[side], colors=[colour], linewidths=width, zorder=order)
        drawn.set_capstyle("round")
        axes.add_collection3d(drawn, autolim=False)
    axes.auto_scale_xyz(*steps.reshape(-1, 3).T)


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
