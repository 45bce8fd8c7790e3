"""A short motion of a new body, t ≤ 10 at 50 times: closed form against integrators, full attitude,
in one process.

    python benchmarks/integrators.py [PROBLEMS]      heyoka needs the extra `fast`, diffrax is taken
    where it is installed

Random problems, A within a factor of 5, unit speed; processor seconds of one call, the problem new
to everybody, libraries loaded. "closed form" has its error. The others are one integration each,
projected every ten radians, without any. heyoka is called as its users call it
(`benchmarks/heyoka_peer.py`).
DOP853 is SciPy's, at the least tolerance that it takes and at the one with which it comes nearest
to an error of 1e-11; heyoka once with the compilation of the field, which it needs for every new n,
and once without. "method taylor" is the numerical engine by heyoka, with its error. "first" is the
first call of all for that n, what is compiled then included. The error is that of the frame against
the closed form with 30 digits; each figure is the median over the problems, the error the largest.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import heyoka_peer
import numpy as np

from veselova import Veselova, solve
from veselova.mechanics.flows.reduced_flow import ReducedFlow
from veselova.numeric.dop853 import Dop853
from veselova.numeric.integrator import Integrator
from veselova.numeric.solve import _integrate

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))
from draws import random_problem

TIMES = np.linspace(0.2, 10, 50)
LOOSE = 1e-12

Solver = Callable[[Veselova], np.ndarray]


def closed(problem: Veselova) -> np.ndarray:
    return solve(problem, TIMES).frame


def _integrated(flow: ReducedFlow, integrator: Integrator) -> np.ndarray:
    return flow.unpack(_integrate((flow,), TIMES / flow.time_unit, integrator)[0])["frame"]


def dop853(tolerance: float) -> Solver:
    def frames(problem: Veselova) -> np.ndarray:
        flow = problem.flow()
        return _integrated(flow, Dop853((flow,), tolerance))

    return frames


def heyoka(problem: Veselova) -> np.ndarray:
    return heyoka_peer.HeyokaPeer(problem)(TIMES)[-1]


def heyoka_compiled_anew(problem: Veselova) -> np.ndarray:
    from heyoka import llvm_state

    heyoka_peer.compile_integrator.cache_clear()
    llvm_state.clear_memcache()
    return heyoka(problem)


def taylor(problem: Veselova) -> np.ndarray:
    """Return what the package makes of heyoka: motion and neighbour, and the bound of the error."""
    return solve(problem, TIMES, "numeric", method="taylor").frame


def diffrax() -> Solver | None:
    """Return diffrax's Dopri8 on the same field, compiled at its first call; None where it is not
    installed.
    """
    try:
        import diffrax as dx
        import jax
    except ImportError:
        return None
    jax.config.update("jax_enable_x64", True)
    from jax import numpy as jnp

    def field(_: float, y: jax.Array, data: tuple[jax.Array, ...]) -> jax.Array:
        A, inverse, twice_energy = data
        n = A.size
        p, E = y[:n], y[n:-1].reshape(n, n)
        q = E[:, 0]
        weight, along = q @ (A * q), (inverse * p) @ q
        q_dot = (inverse * p - along / (q @ q) * q) / weight
        p_dot = -((p @ (inverse * p)) * (q @ q) - (p @ q) * along) / (weight * (q @ q) ** 2) * q
        E_dot = jnp.outer(q_dot, q @ E) - jnp.outer(q, q_dot @ E)
        return jnp.concatenate([p_dot, E_dot.ravel(), jnp.sqrt(twice_energy / weight)[None]])

    def frames(problem: Veselova) -> np.ndarray:
        flow = problem.flow()
        at = TIMES / flow.time_unit
        A, inverse, twice_energy = np.split(flow.parameters, [flow.n, 2 * flow.n])
        data = tuple(jnp.array(x) for x in (A, inverse, twice_energy[0]))
        found = dx.diffeqsolve(
            dx.ODETerm(field),
            dx.Dopri8(),
            0.0,
            at[-1],
            None,
            jnp.array(flow.initial),
            data,
            saveat=dx.SaveAt(ts=jnp.array(at)),
            stepsize_controller=dx.PIDController(rtol=1e-13, atol=1e-14),
            max_steps=10**5,
        )
        return flow.unpack(np.array(found.ys))["frame"]

    return frames


def main(count: int) -> None:
    solvers: dict[str, Solver | None] = {
        "closed form": closed,
        "DOP853, 2.3e-14": dop853(Dop853.tolerance),
        f"DOP853, {LOOSE:.0e}": dop853(LOOSE),
        "heyoka": heyoka,
        "heyoka, compiled anew": heyoka_compiled_anew,
        "method taylor": taylor,
        "diffrax": diffrax(),
    }
    print("| n | method | time | over the closed form | first | error |\n|---|---|---|---|---|---|")
    for n in (3, 4, 5):
        rng, fresh = np.random.default_rng(n), np.random.default_rng(n)
        exact = [solve(random_problem(rng, n, 5.0), TIMES, digits=30).frame for _ in range(count)]
        problems = [random_problem(fresh, n, 5.0) for _ in range(count)]
        ours = np.nan
        for name, solver in solvers.items():
            if solver is None:
                print(f"| {n} | {name} | not installed | | | |")
                continue
            began = time.process_time()
            solver(random_problem(np.random.default_rng(99), n, 5.0))
            first = time.process_time() - began
            seconds, errors = [], []
            for problem, truth in zip(problems, exact, strict=True):
                again = Veselova(problem.A, problem.q, problem.q_dot, problem.frame)
                began = time.process_time()
                frames = solver(again)
                seconds.append(time.process_time() - began)
                errors.append(np.max(np.abs(frames - truth)))
            middle = float(np.median(seconds))
            ours = middle if name == "closed form" else ours
            print(
                f"| {n} | {name} | {middle * 1e3:.3g} ms | {middle / ours:.2g} | {first:.2f} "
                f"s | {max(errors):.0e} |",
                flush=True,
            )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 10)
