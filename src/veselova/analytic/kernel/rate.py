"""The rate of the problem's time on the torus, a product over the cuts.

    dt/dτ₁ ∝ √(q,Aq) = √Π λ_s/Π I_i,   ds/dτ₁ ∝ 1/(q,Aq),   and 1 where the time is τ₁ itself

Its mean F_0 is a quotient of determinants of one-variable integrals (the quadrature that ends the
paper).
"""

from typing import Any

from .arithmetic import jit, number, pi, sqrt, zeros, zeros2
from .elliptic import roots
from .linear import eliminate, solve
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
    return number(1)


@jit
def rate(torus: Any, psi: Any) -> Any:
    """Return d(time)/dτ₁ at ψ (g,)."""
    result = torus.scale[0]
    if torus.time[0] != NEUMANN:
        for s in range(psi.size):
            below, _ = roots(psi[s], torus.cuts[s])
            result = result * rate_factor(torus.points, torus.time[0], s, below * below)
    return result


@jit
def set_weights(torus: Any, s: Any, weights: Any) -> Any:
    """Fill (2π/J) a⁻¹ times the forms times the rate's factor at J nodes of cut s, (g, J)."""
    g, count = weights.shape
    below, forms = zeros(count), zeros2(g, count)
    set_forms_at_nodes(torus.d, s, torus.cuts, below, forms)
    for i in range(count):
        factor = rate_factor(torus.points, torus.time[0], s, below[i]) * (2 * pi / count)
        for k in range(g):
            total = 0 * factor
            for c in range(g):
                total = total + torus.inverse[k, c] * forms[c, i]
            weights[k, i] = total * factor


@jit
def mean_flow(d: Any, points: Any, time: Any, cuts: Any, counts: Any, frequencies: Any) -> Any:
    """Fill f = a⁻¹e_g (g,); return the mean over the torus of Π_s rate_factor, det ã/det a, where ã
    has the factors. Means converge with half the nodes of a series.
    """
    g = counts.size
    a, weighted, unit = zeros2(g, g), zeros2(g, g), zeros(g)
    for s in range(g):
        count = counts[s] // 2 + 4
        below, forms = zeros(count), zeros2(g, count)
        set_forms_at_nodes(d, s, cuts, below, forms)
        for i in range(count):
            factor = rate_factor(points, time, s, below[i]) * (2 * pi / count)
            for k in range(g):
                a[k, s] = a[k, s] + forms[k, i] * (2 * pi / count)
                weighted[k, s] = weighted[k, s] + forms[k, i] * factor
    ratio = eliminate(weighted, unit)
    unit[g - 1] = number(1)
    work = a.copy()
    solve(work, unit, frequencies)
    for k in range(g):
        unit[k] = number(0)
    ratio = ratio / eliminate(a, unit)
    return number(1) if time == NEUMANN else ratio
