"""Hyperelliptic curves with real branch points: periods, Abel–Jacobi map, Legendre's
relation, finite-gap waves.
"""

from __future__ import annotations

from decimal import Decimal
from fractions import Fraction
from typing import Any

import mpmath
import numpy as np
import pytest

from deviations import decimals_of
from veselova import InvalidInput, curves, theta


def branch_points(random: np.random.Generator, count: int) -> list[float]:
    return [float(b) for b in np.cumsum(random.uniform(0.1, 2, count)) - 3]


def off_lattice(z: Any, tau: Any) -> float:
    """Return how far a point is from the lattice Z^g + τZ^g."""
    rest = z - tau @ np.rint(np.linalg.solve(tau.imag, z.imag))
    return float(np.max(np.abs(rest - np.rint(rest.real))))


def quadrature(points: list[Any], low: Any, high: Any, power: int, digits: int = 40) -> Any:
    """Return 2∫ λ^power dλ/|w| between neighbouring branch points, with ten digits fewer."""
    with mpmath.workdps(digits):
        exact = [mpmath.mpf(Fraction(b).numerator) / Fraction(b).denominator for b in points]
        l, h = (exact[points.index(b)] for b in (low, high))
        others = [b for b in exact if b not in (l, h)]

        def density(angle: Any) -> Any:
            x = (l + h) / 2 - (h - l) / 2 * mpmath.cos(angle)
            return x**power / mpmath.sqrt(abs(mpmath.fprod(x - b for b in others)))

        return 2 * mpmath.quad(density, mpmath.linspace(0, mpmath.pi, 9 if digits > 50 else 5))


CASES = [(count, sign) for count in range(3, 10) for sign in (-1, 1)]


@pytest.mark.parametrize(("count", "sign"), CASES)
def test_periods_and_the_riemann_matrix_are_those_of_quadrature(count: int, sign: int) -> None:
    points = branch_points(np.random.default_rng([1, count, sign + 1]), count)
    curve = curves.RealHyperelliptic(points, sign)
    g = curve.genus
    assert g == (count - 1) // 2
    by_quadrature = [
        [quadrature(points, *cut, k) for cut in curve.cuts.tolist()] for k in range(g)
    ]  # fmt: skip
    for k in range(g):
        for s in range(g):
            assert abs(curve.periods.a[k, s]) == pytest.approx(
                abs(float(by_quadrature[k][s])), rel=1e-13
            )
    T = np.linalg.solve(curve.periods.a, curve.periods.b)
    assert np.max(np.abs(T - curve.riemann_matrix)) <= 1e-12
    assert curve.riemann_matrix_error < 1e-13 * max(1, np.max(np.abs(curve.riemann_matrix)))
    assert np.linalg.eigvalsh(curve.riemann_matrix.imag)[0] > 0
    assert np.max(np.abs(curve.normalized_differentials @ curve.periods.a - np.eye(g))) < 1e-12


@pytest.mark.parametrize("gap", ["1e-3", "1e-8", "1e-12", "1e-30"])
def test_near_coincident_branch_points_keep_their_digits(gap: str) -> None:
    """τ of genus 1 is iK'/K, known from the gap alone."""
    narrow = curves.RealHyperelliptic([10**300 + Fraction(x) / 10**20 for x in ("0", gap, "1")])
    with mpmath.workdps(60):
        m = mpmath.mpf(gap)
        ratio = mpmath.ellipk(m) / mpmath.ellipk(1 - m)
    assert narrow.riemann_matrix[0, 0].imag == pytest.approx(float(ratio), rel=1e-14)
    other = curves.RealHyperelliptic(["0", "1", str(1 + Fraction(gap)), "2", "3"])
    assert other.riemann_matrix_error < 1e-13
    assert np.max(np.abs(other.riemann_matrix - other.riemann_matrix.T)) == 0


@pytest.mark.parametrize("digits", [1, 8, 12, 15])
@pytest.mark.parametrize("sign", [-1, 1])
@pytest.mark.parametrize("count", [3, 4, 7, 8])
def test_errors_of_riemann_matrices_bound_the_true_ones(count: int, sign: int, digits: int) -> None:
    random = np.random.default_rng([10, count, sign + 1, digits])
    rows = np.sort(random.uniform(-1, 1, (5, count)), axis=1)
    near = np.arange(5) % (count - 1)
    rows[np.arange(5), near + 1] = rows[np.arange(5), near] + 10.0**-digits
    for row in rows.tolist():
        curve = curves.RealHyperelliptic(row, sign)
        tau, error = curve.riemann_matrix, curve.riemann_matrix_error
        finer = curves.RealHyperelliptic(row, sign, digits=30)
        exact = decimals_of(finer).midpoints["riemann_matrix"]
        off = np.vectorize(Decimal, otypes=[object])(tau.imag) - exact
        assert np.max(np.abs(off)) <= Decimal(float(error))
        assert error < 1e-13 * max(1, np.max(np.abs(tau)))


@pytest.mark.daily(4)
@pytest.mark.parametrize(("count", "sign"), CASES)
def test_the_divisor_of_a_function_maps_to_zero(count: int, sign: int) -> None:
    """Abel's theorem for w − p(λ): real and complex points, on every interval and sheet."""
    random = np.random.default_rng([2, count, sign + 1])
    points = branch_points(random, count)
    curve = curves.RealHyperelliptic(points, sign)
    g, tau = curve.genus, curve.riemann_matrix
    for factor in (1, 1j):
        p = np.poly1d(random.normal(size=g + 1 + (count + 1) % 2) * factor)
        roots = (p * p - sign * np.poly1d(points, r=True)).roots
        roots = [complex(x.real) if abs(x.imag) < 1e-9 * abs(x) else x for x in roots]
        image = curve.abel(roots, [p(x) for x in roots]).sum(axis=0)
        assert off_lattice(image, tau) < 1e-9


@pytest.mark.parametrize(("count", "sign"), CASES)
def test_branch_points_map_to_their_half_periods(count: int, sign: int) -> None:
    points = branch_points(np.random.default_rng([3, count]), count)
    curve = curves.RealHyperelliptic(points, sign)
    images = curve.abel(points, np.zeros(count))
    for image, (epsilon, delta) in zip(images, curve.characteristics, strict=True):
        tau = curve.riemann_matrix
        assert off_lattice(image - tau @ np.array(epsilon) - np.array(delta), tau) < 1e-14


@pytest.mark.parametrize(("count", "sign"), CASES)
def test_inversion_undoes_the_map(count: int, sign: int) -> None:
    random = np.random.default_rng([4, count, sign + 1])
    points = branch_points(random, count)
    curve = curves.RealHyperelliptic(points, sign)
    z = random.uniform(size=(20, curve.genus))
    found, signs = curve.invert(z)
    assert (found >= curve.cuts[:, 0] - 1e-12).all()
    assert (found <= curve.cuts[:, 1] + 1e-12).all()
    # a point near an end says little of its angle
    assert np.max(np.abs((curve.torus(found, signs) - z + 0.5) % 1 - 0.5)) < 1e-7
    inner = np.abs(signs).all(axis=1) & (np.min(np.abs(np.sin(np.pi * z)), axis=1) > 0.2)
    again = curve.torus(found[inner], signs[inner])
    assert np.max(np.abs((again - z[inner] + 0.5) % 1 - 0.5)) < 1e-12
    # the same point by the general map
    lower = [
        points.index(
            min(points, key=lambda b, c=cut: abs(b - c[1 if curve._curve.reverses else 0]))
        )
        for cut in curve.cuts
    ]
    base = curve.abel([points[j] for j in lower], np.zeros(curve.genus)).sum(axis=0)
    image = curve.abel(found[0], signs[0]).sum(axis=0) - base
    assert off_lattice(image - z[0], curve.riemann_matrix) < 1e-7


HARD = [
    ["0", "1", "2", "2.000000000001", "5", "6.5", "8"],
    ["1e-9", "3e-8", "2e-5", "0.1", "0.3", "8", "200", "7e5"],
    ["-6", "1e-9", "3e-8", "2e-5", "0.1", "0.3", "8", "200", "7e5"],
]


@pytest.mark.parametrize("sign", [-1, 1])
@pytest.mark.parametrize("points", HARD)
def test_all_numbers_of_ill_conditioned_curves_are_those_of_ball_arithmetic(
    points: list[str], sign: int
) -> None:
    """Gaps, offsets and orders of magnitude, at which sums over monomials cancel."""
    curve = curves.RealHyperelliptic(points, sign)
    decimals = decimals_of(curves.RealHyperelliptic(points, sign, digits=17))
    exact = {name: decimals.midpoints[name].astype(float) for name in decimals.midpoints}
    omega, omega_prime, eta, eta_prime = curve.quasi_periods
    for name, found, axis in (
        ("a_periods", curve.periods.a, 1),
        ("b_periods", curve.periods.b.imag, 1),
        ("normalized_differentials", curve.normalized_differentials, 0),
        ("omega", omega.imag, 1),
        ("omega_prime", omega_prime.real, 1),
        ("eta", eta.imag, 1),
        ("eta_prime", eta_prime.real, 1),
    ):
        off = np.max(np.abs(found - exact[name]), axis=axis)
        assert np.max(off / np.max(np.abs(exact[name]), axis=axis)) < 2e-12, name


@pytest.mark.parametrize(("count", "sign"), CASES)
def test_legendres_relation_holds(count: int, sign: int) -> None:
    curve = curves.RealHyperelliptic(branch_points(np.random.default_rng([7, count]), count), sign)
    omega, omega_prime, eta, eta_prime = curve.quasi_periods
    off = omega @ eta_prime.T - omega_prime @ eta.T
    half = np.pi / 2 * np.eye(curve.genus)
    size = max(1, np.max(np.abs(omega)) * np.max(np.abs(eta_prime)))
    assert min(np.max(np.abs(off - s * half)) for s in (1j, -1j)) < 1e-12 * size
    assert np.max(np.abs(np.linalg.solve(omega, omega_prime) - curve.riemann_matrix)) < 1e-12


def test_a_wave_of_two_phases_solves_the_kdv_equation() -> None:
    """u = −2 ∂_x² log θ(z), z = c_g x + W t, obeys u''' − 6uu' = A u' + B ∂u/∂(c_{g−1}) on the
    whole torus.
    """
    curve = curves.RealHyperelliptic([0, 1, "1.7", 3, "4.5"])
    size = 48
    axis = np.arange(size) / size
    grid = np.stack(np.meshgrid(axis, axis, indexing="ij"), axis=-1).reshape(-1, 2)
    values, first, second = (
        theta.riemann_theta(grid, curve.riemann_matrix, derivatives=k) for k in range(3)
    )
    along, across = curve.normalized_differentials[:, 1], curve.normalized_differentials[:, 0]
    slope = (first @ along) / values
    u = (-2 * (np.einsum("nij,i,j->n", second, along, along) / values - slope**2)).real.reshape(
        size, size
    )
    k = 2j * np.pi * np.fft.fftfreq(size, 1 / size)

    def derivative(direction: Any, order: int) -> Any:
        rates = direction[0] * k[:, None] + direction[1] * k[None, :]
        return np.fft.ifft2(rates**order * np.fft.fft2(u)).real

    wave = derivative(along, 3) - 6 * u * derivative(along, 1)
    basis = np.stack([derivative(along, 1).ravel(), derivative(across, 1).ravel()], axis=1)
    (_, B), *_ = np.linalg.lstsq(basis, wave.ravel(), rcond=None)
    rest = wave.ravel() - basis @ np.linalg.lstsq(basis, wave.ravel(), rcond=None)[0]
    assert np.max(np.abs(rest)) < 1e-9 * np.max(np.abs(wave))
    assert abs(B) > 0.1


def test_thirty_digits_of_a_riemann_matrix_are_those_of_elliptic_integrals() -> None:
    """Genus 1: T = K'/K of the modulus of the cut, by mpmath."""
    curve = curves.RealHyperelliptic(["0", "1", "3"], digits=30, certified=True)
    decimals = decimals_of(curve)
    with mpmath.workdps(45):
        # the cut is [1, 3]: its modulus is (3−1)/(3−0)
        m = mpmath.mpf(2) / 3
        wanted = mpmath.ellipk(1 - m) / mpmath.ellipk(m)
        off = abs(mpmath.mpf(str(decimals.midpoints["riemann_matrix"][0, 0])) - wanted)
        assert off <= mpmath.mpf(str(decimals.radii["riemann_matrix"][0, 0]))


def test_digits_of_curves_are_bounded_and_named() -> None:
    plain = curves.RealHyperelliptic([0, 1, 2])
    assert plain.decimals is plain.abel_decimals([1], [1]) is plain.invert_decimals([0.5]) is None
    with pytest.raises(InvalidInput) as caught:
        curves.RealHyperelliptic([0, 1], digits=2000, certified=1)  # type: ignore[arg-type]
    fields = [fault.field for fault in caught.value.faults]
    assert fields == ["branch_points", "digits", "certified"]
