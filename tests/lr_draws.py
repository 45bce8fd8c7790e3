"""Random LR systems for the tests and sweeps, and the compact groups that they live on."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np

from veselova import LRSystem, MatrixGroup
from veselova.mechanics.bodies.inertia_operator import Inertia

#: (n, rank) of all D_r with n ≤ 6.
RANKS = [(n, r) for n in range(2, 7) for r in range(1, n)]


def random_operator(rng: np.random.Generator, size: int, ratio: float = 5.0) -> Any:
    """Return a symmetric positive definite matrix with eigenvalues log-uniform up to the ratio."""
    axes = np.linalg.qr(rng.normal(size=(size, size)))[0]
    matrix = axes @ np.diag(np.exp(rng.uniform(0, np.log(ratio), size))) @ axes.T
    return (matrix + matrix.T) / 2


def random_inertia(rng: np.random.Generator, size: int) -> Inertia:
    """Return such an operator as the library has it."""
    return Inertia.of_matrix(random_operator(rng, size), size)


def random_potential(
    rng: np.random.Generator, n: int, rows: int, size: float = 0.1
) -> list[dict[str, Any]]:
    """Return three quadratic monomials in the first rows of g, that is in e_1, e_2, …"""
    entries = rng.integers(1, n + 1, (3, 2, 2)), rng.integers(1, rows + 1, (3, 2))
    return [
        {
            "coefficient": float(c),
            "powers": [[int(i), int(j), 1] for i, (_, j) in zip(first, pairs, strict=True)],
        }
        for c, first, pairs in zip(rng.uniform(-size, size, 3), entries[1], entries[0], strict=True)
    ]


def random_lr(
    rng: np.random.Generator,
    n: int,
    rank: int,
    *,
    homogeneous: bool = True,
    special: bool = False,
    potential: Any = None,
) -> LRSystem:
    """Return a system on SO(n) that turns with unit speed from a random attitude, reflected ones
    included.
    """
    inertia = (
        {"special": np.exp(rng.uniform(0, 1.5, n))}
        if special
        else {"matrix": random_operator(rng, n * (n - 1) // 2)}
    )
    g = np.linalg.qr(rng.normal(size=(n, n)))[0]
    spatial = rng.normal(size=(n, n))
    spatial = spatial - spatial.T
    if homogeneous:
        spatial[rank:, rank:] = 0
    omega = g.T @ spatial @ g
    omega = (omega - omega.T) / np.linalg.norm(omega) / np.sqrt(2)
    return LRSystem(n, rank, inertia, g, omega, potential, homogeneous=homogeneous)


def random_lr_on(
    rng: np.random.Generator, group: MatrixGroup, constraints: int, potential: Any = None
) -> LRSystem:
    """Return a system on a group with a random 𝔥, no subalgebra, and random constants of its
    constraints.
    """
    D = group.dimension
    h = group.element(rng.normal(size=(constraints, D)))
    omega = rng.normal(size=D)
    g = group.project(group.exponential(rng.normal(size=D)))
    return LRSystem.on(
        group,
        random_operator(rng, D),
        list(h),
        g,
        group.element(omega / np.linalg.norm(omega)),
        potential,
    )


def _irreducible_so3() -> Sequence[Any]:
    """Return so(3) on the traceless symmetric 3 × 3 matrices, five-dimensional."""
    e = np.eye(3)
    symmetric = [
        (np.outer(e[a], e[b]) + np.outer(e[b], e[a])) / np.sqrt(2)
        for a, b in ((0, 1), (0, 2), (1, 2))
    ]
    symmetric += [np.diag([1, -1, 0]) / np.sqrt(2), np.diag([1, 1, -2]) / np.sqrt(6)]
    return [
        [[float(np.sum(S * (X @ T - T @ X))) for T in symmetric] for S in symmetric]
        for X in MatrixGroup.so(3).basis
    ]


def _g2() -> Sequence[Any]:
    """Return the derivations of the octonions, the algebra g₂ ⊂ so(7)."""
    product = np.zeros((7, 7, 7))
    for a, b, c in ((1, 2, 3), (1, 4, 5), (1, 7, 6), (2, 4, 6), (2, 5, 7), (3, 4, 7), (3, 6, 5)):
        for i, j, k in ((a, b, c), (b, c, a), (c, a, b)):
            product[i - 1, j - 1, k - 1], product[j - 1, i - 1, k - 1] = 1, -1
    so7 = MatrixGroup.so(7).basis
    changes = [
        sum(np.moveaxis(np.tensordot(X, product, (1, axis)), 0, axis) for axis in range(3)).ravel()  # type: ignore[union-attr]
        for X in so7
    ]
    _, values, vectors = np.linalg.svd(np.array(changes).T)
    return list(np.tensordot(vectors[int(np.sum(values > 1e-9)) :], so7, 1))


@cache
def group_named(name: str) -> MatrixGroup:
    """Return one of the groups of the tests."""
    match name.split("-"):
        case ["so", n]:
            return MatrixGroup.so(int(n))
        case ["su", n]:
            return MatrixGroup.su(int(n))
        case ["so3xsu2"]:
            return MatrixGroup.product(MatrixGroup.so(3), MatrixGroup.su(2))
        case ["u2"]:
            return MatrixGroup(
                [[[1j, 0], [0, 0]], [[0, 0], [0, 1j]], [[0, 1], [-1, 0]], [[0, 1j], [1j, 0]]]
            )
        case ["irreducible"]:
            return MatrixGroup(_irreducible_so3())
        case _:
            return MatrixGroup(_g2())


GROUPS = ["so-2", "so-3", "so-4", "so-5", "su-2", "su-3", "so3xsu2", "u2", "irreducible", "g2"]
