"""Latitude, longitude and azimuth on ellipsoids, geodetic and ellipsoidal, in degrees."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.arguments import require_name
from veselova.mechanics.core.errors import Faults, InvalidInput, show
from veselova.mechanics.core.exact_input import exact_number, exact_vector, scale_number

__all__ = [
    "COORDINATES",
    "ELLIPSOIDS",
    "Geographic",
    "ellipsoidal_point",
    "ellipsoidal_sines",
    "from_angles",
    "read_ellipsoid",
    "read_semiaxes",
    "to_angles",
]

Array = NDArray[np.float64]


def _spheroid(a: Fraction, inverse_flattening: str) -> tuple[Fraction, Fraction, Fraction]:
    return a, a, a * (1 - 1 / Fraction(inverse_flattening))


_EARTH = Fraction(6378172), Fraction(6378103), Fraction(6356753)
_MOON = Fraction(17382563, 10), Fraction(17380231, 10), Fraction(17376032, 10)

#: Semiaxes a ≥ b ≥ c in metres. WGS84 and GRS80 by a and 1/f; the Earth with three axes of Ligas
#: (2012), the Moon of Kontou and Panou (2022, fitted to GL0660B), Mars of Archinal et al. (2018),
#: Haumea of Ortiz et al. (2017).
ELLIPSOIDS: Mapping[str, tuple[Fraction, Fraction, Fraction]] = {
    "WGS84": _spheroid(Fraction(6378137), "298.257223563"),
    "GRS80": _spheroid(Fraction(6378137), "298.257222101"),
    "Earth": _EARTH,
    "earth-triaxial": _EARTH,
    "Moon": _MOON,
    "moon-triaxial": _MOON,
    "Mars": (Fraction(3396190), Fraction(3396190), Fraction(3376200)),
    "Haumea": (Fraction(1161000), Fraction(852000), Fraction(513000)),
}

#: Kinds of latitude and longitude.
COORDINATES = ("geodetic", "ellipsoidal")

#: Below this share of its usual length a coordinate direction is none: the point is an umbilic.
_NO_DIRECTION = 1e-8


class Geographic(NamedTuple):
    """Places and directions in degrees, each (N,).

    - latitude: −90 … 90
    - longitude: −180 … 180, from the first axis towards the second
    - azimuth: −180 … 180, clockwise from north; NaN at an umbilic of ellipsoidal coordinates
    """

    latitude: Array
    longitude: Array
    azimuth: Array


def read_ellipsoid(ellipsoid: Any) -> tuple[Fraction, ...]:
    """Return the semiaxes of a named ellipsoid, or three given ones in any order, exactly."""
    if isinstance(ellipsoid, str):
        return ELLIPSOIDS[require_name(ellipsoid, ("ellipsoid",), list(ELLIPSOIDS))]
    return exact_vector(ellipsoid, ("ellipsoid",), 3, scale_number)


def read_semiaxes(ellipsoid: Any) -> tuple[Fraction, ...]:
    """Return semiaxes a ≥ b ≥ c of a named ellipsoid, or of three given ones, exactly."""
    axes = read_ellipsoid(ellipsoid)
    if not axes[0] >= axes[1] >= axes[2]:
        required = "a name, or three semiaxes a ≥ b ≥ c > 0"
        raise InvalidInput(("ellipsoid",), required, show(ellipsoid))
    return axes


def from_angles(
    semiaxes: Array, latitude: Any, longitude: Any, azimuth: Any, coordinates: Any
) -> tuple[Array, Array]:
    """Return the point X (3,) and the unit tangent (3,) of angles in degrees; raises InvalidInput,
    with all faults.
    """
    faults = Faults()
    faults.attempt(require_name, coordinates, ("coordinates",), COORDINATES)
    given = {"latitude": latitude, "longitude": longitude, "azimuth": azimuth}
    numbers = [faults.attempt(exact_number, value, (name,)) for name, value in given.items()]
    if numbers[0] is not None and abs(numbers[0]) > 90:
        faults.add(("latitude",), "a number from −90 to 90 (degrees)", show(latitude))
    faults.require_none()
    # The rest of a turn is exact, and sines of small rests keep their digits.
    phi, lam, alpha = (np.radians(float(x - 360 * round(x / 360))) for x in numbers)
    if coordinates == "geodetic":
        east, north, normal = _geodetic_axes(phi, lam)
        weighted = semiaxes**2 * normal
        X = weighted / np.sqrt(normal @ weighted)
    else:
        X, east, north = _ellipsoidal_axes(semiaxes, np.array([phi]), np.array([lam]))
        X, east, north = X[0], east[0], north[0]
        if not np.all(np.isfinite(north)):
            where = f"latitude {show(latitude)}, longitude {show(longitude)}, which is one"
            raise InvalidInput(("latitude",), "a point other than an umbilic", where)
    return X, np.sin(alpha) * east + np.cos(alpha) * north


def to_angles(semiaxes: Array, X: Array, V: Array, coordinates: Any) -> Geographic:
    """Return the angles of points X (N, 3) of the ellipsoid and tangents V (N, 3)."""
    require_name(coordinates, ("coordinates",), COORDINATES)
    if coordinates == "geodetic":
        normal = X / semiaxes**2
        level = np.hypot(normal[:, 0], normal[:, 1])
        phi = np.arctan2(normal[:, 2], level)
        lam = np.arctan2(normal[:, 1], normal[:, 0])
        east, north, _ = _geodetic_axes(phi, lam)
    else:
        sin_b, cos_b, sin_o, cos_o = ellipsoidal_sines(X / semiaxes, *_moduli(semiaxes)).T
        phi, lam = np.arctan2(sin_b, cos_b), np.arctan2(sin_o, cos_o)
        _, east, north = _ellipsoidal_axes(semiaxes, phi, lam)
    alpha = np.arctan2(np.sum(V * east, axis=1), np.sum(V * north, axis=1))
    return Geographic(*(np.degrees(angle) for angle in (phi, lam, alpha)))


def _geodetic_axes(phi: Any, lam: Any) -> tuple[Array, Array, Array]:
    """Return east, north and the outward normal at geodetic latitudes and longitudes, (..., 3)."""
    sin_phi, cos_phi, sin_lam, cos_lam = np.sin(phi), np.cos(phi), np.sin(lam), np.cos(lam)
    east = np.stack([-sin_lam, cos_lam, np.zeros_like(sin_lam)], axis=-1)
    north = np.stack([-sin_phi * cos_lam, -sin_phi * sin_lam, cos_phi], axis=-1)
    normal = np.stack([cos_phi * cos_lam, cos_phi * sin_lam, sin_phi], axis=-1)
    return east, north, normal


def _moduli(semiaxes: Array) -> tuple[float, float]:
    """Return k² = (b²−c²)/(a²−c²) and k'² = 1−k²; 1 and 0 for a sphere."""
    a, b, c = semiaxes
    whole = (a - c) * (a + c)
    if whole == 0:
        return 1.0, 0.0
    return (b - c) * (b + c) / whole, (a - b) * (a + b) / whole


def _ellipsoidal_axes(semiaxes: Array, beta: Array, omega: Array) -> tuple[Array, Array, Array]:
    """Return X, east and north (N, 3) at ellipsoidal latitudes β and longitudes ω (N,).

    X = (a cos ω t_x, b cos β sin ω, c sin β t_z) with t_x² = k² cos²β + k'², t_z² = k² + k'² sin²ω.
    Lines of constant β and ω are the lines of curvature, which meet at right angles. Directions are
    NaN at umbilics.
    """
    a, b, c = semiaxes
    k2, rest = _moduli(semiaxes)
    k, l = np.sqrt(k2), np.sqrt(rest)
    sin_b, cos_b, sin_o, cos_o = np.sin(beta), np.cos(beta), np.sin(omega), np.cos(omega)
    t_x = np.hypot(k * cos_b, l)
    t_z = np.hypot(k, l * sin_o)
    sines = np.stack([sin_b, cos_b, sin_o, cos_o], axis=1)
    X = semiaxes * ellipsoidal_point(sines, k2, rest)
    # k cos β/t_x and k' sin ω/t_z, which are 1 at the poles of a surface of revolution.
    of_x = np.divide(k * cos_b, t_x, out=np.ones_like(t_x), where=t_x > 0)
    of_z = np.divide(l * sin_o, t_z, out=np.ones_like(t_z), where=t_z > 0)
    north = np.stack([-a * k * cos_o * sin_b * of_x, -b * sin_b * sin_o, c * cos_b * t_z], axis=1)
    east = np.stack([-a * sin_o * t_x, b * cos_b * cos_o, c * l * sin_b * cos_o * of_z], axis=1)
    normal = X / semiaxes**2
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    sizes = [np.linalg.norm(vectors, axis=1) / a for vectors in (north, east)]
    from_north = (sizes[0] >= sizes[1])[:, None]
    with np.errstate(invalid="ignore", divide="ignore"):
        north = np.where(from_north, north, np.cross(normal, east))
        north /= np.linalg.norm(north, axis=1)[:, None]
        north[np.maximum(*sizes) < _NO_DIRECTION] = np.nan
    return X, np.cross(north, normal), north


def ellipsoidal_point(sines: Array, k2: float, rest: float) -> Array:
    """Return U (N, 3), X_i = semiaxes_i U_i, of sin β, cos β, sin ω and cos ω (N, 4)."""
    sb, cb, so, co = sines.T
    t_x, t_z = np.sqrt(k2 * cb**2 + rest), np.sqrt(k2 + rest * so**2)
    return np.stack([co * t_x, cb * so, sb * t_z], axis=1)


def ellipsoidal_sines(U: Array, k2: float, rest: float) -> Array:
    """Return sin β, cos β ≥ 0, sin ω and cos ω (N, 4) of points X_i = semiaxes_i U_i, U (N, 3),
    from which nothing cancels but near umbilics; k2, rest: k² and k'².

    k² cos²β and −k'² sin²ω are the roots of t² − gt − (kk'η)² = 0, η = cos β sin ω.
    """
    xi, eta, zeta = (U / np.sqrt(np.sum(U * U, axis=1))[:, None]).T
    g = k2 * xi**2 + (k2 - rest) * eta**2 - rest * zeta**2
    h = np.sqrt(g * g + 4 * k2 * rest * eta * eta)
    # of the two that with the larger root, and the other by their product
    is_beta = g >= 0
    over = np.where(is_beta, k2, rest) + 0 * g
    larger = np.where(is_beta, h + g, h - g) / 2
    larger = np.sqrt(np.divide(larger, over, out=0 * g, where=over > 0))
    other = np.divide(np.abs(eta), larger, out=0 * g, where=larger > 0)
    cos_b = np.minimum(np.where(is_beta, larger, other), 1)
    sin_o = np.minimum(np.where(is_beta, other, larger), 1) * np.where(eta < 0, -1, 1)
    t_x = np.sqrt(k2 * cos_b**2 + rest)
    t_z = np.sqrt(k2 + rest * sin_o**2)
    sin_b = np.divide(zeta, t_z, out=0 * zeta, where=t_z > 0)
    cos_o = np.divide(xi, t_x, out=1 + 0 * xi, where=t_x > 0)
    return np.stack([sin_b, cos_b, sin_o, cos_o], axis=1)
