"""One motion's torus: what does not depend on times, in one tuple of arrays; whether doubles hold
it, and which time map serves.
"""

from typing import Any, NamedTuple

import numpy as np

from .abel import ROUGH, AngleSeries, abel
from .arithmetic import is_finite, jit, jit_making, largest
from .elliptic import ROOM, angle
from .frame import set_norms
from .periods import set_angle_series, set_cuts
from .rate import mean_flow, rate_factor

#: Calibrated: cycles of the fastest phase beyond which Fourier modes cost less than panels, by
#: genus; and how many times cost them one cycle more. Panels serve higher ones.
FAR, TIMES_OF_A_CYCLE = (np.inf, 1.0, 1.0, 8.0, 100.0, 1000.0), 20.0

#: Derived: cycles that leave no digit of a phase, whatever guard digits Ω has.
MOST_CYCLES = 1e12

#: Derived: terms of an angle series; 60 are many, and the narrowest gaps take 1250.
MOST_TERMS = 1300


class Torus(NamedTuple):
    """The input of a start, and what is found from it.

    - d: (2g+1, 2g+1) b_j − b_i; points: (2g+1,) b_j
    - of_I: (n,) place of I_i among the b; of_c: (g,) that of c_k
    - time: (1,) PHYSICAL, ARC or NEUMANN
    - cuts: (g, ROOM) the intervals of ``elliptic``; angles: the series of the Abel map
    - inverse: (g, g) a⁻¹; frequencies: (g,) f = a⁻¹ du/dτ₁
    - norms_I: (n,) of ``frame`` with the signs of q; norms_c: (g,)
    - scale: (1,) d(time)/dτ₁ = scale·Π rate_factor; mean: (1,) F_0
    - tilt: (1,) of ``rate``, zero without an area constant
    - psi, z: (g,) the start's angles and phases
    - cancellation: (g,) doubles, Σ|a⁻¹||series|, by which roundings of z and f are multiplied
    """

    d: Any
    points: Any
    of_I: Any
    of_c: Any
    time: Any
    cuts: Any
    angles: Any
    inverse: Any
    frequencies: Any
    norms_I: Any
    norms_c: Any
    scale: Any
    mean: Any
    tilt: Any
    psi: Any
    z: Any
    cancellation: Any


class Room(NamedTuple):
    """Work arrays of one evaluation."""

    z: Any
    slopes: Any
    step: Any
    target: Any
    roots: Any
    between: Any
    lines: Any
    rows: Any
    q: Any
    v: Any
    frame: Any
    velocity: Any
    angles: Any
    work: Any


@jit_making
def make_room(g: Any) -> Any:
    """Return work arrays for a torus of genus g."""
    n, vectors, squares = g + 1, np.zeros((5, g)), np.zeros((4, g, g))
    of_map = vectors[0], squares[0], vectors[1], vectors[2], np.zeros((g, 2 * g + 1)), squares[1]
    of_frame = np.zeros((g, n)), squares[2], np.zeros(n), vectors[3], np.zeros((n, n)), np.zeros(n)
    return Room(*of_map, *of_frame, vectors[4], squares[3])


@jit_making
def make_torus(start: Any, time: Any, flow: Any) -> Any:
    """Return the torus of a ``Start``; time: of ``Torus``; flow: (g,) du/dτ₁."""
    d, points, of_I, of_c, signs, on_cuts, up, rate = start
    g = up.size
    cuts, counts = np.zeros((g, ROOM)), np.zeros(g, np.int64)
    set_cuts(d, cuts, counts)
    most, few = 0, np.zeros(g, np.int64)
    for s in range(g):
        most, few[s] = max(most, counts[s]), (counts[s] + ROUGH - 1) // ROUGH
    series, sines, inverse = np.zeros((g, g, most)), np.zeros((g, g, most)), np.zeros((g, g))
    angles = AngleSeries(counts, few, series, sines, np.zeros((2, most)))
    cancellation = np.ones(g)
    set_angle_series(d, cuts, counts, inverse, series, cancellation)
    for k in range(g):
        for s in range(g):
            for m in range(1, counts[s]):
                sines[k, s, m] = series[k, s, m] / m
    norms_I, norms_c, psi, z = np.zeros(g + 1), np.zeros(g), np.zeros(g), np.zeros(g)
    set_norms(d, of_I, norms_I)
    set_norms(d, of_c, norms_c)
    for i in range(g + 1):
        norms_I[i] = norms_I[i] * signs[i]
    scale, mean, frequencies = np.zeros(1), np.zeros(1), np.zeros(g)
    scale[0] = rate[0]
    for s in range(g):
        psi[s] = angle(on_cuts[0, s], on_cuts[1, s], up[s], cuts[s])
        scale[0] = scale[0] / rate_factor(points, time[0], s, on_cuts[0, s])
    mean[0] = scale[0] * mean_flow(d, points, time[0], flow, cuts, counts, frequencies)
    abel(angles, psi, z, np.zeros((g, g)))
    curve = time, cuts, angles, inverse, frequencies, norms_I, norms_c
    rest = scale, mean, np.zeros(1), psi, z, cancellation
    return Torus(d, points, of_I, of_c, *curve, *rest)


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
