"""Theorem recon0: all motions of the body over one q(t), and the integrals that tell them apart.

Over the trajectory of q the natural frame N = [q, n_2, …, n_{n−1}, γ] is one motion, and E = N
diag(1, ℜ), equation (orth, printed 7.6), with ℜ constant in O(n−1), are all others. The momentum p
is along γ, so the linear integrals are (p,γ) times the last row of ℜ.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.geometry.natural_frame import orthonormalize
from veselova.mechanics.results.trajectory import Trajectory
from veselova.mechanics.systems.veselova import Veselova

__all__ = ["frames_over", "linear_integrals", "natural_frames", "rotation", "with_rotation"]

Array = NDArray[np.float64]


def rotation(problem: Veselova) -> Array:
    """Return the constant ℜ of (orth, printed 7.6), (n−1, n−1), that takes the natural frame at the
    start to the frame of the problem.
    """
    return orthonormalize(_natural(problem).frame[:, 1:].T @ problem.frame[:, 1:])


def with_rotation(problem: Veselova, matrix: Any) -> Veselova:
    """Return the problem with the same q(t) whose frame is the natural one turned by ℜ ∈ O(n−1)."""
    rotated = _turn(_natural(problem).frame, matrix)
    return Veselova(**_without_frame(problem), frame=problem.to_body_axes(rotated[None])[0])


def natural_frames(trajectory: Trajectory) -> Array:
    """Return the natural frame along a trajectory of ``Veselova``, (N, n, n): (q, n_2, …, γ)(t),
    carried on from the start.
    """
    problem = trajectory.problem
    return _turn(trajectory.series("frame"), rotation(problem).T)


def frames_over(trajectory: Trajectory, matrix: Any) -> Array:
    """Return the frames E(t) = N(t) diag(1, ℜ) of the motion over the same q(t) with a given ℜ ∈
    O(n−1), (N, n, n).

    Their error is that of the trajectory times at most n−1.
    """
    return _turn(natural_frames(trajectory), matrix)


def linear_integrals(trajectory: Trajectory) -> Array:
    """Return l_k = ⟨𝓜,e_1∧e_k⟩ = (p,e_k), k = 2 … n, along a trajectory, (N, n−1); Σ l_k² = (p,p) =
    2h c_2⋯c_{n−1}.

    (p,p) is an integral of the reduced flow, so n−2 of them are new: of the (n−1)(n−2)/2 numbers in
    ℜ those of its last row.
    """
    return np.asarray(trajectory.problem.integrals(trajectory.arrays)["linear"], dtype=np.float64)


def _without_frame(problem: Veselova) -> dict[str, Any]:
    return {name: value for name, value in problem.given.items() if name != "frame"}


def _natural(problem: Veselova) -> Veselova:
    """Return the problem with its natural frame, which is that of the exact data to
    the last bit.
    """
    return Veselova(**_without_frame(problem))


def _turn(frames: Array, matrix: Array) -> Array:
    """Return frames with the columns after the first multiplied by a matrix."""
    return np.concatenate([frames[..., :1], frames[..., 1:] @ matrix], axis=-1)
