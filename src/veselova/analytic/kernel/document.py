"""What a document of a motion asks for beside its torus: the Riemann matrix from integrals over
gaps (section 3), the periods of λ^{k−1}dλ/(2√R), the attitude at half periods, and how steep the
frame is anywhere.
"""

from typing import Any

import numpy as np

from .abel import abel
from .arithmetic import NATS, jit, jit_making, pi, sqrt
from .elliptic import ASPECT, DENSITY, ROOM, roots, set_interval
from .frame import sensitivity_room, set_frame, set_sensitivity
from .periods import EXTRA_NODES, set_forms
from .rate import even_rate


@jit_making
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
        set_interval(d[max(j - 1, 0), j], d[j, j + 1], d[j + 1, j + 2], s == 0, s > g, gap)
        # of a mean: twice the digits of a series
        count = int(NATS / (2 * pi * abs(gap[ASPECT]))) + EXTRA_NODES
        sums[1, :] = 0.0
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


@jit_making
def set_half_periods(torus: Any, room: Any, halves: Any, entries: Any, rates: Any) -> Any:
    """Fill the ν ∈ {0, 1}^g, (2^g, g), and at the angles πν, the half periods z = ν/2, where every
    λ_s is a branch point, q, v_k = (q', n_k) and (n_k)_i with i before k, (2^g, n + g + ng), k over
    c_2 … c_g, c_1; and d(time)/dτ₁ but for its odd part, (2^g,).
    """
    g = torus.z.size
    n, psi = g + 1, np.zeros(g)
    for h in range(halves.shape[0]):
        for k in range(g):
            halves[h, k] = (h >> k) & 1
            psi[k] = pi * halves[h, k]
        set_frame(torus, psi, room, room.frame, room.velocity)
        rates[h] = even_rate(torus, psi)
        for i in range(n):
            entries[h, i] = room.frame[i, 0]
            for k in range(g):
                entries[h, n + g + i * g + k] = room.frame[i, k + 1]
        for k in range(g):
            entries[h, n + k] = room.v[(k + 1) % g]


@jit
def set_phases(torus: Any, psi: Any, room: Any, z: Any) -> Any:
    """Fill the phases (N, g) at ψ (N, g)."""
    for i in range(psi.shape[0]):
        abel(torus.angles, psi[i], z[i], room.slopes)


@jit_making
def set_sensitivities(torus: Any, psi: Any, room: Any, found: Any) -> Any:
    """Fill the sensitivities of the frame and of X at ψ (N, g), (N, 2, 5) doubles."""
    of_error = sensitivity_room(torus.z.size)
    for i in range(psi.shape[0]):
        set_sensitivity(torus, psi[i], room, of_error, found[i])
