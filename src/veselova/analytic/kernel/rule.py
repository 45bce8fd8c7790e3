"""Which starts are served, and by which time map: one rule for a motion and for many."""

from typing import Any

import numpy as np

from .arithmetic import jit, largest

#: Calibrated: cycles of the fastest phase beyond which Fourier modes cost less than panels, by
#: genus; and how many times cost them one cycle more. Panels serve higher ones.
FAR, TIMES_OF_A_CYCLE = (np.inf, 1.0, 1.0, 8.0, 100.0, 1000.0), 20.0

#: Budget: largest |m_k| and number of modes, by genus.
SIDES = (0, 512, 512, 64, 40, 20)
MOST_MODES = (0, 512, 40_000, 200_000, 400_000, 400_000)

#: Calibrated: cycles of the fastest phase that panels serve, and how many panels one of them takes
#: where rounding does not keep a panel from being resolved, beside a first few.
MOST_CYCLES_ON_PANELS, PANELS_OF_A_CYCLE, FIRST_PANELS = 3000.0, 8.0, 300

#: Derived: cycles that leave no digit of a phase, whatever guard digits Ω has.
MOST_CYCLES = 1e12

#: Derived: the narrowest cut or gap whose products with others are doubles.
NARROWEST = 1e-140

#: Derived: the largest constant of Neumann's system, where the largest I is one: beyond, q' says
#: little of the directions of the frame in doubles.
LARGEST_CONSTANT = 1e30

#: Calibrated: the largest ratio of two A's; the frozen motions have some up to 7e8.
WIDEST = 1e9

#: Derived: the part of the extent from which second orders of an error count.
LARGEST_ERROR = 1e-6

#: Derived: terms of an angle series; 60 are many, and the narrowest gaps take 1250.
MOST_TERMS = 1300


@jit
def is_finite(values: Any) -> Any:
    """Return whether all numbers (n,) are finite."""
    finite = True
    for x in values:
        finite = finite and abs(x) < np.inf
    return finite


@jit
def is_wide(d: Any, points: Any, on_cuts: Any, rate: Any) -> Any:
    """Return whether the numbers of a start are finite, no cut or gap is so narrow that products of
    it with others are none, and no constant is too large.
    """
    wide = is_finite(points) and is_finite(rate)
    wide = wide and is_finite(on_cuts[0]) and is_finite(on_cuts[1])
    ends = points[0], points[points.size - 1]
    wide = wide and abs(ends[0]) < LARGEST_CONSTANT and abs(ends[1]) < LARGEST_CONSTANT
    for j in range(points.size - 1):
        wide = wide and d[j, j + 1] >= NARROWEST
    return wide


@jit
def is_proven(d: Any, points: Any, of_I: Any, on_cuts: Any, rate: Any) -> Any:
    """Return whether the estimates of errors were compared with true ones for such branch points;
    no array of the kernel is too short for them.
    """
    return is_wide(d, points, on_cuts, rate) and points[of_I[0]] * WIDEST >= 1


@jit
def is_regular(torus: Any) -> Any:
    """Return whether all numbers of a torus are finite, and its series not too long."""
    regular = is_finite(torus.psi) and is_finite(torus.z) and is_finite(torus.scale)
    regular = regular and is_finite(torus.norms_I) and is_finite(torus.norms_c)
    for k in range(torus.z.size):
        regular = regular and is_finite(torus.inverse[k])
    fastest = fastest_phase(torus)
    return regular and 0 < fastest < np.inf and largest(torus.angles.counts) <= MOST_TERMS


@jit
def fastest_phase(torus: Any) -> Any:
    """Return the cycles of the fastest phase per unit of time."""
    return largest(torus.frequencies) / abs(torus.mean[0])


@jit
def is_far(g: Any, cycles: Any, times: Any) -> Any:
    """Return whether modes serve so many times over so many cycles of the fastest phase."""
    return g < len(FAR) and cycles > FAR[g] + times / TIMES_OF_A_CYCLE


@jit
def most_panels(cycles: Any) -> Any:
    """Return how many panels so many cycles take at most."""
    return FIRST_PANELS + PANELS_OF_A_CYCLE * cycles
