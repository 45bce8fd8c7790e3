"""Random problems and random matrices for the tests and sweeps."""

from __future__ import annotations

from typing import Any

import numpy as np

from veselova import Veselova


def random_problem(rng: np.random.Generator, n: int, ratio: float = 100.0, *, framed: bool = True) -> Veselova:
    """Return a problem with A log-uniform up to the ratio, a uniform start of unit speed and a random frame."""
    A = np.exp(rng.uniform(0, np.log(ratio), n))
    q, q_dot = rng.normal(size=n), rng.normal(size=n)
    q /= np.linalg.norm(q)
    q_dot -= (q_dot @ q) * q
    q_dot /= np.linalg.norm(q_dot)
    frame = None
    if framed:
        frame = np.linalg.qr(np.column_stack([q, rng.normal(size=(n, n - 1))]))[0]
        frame[:, 0] = q
    return Veselova(A, q, q_dot, frame, normalize=True)


def random_riemann_matrix(rng: np.random.Generator, genus: int, smallest: float = 0.3) -> Any:
    """Return a symmetric positive definite T with eigenvalues between ``smallest`` and 3."""
    basis = np.linalg.qr(rng.normal(size=(genus, genus)))[0]
    T = basis @ np.diag(np.exp(rng.uniform(np.log(smallest), np.log(3.0), genus))) @ basis.T
    return (T + T.T) / 2  # FLINT answers NaN for a matrix that is symmetric only up to rounding
