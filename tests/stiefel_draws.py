"""Random inertia operators, points of Stiefel varieties and reduced flows on them."""

from __future__ import annotations

from typing import Any

import numpy as np

from lr_draws import random_operator
from veselova import StiefelFlow

KINDS = ("special", "matrix")


def random_inertia(
    rng: np.random.Generator, n: int, kind: str, ratio: float = 4.5
) -> dict[str, Any]:
    """Return an inertia operator of so(n): A's, or eigenvalues along random axes, log-uniform up to
    the ratio.
    """
    if kind == "special":
        return {"special": np.exp(rng.uniform(0, np.log(ratio), n)).tolist()}
    return {"matrix": random_operator(rng, n * (n - 1) // 2, ratio).tolist()}


def random_columns(rng: np.random.Generator, n: int, r: int) -> Any:
    """Return a point of V(r,n)."""
    return np.linalg.qr(rng.normal(size=(n, r)))[0]


def random_flow(rng: np.random.Generator, n: int, r: int, kind: str) -> StiefelFlow:
    """Return a reduced flow with ⟨ω,ω⟩ of order one at the start."""
    X, X_dot = random_columns(rng, n, r), rng.normal(size=(n, r)) / np.sqrt(n * r)
    return StiefelFlow(random_inertia(rng, n, kind), X, X_dot=X_dot, normalize=True)
