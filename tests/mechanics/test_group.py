"""Compact matrix groups and inertia operators: products, brackets, projection, and
what is refused.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

from lr_draws import GROUPS, group_named
from veselova import InvalidInput, LRSystem, MatrixGroup
from veselova.mechanics.bodies.inertia_operator import Inertia, apply_operator


def hat(vector: Any) -> Any:
    """The matrix ω_ij = ε_ijk Ω_k of the paper, after (nh3.46)."""
    return np.einsum("ijk,k->ij", levi_civita(), vector)


def levi_civita() -> Any:
    tensor = np.zeros((3, 3, 3))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        tensor[i, j, k], tensor[j, i, k] = 1, -1
    return tensor


@pytest.mark.parametrize("name", GROUPS)
def test_the_product_of_a_group_is_invariant_and_its_brackets_close(
    name: str, rng: np.random.Generator
) -> None:
    group = group_named(name)
    x, y, z = rng.normal(size=(3, group.dimension))
    g = group.exponential(rng.normal(size=group.dimension))
    each = np.eye(group.dimension)
    c = group.bracket(each[:, None], each[None])
    assert np.allclose(group.coordinates(group.basis), np.eye(group.dimension), atol=1e-14)
    assert np.allclose(np.einsum("a,b,abk->k", x, y, c), group.bracket(x, y), atol=1e-12)
    assert np.allclose(c, -np.swapaxes(c, 1, 2), atol=1e-13)  # ⟨[X,Y],Z⟩ = ⟨X,[Y,Z]⟩
    jacobi = (
        group.bracket(x, group.bracket(y, z))
        + group.bracket(y, group.bracket(z, x))
        + group.bracket(z, group.bracket(x, y))
    )
    assert np.max(np.abs(jacobi)) < 1e-12
    assert np.allclose(group.element(group.adjoint(g, x)), g @ group.element(x) @ g.T, atol=1e-12)
    assert np.isclose(np.linalg.norm(group.adjoint(g, x)), np.linalg.norm(x))
    assert np.allclose(group.adjoint_matrix(g).T @ x, group.adjoint(g.T, x), atol=1e-12)
    assert f"dimension {group.dimension}" in repr(group)


@pytest.mark.parametrize("n", [2, 3, 5])
def test_the_basis_of_so_n_is_orthonormal_for_minus_half_the_trace_and_lexicographic(
    n: int,
) -> None:
    group = MatrixGroup.so(n)
    pairs = [(i, j) for i in range(n) for j in range(i + 1, n)]
    for (i, j), X in zip(pairs, group.basis, strict=True):
        assert np.array_equal(
            X, np.outer(np.eye(n)[i], np.eye(n)[j]) - np.outer(np.eye(n)[j], np.eye(n)[i])
        )
    products = -np.trace(group.basis[:, None] @ group.basis[None], axis1=-2, axis2=-1) / 2
    assert np.array_equal(products, np.eye(len(pairs)))


@pytest.mark.parametrize(
    ("name", "matrix"),
    [
        ("so-3", 2 * np.eye(3)),
        ("su-3", np.exp(0.1j) * np.eye(3)),
        ("su-2", np.diag([1j, 1j])),
        ("so3xsu2", np.eye(7)[:, [6, 1, 2, 3, 4, 5, 0]]),
        ("irreducible", np.eye(5)[:, [1, 2, 3, 4, 0]]),
        ("g2", expm(0.1 * MatrixGroup.so(7).basis[0])),
    ],
)
def test_a_matrix_off_the_group_is_refused_with_how_far(name: str, matrix: Any) -> None:
    group = group_named(name)
    with pytest.raises(
        InvalidInput, match="a matrix of the group to 1e-9; given one that is off it by"
    ) as raised:
        LRSystem.on(group, np.eye(group.dimension), [], matrix, group.basis[0])
    assert raised.value.field == "g"


@pytest.mark.parametrize("n", [3, 4, 5])
def test_the_special_operator_is_a_omega_a_over_det_a(n: int, rng: np.random.Generator) -> None:
    A, omega = np.exp(rng.normal(size=n)), rng.normal(size=n * (n - 1) // 2)
    inertia, group = Inertia.of({"special": A}, n), MatrixGroup.so(n)
    X = group.element(omega)
    assert np.allclose(group.element(inertia(omega)), np.diag(A) @ X @ np.diag(A) / np.prod(A))
    assert np.allclose(apply_operator(inertia.inverse, inertia(omega)), omega)
    matrix = Inertia.of({"matrix": inertia.matrix}, n)
    assert np.allclose(matrix.operator, inertia.operator)
    assert matrix.operator.ndim == 1


def test_in_three_dimensions_the_special_operator_is_any_inertia_tensor(
    rng: np.random.Generator,
) -> None:
    A, x, y = np.exp(rng.normal(size=3)), *rng.normal(size=(2, 3))
    group = MatrixGroup.so(3)
    inertia = Inertia.special(A, 3)

    def vector(coordinates: Any) -> Any:
        return np.einsum("ijk,ij->k", levi_civita(), group.element(coordinates)) / 2

    moved = vector(inertia(group.coordinates(hat(np.cross(x, y)))))
    assert np.allclose(moved, np.cross(A * x, A * y) / np.prod(A))  # 𝓘(x×y) = Ax×Ay/det A
