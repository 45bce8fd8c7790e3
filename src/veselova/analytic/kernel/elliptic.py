"""The elliptic angle of one interval [b_1, b_2] of the curve, with its neighbours b_0 and b_3.

    sn²v = (b_2−b_0)(λ−b_1) / ((b_2−b_1)(λ−b_0)),   ψ = πv/K,
    k² = (b_2−b_1)(b_3−b_0) / ((b_3−b_1)(b_2−b_0)),   dλ/(2√|Π_{0…3}(λ−b_i)|) = density dψ

By Gauss's transformation, κ = (1−k')/(1+k'): it keeps ψ, so the circular functions of ψ/2 lead to
sn and cn by products and sums of positive numbers. Both keep their relative accuracy for every
modulus. An interval is an array: [b_1−b_0, b_2−b_1, density, levels, K'/K, κ_1, 1−κ_1, κ_2 …].
"""

from typing import Any

from .arithmetic import EPSILON, atan, cos, jit, log, pi, sin, sqrt

BEFORE, WIDTH, DENSITY, LEVELS, ASPECT, OPEN, SCALE = 0, 1, 2, 3, 4, 5, 6

#: Derived: levels of the transformation; moduli with k' of 1e-140 take 13.
MOST_LEVELS = 16
ROOM = SCALE + 2 * MOST_LEVELS


@jit
def set_interval(before: Any, width: Any, after: Any, first: Any, last: Any, interval: Any) -> Any:
    """Fill an interval from its widths; ``first``, ``last``: whether b_0, b_3 is infinite."""
    lower, below = (1.0, 0.0) if first else (before / (before + width), width / (before + width))
    upper, above = (1.0, 0.0) if last else (after / (after + width), width / (after + width))
    square, complement = below + above * lower, sqrt(lower * upper)  # k², k'
    factor = 0.5  # K/π
    levels = 0
    while abs(square) > EPSILON and levels < MOST_LEVELS:
        kappa = square / ((1 + complement) * (1 + complement))
        interval[SCALE + 2 * levels] = kappa
        interval[SCALE + 2 * levels + 1] = 2 * complement / (1 + complement)
        factor = factor * (1 + kappa)
        square, complement = kappa * kappa, 2 * sqrt(complement) / (1 + complement)
        levels += 1
    interval[BEFORE], interval[WIDTH] = 1.0 if first else before, width
    interval[OPEN], interval[LEVELS] = 1.0 if first else 0.0, float(levels)
    # K'/K halves with each level; at the last one K' = log 4/k, K = π/2
    aspect = log(16 / max(abs(square), 1e-300)) / (pi * 2.0**levels)
    interval[ASPECT] = aspect
    if not first:
        factor = factor / sqrt(before + width)
    if not last:
        factor = factor / sqrt(after + width)
    interval[DENSITY] = factor


@jit
def roots(psi: Any, interval: Any) -> Any:
    """Return √(λ−b_1) along sn and √(b_2−λ) along cn, signed, of period 4π in ψ."""
    s, c, d = sin(psi / 2), cos(psi / 2), 1.0
    for i in range(round(interval[LEVELS]) - 1, -1, -1):
        kappa, rest = interval[SCALE + 2 * i], interval[SCALE + 2 * i + 1]
        common = 1 / (1 + kappa * s * s)
        s, c, d = (1 + kappa) * s * common, c * d * common, (c * c + rest * s * s) * common
    before, width = interval[BEFORE], interval[WIDTH]
    if interval[OPEN] != 0:
        return sqrt(width) * s, sqrt(width) * c
    rest = before + width * c * c
    # ratios before products: the square of a width of 1e-200 is no double
    return sqrt(width * (before / rest)) * s, sqrt(width * ((width + before) / rest)) * c


@jit
def angle(below: Any, above: Any, up: Any, interval: Any) -> Any:
    """Return ψ of a point with λ−b_1 = ``below``, b_2−λ = ``above``: the same scale downwards."""
    if interval[OPEN] == 0:
        above = above * (interval[BEFORE] / (interval[BEFORE] + interval[WIDTH]))
    s, c = sqrt(below / (below + above)), sqrt(above / (below + above))
    for i in range(round(interval[LEVELS])):
        kappa, rest = interval[SCALE + 2 * i], interval[SCALE + 2 * i + 1]
        root = rest / (1 + kappa)  # k'
        d = sqrt(c * c + root * root * s * s)
        s, c = 2 * s / ((1 + kappa) * (1 + d)), 2 * c / sqrt((1 + d) * (rest + (1 + kappa) * d))
    psi = 2 * atan(s / c) if abs(s) <= abs(c) else pi - 2 * atan(c / s)
    return psi if up else -psi
