"""The curve w² = −λΠ(λ−I_i)Π(λ−c_k), its nodal differentials, periods and angle series (section 3).

Branch points b_0 = 0 < b_1 … < b_2g come as differences d[i, j] = b_j − b_i, each rounded once.
On cut s = 0…g−1, [b_{2s+1}, b_{2s+2}], the differentials are cosine series in ψ, and

    a_ks = (−1)^{g−s−1} ∮ p_k dλ/(2√|R|),   G_s(ψ) = a⁻¹∫ = e_s ψ/2π + Σ_m g_sm sin(mψ)/m,
    f = a⁻¹e_g
"""

from typing import Any

import numpy as np

from .arithmetic import NATS, inverse, jit, jit_making, pi, sqrt
from .elliptic import ASPECT, DENSITY, roots, set_interval
from .series import set_transform, transform

#: Calibrated: nodes of a cut beyond those that its modulus asks for.
EXTRA_NODES = 6


@jit
def set_cuts(d: Any, cuts: Any, counts: Any) -> Any:
    """Fill the intervals of the cuts, and how many nodes each needs: coefficients fall like
    e^(−πmK'/K).
    """
    g = counts.size
    for s in range(g):
        j = 2 * s + 1
        first, last = s < 0, s == g - 1  # no literals: ``set_interval`` is compiled once
        after = d[j + 1, 2 * g if last else j + 2]
        set_interval(d[j - 1, j], d[j, j + 1], after, first, last, cuts[s])
        counts[s] = int(NATS / (pi * abs(cuts[s, ASPECT]))) + EXTRA_NODES


@jit
def set_forms(
    d: Any, j: Any, below: Any, above: Any, interval: Any, factors: Any, forms: Any
) -> Any:
    """Fill p_k dλ/(2√|R|dψ), k = 1…g, (g,) or (g, N), on [b_j, b_{j+1}] at λ−b_j =
    ``below``, b_{j+1}−λ = ``above``.

    p_g = Π(λ−ζ_l) over the midpoints ζ_l of the inner gaps, p_k = p_g/(λ−ζ_k) for k < g. Each λ−ζ_l
    goes with the roots of its own gap's ends, so that no product is large or small. Room:
    ``factors`` (2, g).
    """
    g = forms.shape[0]
    measure = interval[DENSITY]
    for i in (0, 1, 2 * g):
        if i < j - 1:
            measure = measure / sqrt(d[i, j] + below)
        elif i > j + 2:
            measure = measure / sqrt(d[j + 1, i] + above)
    for l in range(1, g):
        a, b = 2 * l, 2 * l + 1
        root = 1.0
        for i in (a, b):
            if i < j - 1:
                root = root * sqrt(d[i, j] + below)
            elif i > j + 2:
                root = root * sqrt(d[j + 1, i] + above)
        if b <= j:
            distance = below + (d[a, j] + d[b, j]) / 2
        elif a > j:
            distance = -(above + (d[j + 1, a] + d[j + 1, b]) / 2)
        else:
            distance = (below - above) / 2
        factors[0, l - 1], factors[1, l - 1] = distance / root, 1 / root
    for k in range(g - 1):
        forms[k] = measure * factors[1, k]
        measure = measure * factors[0, k]
    forms[g - 1] = measure
    beyond = factors[0, g - 2]  # of l > k; for g = 1 none is needed
    for k in range(g - 3, -1, -1):
        forms[k] = forms[k] * beyond
        beyond = beyond * factors[0, k]


@jit
def set_forms_at_nodes(d: Any, s: Any, cuts: Any, factors: Any, below: Any, forms: Any) -> Any:
    """Fill λ−b_{2s+1} (N,) and the differentials on cut s, signs included, (g, N), at
    ψ_j = π(2j+1)/2N. Room: factors (3, g).
    """
    g, n, at = cuts.shape[0], below.size, factors[2]
    for i in range(n):
        low, high = roots(pi * (2 * i + 1) / (2 * n), cuts[s])
        below[i] = low * low
        set_forms(d, 2 * s + 1, low * low, high * high, cuts[s], factors, at)
        for k in range(g):
            forms[k, i] = at[k] if (g - s) % 2 == 1 else -at[k]


@jit_making
def set_angle_series(
    d: Any, cuts: Any, counts: Any, inverse_periods: Any, series: Any, cancellation: Any
) -> Any:
    """Fill a⁻¹, the coefficients g_ksm (g, g, N) of ∂z_k/∂ψ_s, and how much cancels in each z_k."""
    g, most = counts.size, series.shape[2]
    raw, room = np.zeros((g, g, most)), np.zeros((3, g))
    a, work = np.zeros((g, g)), np.zeros((g, g))
    for s in range(g):
        n = counts[s]
        below, forms, matrix = np.zeros(n), np.zeros((g, n)), np.zeros((n, n))
        set_forms_at_nodes(d, s, cuts, room, below, forms)
        set_transform(matrix)
        for k in range(g):
            transform(matrix, forms[k], raw[k, s])
            a[k, s] = 2 * pi * raw[k, s, 0]
    inverse(a, work, room[0], room[1], inverse_periods)
    for k in range(g):
        total = 0.0
        for s in range(g):
            for m in range(counts[s]):
                value = 0.0
                for c in range(g):
                    value = value + inverse_periods[k, c] * raw[c, s, m]
                    total += abs(inverse_periods[k, c]) * abs(raw[c, s, m])
                series[k, s, m] = value
        cancellation[k] = max(1.0, total)
