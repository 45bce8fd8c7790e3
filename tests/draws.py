"""Random problems and random matrices for the tests and sweeps."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np

from veselova import Veselova


def near_unstable_circle(q_2: str, q_dot_2: str) -> Veselova:
    """Return a motion of n = 3 next to the great circle across the middle axis, a separatrix, by
    q_2 and q̇_2.
    """
    return Veselova(["3", "2", "1"], ["0.6", q_2, "0.8"], ["1", q_dot_2, "-0.7"], normalize=True)


def random_problem(
    rng: np.random.Generator, n: int, ratio: float = 100.0, *, framed: bool = True
) -> Veselova:
    """Return a problem with A log-uniform up to the ratio, a uniform start of unit speed and a
    random frame.
    """
    A = np.exp(rng.uniform(0, np.log(ratio), n))
    q, q_dot = rng.normal(size=n), rng.normal(size=n)
    q /= np.linalg.norm(q)
    q_dot -= (q_dot @ q) * q
    q_dot /= np.linalg.norm(q_dot)
    frame = None
    if framed:
        frame = np.linalg.qr(np.column_stack([q, rng.normal(size=(n, n - 1))]))[0]
        frame[:, 0] = q
    return Veselova(A, q, q_dot, frame, normalize=True)


def random_riemann_matrix(rng: np.random.Generator, genus: int, smallest: float = 0.3) -> Any:
    """Return a symmetric positive definite T with eigenvalues between ``smallest`` and 3."""
    basis = np.linalg.qr(rng.normal(size=(genus, genus)))[0]
    T = basis @ np.diag(np.exp(rng.uniform(np.log(smallest), np.log(3.0), genus))) @ basis.T
    return (T + T.T) / 2  # FLINT answers NaN for a matrix that is symmetric only up to rounding


def adversarial_start(rng: np.random.Generator, n: int) -> tuple[str, Veselova]:
    """Return the name of a class of starts at which closed forms usually fail, and one of it, in
    exact rationals.
    """
    name, A, q, v = adversarial_data(rng, n, CLASSES)
    return name, Veselova(A, q, v, normalize=True)


def adversarial_data(
    rng: np.random.Generator, n: int, classes: tuple[str, ...], narrowest: int = 300
) -> tuple[str, list[Fraction], list[Fraction], list[Fraction]]:
    """Return the name of one of the classes, A, q of any length and v not along q, in exact
    rationals; widths of gaps and cuts go from 1e-1 to 10^−narrowest.
    """
    name = str(rng.choice(classes))
    A, q, v = (_fractions(rng, n, low) for low in (0.3, -1.0, -1.0))
    A = [a + Fraction(1, 5) for a in A]
    power = Fraction(1, 10 ** int(rng.integers(1, narrowest + 1)))
    if name in ("equal A's", "equal and frozen"):
        values = A[: max(1, int(rng.integers(1, n)))]
        A = [values[int(k)] for k in rng.integers(0, len(values), n)]
    if name == "nearly equal A's":
        A[1] = A[0] * (1 + power)
    if name == "near three equal A's" and n > 2:
        A[1], A[2] = A[0] * (1 + power), A[0] * (1 + 3 * power)
    if name in ("frozen", "equal and frozen"):
        for i in rng.permutation(n)[: int(rng.integers(0, n - 1))]:
            q[i] = v[i] = Fraction()
    if name == "nearly frozen" and n > 2:
        q[0], v[0] = q[0] * power, v[0] * power
    if name == "in planes q_i = 0":
        for i in rng.permutation(n)[: int(rng.integers(1, n))]:
            q[i] = Fraction()
    if name == "near a plane q_i = 0":
        q[0] *= power
    if name == "wide A's":
        A = [
            Fraction(round(10 ** rng.uniform(0, 6), 3)) * Fraction(10) ** int(rng.integers(-3, 4))
            for _ in range(n)
        ]
    if name == "scaled":
        speed, unit = (int(rng.integers(-most, most + 1)) for most in (28, 2))
        v, A = [x * Fraction(10) ** speed for x in v], [a * Fraction(10) ** unit for a in A]
    if name in ("separatrix", "near a separatrix") and n > 2:
        A, q = _umbilic(rng, n, q)
        q[0] = power if name == "near a separatrix" else Fraction()
    if name == "along an axis":
        q = [Fraction(int(i == 0)) for i in range(n)]
    v = v if any(_wedge(q, v)) else [q[(i + 1) % n] * (1 if i % 2 else -1) + v[i] for i in range(n)]
    return name, A, q, v


#: The classes of adversarial starts; what cannot be had for n = 2 falls back to a plain draw.
CLASSES = (
    "plain",
    "equal A's",
    "nearly equal A's",
    "near three equal A's",
    "frozen",
    "equal and frozen",
    "nearly frozen",
    "in planes q_i = 0",
    "near a plane q_i = 0",
    "along an axis",
    "wide A's",
    "scaled",
    "separatrix",
    "near a separatrix",
)


#: Attempts at A's for one start.
_HOPELESS = 1000


def _fractions(rng: np.random.Generator, n: int, low: float) -> list[Fraction]:
    return [Fraction(int(x), 1000) for x in rng.integers(int(1000 * low), 1000, n)]


def _wedge(q: list[Fraction], v: list[Fraction]) -> list[Fraction]:
    return [q[i] * v[j] - q[j] * v[i] for i in range(len(q)) for j in range(i)]


def _umbilic(
    rng: np.random.Generator, n: int, q: list[Fraction]
) -> tuple[list[Fraction], list[Fraction]]:
    """Return A and q with Σ_{j≥1} q_j²/(I_0−I_j) = 0: where q_0 = 0 and q̇_0 ≠ 0 then F_0 = 0, so
    some c_k = I_0 exactly.
    """
    attempts = 0
    while True:
        attempts += 1
        if attempts % _HOPELESS == 0:  # no A goes with coordinates as different as these
            q = _fractions(rng, n, -1.0)
        inverse = [Fraction(int(x), 1000) for x in rng.integers(300, 3000, n)]
        q = [x if x else Fraction(1, 7) for x in q]
        if len({*inverse}) < n:
            continue
        partial = sum((q[j] ** 2 / (inverse[0] - inverse[j]) for j in range(1, n - 1)), Fraction())
        last = inverse[0] + q[-1] ** 2 / partial if partial else Fraction()
        if Fraction(1, 10) < last < 10 and last not in inverse[:-1]:
            return [1 / x for x in (*inverse[:-1], last)], q
