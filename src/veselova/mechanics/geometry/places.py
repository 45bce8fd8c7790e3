"""Points of an ellipsoid as its users have them: angles in degrees of three kinds, or x, y, z.

What all of them are read as is the unit vector U = (x/a, y/b, z/c).
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from veselova.mechanics.core.arguments import FEWEST_DIGITS, require_truth_value
from veselova.mechanics.core.errors import Faults, InvalidInput, show
from veselova.mechanics.core.exact_input import double_array, exact_number
from veselova.mechanics.geometry.sphere import INPUT_TOLERANCE

__all__ = [
    "PLACES",
    "angle_of_balls",
    "exact_array",
    "from_places",
    "read_places",
    "sines_of_degrees",
    "to_places",
]

Array = NDArray[Any]

#: Kinds of coordinates: (latitude, longitude) in degrees, and (x, y, z).
PLACES = ("geodetic", "parametric", "ellipsoidal", "cartesian")

#: Derived: parts of the semiaxes below which squares of a point leave the doubles.
_AT_CENTRE = 1e-100


def read_places(
    values: ArrayLike,
    name: str,
    coordinates: Any,
    semiaxes: Array,
    *,
    normalize: bool = False,
    exact: bool = False,
) -> Array:
    """Return points (…, 2) in degrees, or (…, 3) on the ellipsoid, where NaN stands for none.

    normalize: whether points off it are moved to it along its normal. exact: whether they are read
    as rationals, none of them NaN. Raises InvalidInput.
    """
    width = 3 if coordinates == "cartesian" else 2
    required = f"finite numbers of shape (…, {width}), text only where digits > {FEWEST_DIGITS}"
    require_truth_value(normalize, "normalize")
    points = exact_array(values, name) if exact else double_array(values, (name,), required)
    doubles = points.astype(np.float64)
    bad = not points.ndim or points.shape[-1] != width or np.any(np.isinf(doubles))
    if bad or (points.ndim == 1 and np.any(np.isnan(doubles))):
        raise InvalidInput((name,), required, show(values))
    if width == 2:
        _require(np.abs(points[..., 0]) <= 90, points, name, "a latitude from −90 to 90 (degrees)")
        return points
    if normalize:
        far = np.max(np.abs(doubles) / semiaxes, axis=-1) > _AT_CENTRE
        _require(far, points, name, "a point away from the centre")
        return nearest(points, semiaxes)
    off = np.abs(np.sum((doubles / semiaxes) ** 2, axis=-1) - 1) / 2
    _require(off <= INPUT_TOLERANCE, points, name, "a point on the ellipsoid, or normalize=True")
    return points


def exact_array(values: Any, name: str) -> Array:
    """Return the rationals that numbers of any shape state; raises InvalidInput."""
    given, faults = np.asarray(values, dtype=object), Faults()
    found = np.empty(given.shape, dtype=object)
    for index in np.ndindex(given.shape):
        found[index] = faults.attempt(exact_number, given[index], (name, *index))
    faults.require_none()
    return found


def _require(good: NDArray[np.bool_], points: Array, name: str, required: str) -> None:
    """Raise InvalidInput, with all faults, where points are not NaN and not good."""
    faults = Faults()
    for index in np.argwhere(~good & ~np.any(points != points, axis=-1)):
        faults.add((name, *index.tolist()), required, show(points[tuple(index)].tolist()))
    faults.require_none()


def nearest(points: Array, semiaxes: Array) -> Array:
    """Return the points (…, 3) moved to the ellipsoid along its normal, the nearest ones outside:
    x_i a_i²/(a_i²+t), where Newton's method finds t from below, since the sum is convex.
    """
    unit = float(np.max(semiaxes))
    squares, given = (semiaxes / unit) ** 2, points / unit
    sizes = np.abs(given) * np.sqrt(squares)
    t = np.max(sizes - squares, axis=-1)
    for _ in range(100):
        parts = sizes / (squares + t[..., None])
        value = np.sum(parts**2, axis=-1) - 1
        slope = -2 * np.sum(parts**2 / (squares + t[..., None]), axis=-1)
        step = value / slope
        t = t - step
        if not np.any(np.abs(step) > 1e-15):
            break
    return np.asarray(unit * given * squares / (squares + t[..., None]))


def sines_of_degrees(angles: Array) -> Array:
    """Return sine and cosine of each of two angles (N, 2) in degrees, (N, 4): exact at multiples of
    90°, whose rest of a turn is exact; of rationals they are balls.
    """
    if angles.dtype == object:
        return np.stack(np.frompyfunc(_sines_in_balls, 1, 2)(angles), axis=-1).reshape(-1, 4)
    rest = np.fmod(angles, 360.0)
    quarters = np.rint(rest / 90)
    radians = np.radians(rest - 90 * quarters)
    s, c = np.sin(radians), np.cos(radians)
    turns = np.nan_to_num(quarters).astype(int) % 4
    sine = np.choose(turns, [s, c, -s, -c]) + 0.0
    cosine = np.choose(turns, [c, -s, -c, s]) + 0.0
    return np.stack([sine, cosine], axis=-1).reshape(-1, 4)


def _sines_in_balls(degrees: Fraction) -> tuple[Any, Any]:
    from flint import arb, fmpq

    turn = fmpq(*(degrees / 180).as_integer_ratio())
    return arb.sin_pi_fmpq(turn), arb.cos_pi_fmpq(turn)


def from_places(points: Array, coordinates: str, semiaxes: Array, at_pole: Any = 1e-18) -> Array:
    """Return U (N, 3) of points (N, 2) or (N, 3), but for ellipsoidal ones.

    at_pole: a cosine of 90°, below rounding, that keeps the longitude of a pole.
    """
    if coordinates == "cartesian":
        return np.asarray(points / semiaxes)
    sp, cp, sl, cl = sines_of_degrees(points).T
    cp = np.where(cp == 0, at_pole, cp)
    U = np.stack([cp * cl, cp * sl, sp], axis=1)
    if coordinates == "geodetic":
        U = U * semiaxes / np.max(semiaxes)
        U = U / np.sqrt(np.sum(U * U, axis=1))[:, None]
    return np.asarray(U)


def to_places(U: Array, sines: Array, coordinates: str, semiaxes: Array) -> Array:
    """Return points (N, 2) or (N, 3) of U (N, 3), with sines and cosines of β and ω (N, 4)."""
    if coordinates == "cartesian":
        return np.asarray(U * semiaxes)
    if coordinates == "ellipsoidal":
        sb, cb, so, co = sines.T
        return np.stack([_degrees(sb, cb), _degrees(so, co)], axis=1)
    if coordinates == "geodetic":
        U = U / semiaxes * np.min(semiaxes)
    level = np.sqrt(U[:, 0] ** 2 + U[:, 1] ** 2)
    return np.stack([_degrees(U[:, 2], level), _degrees(U[:, 1], U[:, 0])], axis=1)


def _degrees(y: Array, x: Array) -> Array:
    """Return the angle of (x, y) in degrees, of balls too."""
    if y.dtype == object:
        angles = np.asarray(np.frompyfunc(angle_of_balls, 2, 1)(y, x))
        return np.asarray(180 * angles / angle_of_balls(0, -1))
    return np.degrees(np.arctan2(y, x))


def angle_of_balls(y: Any, x: Any) -> Any:
    """Return the angle of midpoints (x, y); π where y may be zero and x is below zero."""
    from flint import arb

    y = arb(y)
    return arb.atan2(arb(0) if y.contains(0) else y.mid(), arb(x).mid())
