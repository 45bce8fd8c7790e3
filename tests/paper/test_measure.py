"""Invariant measures: the densities of section 3 and of the special inertia, by the divergence of
the actual fields.
"""

from __future__ import annotations

from functools import partial
from itertools import combinations
from typing import Any

import numpy as np
import pytest

from lr_draws import GROUPS, RANKS, group_named, random_inertia, random_lr, random_lr_on
from paper import invariant_measure as measure
from veselova import LRSystem, MatrixGroup
from veselova.mechanics.bodies.inertia_operator import Inertia
from veselova.mechanics.core.flow import FLOATS
from veselova.mechanics.groups.distribution import Distribution

#: Complex steps leave rounding: some 1e-16 for each of up to 150 coordinates.
ZERO = 2e-14


@pytest.mark.parametrize("name", GROUPS[1:])
def test_the_constraint_form_keeps_its_measure_wherever_the_f_are(
    name: str, rng: np.random.Generator
) -> None:
    """Theorem IM1 for (EPS1), at any ℱ_1 … ℱ_m, orthonormal or not, and any ω; the plain volume is
    not kept.
    """
    group = group_named(name)
    D, inertia = group.dimension, random_inertia(rng, group.dimension)
    for m in {1, 2, D - 1}:
        point = rng.normal(size=(1 + m) * D)

        def field(state: Any) -> Any:
            return measure.constraint_field(group, inertia, state)

        def density(state: Any) -> Any:
            return measure.density(inertia, state.reshape(-1, D)[1:])

        assert abs(measure.divergence(density, field, point)) < ZERO
        assert abs(measure.divergence(lambda _: 1.0, field, point)) > 1e-6


@pytest.mark.parametrize("name", GROUPS[1:])
def test_the_momentum_form_keeps_its_measure_in_both_its_variables(
    name: str, rng: np.random.Generator
) -> None:
    """Theorem IM2 for (mom_eq1) at orthonormal 𝒲_k: μ̃⁻¹ d𝓜∧d𝒲, and μ̃ dω∧d𝒲 since
    |∂𝓜/∂ω| = μ̃².
    """
    group = group_named(name)
    D, inertia = group.dimension, random_inertia(rng, group.dimension)
    for m in {1, D // 2, D - 1}:
        distribution = Distribution.orthogonal_to(
            group, list(group.element(rng.normal(size=(m, D))))
        )
        g = group.exponential(rng.normal(size=D))
        W, _ = distribution.in_body(g)
        point = np.concatenate([rng.normal(size=D), W.ravel()])

        def field(state: Any) -> Any:
            return measure.momentum_field(group, inertia, state)

        def density(state: Any) -> Any:
            return 1 / measure.momentum_density(inertia, state.reshape(-1, D)[1:])

        assert abs(measure.divergence(density, field, point)) < ZERO
        assert abs(measure.divergence(lambda _: 1.0, field, point)) > 1e-9
        jacobian = np.eye(D) + W.T @ (inertia(W) - W)  # ∂𝓜/∂ω of (mom_eq1)
        assert np.isclose(
            np.linalg.det(jacobian), measure.momentum_density(inertia, W) ** 2, rtol=1e-12
        )


@pytest.mark.parametrize("name", GROUPS)
def test_the_densities_are_dual_to_machine_precision(name: str, rng: np.random.Generator) -> None:
    """(duality): μ² = det 𝓘⁻¹ μ̃²."""
    group = group_named(name)
    D = group.dimension
    g = group.project(group.exponential(rng.normal(size=(D))))
    for m in {0, 1, D // 2, D}:
        distribution = Distribution.orthogonal_to(
            group, list(group.element(rng.normal(size=(m, D))))
        )
        assert abs(measure.duality_defect(distribution, random_inertia(rng, D), g)) < 1e-13
    assert measure.duality_defect(distribution, random_inertia(rng, D), np.stack([g, g])).shape == (
        2,
    )


@pytest.mark.parametrize("name", ["so-3", "so-4", "su-2", "su-3", "irreducible"])
@pytest.mark.parametrize("formulation", LRSystem.formulations)
def test_the_fields_that_are_integrated_keep_these_measures(
    name: str, formulation: str, rng: np.random.Generator
) -> None:
    """μ(g) dω∧dg on 𝔤 × G (after (duality)); and for constant momentum in space μ̃(g)⁻¹ dg on G,
    which (measure2) becomes.
    """
    group = group_named(name)
    system = random_lr_on(rng, group, group.dimension // 2)
    flow, area = system.flow(formulation), group.size**2

    def density(state: Any) -> Any:
        W, F = system.distribution.in_body(state[-area:].reshape(group.size, group.size))
        inertia = flow.inertia
        return (
            1 / measure.momentum_density(inertia, W)
            if formulation == "momentum"
            else measure.density(inertia, F)
        )

    # constant momentum in space is no coordinate
    count = area if formulation == "momentum" else flow.initial.size

    def field(state: Any) -> Any:
        whole = np.concatenate([state, flow.initial[count:]])
        return flow.field(whole, flow.parameters, FLOATS)[:count]

    assert abs(measure.divergence(density, field, flow.initial[:count])) < ZERO
    assert abs(measure.divergence(lambda _: 1.0, field, flow.initial[:count])) > 1e-6


@pytest.mark.parametrize(("n", "rank"), RANKS)
def test_the_determinant_of_the_special_inertia_is_a_power_of_a_plucker_form(
    n: int, rank: int, rng: np.random.Generator
) -> None:
    """Theorem IM_A with ϱ = r(r+3)/2 − rn; (exp) and its dual with ϱ_1 = dim 𝔥; and the row e_1 …
    e_r by Cauchy–Binet.
    """
    A = np.exp(rng.normal(size=n))
    inertia, g = Inertia.special(A, n), np.linalg.qr(rng.normal(size=(n, n)))[0]
    W, F = Distribution.of_rank(n, rank).in_body(g)
    X, rest = g[:rank].T, g[rank:].T
    direct = measure.restricted_determinant(inertia, W)
    assert np.isclose(direct, measure.special_determinant(A, X), rtol=1e-11)
    assert np.isclose(measure.plucker_form(A, X), np.linalg.det(X.T @ (A[:, None] * X)), rtol=1e-12)
    assert np.isclose(np.sum(measure.plucker_coordinates(X) ** 2), 1)
    dual = measure.restricted_determinant(measure.solve(inertia), F)
    constraints = (n - rank) * (n - rank - 1) // 2
    expected = np.prod(A) ** constraints * measure.plucker_form(1 / A, rest) ** (n - rank - 1)
    assert np.isclose(dual, expected, rtol=1e-11)
    if constraints:
        pairs = list(combinations(range(rank, n), 2))
        gram = g @ np.diag(1 / A) @ g.T
        entries = [
            [gram[p, s] * gram[q, l] - gram[p, l] * gram[q, s] for s, l in pairs] for p, q in pairs
        ]
        assert np.isclose(np.linalg.det(np.prod(A) * np.array(entries)), dual, rtol=1e-11)  # (exp)


@pytest.mark.parametrize(("n", "rank"), RANKS[1:])
def test_the_frame_form_keeps_the_measure_of_the_corollary(
    n: int, rank: int, rng: np.random.Generator
) -> None:
    """(true) for (4.1c)–(4.2a) with inertia (4.5), and (IM3) for any inertia; r = n−1 keeps the
    plain volume.
    """
    A, group = np.exp(rng.normal(size=n)), MatrixGroup.so(n)
    D, g = group.dimension, np.linalg.qr(rng.normal(size=(n, n)))[0]
    point = np.concatenate([rng.normal(size=D), g[:rank].ravel()])

    def columns(state: Any) -> Any:
        return state[D:].reshape(rank, n).T

    special, general = Inertia.special(A, n), random_inertia(rng, D)
    pairs = [(i, p) for i in range(rank) for p in range(i + 1, n)]
    # (IM3) does not depend on how e_{r+1} … e_n complete the frame: they may stand still
    completion = g[rank:].T

    def wedges(state: Any) -> Any:
        frame = np.column_stack([columns(state), completion])
        products = [np.outer(frame[:, i], frame[:, p]) for i, p in pairs]
        return group.coordinates(np.array([product - product.T for product in products]))

    def corollary(state: Any) -> Any:
        return measure.special_density(A, columns(state))

    def restricted(state: Any) -> Any:
        """Return (IM3) for the projector Γ of the e_i: |∂𝓜/∂ω|, with columns of Γ where vectors of
        the frame would stand.
        """
        X = columns(state)
        Gamma = X @ X.T
        moved = group.element(general.matrix - np.eye(D))
        along = Gamma @ moved + moved @ Gamma - Gamma @ moved @ Gamma
        return np.linalg.det(np.eye(D) + group.coordinates(along).T) ** -0.5

    for density, system in ((corollary, special), (restricted, general)):
        field = partial(measure.frame_field, group, system)
        assert abs(measure.divergence(density, field, point)) < ZERO
    momentum = measure.momentum_density(general, wedges(point))
    assert np.isclose(restricted(point), 1 / momentum, rtol=1e-11)
    field = partial(measure.frame_field, group, special)
    plain = abs(measure.divergence(lambda _: 1.0, field, point))
    assert plain < ZERO if rank == n - 1 else plain > 1e-6


def test_for_rank_one_the_density_is_the_known_power_of_one_quadratic_form(
    rng: np.random.Generator,
) -> None:
    for n in (3, 4, 6):
        A = np.exp(rng.normal(size=n))
        inertia, distribution = Inertia.special(A, n), Distribution.of_rank(n, 1)
        ratios = []
        for _ in range(3):
            g = np.linalg.qr(rng.normal(size=(n, n)))[0]
            ratios.append(
                measure.momentum_density(inertia, distribution.in_body(g)[0])
                / (g[0] @ (A * g[0])) ** ((n - 2) / 2)
            )
        assert np.allclose(ratios, ratios[0], rtol=1e-12)


def test_on_so_3_the_density_is_that_of_the_classical_veselova_system(
    rng: np.random.Generator,
) -> None:
    """μ = √(γ, I⁻¹γ) for γ = e_1 = e_2 × e_3."""
    system = random_lr(rng, 3, 1)
    group, gamma = system.distribution.group, system.g[0]
    tensor = np.array(
        [
            [group_vector(group, system.inertia(group_of(group, e)))[k] for k in range(3)]
            for e in np.eye(3)
        ]
    )
    F = system.distribution.in_body(system.g)[1]
    assert np.isclose(
        measure.density(system.inertia, F),
        np.sqrt(gamma @ np.linalg.solve(tensor, gamma)),
        rtol=1e-12,
    )


def group_of(group: MatrixGroup, vector: Any) -> Any:
    """The coordinates of ω with ω_ij = ε_ijk Ω_k."""
    x, y, z = vector
    return group.coordinates(np.array([[0, z, -y], [-z, 0, x], [y, -x, 0]]))


def group_vector(group: MatrixGroup, coordinates: Any) -> Any:
    """The Ω_k of ω_ij = ε_ijk Ω_k."""
    X = group.element(coordinates)
    return np.array([X[1, 2], X[2, 0], X[0, 1]])
