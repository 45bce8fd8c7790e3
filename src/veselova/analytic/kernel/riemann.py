"""Periods that motions do not ask for: the Riemann matrix, from integrals over gaps (section 3),
and the periods of λ^{k−1}dλ/(2√R).
"""

from typing import Any

import numpy as np

from .arithmetic import NATS, jit, pi, sqrt
from .elliptic import ASPECT, DENSITY, ROOM, roots, set_interval
from .periods import EXTRA_NODES, set_forms


@jit
def set_riemann_matrix(torus: Any, T: Any) -> Any:
    """Fill T = a⁻¹B, B_ks = Σ_{gaps j ≤ s} (−1)^{g−j+1} ∮ p_k dλ/(2√|R|), made symmetric, (g, g);
    the Riemann matrix is iT.

    Return max |T − Tᵀ|/max |T| before that, a check of all periods at once, and max_k Σ|a⁻¹||forms|
    over all gaps, what T is a difference of.
    """
    g = T.shape[0]
    d, inverse = torus.d, torus.inverse
    gap, factors, forms, sums = np.zeros(ROOM), np.zeros((2, g)), np.zeros(g), np.zeros((2, g))
    raw, sizes = np.zeros((g, g)), np.zeros(g)
    for s in range(g):
        j = 2 * s
        set_interval(d[max(j - 1, 0), j], d[j, j + 1], d[j + 1, j + 2], s == 0, False, gap)
        # of a mean: twice the digits of a series
        count = int(NATS / (2 * pi * abs(gap[ASPECT]))) + EXTRA_NODES
        for k in range(g):
            sums[1, k] = 0.0
        for i in range(count):
            low, high = roots(pi * (2 * i + 1) / (2 * count), gap)
            set_forms(d, j, low * low, high * high, gap, factors, forms)
            for k in range(g):
                form = forms[k] * (2 * pi / count)
                sums[0, k] = sums[0, k] + (form if (g - s) % 2 == 1 else -form)
                sums[1, k] = sums[1, k] + abs(form)
        for k in range(g):
            for c in range(g):
                raw[k, s] = raw[k, s] + inverse[k, c] * sums[0, c]
                sizes[k] = sizes[k] + abs(inverse[k, c]) * sums[1, c]
    largest, apart, cancelling = 0.0, 0.0, 0.0
    for k in range(g):
        cancelling = max(cancelling, abs(sizes[k]))
        for s in range(g):
            largest, apart = max(largest, abs(raw[k, s])), max(apart, abs(raw[k, s] - raw[s, k]))
            T[k, s] = (raw[k, s] + raw[s, k]) / 2
    return apart / largest, cancelling


@jit
def set_monomial_periods(torus: Any, periods: Any) -> Any:
    """Fill a_ks = (−1)^{g−s−1} ∮ λ^{k−1}dλ/(2√|R|) over cut s, (g, g), means over its angle."""
    g = periods.shape[0]
    for s in range(g):
        j, count = 2 * s + 1, torus.angles.counts[s]
        for i in range(count):
            low, high = roots(pi * (2 * i + 1) / (2 * count), torus.cuts[s])
            value = torus.cuts[s, DENSITY] * (2 * pi / count)
            for b in range(2 * g + 1):
                if b < j - 1:
                    value = value / sqrt(torus.d[b, j] + low * low)
                elif b > j + 2:
                    value = value / sqrt(torus.d[j + 1, b] + high * high)
            for k in range(g):
                periods[k, s] = periods[k, s] + (value if (g - s) % 2 == 1 else -value)
                value = value * (torus.points[j] + low * low)
