"""Hyperelliptic curves with real branch points: periods, Abel–Jacobi map, Thomae's formula,
finite-gap waves.
"""

from __future__ import annotations

from decimal import Decimal
from fractions import Fraction
from typing import Any

import mpmath
import numpy as np
import pytest

from veselova import InvalidInput, Unsolved, curves, theta


def branch_points(random: np.random.Generator, count: int) -> list[float]:
    return [float(b) for b in np.cumsum(random.uniform(0.1, 2, count)) - 3]


def off_lattice(z: Any, tau: Any) -> float:
    """Return how far a point is from the lattice Z^g + τZ^g."""
    rest = z - tau @ np.rint(np.linalg.solve(tau.imag, z.imag))
    return float(np.max(np.abs(rest - np.rint(rest.real))))


def quadrature(points: list[Any], low: Any, high: Any, power: int) -> Any:
    """Return 2∫ λ^power dλ/|w| between neighbouring branch points with 30 digits."""
    with mpmath.workdps(40):
        exact = [mpmath.mpf(Fraction(b).numerator) / Fraction(b).denominator for b in points]
        l, h = (exact[points.index(b)] for b in (low, high))
        others = [b for b in exact if b not in (l, h)]

        def density(angle: Any) -> Any:
            x = (l + h) / 2 - (h - l) / 2 * mpmath.cos(angle)
            return x**power / mpmath.sqrt(abs(mpmath.fprod(x - b for b in others)))

        return 2 * mpmath.quad(density, mpmath.linspace(0, mpmath.pi, 5))


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
    narrow = curves.RealHyperelliptic(["0", gap, "1"])
    with mpmath.workdps(60):
        m = mpmath.mpf(gap)
        ratio = mpmath.ellipk(m) / mpmath.ellipk(1 - m)
    assert narrow.riemann_matrix[0, 0].imag == pytest.approx(float(ratio), rel=1e-14)
    other = curves.RealHyperelliptic(["0", "1", str(1 + Fraction(gap)), "2", "3"])
    assert other.riemann_matrix_error < 1e-13
    assert np.max(np.abs(other.riemann_matrix - other.riemann_matrix.T)) == 0


def test_riemann_matrices_of_many_curves_are_those_of_each() -> None:
    """Points in any order, gaps to 1e-12 of the span anywhere and to 1e-90 about zero, any unit."""
    random = np.random.default_rng(9)
    for count in range(3, 18):
        for narrow in (0, 3, 12):
            rows = np.cumsum(10 ** -random.uniform(0, narrow, (4, count)), axis=1)
            if narrow == 12:
                rows[1] = random.choice([-1, 1], count) * 10 ** -random.uniform(0, 45, count)
                rows[2] = (rows[1] * random.uniform(1, 2, count)) * 1e200
            sign = int(random.choice([-1, 1]))
            found = curves.riemann_matrices(random.permuted(rows, axis=1), sign)
            for row, tau, error in zip(rows.tolist(), *found, strict=True):
                alone = curves.RealHyperelliptic(row, sign)
                off = np.max(np.abs(tau - alone.riemann_matrix))
                assert off <= error + alone.riemann_matrix_error


@pytest.mark.parametrize("digits", [1, 8, 12, 15])
@pytest.mark.parametrize("sign", [-1, 1])
@pytest.mark.parametrize("count", [3, 4, 7, 8])
def test_errors_of_riemann_matrices_bound_the_true_ones(count: int, sign: int, digits: int) -> None:
    random = np.random.default_rng([10, count, sign + 1, digits])
    rows = np.sort(random.uniform(-1, 1, (5, count)), axis=1)
    near = np.arange(5) % (count - 1)
    rows[np.arange(5), near + 1] = rows[np.arange(5), near] + 10.0**-digits
    found = curves.riemann_matrices(rows, sign)
    for row, tau, error in zip(rows.tolist(), *found, strict=True):
        decimals = curves.RealHyperelliptic(row, sign, digits=30).decimals
        assert decimals is not None
        exact = decimals.midpoints["riemann_matrix"]
        off = np.vectorize(Decimal, otypes=[object])(tau.imag) - exact
        assert np.max(np.abs(off)) <= Decimal(float(error))
        assert error < 1e-13 * max(1, np.max(np.abs(tau)))


def test_no_riemann_matrix_depends_on_other_curves() -> None:
    rows = np.cumsum(np.random.default_rng(11).uniform(0.01, 2, (300, 6)), axis=1)
    together = curves.riemann_matrices(rows)
    for part in (slice(7, 8), slice(100, 160)):
        some = curves.riemann_matrices(rows[part])
        assert np.array_equal(some.tau, together.tau[part])
        assert np.array_equal(some.error, together.error[part])
    assert curves.riemann_matrices(np.empty((0, 5))).tau.shape == (0, 2, 2)


def test_bad_rows_of_branch_points_are_named() -> None:
    """Every one of them, and one by its exact differences."""
    for rows, fields in (
        ([[0, 1, 2], [3, 1, 3], [0, float("nan"), float("inf")]], ["[1][2]", "[2][1]", "[2][2]"]),
        ([[0, 1, 2], [0, 1e-200, 1], [0, 5e-324, 1]], ["[1]", "[2]"]),
        ([[-1, -1e-190, 0, 1e-300]], ["[0]"]),
        ([["0", "1", "2"]], [""]),
        ([[0, 1, 2], [0, 1]], [""]),
        ([0, 1, 2], [""]),
        ([[0, 1]], [""]),
        (None, [""]),
    ):
        with pytest.raises(InvalidInput) as caught:
            curves.riemann_matrices(rows, 3 if fields == [""] else 1)  # type: ignore[arg-type]
        expected = [f"branch_points{field}" for field in fields]
        assert [fault.field for fault in caught.value.faults] == expected + ["sign"] * (
            fields == [""]
        )


@pytest.mark.parametrize(("count", "sign"), CASES)
def test_the_divisor_of_a_function_maps_to_zero(count: int, sign: int) -> None:
    """Abel's theorem for w − p(λ): real and complex points, on every interval and sheet."""
    random = np.random.default_rng([2, count, sign + 1])
    points = branch_points(random, count)
    curve = curves.RealHyperelliptic(points, sign)
    g, tau = curve.genus, curve.riemann_matrix
    for trial in range(6):
        p = np.poly1d(random.normal(size=g + 1 + (count + 1) % 2) * (1 if trial < 3 else 1j))
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
        assert (
            off_lattice(
                image - curve.riemann_matrix @ np.array(epsilon) - np.array(delta),
                curve.riemann_matrix,
            )
            < 1e-14
        )


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
    assert (
        np.max(np.abs((curve.torus(found[inner], signs[inner]) - z[inner] + 0.5) % 1 - 0.5)) < 1e-12
    )
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


@pytest.mark.parametrize(("count", "sign"), CASES[:-2])
def test_thomaes_formula_gives_the_theta_constants(count: int, sign: int) -> None:
    curve = curves.RealHyperelliptic(branch_points(np.random.default_rng([5, count]), count), sign)
    constants = theta.theta_constants(curve.riemann_matrix)
    predicted = curve.thomae()
    for constant in predicted:
        assert abs(constants[constant.characteristic]) ** 4 == pytest.approx(
            constant.fourth_power, rel=1e-11, abs=1e-13
        )
    # The others vanish, for a hyperelliptic curve of genus 3 one even constant among them.
    named = {constant.characteristic for constant in predicted}
    assert max((abs(value) for c, value in constants.items() if c not in named), default=0) < 1e-12
    assert len(named) == len(predicted)


NARROW = [("8", 2), ("12", 0), ("15", 3), ("30", 1)]


def narrow_points(count: int, place: int, digits: str) -> list[str]:
    """Return exact branch points, two of them so near to each other."""
    random = np.random.default_rng([12, count, place])
    points = [Fraction(b) for b in np.cumsum(random.uniform(0.1, 2, count)) - 3]
    points[place + 1] = points[place] + Fraction(f"1e-{digits}")
    return [str(b) for b in points]


@pytest.mark.parametrize(("digits", "place"), NARROW)
@pytest.mark.parametrize("sign", [-1, 1])
@pytest.mark.parametrize("count", [5, 6])
def test_images_and_inverses_beside_near_branch_points_are_those_of_ball_arithmetic(
    count: int, sign: int, digits: str, place: int
) -> None:
    """Complex points on all scales down to the gap; λ as near as doubles are."""
    points = narrow_points(count, place, digits)
    curve = curves.RealHyperelliptic(points, sign)
    fine = curves.RealHyperelliptic(points, sign, digits=20)
    near = float(Fraction(points[place]))
    places = [2.3 - 1.1j, near + 1e-9j, near - 1e-3 - 1e-3j, near + 0.2 + 1e-12j, near - 1e-15j]
    w = [1 + 0.3j] * len(places)
    images = fine.abel_decimals(places, w)
    assert images is not None
    wanted = images.midpoints["abel"].astype(float)
    for image, other in zip(curve.abel(places, w), wanted, strict=True):
        assert off_lattice(image - other[:, 0] - 1j * other[:, 1], curve.riemann_matrix) < 1e-12
    z = np.random.default_rng(13).uniform(size=(3, 2))
    found, signs = curve.invert(z)
    exact = fine.invert_decimals(z)
    assert exact is not None
    off = np.abs(found - exact.midpoints["points"].astype(float))
    assert np.max(off) < 1e-14 * np.max(np.abs(curve.branch_points))
    assert curve.torus(found, signs).shape == (3, 2)  # a rounding beyond a cut is no fault


@pytest.mark.parametrize("spacing", ["1e-4", "1e-7", "1e-13"])
@pytest.mark.parametrize("sign", [-1, 1])
def test_images_beside_three_near_branch_points_are_those_of_ball_arithmetic(
    spacing: str, sign: int
) -> None:
    near = [Fraction(1) + j * Fraction(spacing) for j in range(3)]
    points = [Fraction(-1), Fraction(0), *near]
    places = [Fraction(x) for x in ("-1.5", "-0.7", "0.2", "0.5", "0.999", "1.5", "40")]
    w = np.full(len(places), 1 + 1j)
    found = curves.RealHyperelliptic(points, sign).abel(places, w)
    truth = curves.RealHyperelliptic(points, sign, digits=25).abel_decimals(places, w)
    assert truth is not None
    parts = truth.midpoints["abel"].astype(float)
    assert np.max(np.abs(found - parts[..., 0] - 1j * parts[..., 1])) < 1e-13


def test_the_sign_of_w_names_the_sheet_and_zero_none() -> None:
    curve = curves.RealHyperelliptic([1, 2, 3])
    for point, unit in ((1.5, 1j), (2.5, 1)):
        upper, lower = curve.abel([point] * 2, [unit, -unit])
        assert np.max(np.abs(upper - lower)) > 0.1
        for other in (1, 1j, 1 + 1j):
            assert curve.abel([point] * 2, [other, -other]).tolist() == [upper, lower]
        with pytest.raises(InvalidInput, match="w: required a number other than 0"):
            curve.abel([point], [0])
    assert np.all(np.isfinite(curve.abel([1, 2, 3], [0, 0, 0])))


def test_inverses_of_points_of_many_orders_are_those_of_ball_arithmetic() -> None:
    """λ is as exact as its distance to the nearer branch point, also with 2g+2 of them."""
    points = ["1e-30", "3e-30", "2e-18", "5e-7", "0.3", "8", "2e9", "7e15"]
    for given, sign in ((points, -1), (points[1:], 1)):
        curve = curves.RealHyperelliptic(given, sign, digits=62)
        found, signs = curve.invert([0.1, 0.2, 0.3])
        exact = curve.invert_decimals([0.1, 0.2, 0.3])
        assert exact is not None
        assert np.allclose(found, exact.midpoints["points"][0].astype(float), rtol=1e-14, atol=0)
        assert np.allclose(curve.torus(found.tolist(), signs), [0.1, 0.2, 0.3], atol=1e-13)


HARD = [
    narrow_points(6, 4, "12"),
    narrow_points(7, 1, "15"),
    narrow_points(8, 2, "9"),
    [str(1000 + Fraction(b)) for b in narrow_points(11, 3, "1")],
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
    decimals = curves.RealHyperelliptic(points, sign, digits=17).decimals
    assert decimals is not None
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
    powers = np.array([constant.fourth_power for constant in curve.thomae()])
    assert np.allclose(powers, exact["thomae"], rtol=1e-12, atol=0)
    assert curve.legendre_residual < 1e-12


@pytest.mark.parametrize(("count", "sign"), CASES)
def test_legendres_relation_holds(count: int, sign: int) -> None:
    curve = curves.RealHyperelliptic(branch_points(np.random.default_rng([7, count]), count), sign)
    assert curve.legendre_residual < 1e-9
    omega, omega_prime, *_ = curve.quasi_periods
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


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ([0, 1, 1, 2, 3], "distinct numbers"),
        (["0.5", "1/2", 1], "distinct numbers"),
        ([0, 1], "3 to 34 real numbers"),
        ([0, 1j, 2], "branch_points"),
        (np.array([0, 1j, 2]), r"branch_points\[0\]: required a finite real number"),
        ([0, float("nan"), 2], "branch_points"),
        ("012", "branch_points"),
        (list(range(60)), "3 to 34"),
    ],
)
def test_bad_branch_points_are_named(given: Any, message: str) -> None:
    with pytest.raises(InvalidInput, match=message):
        curves.RealHyperelliptic(given)


def test_other_bad_arguments_are_named() -> None:
    curve = curves.RealHyperelliptic([0, 1, 2, 3, 4])
    for call, field in (
        (lambda: curves.RealHyperelliptic([0, 1, 2], 0), "sign"),
        (lambda: curve.invert([0.5]), "z"),
        (lambda: curve.invert([0.5, float("inf")]), "z"),
        (lambda: curve.abel([1.5, 2], [1]), "w"),
        (lambda: curve.abel([float("nan")], [1]), "points"),
        (lambda: curve.torus([0.5, 3.5], [1, 1]), "points"),
        (lambda: curve.torus([1.5], [1]), "points"),
        (lambda: curve.torus([[1.5, 3.5], [1.5]], [[1, 1], [1, 1]]), "points"),
        (lambda: curve.torus([[1.5, 3.5], 2], [1, 1]), "points"),
    ):
        with pytest.raises(InvalidInput) as caught:
            call()
        assert caught.value.path[0] == field


@pytest.mark.slow
@pytest.mark.parametrize("genus", [6, 8, 10])
def test_high_genera_agree_with_quadrature(genus: int) -> None:
    points = branch_points(np.random.default_rng([6, genus]), 2 * genus + 1)
    curve = curves.RealHyperelliptic(points)
    with mpmath.workdps(40):
        a = mpmath.matrix(genus, genus)
        b = mpmath.matrix(genus, genus)
        for k in range(genus):
            total = mpmath.mpf(0)
            for s in range(genus):
                a[k, s] = (-1) ** (genus - s - 1) * quadrature(
                    points, points[2 * s + 1], points[2 * s + 2], k
                )
                total += (-1) ** (genus - s + 1) * quadrature(
                    points, points[2 * s], points[2 * s + 1], k
                )
                b[k, s] = total
        T = mpmath.inverse(a) * b
    found = curve.riemann_matrix.imag
    assert max(
        abs(found[i, j] - float(T[i, j])) for i in range(genus) for j in range(genus)
    ) < 1e-13 * np.max(found)


@pytest.mark.parametrize("count", [5, 6])
@pytest.mark.parametrize("unit", [1e-250, 1e-100, 1e100, 1e250])
def test_the_riemann_matrix_has_no_unit(count: int, unit: float) -> None:
    points = branch_points(np.random.default_rng([7, count]), count)
    scaled = curves.RealHyperelliptic([Fraction(b) * Fraction(unit) for b in points])
    plain = curves.RealHyperelliptic(points)
    assert np.allclose(scaled.riemann_matrix, plain.riemann_matrix, rtol=1e-13, atol=0)
    assert scaled.legendre_residual < 1e-12
    point, signs = scaled.invert([0.2, 0.7])
    assert np.allclose(scaled.torus(point.tolist(), signs), [0.2, 0.7], atol=1e-12)


def test_far_branch_points_are_as_good_as_near_ones() -> None:
    near = curves.RealHyperelliptic([0, 1, 3, 7, 12])
    far = curves.RealHyperelliptic([10**15, 10**15 + 1, 10**15 + 3, 10**15 + 7, 10**15 + 12])
    assert np.array_equal(near.riemann_matrix, far.riemann_matrix)
    assert far.legendre_residual < 1e-13


def test_periods_out_of_range_are_refused_by_name() -> None:
    curve = curves.RealHyperelliptic(["1e250", "2e250", "4e250", "5e250", "7e250"])
    with pytest.raises(Unsolved, match="beyond-floats"):
        _ = curve.periods
    with pytest.raises(InvalidInput, match="1e-100"):
        curves.RealHyperelliptic([0, 1e-200, 1])


def test_every_bad_branch_point_is_named() -> None:
    with pytest.raises(InvalidInput) as caught:
        curves.RealHyperelliptic([0, "x", 1j, float("nan")], 3)
    fields = [fault.field for fault in caught.value.faults]
    assert fields == ["branch_points[1]", "branch_points[2]", "branch_points[3]", "sign"]


@pytest.mark.parametrize("certified", [False, True])
@pytest.mark.parametrize(
    ("points", "sign"),
    [(["0", "1", "1.7", "3", "4.5"], -1), (["0", "1", "1.7", "3", "4.5", "7/2"], 1)],
)
def test_the_riemann_matrix_has_the_digits_asked_for(
    points: list[str], sign: int, certified: bool
) -> None:
    curve = curves.RealHyperelliptic(points, sign, digits=30, certified=certified)
    ordered = [str(b) for b in sorted(map(Fraction, points))]
    decimals = curve.decimals
    assert decimals is not None
    T, radii = decimals.midpoints["riemann_matrix"], decimals.radii["riemann_matrix"]
    assert max(radii.ravel()) <= Decimal("1e-30")
    finer = curves.RealHyperelliptic(ordered, sign, digits=60).decimals
    assert finer is not None
    assert (np.abs(T - finer.midpoints["riemann_matrix"]) <= radii).all()
    assert np.allclose(T.astype(float), curve.riemann_matrix.imag, rtol=1e-14, atol=0)


def test_thirty_digits_of_a_riemann_matrix_are_those_of_elliptic_integrals() -> None:
    """Genus 1: T = K'/K of the modulus of the cut, by mpmath."""
    decimals = curves.RealHyperelliptic(["0", "1", "3"], digits=30, certified=True).decimals
    assert decimals is not None
    with mpmath.workdps(45):
        # the cut is [1, 3]: its modulus is (3−1)/(3−0)
        m = mpmath.mpf(2) / 3
        wanted = mpmath.ellipk(1 - m) / mpmath.ellipk(m)
        off = abs(mpmath.mpf(str(decimals.midpoints["riemann_matrix"][0, 0])) - wanted)
        assert off <= mpmath.mpf(str(decimals.radii["riemann_matrix"][0, 0]))


def test_digits_of_curves_are_bounded_and_named() -> None:
    assert curves.RealHyperelliptic([0, 1, 2]).decimals is None
    with pytest.raises(InvalidInput) as caught:
        curves.RealHyperelliptic([0, 1], digits=2000, certified=1)  # type: ignore[arg-type]
    fields = [fault.field for fault in caught.value.faults]
    assert fields == ["branch_points", "digits", "certified"]


def test_far_and_near_points_have_images_and_bad_arguments_are_named() -> None:
    curve = curves.RealHyperelliptic([0, 1, 2, 3, 4])
    with np.errstate(all="raise", under="ignore"):
        far = curve.abel([1e300, -1e300, 1e300j], [1, 1, 1])
    assert np.max(np.abs(far)) < 1e-100  # infinity is where paths begin
    assert curve.abel([], []).shape == (0, 2)
    precise = curves.RealHyperelliptic([0, 1, 2, 3, 4], digits=20)
    none = precise.abel_decimals([], [])
    assert none is not None
    assert none.midpoints["abel"].shape == (0, 2, 2)
    tiny = curves.RealHyperelliptic(["0", "1e-300", "2e-300"])
    with pytest.raises(Unsolved, match="beyond-floats"):
        tiny.abel([1e300], [1])
    for call, field in (
        (lambda: curve.torus([1.5, 3.5], ["a", 1]), "signs[0]"),
        (lambda: curve.torus([1.5, 3.5], [[1], [1, 2]]), "signs"),
        (lambda: curves.RealHyperelliptic([0, 1, 2], np.array([1, 1])), "sign"),  # type: ignore[arg-type]
        (lambda: theta.riemann_theta([0], [[1j]], derivatives=np.array([1])), "derivatives"),  # type: ignore[arg-type]
        (lambda: theta.riemann_theta([0], [[1j]], derivatives=1.0), "derivatives"),  # type: ignore[arg-type]
    ):
        with pytest.raises(InvalidInput) as caught:
            call()
        assert caught.value.faults[0].field == field
