"""The attitude of a body in space as rotations: matrices, quaternions and Euler angles."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.errors import InvalidInput, show
from veselova.mechanics.core.exact_input import require_truth_value

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

__all__ = ["euler_angles", "quaternions", "rotations"]

Array = NDArray[np.float64]


def rotations(frame: Array) -> Rotation:
    """Return the rotations from body to space, g = Eᵀ, of frames E (N, 3, 3) with columns e_i.

    Raises InvalidInput unless the frames are those of a body in three dimensions that has not been
    reflected.
    """
    if frame.shape[1:] != (3, 3):
        size = " × ".join(str(length) for length in frame.shape[1:])
        raise InvalidInput(("problem",), "a body with a frame of 3 × 3 numbers", f"{size} numbers")
    if np.linalg.det(frame[0]) < 0:
        raise InvalidInput(("frame",), "a frame of determinant 1", "a reflected one")
    # Loaded here: who asks a server for motions loads no SciPy.
    from scipy.spatial.transform import Rotation

    return Rotation.from_matrix(np.swapaxes(frame, 1, 2))


def quaternions(frame: Array, scalar_first: bool = False) -> Array:
    """Return unit quaternions (N, 4) of the rotations from body to space, each with the sign that
    is nearer to the one before it.
    """
    require_truth_value(scalar_first, "scalar_first")
    found = rotations(frame).as_quat(scalar_first=scalar_first)
    # −p and p are one rotation. The product of signs so far keeps the list continuous.
    steps = np.sum(found[1:] * found[:-1], axis=1)
    signs = np.cumprod(np.concatenate([[1.0], np.where(steps < 0, -1.0, 1.0)]))
    return np.asarray(found * signs[:, None], dtype=np.float64)


def euler_angles(frame: Array, sequence: Any, degrees: bool = False) -> Array:
    """Return Euler angles (N, 3) of the rotations from body to space, as SciPy's ``as_euler``."""
    letters = sequence if isinstance(sequence, str) else ""
    axes = letters.lower()
    valid = (
        len(axes) == 3
        and set(axes) <= set("xyz")
        and letters in (axes, axes.upper())
        and axes[0] != axes[1] != axes[2]
    )
    if not valid:
        required = "three of the letters XYZ (or xyz), no two neighbours equal, such as XZX"
        raise InvalidInput(("sequence",), required, show(sequence))
    require_truth_value(degrees, "degrees")
    return np.asarray(rotations(frame).as_euler(letters, degrees=degrees), dtype=np.float64)
