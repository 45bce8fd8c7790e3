"""Compile the loops ahead: ``python -m veselova.analytic.compiled``, three minutes a version."""

from __future__ import annotations

import numpy as np

from veselova.analytic.compiled.compiler import compiled_loops


def main() -> None:
    """Compile all loops by using them."""
    from veselova.analytic.motion.atlas import Atlas
    from veselova.analytic.motion.ensemble import states_of_starts
    from veselova.analytic.solve import solve
    from veselova.mechanics.core.times import TimeGrid
    from veselova.mechanics.systems.neumann import NeumannSystem
    from veselova.mechanics.systems.veselova import Veselova

    rows = [[4.0, 3, 2, 1], [0.6, 0.1, 0.8, 0.2], [0.1, 1, -0.2, 0.3]]
    A, q, q_dot = np.array(rows)[:, None]
    times = TimeGrid.of([1.0])
    with compiled_loops(True):
        for _ in Atlas(A[0, :3]).states(q[:, :3], q_dot[:, :3], times):
            pass
        for n in (2, 3, 4):
            for _ in states_of_starts(A[:, :n], q[:, :n], q_dot[:, :n], times):
                pass
        for number in (float, str):  # doubles, and other exact data
            data = [list(map(number, row[:3])) for row in rows]
            solve(NeumannSystem(*data, normalize=True), [1.0, 1e6])
            for far in (1.0, 60.0, 1e6):  # panels, Fourier modes, with guard digits
                solve(Veselova(*data, normalize=True), [-far, far])


if __name__ == "__main__":
    main()
