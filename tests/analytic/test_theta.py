"""Theta functions of motions: the sums of documents, characteristics, refusals."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from draws import random_problem, random_riemann_matrix
from veselova import solve
from veselova.analytic.curve.hyperelliptic import characteristics
from veselova.analytic.theta.siegel_terms import short_sum
from veselova.mechanics.core.errors import Unsolved
from veselova.theta import riemann_theta


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
        halves = characteristics(genus)
        # θ[ε; δ](−z) = (−1)^{4ε·δ} θ[ε; δ](z)
        odd = [round(4 * epsilon @ delta) % 2 == 1 for epsilon, delta in halves]
        assert odd == [j % 2 == 1 for j in range(2 * genus + 1)]
        total = np.sum(halves[1::2], axis=0) % 1  # Riemann's constant: the sum of the odd ones
        assert np.all(total[0] == 0.5)


def test_theta_sums_that_would_fill_the_memory_are_refused(rng: np.random.Generator) -> None:
    with pytest.raises(Unsolved, match=r"too-many-terms.*angles serve"):
        solve(random_problem(rng, 14), [1.0], method="theta")
