"""How far is the reduced flow on T*V(r,n) from Hamiltonian in Chaplygin's time? Median of the
obstruction over random points.

    python benchmarks/obstruction.py

Three inertia operators: special, A = (1, …, n); of a mass distribution, 𝓘(E_i∧E_j) = (J_i+J_j)
E_i∧E_j, J = (1, …, n); random.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))

from paper.chaplygin_multiplier import ChaplyginMultiplier

POINTS = 200


def main() -> None:
    """Print one row for each n and r."""
    rng = np.random.default_rng(1)
    print(f"{'n':>2} {'r':>2} {'N':>3} {'special':>9} {'masses':>9} {'random':>9}")
    for n in range(3, 7):
        numbers = np.arange(1.0, n + 1)
        rows, columns = np.triu_indices(n, 1)
        axes = np.linalg.qr(rng.normal(size=(rows.size, rows.size)))[0]
        generic = axes @ np.diag(np.exp(rng.uniform(0, np.log(4), rows.size))) @ axes.T
        inertias = (
            {"special": numbers},
            {"matrix": np.diag(numbers[rows] + numbers[columns])},
            {"matrix": (generic + generic.T) / 2},
        )
        for r in range(1, n):
            multipliers = [ChaplyginMultiplier.of(inertia, n, r) for inertia in inertias]
            points = [np.linalg.qr(rng.normal(size=(n, r)))[0] for _ in range(POINTS)]
            found = [
                np.median([multiplier.obstruction(X) for X in points]) for multiplier in multipliers
            ]
            print(
                f"{n:>2} {r:>2} {multipliers[0].freedom:>3} "
                + " ".join(f"{value:9.2g}" for value in found)
            )


if __name__ == "__main__":
    main()
