"""Compile the loops ahead: ``python -m veselova.analytic.compiled``, two minutes a
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

    rows = [[4.0, 3, 2, 1], [0.6, 0.1, 0.8, 0.2], [0.1, 1, -0.2, 0.3]]
    A, q, q_dot = np.array(rows)[:, None]
    times = TimeGrid.of([1.0])
    with compiled_loops(True):
        for _ in Atlas(A[0, :3]).states(q[:, :3], q_dot[:, :3], times):
            pass
        for n in (2, 3, 4):
            for _ in states_of_starts(A[:, :n], q[:, :n], q_dot[:, :n], times):
                pass


if __name__ == "__main__":
    main()
