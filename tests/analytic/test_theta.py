"""Theta functions: against python-flint, and through the identities that define them."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import pytest
from flint import acb, acb_mat, ctx

from draws import random_problem, random_riemann_matrix
from veselova import solve
from veselova.analytic.theta.characteristic import Characteristic
from veselova.analytic.theta.lattice import lattice_points, short_sum
from veselova.analytic.theta.siegel_theta import SiegelTheta
from veselova.mechanics.core.errors import Unsolved


def all_characteristics(genus: int) -> list[Characteristic]:
    halves = list(product((0, 1), repeat=genus))
    return [Characteristic(epsilon, delta) for epsilon in halves for delta in halves]


def is_odd(characteristic: Characteristic) -> bool:
    """Whether θ[ε; δ](−z) = −θ[ε; δ](z)."""
    return int(np.dot(characteristic.epsilon, characteristic.delta)) % 2 == 1


class Theta:
    """The real functions θ[ε;δ](z; iT), as motions take them."""

    def __init__(self, T: Any) -> None:
        self.theta = SiegelTheta(1j * np.asarray(T))

    def values(self, z: Any, characteristics: list[Characteristic]) -> Any:
        halves = np.array([[c.epsilon, c.delta] for c in characteristics]) / 2
        mantissas, exponents, _ = self.theta.values(z.astype(complex), halves, 0)
        found = mantissas * np.exp(exponents)
        assert np.all(np.abs(found.imag) <= 1e-13 * np.exp(exponents))
        return found.real


def flint_values(T: Any, z: Any) -> Any:
    """θ[ε;δ](z; iT) of FLINT for every characteristic, ε's bits before δ's, as doubles."""
    ctx.prec = 106
    try:
        tau = acb_mat([[acb(0, float(x)) for x in row] for row in T])
        values = tau.theta(acb_mat([[acb(float(x))] for x in z]))
        return np.array([complex(values[0, i]) for i in range(values.ncols())])
    finally:
        ctx.prec = 53


def as_flint_orders(characteristic: Characteristic) -> int:
    bits = [*characteristic.epsilon, *characteristic.delta]
    return int("".join(map(str, bits)), 2)


@pytest.mark.parametrize("genus", [1, 2, 3, 4])
def test_every_characteristic_agrees_with_flint(genus: int, rng: np.random.Generator) -> None:
    characteristics = all_characteristics(genus)
    for _ in range(6 if genus < 4 else 2):
        T, z = random_riemann_matrix(rng, genus), rng.uniform(-1, 1, genus)
        expected = flint_values(T, z)
        scale = np.abs(Theta(T).values(np.zeros((1, genus)), [Characteristic.zero(genus)]))[0, 0]
        found = Theta(T).values(z[None, :], characteristics)[0]
        for characteristic, value in zip(characteristics, found, strict=True):
            true = expected[as_flint_orders(characteristic)]
            # FLINT's series carries e^{2πi(m+ε)·(z+δ)}: real where ours is, since pairs ±(m+ε)
            # join.
            assert abs(true.imag) < 1e-14 * scale
            assert abs(value - true.real) < 1e-13 * scale


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
    value = Theta(T).values(z[None], [Characteristic.zero(genus)])[0, 0]
    assert np.isclose(total, value, rtol=1e-11)
    assert least > 0.1 or len(F) < genus


@pytest.mark.parametrize("genus", [1, 2, 3, 5])
def test_theta_has_period_one_up_to_the_sign_of_its_characteristic(
    genus: int, rng: np.random.Generator
) -> None:
    theta, z = Theta(random_riemann_matrix(rng, genus)), rng.uniform(-1, 1, (4, genus))
    for characteristic in all_characteristics(genus)[:: genus**2]:
        values = theta.values(z, [characteristic])[:, 0]
        for s in range(genus):
            shifted = theta.values(z + np.eye(genus)[s], [characteristic])[:, 0]
            assert np.allclose(
                shifted, (-1) ** characteristic.epsilon[s] * values, rtol=1e-11, atol=1e-13
            )


@pytest.mark.parametrize("genus", [1, 2, 3, 4])
def test_parity_of_theta_is_that_of_its_characteristic(
    genus: int, rng: np.random.Generator
) -> None:
    theta, z = Theta(random_riemann_matrix(rng, genus)), rng.uniform(-1, 1, (4, genus))
    for characteristic in all_characteristics(genus):
        sign = -1 if is_odd(characteristic) else 1
        values, mirrored = (theta.values(x, [characteristic])[:, 0] for x in (z, -z))
        assert np.allclose(mirrored, sign * values, rtol=1e-11, atol=1e-13)


def test_theta_is_quasi_periodic_along_the_imaginary_periods(rng: np.random.Generator) -> None:
    """θ[ε;δ] with ε moved by one is the same sum: the shadow, at real z, of quasi-periodicity along
    iT.
    """
    T, z = random_riemann_matrix(rng, 2), rng.uniform(-1, 1, (1, 2))
    for epsilon in ([0.0, 0.0], [0.5, 0.0], [0.5, 0.5]):
        for shift in ([1, 0], [0, -2]):
            m = lattice_points(T, 6.0, np.array(epsilon)) + np.array(shift)
            weights = np.exp(-np.pi * np.sum((m @ T) * m, axis=1))
            direct = np.sum(weights * np.cos(2 * np.pi * (m @ z[0])))
            characteristic = Characteristic(tuple(int(2 * e) for e in epsilon), (0, 0))
            assert np.isclose(direct, Theta(T).values(z, [characteristic])[0, 0], rtol=1e-12)


def test_riemanns_quartic_relation(rng: np.random.Generator) -> None:
    """In genus one: θ3(0)⁴ = θ2(0)⁴ + θ4(0)⁴, and the two relations between squares at z and at
    zero.
    """
    theta = Theta(np.array([[0.8]]))
    z = rng.uniform(-1, 1, (6, 1))
    names = {"θ3": ((0,), (0,)), "θ4": ((0,), (1,)), "θ2": ((1,), (0,)), "θ1": ((1,), (1,))}
    at_z = {k: theta.values(z, [Characteristic(*v)])[:, 0] for k, v in names.items()}
    at_0 = {k: theta.values(np.zeros((1, 1)), [Characteristic(*v)])[0, 0] for k, v in names.items()}
    assert np.isclose(at_0["θ3"] ** 4, at_0["θ2"] ** 4 + at_0["θ4"] ** 4, rtol=1e-13)
    assert np.allclose(
        at_z["θ3"] ** 2 * at_0["θ3"] ** 2,
        at_z["θ4"] ** 2 * at_0["θ4"] ** 2 + at_z["θ2"] ** 2 * at_0["θ2"] ** 2,
    )
    assert np.allclose(
        at_z["θ4"] ** 2 * at_0["θ3"] ** 2,
        at_z["θ3"] ** 2 * at_0["θ4"] ** 2 + at_z["θ1"] ** 2 * at_0["θ2"] ** 2,
    )


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
