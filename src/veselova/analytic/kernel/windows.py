"""Many times: states as Chebyshev series in the problem's time on windows, whatever time map serves
their nodes.
"""

from typing import Any

from .arithmetic import cos, jit, number, pi, zeros, zeros2
from .series import set_transform, tail, transform


@jit
def set_window_times(lefts: Any, lengths: Any, nodes: Any) -> Any:
    """Fill the Chebyshev points (W, N) of windows that begin at lefts (W,), increasing."""
    count = nodes.shape[1]
    for w in range(lefts.size):
        for i in range(count):
            x = cos(pi * (2 * i + 1) / (2 * count))
            nodes[w, i] = lefts[w] + lengths[w] * (1 - x) / 2


@jit
def set_window_series(values: Any, series: Any, tails: Any) -> Any:
    """Fill the series (W, N, E) of values at the nodes (W, N, E), and their last coefficients (W,)."""
    windows, count, entries = values.shape
    matrix, column, found = zeros2(count, count), zeros(count), zeros(count)
    set_transform(matrix)
    for w in range(windows):
        tails[w] = 0.0
        for e in range(entries):
            for i in range(count):
                column[count - 1 - i] = values[w, i, e]
            transform(matrix, column, found)
            tails[w] = max(tails[w], tail(found, count))
            for m in range(count):
                series[w, m, e] = found[m]


@jit
def sum_windows(series: Any, lefts: Any, lengths: Any, times: Any, first: Any, results: Any) -> Any:
    """Fill the entries (T, E) at increasing times by Clenshaw's recurrence, all entries side by
    side; window ``first`` has the first of them.
    """
    count, entries = series.shape[1], series.shape[2]
    b1, b2 = zeros(entries), zeros(entries)
    w = first
    for t in range(times.size):
        while w + 1 < lefts.size and times[t] >= lefts[w + 1]:
            w += 1
        x = 2 * (times[t] - lefts[w]) / lengths[w] - 1
        for e in range(entries):
            b1[e], b2[e] = number(0), number(0)
        for m in range(count - 1, 0, -1):
            for e in range(entries):
                value = series[w, m, e] + 2 * x * b1[e] - b2[e]
                b2[e] = b1[e]
                b1[e] = value
        for e in range(entries):
            results[t, e] = series[w, 0, e] + x * b1[e] - b2[e]
    return w
