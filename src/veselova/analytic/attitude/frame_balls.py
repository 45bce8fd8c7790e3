"""Frames and vectors in balls: the directions that move, and frames made exactly orthonormal."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np

from veselova.analytic.arithmetic.arithmetic import Values
from veselova.analytic.spectrum.moving_part import Moving

__all__ = ["across", "directions", "frame_around", "orthonormal", "to_axes"]


def directions(moving: Moving, arithmetic: Any) -> Values:
    """Return the orthonormal directions that move, shape (n, m)."""
    columns = arithmetic.array(np.zeros((moving.n, moving.size)))
    for column, vector in zip(columns.T, moving.vectors, strict=True):
        length = arithmetic.sqrt(
            arithmetic.number(sum((x * x for x in vector.values()), Fraction()))
        )
        column[list(vector)] = arithmetic.array(list(vector.values())) / length
    return np.asarray(columns)


def to_axes(moving: Moving, columns: Values, vectors: Values) -> Values:
    """Return vectors (N, m, …) along the ``columns``, the directions that move, by components along
    principal axes, (N, n, …).

    Where every direction is that of an axis, and all move, components change their places and signs
    alone.
    """
    if moving.size < moving.n or any(len(vector) > 1 for vector in moving.vectors):
        return np.asarray(np.moveaxis(np.tensordot(columns, vectors, (1, 1)), 0, 1))
    result = np.empty_like(vectors)
    for place, vector in enumerate(moving.vectors):
        ((axis, length),) = vector.items()
        result[:, axis] = vectors[:, place] if length > 0 else -vectors[:, place]
    return result


def across(a: Values, b: Values) -> Values:
    """Return the vector products of vectors (N, 3)."""
    return np.asarray(a[:, [1, 2, 0]] * b[:, [2, 0, 1]] - a[:, [2, 0, 1]] * b[:, [1, 2, 0]])


def frame_around(q: Values, rows: Any, arithmetic: Any) -> Values:
    """Return the frame with first column q, a unit vector, and the other columns of ``rows`` made
    exactly orthonormal.
    """
    normals = arithmetic.array(rows)[:, 1:]
    return orthonormal(np.column_stack([q, normals - np.outer(q, q @ normals)]), arithmetic)


def orthonormal(frame: Values, arithmetic: Any) -> Values:
    """Return the polar factor P of a nearly orthogonal X = PS, by Newton–Schulz steps E(3 − EᵀE)/2.

    For the E found, |E − P| ≤ |EᵀE − 1| + 2|EᵀX − XᵀE|, both zero for P itself (entries summed, S
    within a half of 1).
    """
    one = np.eye(frame.shape[0], dtype=int)
    nearly = arithmetic.midpoints(frame)
    for _ in range(3 + arithmetic.digits.bit_length()):
        nearly = arithmetic.midpoints(nearly @ (3 * one - nearly.T @ nearly) / 2)
    product = nearly.T @ frame
    bound = np.sum(np.abs(nearly.T @ nearly - one)) + 2 * np.sum(np.abs(product - product.T))
    return np.asarray(arithmetic.add_error(nearly, bound))
