"""The Neumann system on Sⁿ⁻¹: a point on the unit sphere in the potential U = ½(A⁻¹q,q), for any value of F_0."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.errors import InvalidInput, shown
from veselova.mechanics.exact import exact_number, exact_vector, plain, read_only, to_float
from veselova.mechanics.flow import Flow, Operations
from veselova.mechanics.integrals import energy as veselova_energy
from veselova.mechanics.integrals import moser_eigenvalues, uhlenbeck_integrals
from veselova.mechanics.problem import Problem, Series
from veselova.mechanics.sphere import INPUT_TOLERANCE, ExactState, require_on_sphere, unit
from veselova.mechanics.spheroconic import to_spheroconic

if TYPE_CHECKING:
    from veselova.mechanics.veselova import Veselova

__all__ = ["NeumannSystem"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, init=False, repr=False)
class NeumannSystem(Problem):
    """A point on the unit sphere Sⁿ⁻¹, n ≥ 2, that moves by q'' = −A⁻¹q + [(A⁻¹q,q) − (q',q')]q, equation (4.7), in time τ₁.

    A        n positive numbers
    q        the unit vector at τ₁ = 0, (n,)
    q_prime  its velocity dq/dτ₁, tangent to the sphere, (n,)

    q must have unit length and q_prime be tangent to 1e-9; with ``normalize=True`` q is scaled and q_prime projected first.
    On F_0 = 0, equation (4.8), the motion is that of a Veselova problem (Theorem LR→Nn); here F_0 may have any value.
    Raises InvalidInput, which names the field, what was required and what was given.
    """

    A: Array
    q: Array
    q_prime: Array
    exact: ExactState
    given: Mapping[str, Any]

    system: ClassVar[str] = "neumann"
    time: ClassVar[str] = "tau1"
    outputs: ClassVar[Mapping[str, tuple[str, ...]]] = {"q": ("axis",), "q_prime": ("axis",), "spheroconic": ("coordinate",)}
    derived: ClassVar[tuple[str, ...]] = ("spheroconic",)
    bounded: ClassVar[tuple[str, ...]] = ("q",)
    portrait: ClassVar[str] = "q"
    formulations: ClassVar[tuple[str, ...]] = ("neumann",)

    def __init__(self, A: Any, q: Any, q_prime: Any, *, normalize: bool = False) -> None:
        if not isinstance(normalize, bool):
            raise InvalidInput(("normalize",), "true or false", shown(normalize))
        diagonal = exact_vector(A, ("A",))
        if len(diagonal) < 2:
            raise InvalidInput(("A",), "at least 2 numbers (n ≥ 2)", f"{len(diagonal)}")
        for i, value in enumerate(diagonal):
            if value <= 0 or float(value) == 0:
                raise InvalidInput(("A", i), "a finite number greater than 0", shown(A[i]))
        exact_q, exact_v = exact_vector(q, ("q",), len(diagonal)), exact_vector(q_prime, ("q_prime",), len(diagonal))
        if not any(exact_q):
            raise InvalidInput(("q",), "a vector of unit length", "the zero vector")
        position, velocity = to_float(exact_q), to_float(exact_v)
        if not normalize:
            require_on_sphere(position, velocity, "q_prime")
        exact = ExactState(diagonal, exact_q, exact_v, None)
        object.__setattr__(self, "exact", exact)
        arrays = {"A": to_float(diagonal), "q": read_only(unit(position)), "q_prime": to_float(exact.tangent)}
        for name, array in arrays.items():
            object.__setattr__(self, name, array)
        given = {"A": A, "q": q, "q_prime": q_prime, "normalize": normalize}
        object.__setattr__(self, "given", {name: plain(value) for name, value in given.items()})

    def __repr__(self) -> str:
        parts = (f"{name}={np.array2string(getattr(self, name), precision=6, threshold=8)}" for name in ("A", "q", "q_prime"))
        return f"NeumannSystem({', '.join(parts)})".replace("\n", "")

    @property
    def n(self) -> int:
        """Return the dimension of the ambient space."""
        return int(self.A.size)

    @property
    def title(self) -> str:
        """Return the system and its dimension."""
        return f"{self.system}, n = {self.n}, energy {float(self._energy(self.q, self.q_prime)):.12g}"

    @property
    def turning(self) -> float:
        """Return the larger of |q'| and √max I."""
        return float(max(np.linalg.norm(self.q_prime), np.sqrt(np.max(1 / self.A))))

    @property
    def start(self) -> Series:
        """Return the series at τ₁ = 0."""
        return {"q": self.q[None], "q_prime": self.q_prime[None]}

    def flow(self, formulation: str = "neumann") -> NeumannFlow:
        """Return the field (4.7) in units of this problem."""
        unit_of_time = 1 / self.turning
        inverse = unit_of_time**2 / self.A
        return NeumannFlow(inverse, unit_of_time, np.concatenate([self.q, unit_of_time * self.q_prime]))

    def veselova(self, energy: Any, frame: Any = None) -> Veselova:
        """Return the Veselova problem of energy h > 0 whose motion this is in time τ₁ (Theorem LR→Nn), with a frame at the start.

        q̇ = q' √(2h det A/(Aq,q)). Raises InvalidInput unless F_0 = 0, equation (4.8), to 1e-9 of (Aq,q).
        """
        from veselova.mechanics.veselova import Veselova

        h = float(exact_number(energy, ("energy",)))
        if h <= 0:
            raise InvalidInput(("energy",), "a number greater than 0", shown(energy))
        q, v = self.q, self.q_prime
        F0 = float(self.integrals(self.start)["F0"][0] / (q @ (self.A * q)))
        if abs(F0) > INPUT_TOLERANCE:
            raise InvalidInput(("q_prime",), "F_0 = 0, equation (4.8), to 1e-9 of (Aq,q)", f"F_0/(Aq,q) = {F0:.3g}")
        return Veselova(self.A, q, v * np.sqrt(h / veselova_energy(self.A, q, v)), frame, normalize=True)

    def derive(self, name: str, series: Series) -> Array:
        """Return the spheroconic coordinates."""
        return to_spheroconic(self.A, series["q"])

    def _energy(self, q: Array, v: Array) -> Array:
        return np.asarray((np.sum(v * v, axis=-1) + np.sum(q * q / self.A, axis=-1)) / 2, dtype=np.float64)

    def integrals(self, series: Series) -> dict[str, Array]:
        """Return the integrals of motion along the series, by name.

        ``energy`` ½(q',q') + ½(A⁻¹q,q); ``F0`` (4.8); ``neumann`` F_1…F_n; ``constants`` c_1…c_{n−1}; ``q_norm`` (q,q).
        """
        q, v, A = series["q"], series["q_prime"], self.A
        qAq, qAv, vAv = (np.sum(a * A * b, axis=-1) for a, b in ((q, q), (q, v), (v, v)))
        return {
            "energy": self._energy(q, v),
            "F0": vAv * qAq - qAv * qAv - qAq,
            "neumann": uhlenbeck_integrals(A, q, v),
            "constants": moser_eigenvalues(A, q, v),
            "q_norm": np.sum(q * q, axis=-1),
        }


@dataclass(frozen=True)
class NeumannFlow(Flow):
    """Equation (4.7) for states (q, q'), with λ divided by (q,q): off the sphere it is then not unstable."""

    parameters: Array
    time_unit: float
    initial: Array

    def field(self, state: Any, parameters: Any, ops: Operations) -> Any:
        """Return (q', q'')."""
        q, v = state[: parameters.size], state[parameters.size :]
        multiplier = (ops.dot(parameters * q, q) - ops.dot(v, v)) / ops.dot(q, q)
        return np.concatenate([v, multiplier * q - parameters * q])

    def project(self, state: Array) -> Array:
        """Return the state with |q| = 1, (q,q') = 0 and the energy of the start, by one step along its gradient."""
        q, v = self._tangent(state)
        restored = self._tangent(np.concatenate([q, v]) - self._defect(q, v))
        return np.concatenate(restored)

    def _tangent(self, state: Array) -> tuple[Array, Array]:
        q, v = state[: self.parameters.size], state[self.parameters.size :]
        q = q / np.linalg.norm(q)
        return q, v - (q @ v) * q

    def _defect(self, q: Array, v: Array) -> Array:
        """Return the step along the energy's gradient that makes up for the energy's change; none at rest."""
        energy, wanted = (float(b @ b + a @ (self.parameters * a)) / 2 for a, b in ((q, v), self._tangent(self.initial)))
        force = self.parameters * q - (q @ (self.parameters * q)) * q
        gradient = np.concatenate([force, v])
        size = float(gradient @ gradient)
        return gradient * ((energy - wanted) / size) if size > 0 else gradient

    def neighbour(self, distance: float) -> NeumannFlow:
        """Return the flow of a start moved by about ``distance``."""
        direction = np.random.default_rng(self.initial.size).normal(size=self.initial.size) / np.sqrt(self.parameters.size)
        return replace(self, initial=np.concatenate(self._tangent(self.initial + distance * direction)))

    def unpack(self, states: Array) -> dict[str, Array]:
        """Return q and q_prime."""
        n = self.parameters.size
        q = states[:, :n] / np.linalg.norm(states[:, :n], axis=1, keepdims=True)
        v = states[:, n:]
        return {"q": q, "q_prime": (v - np.sum(q * v, axis=1, keepdims=True) * q) / self.time_unit}
