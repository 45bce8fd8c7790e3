"""The nodal differentials along straight paths in the plane of μ, from a branch point or from
infinity, as functions of a local parameter: complex doubles, or complex balls.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from veselova.analytic.arithmetic.arithmetic import Arithmetic

__all__ = ["FormsAtEnd", "FormsAtInfinity"]


@dataclass(frozen=True)
class _Forms:
    """The arithmetic, and the other branch points, and the midpoints of the inner gaps, counted
    from where the path begins, or from c.
    """

    arithmetic: Arithmetic
    below: Sequence[Any]
    above: Sequence[Any]
    zeros: Sequence[Any]

    def _zeros_but(self, k: int) -> list[Any]:
        """Return the zeros of the form k, from 0: the last one has all."""
        return [zero for l, zero in enumerate(self.zeros) if l != k]


class FormsAtEnd(_Forms):
    """dμ/(2v) p_k = p_k dx/(v/x), x = √(μ−β_j): v² = −x² Π_{<}(μ−β) Π_{>}(μ−β)."""

    def __call__(self, k: int, x: Any, analytic: bool) -> Any:
        """Return the form k at x; in balls not finite where a root is not ``analytic``."""
        square = x * x
        factors = [square - zero for zero in self._zeros_but(k)]
        return math.prod(factors, start=1 / self._roots(square, analytic))

    def _roots(self, square: Any, analytic: bool) -> Any:
        """Return v/x: each root below stays away from its branch line."""
        root = self.arithmetic.complex_root
        roots = [root(square - b, analytic) for b in self.below]
        roots += [root(b - square, analytic) for b in self.above]
        product = math.prod(roots, start=square**0)
        return product * self.arithmetic.i if len(self.above) % 2 == 0 else product

    def direction(self, x: Any) -> complex:
        """Return v/|v|."""
        return _direction(x * self._roots(x * x, False))


class FormsAtInfinity(_Forms):
    """The same in t = (μ−c)^{−1/2}: v = i t^{−2g−1} Π√(1+(c−β)t²)."""

    def __call__(self, k: int, t: Any, analytic: bool) -> Any:
        """Return the form k at t; in balls not finite where a root is not ``analytic``."""
        square = t * t
        factors = [1 - square * zero for zero in self._zeros_but(k)]
        common = self.arithmetic.i / self._roots(square, analytic)
        return math.prod(factors, start=common if k == len(self.zeros) else common * square)

    def _roots(self, square: Any, analytic: bool) -> Any:
        root = self.arithmetic.complex_root
        return math.prod((root(1 - square * b, analytic) for b in self.above), start=square**0)

    def direction(self, t: Any) -> complex:
        """Return v/|v|."""
        # phases alone: powers of far points leave the range of a double
        phase = (t / abs(t)) ** -len(self.above)
        return _direction(self.arithmetic.i * phase * self._roots(t * t, False))


def _direction(value: Any) -> complex:
    """Return the midpoint of a complex number over its size."""
    return complex(value / abs(value))
