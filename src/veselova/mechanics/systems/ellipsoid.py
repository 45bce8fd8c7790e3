"""Geodesics on the ellipsoid Q(0): Σ X_i²/A_i = 1, whose unit normals move as Neumann's point
(Theorem Kno).
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.bodies.principal_inertia import positive_numbers
from veselova.mechanics.core.arguments import entry_count, read_only, takes_arrays
from veselova.mechanics.core.decimals import exact_as
from veselova.mechanics.core.errors import Faults, InvalidInput, show
from veselova.mechanics.core.exact_input import Number, Numbers, to_float
from veselova.mechanics.core.problem import Series
from veselova.mechanics.flows.neumann_flow import GeodesicFlow
from veselova.mechanics.geometry import integrals_of_motion as integrals
from veselova.mechanics.geometry.geographic import Geographic, from_angles, read_semiaxes, to_angles
from veselova.mechanics.geometry.natural_frame import natural_frame, orthonormalize, refine
from veselova.mechanics.geometry.sphere import (
    INPUT_TOLERANCE,
    ExactState,
    nonzero_vector,
    over_largest,
)
from veselova.mechanics.systems.torus_problem import TorusProblem

__all__ = ["EllipsoidGeodesic", "normal_velocity", "position"]

Array = NDArray[np.float64]


#: Derived: how far α_2 of an umbilic geodesic may be from A_2, relative: some thousand roundings.
_UMBILIC = 1e-12


class EllipsoidGeodesic(TorusProblem):
    """A geodesic X(s) on the ellipsoid Σ X_i²/A_i = 1 in ℝⁿ, n ≥ 2, with s its arc length.

    - A: the squares of the semiaxes, n positive numbers
    - X: (n,) the point at s = 0
    - X_dot: (n,) the unit tangent dX/ds there

    X must lie on the ellipsoid, and X_dot be a tangent of unit length, to 1e-9. With
    ``normalize=True`` X is scaled onto the ellipsoid and X_dot projected and scaled first.

    The frame is [q, n_2 … n_{n−1}, γ], with determinant 1 for n > 2. q is the normal of the
    ellipsoid, n_k are the normals of the confocal quadrics that the tangent touches (Chasles; see
    ``quadrics``), and γ = dX/ds is the tangent itself.

    Raises InvalidInput, which names the field, what was required and what was given.
    """

    A: Array
    X: Array
    X_dot: Array
    near_frame: Array
    exact: ExactState
    semiaxes: Array
    energy = 0.5  # that of unit speed

    system: ClassVar[str] = "ellipsoid-geodesic"
    time: ClassVar[str] = "s"
    outputs: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "X": ("axis",),
        "X_dot": ("axis",),
        "frame": ("axis", "vector"),
        "tau1": (),
    }
    derived: ClassVar[tuple[str, ...]] = ("X", "X_dot")
    columns_of_frame: ClassVar[Mapping[str, int]] = {"X_dot": -1}
    bounded: ClassVar[tuple[str, ...]] = ("X", "frame")
    shown: ClassVar[tuple[str, ...]] = ("A", "X", "X_dot")
    portrait: ClassVar[str] = "X"
    formulations: ClassVar[tuple[str, ...]] = ("geodesic",)

    def __init__(self, A: Numbers, X: Numbers, X_dot: Numbers, *, normalize: bool = False) -> None:
        faults = Faults()
        diagonal = faults.attempt(positive_numbers, A)
        n = entry_count(A, X)
        exact_X = faults.attempt(nonzero_vector, X, n, True, "X")
        exact_V = faults.attempt(nonzero_vector, X_dot, n, True, "X_dot")
        faults.require_none()
        A_float = to_float(diagonal)
        if not normalize:
            _require_on_ellipsoid(to_float(exact_X), to_float(exact_V), np.sqrt(A_float))
        # q ∝ A⁻¹X, and dq ∝ A⁻¹V up to a multiple of q, for V tangent to the ellipsoid.
        q = tuple(a / b for a, b in zip(exact_X, diagonal, strict=True))
        tangent = ExactState(diagonal, q, exact_V, None).tangent
        if not any(tangent):
            required = "a vector with a part tangent to the ellipsoid"
            raise InvalidInput(("X_dot",), required, "one along its normal")
        q_dot = tuple(a / b for a, b in zip(tangent, diagonal, strict=True))
        exact = ExactState(diagonal, q, q_dot, None)
        velocity = to_float(over_largest(exact.tangent))
        frame = natural_frame(A_float, exact.position, velocity)
        frame = orthonormalize(refine(frame, diagonal, q, exact.tangent))
        # n = 2, where γ has no partner whose sign makes the determinant positive
        if frame[:, -1] @ velocity < 0:
            frame[:, -1] = -frame[:, -1]
        X_float = position(A_float, exact.position)
        self._set(A=A_float, X=X_float, X_dot=frame[:, -1], near_frame=frame, exact=exact)
        self._set(semiaxes=np.sqrt(A_float))

    @classmethod
    @takes_arrays
    def from_angles(
        cls,
        ellipsoid: str | Numbers,
        latitude: Number,
        longitude: Number,
        azimuth: Number,
        *,
        coordinates: str = "geodetic",
    ) -> EllipsoidGeodesic:
        """Return the geodesic that starts at a place in a direction, n = 3, angles in degrees.

        - ellipsoid: "WGS84", "GRS80", "earth-triaxial" or "moon-triaxial", in metres; or three
          semiaxes a ≥ b ≥ c, the third along the axis of the poles
        - latitude, longitude: of the normal (``geodetic``), or the parameters β, ω of the lines of
          curvature (``ellipsoidal``); −90 to 90, and any number
        - azimuth: clockwise from the direction of growing latitude

        Raises InvalidInput, which names the field, for bad data, and at the umbilics of ellipsoidal
        coordinates, where there is no north. Against GeographicLib's published lines on WGS84:
        within 3e-8 m and 2e-12 degrees over 17 000 km.
        """
        semiaxes = read_semiaxes(ellipsoid)
        X, V = from_angles(to_float(semiaxes), latitude, longitude, azimuth, coordinates)
        return cls([a * a for a in semiaxes], X, V, normalize=True)

    def geographic(self, motion: Any = None, coordinates: str = "geodetic") -> Geographic:
        """Return latitude, longitude and azimuth of the points and tangents of a motion, each (N,)
        in degrees; ``motion``: a trajectory of this problem, or None for the start.

        Raises InvalidInput unless n = 3 and the semiaxes decrease.
        """
        if self.n != 3 or not self.A[0] >= self.A[1] >= self.A[2]:
            given = f"A = {show(self.A.tolist())}"
            raise InvalidInput(("A",), "three numbers that do not increase", given)
        known = self if motion is None else getattr(motion, "problem", None)
        if not isinstance(known, EllipsoidGeodesic):
            raise InvalidInput(("motion",), "a trajectory of this problem, or None", show(motion))
        X, V = (self.X[None], self.X_dot[None]) if motion is None else (motion.X, motion.X_dot)
        return to_angles(self.semiaxes, X, V, coordinates)

    @property
    def title(self) -> str:
        """Return the system and its dimension."""
        return f"{self.system}, n = {self.n}, J {self.joachimsthal:.12g}"

    @property
    def frame(self) -> Array:
        """Return the frame at s = 0, (n, n), to the last bit."""
        return self.near_frame

    @cached_property
    def joachimsthal(self) -> float:
        """Return J = (V,A⁻¹V)(X,A⁻²X), which is constant along a geodesic with unit tangent V."""
        return float(_joachimsthal(self.A, self.frame[:, 0], self.X_dot))

    @cached_property
    def quadrics(self) -> Array:
        """Return α_2 ≥ … ≥ α_{n−1}: the quadrics Σ x_i²/(A_i−α) = 1 that all tangents touch besides
        the ellipsoid itself.
        """
        q = self.frame[:, 0]
        velocity = normal_velocity(self.A, q, self.X_dot)
        return read_only(1 / integrals.constants_of_motion(self.A, q, velocity))

    @property
    def badly_conditioned(self) -> str | None:
        """Return that the geodesic runs through umbilics, n = 3: its tangents touch the quadric
        α_2 = A_2, the focal hyperbola, to 1e-12.
        """
        if self.n != 3:
            return None
        low, middle, high = np.sort(self.A)
        near = _UMBILIC * middle
        if abs(self.quadrics[0] - middle) > near or min(middle - low, high - middle) <= near:
            return None
        return "the geodesic runs through umbilics, and neighbouring geodesics part exponentially"

    @property
    def turning(self) -> float:
        """Return |dq/ds|, the rate at which the normal turns at the start."""
        return float(np.linalg.norm(normal_velocity(self.A, self.frame[:, 0], self.X_dot)))

    @property
    def start(self) -> Series:
        """Return the series at s = 0."""
        return {"frame": self.frame[None], "tau1": np.zeros(1)}

    def flow(self, formulation: str = "geodesic") -> GeodesicFlow:
        """Return the geodesic equation in ℝⁿ, in units of √max A."""
        length = float(np.sqrt(np.max(self.A)))
        A, N = self.A / length**2, self.frame[:, 1:-1]
        X = position(A, self.frame[:, 0])
        return GeodesicFlow(1 / A, length, np.concatenate([X, self.X_dot, N.ravel(), [0.0]]))

    def derive(self, name: str, series: Series) -> Array:
        """Return X = Aq/√(q,Aq), equation (Gauss, printed 7.5), or its tangent γ, the last column
        of the frame.
        """
        if name == "X_dot":
            return super().derive(name, series)
        q = series["frame"][..., 0]
        return position(exact_as(q, self.exact.A), q)

    def complete(self, series: Series) -> Series:
        """Return frame and Neumann time."""
        return {"frame": series["frame"], "tau1": series["tau1"]}

    def bound(self, series: Series, error: Array) -> Array:
        """Return the larger of the error of the frame and what it makes of X = Aq/√(q,Aq)."""
        q = series["frame"][..., 0]
        root = np.sqrt(np.sum(self.A * q * q, axis=-1))
        X = position(self.A, q)
        spread = (
            np.max(self.A) + np.max(np.abs(X), axis=-1) * np.sum(self.A * np.abs(q), axis=-1) / root
        ) / root
        return np.asarray(error * np.maximum(1.0, spread))

    def rounding(self, series: Series) -> Array:
        """Return the larger of the rounding of the frame and what it makes of X, whose formula has
        a rounding for each term besides.
        """
        X = np.max(np.abs(position(self.A, series["frame"][..., 0])), axis=-1)
        own = np.finfo(float).eps * (3 + self.n / 2) * X
        return np.asarray(self.bound(series, super().rounding(series)) + own)

    def integrals(self, series: Series) -> dict[str, Array]:
        """Return ``joachimsthal`` J, ``constants`` c_k = 1/α_k, k = 2…n−1, and ``neumann`` F_1…F_n
        of the normal.
        """
        frame = series["frame"]
        q = frame[..., 0]
        V = frame[..., -1]
        velocity = integrals.neumann_velocity(self.A, q, normal_velocity(self.A, q, V))
        return {
            "joachimsthal": _joachimsthal(self.A, q, V),
            "constants": integrals.moser_eigenvalues(self.A, q, velocity)[..., 1:],
            "neumann": integrals.uhlenbeck_integrals(self.A, q, velocity),
        }


def position(A: Array, q: Array) -> Array:
    """Return X = Aq/√(q,Aq), the point of the ellipsoid with unit normal q, shape (..., n)."""
    return np.asarray(A * q / np.sqrt(np.sum(A * q * q, axis=-1))[..., None])


def normal_velocity(A: Array, q: Array, V: Array) -> Array:
    """Return dq/ds = √(q,Aq) pr A⁻¹V, pr the projection along q: |A⁻¹X| = 1/√(q,Aq) on the
    ellipsoid, shape (..., n).
    """
    step = V / A
    step = step - np.sum(q * step, axis=-1)[..., None] * q
    return np.asarray(np.sqrt(np.sum(A * q * q, axis=-1))[..., None] * step, dtype=np.float64)


def _joachimsthal(A: Array, q: Array, V: Array) -> Array:
    return np.asarray(np.sum(V * V / A, axis=-1) / np.sum(A * q * q, axis=-1), dtype=np.float64)


def _require_on_ellipsoid(X: Array, V: Array, semiaxes: Array) -> None:
    """Raise InvalidInput unless X lies on the ellipsoid and V is a unit tangent, each to the
    tolerance.
    """
    with np.errstate(over="ignore"):
        scaled = X / semiaxes
        value = float(scaled @ scaled)
        length = float(np.linalg.norm(V))
    faults = Faults()
    if not abs(value - 1) <= 2 * INPUT_TOLERANCE:
        faults.add(("X",), "a point with Σ X_i²/A_i = 1 to 1e-9 (or normalize=True)", f"{value!r}")
    if not abs(length - 1) <= INPUT_TOLERANCE:
        required = "a vector of unit length to 1e-9 (or normalize=True)"
        faults.add(("X_dot",), required, f"length {length!r}")
    faults.require_none()
    normal = scaled / semiaxes
    slope = float(normal @ V) / float(np.linalg.norm(normal))
    if not abs(slope) <= INPUT_TOLERANCE:
        required = "a tangent of the ellipsoid to 1e-9 (or normalize=True)"
        raise InvalidInput(("X_dot",), required, f"cosine {slope:.3g} with its normal")
