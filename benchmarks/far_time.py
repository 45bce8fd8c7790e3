"""What does t = 10⁶ cost in closed form, how accurate is it, and what would integrating there cost?

    python benchmarks/far_time.py      needs the extra `fast`

Per n: set-up (curve, periods, modes of the time map, 30-digit frequencies), one attitude at t = 10⁶
after it (median of 9), heyoka's least time of five to integrate to t = 1000, called as its users
call it, in the same run and scaled to 10⁶ (its cost is proportional to time), their ratio; then the
reported error, and the conditioning floor ε|ω|t.
"""

from __future__ import annotations

import os
import statistics
import time

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from heyoka_peer import HeyokaPeer

import veselova as vs

FAR = 1e6


def main() -> None:
    print(
        "n    modes   set-up s   one attitude ms   integrating s (scaled)      ratio      "
        "error    floor"
    )
    for n in (2, 3, 4, 5, 6):
        rng = np.random.default_rng(n)
        problem = vs.Veselova(
            np.exp(rng.uniform(0, np.log(5), n)),
            rng.normal(size=n),
            rng.normal(size=n),
            normalize=True,
        )
        speed = float(np.linalg.norm(problem.q_dot))
        times = np.array([FAR / speed])
        began = time.process_time()
        trajectory = vs.solve(problem, times)
        setup = time.process_time() - began
        single = []
        for i in range(9):
            began = time.process_time()
            trajectory.at(times * (1 - 1e-7 * i))
            single.append(time.process_time() - began)
        one = statistics.median(single)

        peer, near = HeyokaPeer(problem), np.array([1000 / speed])
        peer(near / 100)
        integration = []
        for _ in range(5):
            began = time.process_time()
            peer(near)
            integration.append(time.process_time() - began)
        integrating = min(integration) * FAR / 1000

        floor = problem.conditioning_floor(times)[0]
        size = trajectory.provenance.details["time_map_size"]
        print(
            f"{n}   {size:6d}   {setup:8.3f}   {one * 1e3:15.2f}   {integrating:22.1f}   "
            f"{integrating / one:8.1e}"
            f"   {trajectory.error[0]:8.1e}   {floor:6.1e}",
            flush=True,
        )


if __name__ == "__main__":
    main()
