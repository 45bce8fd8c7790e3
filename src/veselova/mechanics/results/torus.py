"""The invariant torus of a motion: its curve, periods, frequencies and the phases of the start;
the numbers of many tori, as arrays; and the mean velocity of a ball that rolls along one."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.arguments import takes_arrays
from veselova.mechanics.core.errors import Unsolved
from veselova.mechanics.core.problem import html_table
from veselova.mechanics.results.ensemble import SOLVED
from veselova.mechanics.results.resonance import (
    NearReturn,
    Resonance,
    find_near_returns,
    find_resonance,
    find_windings,
)

__all__ = ["Drift", "Tori", "Torus", "TorusNumbers"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, repr=False)
class Torus:
    """The torus of one motion. g = n−1, less one for every direction that does not move.

    - energy: h, that of Neumann's motion for that system, ½ for a geodesic; None where it leaves
      the range of a float or is not conserved
    - jacobi_integral: ½(𝓘Ω,Ω) − (Ω,γ)(𝓘Ω,γ), which a body with (Ω,γ) ≠ 0 conserves in place of the
      energy; None elsewhere
    - constants: c_2 ≤ … ≤ c_{n−1}, with c_1 first for Neumann's system
    - branch_points: (2g+1,) b_0 < … < b_{2g}, with b_0 = c_1 = 0 but for Neumann's system
    - origins: (2g+1,) which of them is an I_i (``I3``: that of the third body axis) and which a
      c_k (``c1`` is 0)
    - periods: (g, g) a_{ks} = (−1)^{g−s} ∮ λ^{k−1}dλ/(2√|R|) over cut s, which scale like
      A^{g+½−k}; None where one of them leaves the range of a float
    - riemann_matrix: (g, g) T; the Riemann matrix is iT
    - riemann_matrix_residual: max |T − Tᵀ|/max |T| before symmetrisation
    - actions: (g,) J_s = (1/2π)∮ p_s dλ_s of the Neumann motion, p_s = ½√|λ Π(λ−c_k)/Π(λ−I_i)|
    - frequencies_tau1: (g,) cycles per unit of τ₁
    - frequencies_t: (g,) cycles per unit of the problem's own time (t, s or τ₁)
    - rotation_numbers: (g,) Ω_s/Ω_1
    - phases: (g,) z⁰ in [0, 1)
    - mean_rate: mean of d(time)/dτ₁
    - signs: (n,) of the q_i at the start (of q̇_i where q_i = 0). With energy, constants and
      phases they determine the start
    - regime: ``generic``, ``closed-cut`` (directions that do not move, or equal A's) or
      ``separatrix`` (some c_k = I_i: periods are infinite there, and the torus is that of a
      start 1e-40 away)
    - close_orbit: the time in which the phases go round so many times along the orbit, and whether
      the attitude is then the same; None for a torus from a document
    - drift: the mean velocity of the contact point of a ball, of up to three phases (``ball.drift``
      has it for more); None on a separatrix and for what does not roll
    """

    n: int
    energy: float | None
    constants: Array
    branch_points: Array
    origins: tuple[str, ...]
    periods: Array | None
    actions: Array
    rotation_numbers: Array
    signs: NDArray[np.int64]
    riemann_matrix: Array
    riemann_matrix_residual: float
    frequencies_tau1: Array
    frequencies_t: Array
    phases: Array
    mean_rate: float
    regime: str
    close_orbit: Callable[[NDArray[np.int64]], tuple[float, bool]] | None = field(default=None)
    drift: Drift | None = None
    jacobi_integral: float | None = None

    @takes_arrays
    def resonance(self, max_order: int = 12, tolerance: float = 1e-9) -> Resonance:
        """Return the integer relations k·f = 0 between the frequencies, |k_s| ≤ max_order, where
        |k·f| is at most ``tolerance`` of the largest frequency.

        Raises InvalidInput for a bad order or tolerance, and for more than 4·10⁶ combinations k.
        """
        return find_resonance(self.frequencies_tau1, max_order, tolerance)

    @takes_arrays
    def period(self, max_order: int = 100, tolerance: float = 1e-9) -> float:
        """Return the time after which the motion of a torus that is filled by periodic orbits
        returns: the state, with the attitude, is the same.

        All frequencies are then whole multiples of one: f = p f_0 with integers |p_s| ≤ max_order,
        where ratios of frequencies may differ by ``tolerance``. The period is not p_s/Ω_s for the
        ``frequencies_t`` Ω, which are means over the torus. On a resonance the time rate has
        another mean along the orbit, so it is integrated along it. The attitude may have changed
        signs after one turn; it takes two then. A ball's position returns but for its drift.

        Raises InvalidInput for bad arguments, Unsolved (``not-periodic``) where the frequencies
        are in no such ratio, on a separatrix, and for a torus that was read from a document. The
        state returns to 1e-10 where the ratios hold to 1e-13; tested for n = 2, 3 and 4.
        """
        windings = find_windings(self.frequencies_tau1, max_order, tolerance)
        self._require_return()
        if windings is None:
            raise Unsolved(
                "not-periodic",
                f"the frequencies are in no ratio of whole numbers up to {max_order} to "
                f"{tolerance:g}",
            )
        if self.close_orbit is None:
            raise Unsolved(
                "not-periodic",
                "a torus from a document has no time along its orbit; take veselova.torus(problem)",
            )
        time, returned = self.close_orbit(windings)
        # The second turn may take another time than the first: with an area constant dt/dτ₁ has
        # period 2 in the phases.
        return time if returned else self.close_orbit(2 * windings)[0]

    @takes_arrays
    def nearly_periodic(self, max_order: int = 100) -> tuple[NearReturn, ...]:
        """Return the times at which the phases are back more nearly than at any time before, by
        increasing time, the last the nearest.

        Each has its ``time``, about; ``windings`` (g,), how often each phase went round by then,
        the fastest up to ``max_order`` times; and ``misfit``, the largest distance of a phase from
        its start, in cycles. The attitude may have other signs where a winding is odd. Raises
        InvalidInput for a bad order, Unsolved (``not-periodic``) on a separatrix.
        """
        self._require_return()
        return find_near_returns(self.frequencies_t, max_order)

    def _require_return(self) -> None:
        if self.regime == "separatrix":
            raise Unsolved("not-periodic", "a motion on a separatrix never returns")

    def as_dict(self) -> dict[str, Any]:
        """Return the torus as a JSON-ready dictionary (arrays as nested lists); ``drift`` and
        ``jacobi_integral`` where there is one.
        """
        found = {f.name: getattr(self, f.name) for f in fields(self) if f.name != "close_orbit"}
        found["drift"] = self.drift and self.drift.as_dict()
        return {
            name: np.asarray(value).tolist() if isinstance(value, (np.ndarray, tuple)) else value
            for name, value in found.items()
            if value is not None or name not in ("drift", "jacobi_integral")
        }

    def _repr_html_(self) -> str:
        return html_table(self.as_dict())

    def __repr__(self) -> str:
        frequencies = ", ".join(f"{x:.6g}" for x in self.frequencies_t)
        ratios = ", ".join(f"{x:.6g}" for x in self.rotation_numbers[1:])
        ratio = f", ratio {ratios}" if ratios else ""
        return f"<Torus: n = {self.n}, {self.regime}, frequencies {frequencies}{ratio}>"


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class TorusNumbers:
    """What N tori have in numbers: see ``Tori``."""

    energy: Array
    constants: Array
    branch_points: Array
    origins: NDArray[np.str_]
    actions: Array
    rotation_numbers: Array
    frequencies_tau1: Array
    frequencies_t: Array
    phases: Array
    mean_rate: Array


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Tori(TorusNumbers):
    """The tori of N Veselova problems, g = n−1; names, shapes and units after the first axis are
    those of ``Torus``. Numbers of a row that was not found are NaN.

    - outcome: (N,) ``solved``, or the name of the reason
    - detail: (N,) the reason in a sentence
    - energy, mean_rate: (N,)
    - constants: (N, n−2)
    - branch_points, origins: (N, 2g+1)
    - actions, rotation_numbers, frequencies_tau1, frequencies_t, phases: (N, g)
    """

    outcome: NDArray[np.str_]
    detail: tuple[str, ...]

    def __len__(self) -> int:
        return int(self.outcome.size)

    @property
    def solved(self) -> NDArray[np.bool_]:
        """Return which tori were found, (N,)."""
        return np.asarray(self.outcome == SOLVED)

    def __repr__(self) -> str:
        found = int(np.count_nonzero(self.solved))
        return f"<Tori: {len(self)} problems, {found} solved>"


@dataclass(frozen=True, eq=False)
class Drift:
    """The mean velocity of a contact point over all times, along e_2 … e_n.

    - velocity: (n−1,)
    - resonance: the whole numbers M with Σ_s M_s f_s = 0 by which the ball also drifts across
      the direction of its generic motions; None where there are none
    """

    velocity: Array
    resonance: tuple[int, ...] | None = None

    @property
    def speed(self) -> float:
        """Return |velocity|."""
        return float(np.linalg.norm(self.velocity))

    @property
    def direction(self) -> Array:
        """Return the unit vector along the velocity, (n−1,); zero for a ball at rest."""
        return self.velocity / self.speed if self.speed else np.zeros_like(self.velocity)

    def as_dict(self) -> dict[str, Any]:
        """Return velocity and resonance as JSON has them."""
        resonance = None if self.resonance is None else list(self.resonance)
        return {"velocity": self.velocity.tolist(), "resonance": resonance}

    @classmethod
    def from_dict(cls, document: Mapping[str, Any]) -> Drift:
        """Return the drift of what ``as_dict`` gave."""
        resonance = document["resonance"]
        velocity = np.array(document["velocity"], dtype=np.float64)
        return cls(velocity, None if resonance is None else tuple(map(int, resonance)))
