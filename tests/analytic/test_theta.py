"""Theta functions of motions: the sums of documents, characteristics, refusals."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from draws import random_problem, random_riemann_matrix
from veselova import solve
from veselova.analytic.theta.characteristic import Characteristic
from veselova.analytic.theta.siegel_terms import short_sum
from veselova.mechanics.core.errors import Unsolved
from veselova.theta import riemann_theta


def is_odd(characteristic: Characteristic) -> bool:
    """Whether θ[ε; δ](−z) = −θ[ε; δ](z)."""
    return int(np.dot(characteristic.epsilon, characteristic.delta)) % 2 == 1


@pytest.mark.parametrize("genus", [2, 3, 4])
@pytest.mark.parametrize("least", [5e-3, 0.3, 2.0])
def test_the_sum_of_a_document_is_the_function(
    genus: int, least: float, rng: np.random.Generator
) -> None:
    """Waves in some coordinates of a basis, Gaussians in the others."""
    T = random_riemann_matrix(rng, genus) + least * np.eye(genus)
    if least < 0.1:
        difference = np.zeros(genus)
        difference[:2] = 1, -1
        projection = np.eye(genus) - np.outer(difference, difference) / 2
        T = projection @ T @ projection + least * np.outer(difference, difference)
    U, F = short_sum(T)
    G = [i for i in range(genus) if i not in F]
    assert abs(round(np.linalg.det(U))) == 1
    form, z = U @ T @ U.T, rng.uniform(-1, 1, genus)
    y = U @ z
    inverse = np.linalg.inv(form[np.ix_(G, G)])
    C = form[np.ix_(F, G)] @ inverse
    S = form[np.ix_(F, F)] - C @ form[np.ix_(G, F)]
    box = list(product(range(-9, 10), repeat=len(F)))
    total = 0.0
    for k in product(range(-9, 10), repeat=len(G)):
        d = np.array(k) + np.rint(y[G]) - y[G]
        x = np.array(box).reshape(len(box), len(F))
        gaussian = np.exp(-np.pi * d @ inverse @ d)
        waves = np.cos(2 * np.pi * (x @ (y[F] + C @ d)))
        total += gaussian * (np.exp(-np.pi * np.sum((x @ S) * x, axis=1)) @ waves)
    total *= np.sqrt(np.linalg.det(inverse))
    assert np.isclose(total, riemann_theta(z, 1j * T), rtol=1e-11)
    assert least > 0.1 or len(F) < genus


def test_characteristics_of_the_branch_points_have_the_parity_of_the_table() -> None:
    for genus in range(1, 8):
        odd = [is_odd(Characteristic.of_branch_point(j, genus)) for j in range(2 * genus + 1)]
        assert odd == [j % 2 == 1 for j in range(2 * genus + 1)]
        total = Characteristic.zero(genus)
        for j in range(1, 2 * genus + 1, 2):
            total = total + Characteristic.of_branch_point(j, genus)
        assert total.epsilon == (1,) * genus  # Riemann's constant: the sum of the odd ones


def test_theta_sums_that_would_fill_the_memory_are_refused(rng: np.random.Generator) -> None:
    with pytest.raises(Unsolved, match=r"too-many-terms.*angles serve"):
        solve(random_problem(rng, 14), [1.0], method="theta")
