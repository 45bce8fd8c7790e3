"""One theta value: ours against python-flint (Arb) at 53 bits, at random phases of random Riemann matrices.

    python benchmarks/theta.py      needs python-flint (extra `test`)

Prints per genus the time of one value at one point (ours: 2000 points, one characteristic and the denominator; FLINT: all
characteristics at once, as its binding gives them, divided by their number), the ratio, and the largest difference.
"""

from __future__ import annotations

import time

import numpy as np
from flint import acb, acb_mat

from veselova.analytic.characteristic import Characteristic
from veselova.analytic.theta import Theta

POINTS = 2000


def main() -> None:
    print("g    ours µs   FLINT µs (of all)   ratio   FLINT µs (per value)   largest difference")
    for genus in range(1, 5):
        rng = np.random.default_rng(genus)
        basis = np.linalg.qr(rng.normal(size=(genus, genus)))[0]
        T = basis @ np.diag(np.exp(rng.uniform(np.log(0.3), np.log(3), genus))) @ basis.T
        T = (T + T.T) / 2
        z = rng.uniform(0, 1, (POINTS, genus))
        theta, characteristic = Theta(T), Characteristic.of_branch_point(2, genus)
        theta.values(z[:10], [characteristic])
        began = time.perf_counter()
        ours = theta.values(z, [characteristic])[:, 0]
        each = (time.perf_counter() - began) / POINTS
        tau = acb_mat([[acb(0, float(x)) for x in row] for row in T])
        index = int("".join(map(str, [*characteristic.epsilon, *characteristic.delta])), 2)
        count, worst = (40 if genus < 4 else 5), 0.0
        began = time.perf_counter()
        values = [tau.theta(acb_mat([[acb(float(x))] for x in z[i]])) for i in range(count)]
        theirs = (time.perf_counter() - began) / count
        for i, value in enumerate(values):
            worst = max(worst, abs(complex(value[0, index]).real - ours[i]))
        row = f"{genus}   {each * 1e6:8.2f}   {theirs * 1e6:17.0f}   {theirs / each:5.0f}"
        print(f"{row}   {theirs / 4**genus * 1e6:20.1f}   {worst:18.1e}")


if __name__ == "__main__":
    main()
