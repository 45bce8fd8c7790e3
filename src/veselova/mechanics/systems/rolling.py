"""What balls that roll without slipping share: the start as it is read, and the contact point."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.bodies.ball import BallData
from veselova.mechanics.core.arguments import entry_count, is_matrix
from veselova.mechanics.core.errors import Faults, InvalidInput
from veselova.mechanics.core.exact_input import exact_matrix, exact_vector
from veselova.mechanics.core.flow import Flow
from veselova.mechanics.core.problem import Problem, Series
from veselova.mechanics.core.upper import call_upper
from veselova.mechanics.flows.ball_flow import RollingFlow
from veselova.mechanics.geometry.natural_frame import ExactFrame, read_frame
from veselova.mechanics.geometry.so_n import coefficients
from veselova.mechanics.geometry.sphere import INPUT_TOLERANCE, read_direction
from veselova.mechanics.groups.matrix_group import LARGEST

if TYPE_CHECKING:
    from veselova.mechanics.results.torus import Drift

__all__ = ["Rolling", "RollingOnPlane", "frame_along", "read_start", "require_turning"]

Array = NDArray[np.float64]


class Rolling(Problem):
    """What balls that roll without slipping share, in three dimensions and more.

    - ball: what was given of the ball
    - Omega: the angular velocity at t = 0
    - frame: (n, n) at t = 0
    """

    ball: BallData
    Omega: Array
    frame: Array

    @property
    def moves(self) -> bool:
        """Return whether the ball moves."""
        return bool(np.any(self.Omega))

    @property
    def turning(self) -> float:
        """Return |ω|."""
        return float(np.linalg.norm(self.Omega))


class RollingOnPlane(Rolling):
    """What those on a plane, or a hyperplane, share: the path of the contact point."""

    bounded: ClassVar[tuple[str, ...]] = ("frame", "position")
    tabulated = "position"
    #: Whether the ball may turn freely about the normal.
    twists: ClassVar[bool]

    @property
    def start(self) -> Series:
        """Return the series at t = 0."""
        contact = np.array([[float(x) for x in self.ball.contact]])
        return {"Omega": self.Omega[None], "frame": self.frame[None], "position": contact}

    @property
    def extent(self) -> float:
        """Return the length in which errors of frame and contact point together are measured."""
        return self.ball.size

    @cached_property
    def drift(self) -> Drift:
        """Return the mean velocity of the contact point, its direction, and the resonance if there
        is one. Raises Unsolved on a separatrix.
        """
        found: Drift = call_upper("drift", self)
        return found

    def roll(self, attitude: Flow) -> Flow:
        """Return a field of the attitude in units of this problem with the quadrature of the
        contact point.
        """
        contact = self.start["position"][0]
        return RollingFlow(attitude, float(self.ball.radius), contact, self.ball.size)


def read_start(
    faults: Faults,
    read_ball: Callable[[int], Any],
    gamma: Any,
    Omega: Any,
    frame: Any,
    normalize: bool,
) -> tuple[Any, tuple[Fraction, ...], Array, Any, ExactFrame | None]:
    """Return the ball of γ's dimension, γ as given and of length one, ω as rationals (n, n), and
    the frame. Raises InvalidInput, with the faults that were found before.
    """
    n = max(entry_count(gamma), 3)
    if n > LARGEST:
        raise InvalidInput(("gamma",), f"a list of 3 to {LARGEST} numbers", f"{n} entries")
    ball = faults.attempt(read_ball, n)
    point = faults.attempt(read_direction, gamma, n, normalize)
    omega = faults.attempt(_read_turning, Omega, n)
    of_frame = (point and point[0], n, normalize, "gamma")
    exact_frame = faults.attempt(read_frame, frame, *of_frame)
    faults.require_none()
    return ball, *point, omega, exact_frame


def require_turning(omega: Any, turning: Array, restriction: str) -> None:
    """Raise InvalidInput unless ω as given has the coefficients that are left of it."""
    given = coefficients(omega)
    off = float(np.max(np.abs(given - turning)))
    if off > INPUT_TOLERANCE * float(np.max(np.abs(given))):
        required = f"{restriction}, to 1e-9 of its largest entry (or normalize=True)"
        raise InvalidInput(("Omega",), required, f"entries that are off it by {off:.3g}")


def frame_along(gamma: Array, velocity: Array) -> Array:
    """Return orthonormal columns of determinant one, the first along γ, the second along γ̇ where
    that is not zero.
    """
    frame, triangle = np.linalg.qr(np.column_stack([gamma, velocity, np.eye(gamma.size)]))
    frame[:, :2] *= np.where(np.diag(triangle)[:2] < 0, -1.0, 1.0)
    frame[:, -1] *= np.sign(np.linalg.det(frame))
    return np.asarray(frame)


def _read_turning(given: Any, n: int) -> Any:
    """Return ω as an (n, n) array of rationals: of Ω (3,), by its coefficients, or as a skew
    matrix.
    """
    if is_matrix(given):
        rows = np.array(exact_matrix(given, ("Omega",), n), dtype=object)
        off = np.array(rows + rows.T, dtype=np.float64)
        if np.max(np.abs(off)) > INPUT_TOLERANCE * float(np.max(np.abs(rows))):
            row, column = divmod(int(np.argmax(np.abs(off))), n)
            given_pair = (
                f"{float(rows[row, column])} against {float(rows[column, row])} across the diagonal"
            )
            raise InvalidInput(("Omega", row, column), "a skew matrix", given_pair)
        return (rows - rows.T) / Fraction(2)
    numbers = exact_vector(given, ("Omega",), n * (n - 1) // 2)
    if n == 3:
        numbers = (-numbers[2], numbers[1], -numbers[0])
    omega = np.full((n, n), Fraction(0), dtype=object)
    for value, i, j in zip(numbers, *np.triu_indices(n, 1), strict=True):
        omega[i, j], omega[j, i] = value, -value
    return omega
