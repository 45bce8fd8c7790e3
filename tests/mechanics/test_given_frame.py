"""Frames as given: admitted to 1e-9, and made orthonormal with ``normalize=True``."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from veselova import EulerPoisson, InvalidInput, Veselova, VeselovaSO3

MATRIX = [[2, 0.3, 0.1], [0.3, 1.5, 0.2], [0.1, 0.2, 1]]


def _made(kind: str, frame: Any, normalize: bool = True, q: Any = (1, 2, 2)) -> Any:
    systems = {"veselova": Veselova, "veselova-so3": VeselovaSO3, "euler-poisson": EulerPoisson}
    name, _, matrix = kind.partition("+")
    return systems[name](
        MATRIX if matrix else [3, 2, 1], q, [0, 1, -1], frame=frame, normalize=normalize
    )


KINDS = [
    name + suffix
    for name in ("veselova", "veselova-so3", "euler-poisson")
    for suffix in ("", "+matrix")
]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("size", [1e-6, 0.3, 3.0])
def test_normalize_mends_a_frame(kind: str, size: float, rng: np.random.Generator) -> None:
    """Orthonormal to rounding, e_1 = q, the determinant's sign kept, and columns near the given
    ones where little was wrong.
    """
    for _ in range(10):
        q = rng.standard_normal(3)
        given = np.linalg.qr(np.column_stack([q, rng.standard_normal((3, 2))]))[0]
        given += size * rng.uniform(-1, 1, (3, 3))
        frame = _made(kind, given.tolist(), q=q.tolist()).start["frame"][0]
        assert np.allclose(frame.T @ frame, np.eye(3), atol=1e-15)
        assert np.allclose(frame[:, 0], q / np.linalg.norm(q), atol=1e-15)
        assert np.sign(np.linalg.det(frame)) == np.sign(np.linalg.det(given))
        if size < 1e-3 and given[:, 0] @ q > 0:
            assert np.allclose(frame, given, atol=10 * size)


@pytest.mark.parametrize("kind", KINDS)
def test_without_normalize_the_error_says_what_mends_a_frame(kind: str) -> None:
    q = [0.6, 0, 0.8]
    for frame in (np.eye(3).tolist(), [[0.6, 0, 0.8], [0, 2, 0], [0.8, 0, -0.6]]):
        system = {"veselova": Veselova, "veselova-so3": VeselovaSO3, "euler-poisson": EulerPoisson}[
            kind.partition("+")[0]
        ]
        with pytest.raises(InvalidInput, match=r"frame.*normalize=True"):
            system(MATRIX if "+" in kind else [3, 2, 1], q, [0, 1, 0], frame=frame)


@pytest.mark.parametrize(
    "frame",
    [
        np.zeros((3, 3)),
        np.ones((3, 3)),
        [[1, 1, 0], [2, 2, 1], [2, 2, 0]],
        [[0, 0, 0], [1, 0, 0], [1, 1, 1]],
    ],
)
def test_columns_that_span_no_space_are_refused(frame: Any) -> None:
    for kind in KINDS:
        with pytest.raises(InvalidInput, match="frame"):
            _made(kind, np.array(frame, dtype=float).tolist())
