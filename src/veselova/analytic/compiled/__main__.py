"""Compile the loops ahead: ``python -m veselova.analytic.compiled``, a minute a
version.
"""

from __future__ import annotations

import numpy as np

from veselova.analytic.compiled.compiler import compiled_loops


def main() -> None:
    """Compile all loops by using them."""
    from veselova.analytic.motion.atlas import Atlas
    from veselova.analytic.motion.ensemble import states_of_starts
    from veselova.mechanics.core.times import TimeGrid

    A, q, q_dot = np.array([[3.0, 2, 1], [0.6, 0.1, 0.8], [0.1, 1, -0.2]])[:, None]
    times = TimeGrid.of([1.0])
    with compiled_loops(True):
        for _ in Atlas(A[0]).states(q, q_dot, times):
            pass
        for n in (2, 3):
            for _ in states_of_starts(A[:, :n], q[:, :n], q_dot[:, :n], times):
                pass


if __name__ == "__main__":
    main()
