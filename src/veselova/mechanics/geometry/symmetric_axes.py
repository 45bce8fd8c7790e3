"""Eigenvectors of symmetric matrices, and orthonormal columns, far beyond double precision, in
Arb's numbers.
"""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from typing import Any

import numpy as np

from veselova.mechanics.core.decimals import rational

__all__ = ["BITS", "eigenvectors", "midpoints", "orthonormal"]

#: Bits of numbers of size one.
BITS = 320

#: The midpoints of balls, exactly.
midpoints = np.frompyfunc(lambda x: x.mid(), 1, 1)


def eigenvectors(M: Any) -> tuple[list[Fraction], Any]:
    """Return the eigenvalues of a symmetric matrix (n, n), increasing, and orthonormal eigenvectors
    as columns, multiple eigenvalues included; no bounds of their errors. Numbers are Arb's, in the
    precision in force.
    """
    from flint import acb_mat

    values, vectors = acb_mat(M.tolist()).eig(right=True, algorithm="approx")
    found = [rational(value.real) for value in values]
    order = sorted(range(len(found)), key=found.__getitem__)
    columns = ([vectors[i, k].real.mid() for i in range(len(M))] for k in order)
    # FLINT's vectors of one eigenvalue are independent, and not orthogonal
    unit = orthonormal(np.array(column, dtype=object) for column in columns)
    return [found[k] for k in order], np.stack(list(unit), axis=1)


def orthonormal(columns: Iterable[Any]) -> Iterable[Any]:
    """Yield independent vectors made orthonormal in turn, each against those before it; one that
    depends on them comes out as no vector of length 1.
    """
    known: list[Any] = []
    for column in columns:
        rest = column
        for other in known:
            rest = midpoints(rest - other * (other @ rest))
        known.append(midpoints(rest / (rest @ rest).sqrt()))
        yield known[-1]
