"""The rate of the problem's time on the torus, a product over the cuts.

    dt/dτ₁ ∝ √(q,Aq) = √Π λ_s/Π I_i,   ds/dτ₁ ∝ 1/(q,Aq),   and 1 where the time is τ₁ itself

With an area constant n = 3, and the first has the factor 1 − tilt (n_2,Aq)/(q,Aq). Its mean F_0 is
a quotient of determinants of one-variable integrals (the quadrature that ends the paper); the part
that is odd in n_2 has none.
"""

from typing import Any

import numpy as np

from .arithmetic import eliminate, jit, jit_making, pi, solve, sqrt
from .elliptic import roots
from .periods import set_forms_at_nodes

#: The problem's time: t, arc length s, τ₁.
PHYSICAL, ARC, NEUMANN = 0, 1, 2


@jit
def rate_factor(points: Any, time: Any, s: Any, below: Any) -> Any:
    """Return the factor of cut s at λ_s−b_{2s−1} = ``below``, at most one."""
    if time == PHYSICAL:
        return sqrt((points[2 * s + 1] + below) / points[2 * s + 2])
    if time == ARC:
        return points[2 * s + 1] / (points[2 * s + 1] + below)
    return 1.0


@jit
def even_rate(torus: Any, psi: Any) -> Any:
    """Return d(time)/dτ₁ at ψ (g,), but for its odd part."""
    result = torus.scale[0]
    if torus.time[0] != NEUMANN:
        for s in range(psi.size):
            below, _ = roots(psi[s], torus.cuts[s])
            result = result * rate_factor(torus.points, torus.time[0], s, below * below)
    return result


@jit
def tilted(torus: Any, frame: Any) -> Any:
    """Return tilt (n_2,Aq)/(q,Aq), between −1 and 1; A less its least entry in the numerator, which
    would cancel.
    """
    n = frame.shape[0]
    last = torus.of_I[n - 1]
    across, along = 0.0, 0.0
    for i in range(n):
        part = frame[i, 0] / torus.points[torus.of_I[i]]
        across = across + torus.d[torus.of_I[i], last] * part * frame[i, 1]
        along = along + part * frame[i, 0]
    return torus.tilt[0] * across / (along * torus.points[last])


@jit
def rate(torus: Any, psi: Any, frame: Any) -> Any:
    """Return d(time)/dτ₁ at ψ (g,); ``frame``: that there, where there is a tilt."""
    result = even_rate(torus, psi)
    return result if torus.tilt[0] == 0 else result * (1 - tilted(torus, frame))


@jit_making
def mean_flow(
    d: Any, points: Any, time: Any, flow: Any, cuts: Any, counts: Any, frequencies: Any
) -> Any:
    """Fill f = a⁻¹ flow (g,); return the mean over the torus of Π_s rate_factor, det ã/det a,
    where ã has the factors. Means converge with half the nodes of a series.
    """
    g = counts.size
    a, weighted, room = np.zeros((g, g)), np.zeros((g, g)), np.zeros((3, g))
    for s in range(g):
        count = counts[s] // 2 + 4
        below, forms = np.zeros(count), np.zeros((g, count))
        set_forms_at_nodes(d, s, cuts, room, below, forms)
        for i in range(count):
            factor = rate_factor(points, time, s, below[i]) * (2 * pi / count)
            for k in range(g):
                a[k, s] = a[k, s] + forms[k, i] * (2 * pi / count)
                weighted[k, s] = weighted[k, s] + forms[k, i] * factor
    ratio = eliminate(weighted, room[0])
    solve(a.copy(), flow.copy(), frequencies)
    ratio = ratio / eliminate(a, room[0])
    return 1.0 if time == NEUMANN else ratio
