"""Theta functions of any matrix: against ball arithmetic, identities, and
differential equations.
"""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest
from flint import acb, acb_mat, ctx

from veselova import InvalidInput, Unsolved, theta


def random_tau(random: np.random.Generator, genus: int) -> Any:
    """Return a matrix of the half space, unreduced, sometimes nearly degenerate."""
    X, M = random.normal(size=(genus, genus)) * 3, random.normal(size=(genus, genus))
    Y = M @ M.T * random.choice([1, 0.1]) + random.choice([1e-3, 0.02, 0.3]) * np.eye(genus)
    return (X + X.T) / 2 + 1j * Y


def all_halves(genus: int) -> list[Any]:
    rows = list(itertools.product((0, 0.5), repeat=genus))
    return [[list(e), list(d)] for e in rows for d in rows]


def in_balls(z: Any, tau: Any, bits: int) -> Any:
    """Return θ of all half-integer characteristics by python-flint, in the order of
    ``all_halves``.
    """
    ctx.prec = bits
    columns = acb_mat([[acb(x.real, x.imag)] for x in np.asarray(z, dtype=complex).tolist()])
    values = acb_mat([[acb(x.real, x.imag) for x in row] for row in tau.tolist()]).theta(columns)
    return values.entries()


@pytest.mark.parametrize("genus", [1, 2, 3, 4])
def test_values_are_those_of_ball_arithmetic(genus: int) -> None:
    random = np.random.default_rng([1, genus])
    for _ in range(12 if genus < 4 else 3):
        tau, z = (
            random_tau(random, genus),
            random.normal(size=genus) + 0.2j * random.normal(size=genus),
        )
        exact = np.array(list(map(complex, in_balls(z, tau, 120))))
        found = theta.scaled_riemann_theta(z, tau, all_halves(genus))
        ours = found.mantissa * np.exp(found.exponent)
        assert np.max(np.abs(ours - exact)) <= 1e-13 * np.max(np.abs(exact))
        assert (np.abs(ours - exact) <= found.error * np.exp(found.exponent)).all()


@pytest.mark.parametrize("genus", [1, 2, 3, pytest.param(4, marks=pytest.mark.slow)])
def test_the_error_is_never_below_the_true_one_and_not_far_above_it(genus: int) -> None:
    random = np.random.default_rng([11, genus])
    ratios = []
    for _ in range(20 if genus < 4 else 4):
        tau = random_tau(random, genus)
        z = random.normal(size=genus) + 0.3j * random.normal(size=genus)
        found = theta.scaled_riemann_theta(z, tau, all_halves(genus))
        exact = [
            x / acb(float(e)).exp()
            for x, e in zip(in_balls(z, tau, 600), found.exponent, strict=True)
        ]
        for wanted, mantissa, error in zip(exact, found.mantissa, found.error, strict=True):
            off = abs(wanted - acb(mantissa.real, mantissa.imag))
            if float(off.rad()) < 1e-3 * float(off.mid()):  # the sum in balls may have no digits
                assert float(off.mid()) <= error
                ratios.append(error / float(off.mid()))
    assert len(ratios) > 4**genus
    assert np.median(ratios) <= 100


@pytest.mark.parametrize("genus", [1, 2])
@pytest.mark.parametrize("order", [0, 1, 2])
def test_the_error_bounds_derivatives_with_any_characteristic(genus: int, order: int) -> None:
    """Against the sum itself in balls, term by term."""
    random = np.random.default_rng([12, genus, order])
    ctx.prec = 200
    i, pi = acb(0, 1), acb.pi()
    ratios = []
    for _ in range(12):
        X, M = random.normal(size=(genus, genus)) * 3, random.normal(size=(genus, genus))
        tau = X + X.T + 1j * (M @ M.T + 0.3 * np.eye(genus))
        epsilon, delta = random.choice([0, 0.5, 1 / 3, -0.7, 1.5], (2, genus))
        z = random.normal(size=genus) + 0.3j * random.normal(size=genus)
        found = theta.scaled_riemann_theta(z, tau, [epsilon, delta], order)
        T = [[acb(x.real, x.imag) for x in row] for row in tau.tolist()]
        u = [acb(x.real, x.imag) + acb(d) for x, d in zip(z.tolist(), delta.tolist(), strict=True)]
        middle = np.rint(-np.linalg.solve(tau.imag, z.imag) - epsilon).tolist()
        sums = [acb(0)] * genus**order
        for k in itertools.product(range(-10, 11), repeat=genus):
            m = [acb(a + b) + acb(e) for a, b, e in zip(k, middle, epsilon.tolist(), strict=True)]
            form = sum((m[r] * T[r][s] * m[s] for r, s in np.ndindex(genus, genus)), acb(0))
            term = (
                i * pi * (form + 2 * sum((a * b for a, b in zip(m, u, strict=True)), acb(0)))
            ).exp()
            for place, axes in enumerate(itertools.product(range(genus), repeat=order)):
                factor = acb(1)
                for axis in axes:
                    factor *= 2 * pi * i * m[axis]
                sums[place] += factor * term
        scale = acb(float(found.exponent)).exp()
        off = max(
            float(abs(wanted / scale - acb(x.real, x.imag)).mid())
            for wanted, x in zip(sums, np.ravel(found.mantissa).tolist(), strict=True)
        )
        assert off <= found.error
        ratios.append(float(found.error) / off)
    assert np.median(ratios) <= 200


@pytest.mark.parametrize("genus", [1, 2, 3])
def test_derivatives_are_those_of_a_contour(genus: int) -> None:
    """Cauchy's integral over a small circle in each coordinate."""
    random = np.random.default_rng([2, genus])
    turns = np.exp(2j * np.pi * np.arange(16) / 16)
    for _ in range(4):
        tau, halves = (
            random_tau(random, genus).real + 1j * np.eye(genus),
            random.uniform(-1, 1, (2, genus)),
        )
        z = random.normal(size=genus) + 0.2j * random.normal(size=genus)
        gradient, second = (theta.riemann_theta(z, tau, halves, order) for order in (1, 2))
        for i in range(genus):
            around = z + 0.05 * turns[:, None] * np.eye(genus)[i]
            values, slopes = (theta.riemann_theta(around, tau, halves, order) for order in (0, 1))
            scale = np.max(np.abs(values))
            assert abs(np.mean(values / turns) / 0.05 - gradient[i]) < 1e-11 * scale / 0.05
            found = np.mean(slopes / turns[:, None], axis=0) / 0.05
            assert np.max(np.abs(found - second[i])) < 1e-10 * np.max(np.abs(slopes)) / 0.05


def test_the_heat_equation_ties_second_derivatives_to_tau() -> None:
    """∂θ/∂τ_jj = (1/4πi) ∂²θ/∂z_j², and twice that off the diagonal."""
    tau, z = (
        np.array([[0.3 + 0.9j, 0.2 + 0.1j], [0.2 + 0.1j, -0.4 + 0.8j]]),
        np.array([0.3 + 0.2j, -0.1]),
    )
    second, h = theta.riemann_theta(z, tau, derivatives=2), 1e-4
    for i, j in ((0, 0), (1, 1), (0, 1)):
        step = np.zeros((2, 2))
        step[i, j] = step[j, i] = h
        rise = (theta.riemann_theta(z, tau + step) - theta.riemann_theta(z, tau - step)) / (2 * h)
        assert rise == pytest.approx(second[i, j] / (4j * np.pi) * (1 if i == j else 2), rel=1e-6)


@pytest.mark.parametrize("genus", [1, 2, 4, 6])
def test_translations_by_the_lattice(genus: int) -> None:
    random = np.random.default_rng([3, genus])
    tau = random_tau(random, genus).real + 1j * (0.4 * np.eye(genus) + 0.1)
    z, halves = (
        random.normal(size=genus) + 0.1j * random.normal(size=genus),
        random.uniform(-1, 1, (2, genus)),
    )
    n, m = random.integers(-5, 6, genus), random.integers(-2, 3, genus)
    epsilon, delta = halves
    there, here = (theta.scaled_riemann_theta(point, tau, halves) for point in (z + n + tau @ m, z))
    logarithm = (
        2j * np.pi * (epsilon @ n) - 1j * np.pi * (m @ tau @ m) - 2j * np.pi * m @ (z + delta)
    )
    ratio = there.mantissa / here.mantissa * np.exp(there.exponent - here.exponent - logarithm)
    assert ratio == pytest.approx(1, abs=1e-10)


def test_jacobis_identities_of_theta_constants() -> None:
    constants = theta.theta_constants([[0.2 + 0.7j]])
    third, fourth, second = (constants[(e,), (d,)] for e, d in ((0.0, 0.0), (0.0, 0.5), (0.5, 0.0)))
    assert third**4 == pytest.approx(second**4 + fourth**4, abs=1e-14)
    assert constants[(0.5,), (0.5,)] == 0
    gradient = theta.riemann_theta([0.0], [[0.2 + 0.7j]], [[0.5], [0.5]], 1)[0]
    assert gradient == pytest.approx(-np.pi * second * third * fourth, abs=1e-13)
    assert sum(value == 0 for value in theta.theta_constants(np.eye(3) * 1j + 0.1).values()) == 28


def test_shapes_follow_points_characteristics_and_derivatives() -> None:
    tau, pair = np.eye(2) * 1j, [[0.5, 0], [0, 0.5]]
    z = np.zeros((5, 2))
    assert theta.riemann_theta(z[0], tau).shape == ()
    assert theta.riemann_theta(z, tau).shape == (5,)
    assert theta.riemann_theta(z, tau, [pair] * 3).shape == (5, 3)
    assert theta.riemann_theta(z, tau, [pair] * 3, 1).shape == (5, 3, 2)
    assert theta.riemann_theta(z, tau, pair, 2).shape == (5, 2, 2)
    assert theta.riemann_theta(np.zeros((0, 2)), tau).shape == (0,)


@pytest.mark.parametrize(
    "tau", [1 + 1e-2j, 1 + 2e-2j, 0.5 + 1e-3j, 1e-3j, 1e-9j, 0.3 + 1e-5j, 300j]
)
def test_a_degenerate_matrix_keeps_its_digits_or_says_how_many_it_has(tau: complex) -> None:
    """Im τ' is large: W and the powers of u leave the range of a double, their product does not."""
    for z in (0, 0.1, 0.5, 0.25 + 0.3j * tau.imag, tau / 2, 0.5001 + tau / 2):
        ctx.prec = 400
        column = acb_mat([[acb(complex(z).real, complex(z).imag)]])
        exact = acb_mat([[acb(tau.real, tau.imag)]]).theta(column)
        found = theta.scaled_riemann_theta([z], [[tau]], all_halves(1))
        for i in range(4):
            wanted = complex(exact[0, i] / acb(float(found.exponent[i])).exp())
            assert abs(found.mantissa[i] - wanted) <= found.error[i] <= 1e-7


def test_values_out_of_range_are_refused_by_name() -> None:
    for z, tau in (([1e300j], [[1j]]), ([0], [[1e300j]]), ([0], [[1e-300j]])):
        with pytest.raises(Unsolved, match="beyond-floats"):
            theta.scaled_riemann_theta(z, tau)
    # the derivative overflows, and θ itself does not
    derivative = theta.scaled_riemann_theta([15j], [[1j]], None, 2)
    assert np.isfinite(theta.riemann_theta([15j], [[1j]]))
    assert np.isfinite(derivative.as_dict()["values"]).all()
    with pytest.raises(Unsolved, match="beyond-floats"):
        _ = derivative.values
    with pytest.raises(InvalidInput, match="2\\^53"):
        theta.riemann_theta([0], [[1e300 + 1j]])
