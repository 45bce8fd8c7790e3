"""How fast Chebyshev series fall: the terms that one of many digits will have, and whether those
taken were enough.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import DOUBLE, LAST_COEFFICIENTS, Values

__all__ = ["MORE", "SAMPLE", "are_resolved", "estimate_terms"]

Array = NDArray[np.float64]

#: Method: nodes of a series in double precision that shows how fast one falls, and the digits down
#: to which it does.
SAMPLE = 64
_SAMPLE_DIGITS = 11

#: Calibrated: how much larger than the precision the last coefficients of a series may be (they are
#: rounding there), and how many times as many nodes are taken where they are larger.
_NEARLY = 1e3
MORE = 1.25


def estimate_terms(values: Array, digits: int) -> int:
    """Return the terms of Chebyshev series of so many digits, from values (…, S) at S nodes in
    double precision.

    A falling bound, the largest coefficient from each on, is read off where it is still above
    rounding.
    """
    count = values.shape[-1]
    series = np.abs(DOUBLE.cosine_series(values.reshape(-1, count))) / np.max(np.abs(values))
    falling = np.maximum.accumulate(np.max(series, axis=0)[::-1])[::-1]
    seen = int(np.count_nonzero(falling > 10.0**-_SAMPLE_DIGITS))
    per_digit = seen / max(1.0, -math.log10(falling[min(seen, count - 1)]))
    return math.ceil(per_digit * digits) + LAST_COEFFICIENTS


def are_resolved(series: Values, noise: Values, size: Values, arithmetic: Any) -> bool:
    """Return whether the last coefficients of series (K, N) are rounding: of values that are open
    by noise, of a size, (K,).
    """
    last = np.sum(arithmetic.upper_bound(series[:, -LAST_COEFFICIENTS:]), axis=1)
    return bool(np.all(last <= _NEARLY * (noise + arithmetic.epsilon * size)))
