"""The functions on the torus whose Fourier coefficients are determinants of one-variable integrals.

    RATE   Π_s φ_s, φ_s of ``rate_factor``
    k ≥ 1  (q',n_{k+1}) = Π_s φ_s · norm, φ_s = √|λ_s−c_{k+1}|, signed on the cut that c_{k+1} ends
    ODD    ± ρ/det a⁻¹ of ``rate``, for genus 2: with φ_s = √λ_s √|λ_s−c_2|, signed on the cut that
           c_2 ends, its rows are φ_s dλ/(2w) and ½ φ_s dλ/(λ(λ−c_2))

The sum over s in ρ = y_2 y_γ c_2 Σ_s λ_s'/(2λ_s(λ_s−c_2)) has λ_1−λ_2 as its denominator, as the
measure of the torus has it as a factor. A root that is signed on a cut changes sign with ψ_s → ψ_s
+ 2π: the m_s of its modes are halves of odd numbers. The root of the lower end is odd in ψ_s.
"""

from typing import Any

import numpy as np

from .arithmetic import jit, pi, sqrt
from .elliptic import roots
from .periods import set_forms_at_nodes
from .rate import rate_factor

#: Which function, beside the numbers k of components.
RATE, ODD = 0, -1


@jit
def place_of(torus: Any, which: Any) -> Any:
    """Return the place of the branch point that a function's roots belong to, −1 for none."""
    return -1 if which == RATE else torus.of_c[1 if which == ODD else which]


@jit
def set_parities(torus: Any, which: Any, halves: Any, odd: Any) -> Any:
    """Fill whether the m_s are halves of odd numbers (g,), and which rows are odd in ψ on which
    cuts (g, g); return the phase of the series in cycles: of cos 2π(m·z + turn).
    """
    g, c = halves.size, place_of(torus, which)
    for s in range(g):
        halves[s] = c in (2 * s + 1, 2 * s + 2)
        for k in range(g):
            odd[k, s] = c == 2 * s + 1
        if which == ODD:
            odd[1, s] = c != 2 * s + 1
    if which == ODD:  # one odd factor in each product, or none and two
        return -0.25 if c % 2 == 0 else 0.0
    return -0.25 if c % 2 == 1 and c > 0 else 0.0


@jit
def set_weights(torus: Any, which: Any, s: Any, weights: Any) -> Any:
    """Fill (2π/J) times the rows of the determinant at J nodes of cut s, (g, J)."""
    g, count = weights.shape
    below, forms = np.zeros(count), np.zeros((g, count))
    set_forms_at_nodes(torus.d, s, torus.cuts, below, forms)
    for i in range(count):
        if which == ODD:
            angle = pi * (2 * i + 1) / (2 * count)
            first, second = odd_factors(torus, s, angle)
            weights[0, i] = first * forms[0, i] * (2 * pi / count)
            weights[1, i] = second * forms[0, i] * (2 * pi / count)
            continue
        if which == RATE:
            factor = rate_factor(torus.points, torus.time[0], s, below[i])
        else:
            angle = pi * (2 * i + 1) / (2 * count)
            factor = root_to(torus, s, angle, torus.of_c[which])
        factor = factor * (2 * pi / count)
        for k in range(g):
            total = 0.0
            for c in range(g):
                total = total + torus.inverse[k, c] * forms[c, i]
            weights[k, i] = total * factor


@jit
def root_to(torus: Any, s: Any, psi: Any, j: Any) -> Any:
    """Return √|λ_s−b_j|, signed where b_j ends the cut."""
    low, high = roots(psi, torus.cuts[s])
    if j <= 2 * s + 1:
        return low if j == 2 * s + 1 else sqrt(torus.d[j, 2 * s + 1] + low * low)
    return high if j == 2 * s + 2 else sqrt(torus.d[2 * s + 2, j] + high * high)


@jit
def odd_factors(torus: Any, s: Any, psi: Any) -> Any:
    """Return what the form dλ/(2w) of cut s has as factors in the two rows of ODD."""
    c = torus.of_c[1]
    first = root_to(torus, s, psi, 0) * root_to(torus, s, psi, c)
    second = 1.0
    for j in range(1, 5):
        if j != c:
            second = second * root_to(torus, s, psi, j)
    # dλ is along both roots of the cut's ends; on the cut of c_2 the one of c_2 falls out. The sign
    # is that of λ−c_2 and of the products of two odd factors: c_2 is b_2 or b_3.
    return first, second if s == 0 or c == 2 else -second


@jit
def set_peaks(torus: Any, peaks: Any) -> Any:
    """Fill bounds of |(q',n_k)| for k = 2 …, and of the odd part of the rate after them."""
    g = torus.psi.size
    for k in range(peaks.size):
        if k == g - 1:
            A = torus.points[torus.of_I[g]] / torus.points[torus.of_I[0]]
            most = torus.scale[0]
            for s in range(g):
                most = most * rate_factor(
                    torus.points, torus.time[0], s, torus.d[2 * s + 1, 2 * s + 2]
                )
            spread = torus.d[torus.of_I[0], torus.of_I[g]] / torus.points[torus.of_I[0]]
            peaks[k] = abs(torus.tilt[0] * most * spread / (2 * sqrt(A)))
            continue
        c, peak = torus.of_c[k + 1], abs(torus.norms_c[k + 1])
        for s in range(g):
            far = 2 * s + 2 if c <= 2 * s + 1 else 2 * s + 1
            peak = peak * sqrt(abs(torus.d[min(c, far), max(c, far)]))
        peaks[k] = peak
