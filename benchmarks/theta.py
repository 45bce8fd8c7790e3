"""One theta function at one point: ours against python-flint (Arb) at 53 bits, scattered and along
an orbit.

    python benchmarks/theta.py [TIMES]      needs python-flint (extra `test`); default 10⁶ times

Scattered: random phases of random Riemann matrices, one characteristic. Along an orbit: the Riemann
matrix, phases and frequencies of a random body with n = g+1, random times in [0, 1000], in the
windows in which the closed form takes many times. FLINT's binding gives all 4^g characteristics at
once: "of all" is such a call, which is what one value costs there, and "per value" that over 4^g.
Both ratios are printed. The error is the largest difference to FLINT at 128 bits, over the largest
value of the function; "of the orbit" is what one rounding of the frequencies makes of it at t =
1000, which no evaluation can better.
"""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from flint import acb, acb_mat, arb, ctx

from veselova.analytic.closed.motion import kernel_motion
from veselova.analytic.closed.quotients import riemann_matrix
from veselova.analytic.curve.hyperelliptic import characteristics
from veselova.analytic.theta.siegel_theta import SiegelTheta
from veselova.analytic.time_map.modes import LinearFlow

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))
from draws import random_problem, random_riemann_matrix

SCATTERED = 2000
SPAN = 1000.0


def our_values(theta: SiegelTheta, z: np.ndarray, characteristic: np.ndarray) -> np.ndarray:
    """Return the values of one characteristic at points (N, g), (N,)."""
    mantissas, exponents, _ = theta.values(z.astype(complex), characteristic[None], 0, False)
    return (mantissas * np.exp(exponents))[:, 0].real


def flint_values(
    T: np.ndarray, points: list[list[arb]], characteristic: np.ndarray, bits: int
) -> tuple[np.ndarray, float]:
    """Return the values of one characteristic at points, and the processor seconds of one call."""
    ctx.prec = bits
    tau = acb_mat([[acb(0, float(x)) for x in row] for row in T])
    index = int("".join(map(str, (2 * characteristic).astype(int).flat)), 2)
    columns = [acb_mat([[acb(x)] for x in point]) for point in points]
    began = time.process_time()
    tables = [tau.theta(column) for column in columns]
    each = (time.process_time() - began) / len(points)
    ctx.prec = 53
    return np.array([complex(table[0, index]).real for table in tables]), each


def row(
    genus: int, T: np.ndarray, z: list[list[arb]], ours: np.ndarray, each: float, size: float
) -> str:
    """Return one line of a table."""
    characteristic = characteristics(genus)[2]
    _, theirs = flint_values(T, z, characteristic, 53)
    error = np.max(np.abs(flint_values(T, z, characteristic, 128)[0] - ours)) / size
    ratios = f"{theirs / each:.0f} | {theirs / 4**genus / each:.0f}"
    return f"| {genus} | {each * 1e6:.3f} µs | {theirs * 1e6:.0f} µs | {ratios} | {error:.1e} |"


def scattered(genus: int) -> str:
    """Return the line of random phases."""
    rng = np.random.default_rng(genus)
    T, z = random_riemann_matrix(rng, genus), rng.uniform(0, 1, (SCATTERED, genus))
    theta, characteristic = (
        SiegelTheta(np.asarray(1j * T)),
        characteristics(genus)[2],
    )
    our_values(theta, z[:10], characteristic)
    began = time.process_time()
    ours = our_values(theta, z, characteristic)
    each = (time.process_time() - began) / SCATTERED
    count = 40 if genus < 4 else 5
    points = [[arb(float(x)) for x in point] for point in z[:count]]
    return row(genus, T, points, ours[:count], each, float(np.max(np.abs(ours))))


def along_orbit(genus: int, count: int) -> str:
    """Return the line of an orbit."""
    motion = kernel_motion(random_problem(np.random.default_rng(genus), genus + 1, 5.0))
    T, torus = riemann_matrix(motion.torus)[0], motion.torus
    start, rates = torus.z, torus.frequencies / torus.mean
    theta, characteristic = (
        SiegelTheta(np.asarray(1j * T)),
        characteristics(genus)[2],
    )
    times = np.unique(np.random.default_rng(1).uniform(0, SPAN, count))
    flow = LinearFlow(start, rates)
    began = time.process_time()
    ours = np.concatenate(
        [
            our_values(theta, flow.phases(times[k : k + 32768]), characteristic)
            for k in range(0, times.size, 32768)
        ]
    )
    each = (time.process_time() - began) / times.size
    chosen = np.linspace(0, times.size - 1, 40 if genus < 4 else 5).astype(int)
    ctx.prec = 128
    points = [
        [
            arb(float(z)) + arb(float(f)) * arb(float(times[i]))
            for z, f in zip(start, rates, strict=True)
        ]
        for i in chosen
    ]
    size = float(np.max(np.abs(ours)))
    slope = np.max(np.abs(np.gradient(ours[:2000], times[:2000]))) / size
    return (
        row(genus, T, points, ours[chosen], each, size)
        + f" {slope * SPAN * np.finfo(float).eps:.1e} |"
    )


def main(count: int) -> None:
    print(
        "Scattered\n\n| g | ours | FLINT, of all | ratio | ratio per value | error "
        "|\n|---|---|---|---|---|---|"
    )
    for genus in range(1, 5):
        print(scattered(genus), flush=True)
    print(
        f"\nAlong an orbit, {count} times\n\n| g | ours | FLINT, of all | ratio | ratio per "
        "value | error | of the orbit |"
    )
    print("|---|---|---|---|---|---|---|")
    for genus in range(1, 5):
        print(along_orbit(genus, count), flush=True)


if __name__ == "__main__":
    main(int(float(sys.argv[1])) if len(sys.argv) > 1 else 1_000_000)
