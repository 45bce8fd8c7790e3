"""Numbers beyond double precision, as every trajectory carries them: decimals, each with a radius."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.errors import BackendMissing

__all__ = ["Decimals"]

Objects = NDArray[np.object_]


@dataclass(frozen=True, repr=False)
class Decimals:
    """The series of a trajectory to more digits than a double has, or with certified errors.

    midpoints, radii: by the name of the series, object arrays of ``decimal.Decimal`` of its shape; the exact value lies within
    midpoint ± radius, proven where ``certified``, and otherwise to the honesty of all our error estimates.
    error (N,) the largest radius of q and frame at each time
    """

    digits: int
    certified: bool
    midpoints: Mapping[str, Objects]
    radii: Mapping[str, Objects]

    @property
    def error(self) -> Objects:
        """Return the largest radius of q and frame at each time, (N,)."""
        return np.array([max([*q, *frame.ravel()]) for q, frame in zip(self.radii["q"], self.radii["frame"], strict=True)])

    def strings(self, name: str, radii: bool = False) -> Any:
        """Return a series, or its radii, as nested lists of decimal strings."""
        return np.vectorize(str, otypes=[object])((self.radii if radii else self.midpoints)[name]).tolist()

    def mpmath(self, name: str) -> Objects:
        """Return the midpoints of a series as mpmath numbers of so many digits."""
        import mpmath

        context = mpmath.MPContext()
        context.dps = self.digits + 5
        return np.asarray(np.vectorize(lambda x: context.mpf(str(x)), otypes=[object])(self.midpoints[name]))

    def flint(self, name: str) -> Objects:
        """Return a series as python-flint balls; raises BackendMissing without python-flint."""
        try:
            from flint import arb, fmpq
        except ImportError:
            raise BackendMissing("python-flint", "balls", "pip install python-flint") from None

        def ball(middle: Any, radius: Any) -> Any:
            return arb(fmpq(*middle.as_integer_ratio()), fmpq(*radius.as_integer_ratio()))

        return np.asarray(np.vectorize(ball, otypes=[object])(self.midpoints[name], self.radii[name]))

    def __repr__(self) -> str:
        kind = "certified" if self.certified else "estimated"
        return f"<Decimals: {self.digits} digits, {kind} error ≤ {float(max(self.error)):.2g}>"
