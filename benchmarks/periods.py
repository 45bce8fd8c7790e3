"""All periods and the Riemann matrix of a curve: ours against integrals by python-flint (Arb) at 53
bits.

    python benchmarks/periods.py [PROBLEMS]      needs python-flint (extra `test`)

Random bodies, A within a factor of 5, the branch points known to both: the median time of a⁻¹B from
them, processor seconds. FLINT integrates λ^(k−1)/√|R| dλ, k = 1…g, over g cuts and g gaps after λ =
mid − r cos φ, the functions written in Python. The difference is the largest of the entries of T,
over the largest, to FLINT at 128 bits. The last lines have A's that nearly coincide.
"""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from flint import acb, arb, arb_mat, ctx

from veselova import Veselova
from veselova.analytic.closed.motion import kernel_motion
from veselova.analytic.closed.quotients import riemann_matrix
from veselova.analytic.curve.branch_points import spectrum
from veselova.analytic.curve.moving_part import moving_part

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))
from draws import random_problem


def by_flint(points: list[arb]) -> tuple[np.ndarray, float]:
    """Return T, and the seconds that it took, at the precision that is set."""
    genus = (len(points) - 1) // 2
    began = time.process_time()
    columns = [[_integral(points, j, k) for k in range(genus)] for j in range(2 * genus)]
    a = arb_mat(
        [
            [(-1) ** (genus - s) * columns[2 * s - 1][k] for s in range(1, genus + 1)]
            for k in range(genus)
        ]
    )
    B = [[arb(0)] * genus for _ in range(genus)]
    for k in range(genus):
        total = arb(0)
        for s in range(genus):
            total += (-1) ** (genus - s + 1) * columns[2 * s][k]
            B[k][s] = total
    T = a.inv() * arb_mat(B)
    seconds = time.process_time() - began
    return np.array(
        [[abs(float(T[i, j].mid())) for j in range(genus)] for i in range(genus)]
    ), seconds


def _integral(points: list[arb], j: int, k: int) -> arb:
    """Return ∮ λ^k dλ/(2√|R|) over the interval [b_j, b_{j+1}]: the integral over half a turn,
    times two, over two.
    """
    middle, radius = (points[j] + points[j + 1]) / 2, (points[j + 1] - points[j]) / 2
    others = points[:j] + points[j + 2 :]

    def integrand(phi: acb, _: bool) -> acb:
        point = middle - radius * phi.cos()
        product = acb(1)
        for other in others:
            # Each factor is positive on the interval, and its root analytic around it.
            product *= (point - other if other < middle else other - point).sqrt()
        return point**k / product

    return acb.integral(integrand, acb(0), acb(arb.pi())).real


def ours(problem: Veselova) -> tuple[np.ndarray, float]:
    """Return T, and the least seconds of three runs, those of the start among them."""
    seconds = []
    for _ in range(3):
        began = time.process_time()
        T, _, _ = riemann_matrix(kernel_motion(problem).torus)
        seconds.append(time.process_time() - began)
    return np.abs(T), min(seconds)


def row(problems: list[Veselova], label: str) -> str:
    """Return one line of the table."""
    found = []
    for problem in problems:
        points = spectrum(moving_part(problem), 20).points
        T, seconds = ours(problem)
        ctx.prec = 128
        exact = by_flint([arb(str(x)) for x in points])[0]
        ctx.prec = 53
        theirs, their_seconds = by_flint([arb(str(x)) for x in points])
        size = np.max(exact)
        errors = [np.max(np.abs(x - exact)) / size for x in (T, theirs)]
        found.append((seconds, their_seconds, *errors))
    seconds, their_seconds, error, their_error = np.array(found).T
    times = np.median([seconds, their_seconds, their_seconds / seconds], axis=1)
    return (
        f"| {label} | {times[0] * 1e3:.2f} ms | {times[1] * 1e3:.1f} ms | {times[2]:.0f} | "
        f"{np.max(error):.0e} | {np.max(their_error):.0e} |"
    )


def main(count: int) -> None:
    print("| n | ours | FLINT | ratio | error | FLINT's |\n|---|---|---|---|---|---|")
    for n in range(2, 6):
        rng = np.random.default_rng(n)
        print(row([random_problem(rng, n, 5.0) for _ in range(count)], str(n)), flush=True)
    for digits in (2, 4, 8):
        A = [3, 2, 2 - 10.0**-digits, 1]
        print(
            row([Veselova(A, [0.5] * 4, [0.5, -0.5, 0.3, -0.3])], f"4, A₂ − A₃ = 1e-{digits}"),
            flush=True,
        )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 10)
