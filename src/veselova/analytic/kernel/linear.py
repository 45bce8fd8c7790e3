"""Small linear algebra: Gauss's elimination with pivots."""

from typing import Any

from .arithmetic import jit


@jit
def eliminate(M: Any, v: Any) -> Any:
    """Bring M (n, n) to upper triangular form with v (n,) beside it; return its determinant."""
    n = v.size
    result = 1.0
    for k in range(n):
        p = k
        for i in range(k + 1, n):
            if abs(M[i, k]) > abs(M[p, k]):
                p = i
        if p != k:
            result = -result
            for j in range(n):
                M[k, j], M[p, j] = M[p, j], M[k, j]
            v[k], v[p] = v[p], v[k]
        result = result * M[k, k]
        if M[k, k] == 0:
            return result
        for i in range(k + 1, n):
            f = M[i, k] / M[k, k]
            for j in range(k + 1, n):
                M[i, j] = M[i, j] - f * M[k, j]
            v[i] = v[i] - f * v[k]
    return result


@jit
def solve(M: Any, v: Any, x: Any) -> Any:
    """Fill x of Mx = v; M and v are used up."""
    eliminate(M, v)
    n = v.size
    for k in range(n - 1, -1, -1):
        t = v[k]
        for j in range(k + 1, n):
            t = t - M[k, j] * x[j]
        x[k] = t / M[k, k]


@jit
def inverse(M: Any, work: Any, v: Any, x: Any, result: Any) -> Any:
    """Fill the inverse of M (n, n); ``work`` (n, n), v and x (n,) are room."""
    n = v.size
    for c in range(n):
        for i in range(n):
            v[i] = 1.0 if i == c else 0.0
            for j in range(n):
                work[i, j] = M[i, j]
        solve(work, v, x)
        for i in range(n):
            result[i, c] = x[i]
