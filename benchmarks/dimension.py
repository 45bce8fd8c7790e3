"""How cost and error grow with the dimension: closed form at n = 8 … 256, one core, and what heyoka
says where it can follow.

    python benchmarks/dimension.py [largest n]      default 256; needs the extra `fast`

A within a factor of 3, unit speed, natural frame; 1000 times up to t = 20 (100 up to t = 5 beyond n
= 64). Truth is Neumann's equations for (q, q') alone, by heyoka in Neumann time, compared at the τ₁
of the closed form; its own error is about 1e-13 here. Prints seconds of set-up and all, the largest
difference of q, the largest reported error, the largest defect of EᵀE = 1, and memory.
"""

from __future__ import annotations

import os
import resource
import sys
import time
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

import veselova as vs
from veselova.analytic.closed.motion import kernel_motion
from veselova.mechanics.geometry.integrals_of_motion import neumann_velocity


def neumann(A: Any, q: Any, v: Any, tau1: Any) -> Any:
    """Return q at Neumann times by heyoka: q'' = −A⁻¹q + [(A⁻¹q,q) − (q',q')] q."""
    import heyoka as hy

    n = A.size
    x, y = (list(hy.make_vars(*[f"{name}{i}" for i in range(n)])) for name in ("x", "y"))
    inverse = 1 / A
    norm = hy.sum([a * a for a in x])
    multiplier = (
        hy.sum([c * a * a for c, a in zip(inverse, x, strict=True)]) - hy.sum([b * b for b in y])
    ) / norm
    equations = [(a, b) for a, b in zip(x, y, strict=True)]
    equations += [(b, (multiplier - c) * a) for a, b, c in zip(x, y, inverse, strict=True)]
    integrator = hy.taylor_adaptive(equations, [*q, *v], compact_mode=True)
    # the first time is t = 0
    return integrator.propagate_grid(np.concatenate([[0.0], tau1[1:]]))[-1][:, :n]


def main(largest: int) -> None:
    print(
        "n     times   set-up s   all s   difference of q   reported error   defect of frame   MB"
    )
    for n in (8, 16, 32, 64, 128, 256, 512, 1024):
        if n > largest:
            return
        rng = np.random.default_rng(n)
        A, q, q_dot = 1 / rng.uniform(1 / 3, 1, n), rng.normal(size=n), rng.normal(size=n)
        problem = vs.Veselova(
            A, q / np.linalg.norm(q), q_dot / np.linalg.norm(q_dot), normalize=True
        )
        times = np.linspace(0, 20, 1000) if n <= 64 else np.linspace(0, 5, 100)
        began = time.perf_counter()
        kernel_motion(problem)
        middle = time.perf_counter()
        found = vs.solve(problem, times)
        seconds = time.perf_counter() - middle
        truth = neumann(A, problem.q, neumann_velocity(A, problem.q, problem.q_dot), found.tau1)
        defect = np.max(np.abs(np.swapaxes(found.frame, 1, 2) @ found.frame - np.eye(n)))
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        figures = (
            f"{np.max(np.abs(found.q - truth)):15.1e}   {np.max(found.error):14.1e}   "
            f"{defect:15.1e}   {memory:.0f}"
        )
        print(
            f"{n:4d}   {times.size:5d}   {middle - began:8.2f}   {seconds:5.1f}   {figures}",
            flush=True,
        )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 256)
