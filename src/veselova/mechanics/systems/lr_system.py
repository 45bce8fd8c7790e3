"""LR systems: a left-invariant metric, a right-invariant distribution and any constants of
constraints, on a compact group.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.bodies.inertia_operator import Inertia
from veselova.mechanics.core.arguments import entry_count, whole_number
from veselova.mechanics.core.errors import Faults, InvalidInput, show
from veselova.mechanics.core.exact_input import Numbers, plain, require_moderate
from veselova.mechanics.core.problem import Problem, Series
from veselova.mechanics.flows.lr_flow import LRFlow, MomentumFlow, MultiplierFlow, multipliers_of
from veselova.mechanics.geometry.sphere import INPUT_TOLERANCE
from veselova.mechanics.geometry.stiefel import trace_integrals
from veselova.mechanics.groups.distribution import Distribution
from veselova.mechanics.groups.matrix_group import LARGEST, MatrixGroup
from veselova.mechanics.potentials.on_group import GroupPotential

__all__ = ["LRSystem"]

Array = NDArray[np.float64]

#: A constraint whose constant is below this part of |ω|, in roundings, has the constant zero: what
#: ω = q∧q̇ in doubles leaves.
_ROUNDINGS = 64


class LRSystem(Problem):
    """An LR system (G, l, D): l = ½⟨𝓘ω,ω⟩ − v(g), right-invariant constraints ⟨ω, g⁻¹h_s g⟩ = c_s;
    equations (EPS, printed 2.4) or (mom_eq, printed 2.7).

    On SO(n), with D_r of (4.1, printed 5.3), ⟨ω, e_p∧e_q⟩ = c_pq for r < p < q ≤ n (``LRSystem.on``
    takes any compact group and any 𝔥):

    - n, rank: the dimension, 2 ≤ n ≤ 64, and r from 1 to n−1
    - inertia: {"special": [A_1, …, A_n]}, equation (4.5, printed 5.11), or {"matrix": …}, symmetric
      positive definite, in the basis E_i∧E_j, i < j, lexicographic
    - g: the attitude (body to space) at t = 0, (n, n), frame = gᵀ; None for the identity. A
      reflected frame is taken too
    - omega: the angular velocity ω = g⁻¹ġ in the body at t = 0, (n, n), skew
    - potential: None, or v as a list of monomials {"coefficient": c, "powers": [[i, j, p], …]}:
      c Π g_ij^p, i and j from 1
    - homogeneous: True: ω must satisfy the constraints with c = 0 to 1e-9, and is projected;
      False: c is what ω gives

    Attributes: ``g`` on the group, ``omega`` (D,) in coordinates, ``constraint`` (m,) the c_s,
    ``distribution``, ``inertia``. Raises InvalidInput, which names the field, what was required and
    what was given.
    """

    n: int
    rank: int | None
    distribution: Distribution
    inertia: Inertia
    g: Array
    omega: Array
    potential: GroupPotential | None
    constraint: Array

    system: ClassVar[str] = "lr"
    outputs: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "omega": ("axis", "axis_2"),
        "frame": ("axis", "vector"),
        "momentum": ("axis", "axis_2"),
        "multipliers": ("constraint",),
    }
    derived: ClassVar[tuple[str, ...]] = ("momentum", "multipliers")
    bounded: ClassVar[tuple[str, ...]] = ("frame",)
    portrait: ClassVar[str] = "frame"
    formulations: ClassVar[tuple[str, ...]] = ("momentum", "multipliers")
    vanishing = frozenset({"group", "constraint"})

    def __init__(
        self,
        n: int,
        rank: int,
        inertia: Numbers | Mapping[str, Any],
        g: Numbers | None = None,
        omega: Numbers | None = None,
        potential: Sequence[Mapping[str, Any]] | None = None,
        *,
        homogeneous: bool = False,
    ) -> None:
        faults = Faults()
        known = faults.attempt(whole_number, n, ("n",), 2, LARGEST)
        size = known or min(max(entry_count(omega), 2), LARGEST)
        r = faults.attempt(whole_number, rank, ("rank",), 1, size - 1)
        operator = state = None
        if known is not None:
            operator = faults.attempt(Inertia.of, inertia, size)
            group = Distribution.of_rank(size, r or 1).group
            state = faults.attempt(_read_state, group, g, omega, potential)
        faults.require_none()
        self._become(Distribution.of_rank(size, r), operator, *state, homogeneous)
        self._set(n=size, rank=r)

    @classmethod
    def on(
        cls,
        group: MatrixGroup,
        inertia: Any,
        h: Any,
        g: Any = None,
        omega: Any = None,
        potential: Any = None,
        *,
        homogeneous: bool = False,
    ) -> LRSystem:
        """Return an LR system on any compact group.

        - inertia: (D, D) symmetric positive definite, on coordinates in ``group.basis``
        - h: matrices that span 𝔥, any subspace
        - g, omega: matrices of the group and of its algebra, as the group's basis was given;
          entries of v are those of the real g
        """
        if not isinstance(group, MatrixGroup):
            required = "a MatrixGroup, such as veselova.MatrixGroup.so(3)"
            raise InvalidInput(("group",), required, show(group))
        system = cls.__new__(cls)
        faults = Faults()
        distribution = faults.attempt(Distribution.orthogonal_to, group, h)
        operator = faults.attempt(Inertia.of_matrix, inertia, group.dimension)
        state = faults.attempt(_read_state, group, g, omega, potential)
        faults.require_none()
        system._become(distribution, operator, *state, homogeneous)
        arrays = {
            "basis": group.basis,
            "inertia": system.inertia.matrix,
            "g": system.g,
            "omega": group.element(system.omega),
            "h": group.element(distribution.space[distribution.rank :]),
        }
        stated = {"potential": system.potential.given} if system.potential else {}
        system._set(n=group.size, rank=None, given=plain(arrays) | stated)
        return system

    def as_request(self) -> dict[str, Any]:
        """Return the problem as a request states it; raises InvalidInput for one made by ``on``:
        requests know SO(n) alone.
        """
        if self.rank is None:
            required = "an LR system on SO(n), LRSystem(n, rank, …), where it is to be sent"
            raise InvalidInput(("problem",), required, repr(self))
        return super().as_request()

    def _become(
        self,
        distribution: Distribution,
        inertia: Inertia,
        start: Array,
        velocity: Array,
        potential: GroupPotential | None,
        homogeneous: bool,
    ) -> None:
        along, across = distribution.components(start, velocity)
        size = float(np.max(np.abs(velocity)))
        off = float(np.max(np.abs(across), initial=0.0))
        if homogeneous and off > INPUT_TOLERANCE * size:
            required = "an angular velocity that satisfies the constraints to 1e-9 of its size"
            raise InvalidInput(("omega",), required, f"one that is off them by {off:.3g}")
        if homogeneous or off <= _ROUNDINGS * np.finfo(float).eps * size:
            across = np.zeros_like(across)
            velocity = distribution.body(start, along, across)
        self._set(g=start, omega=velocity, constraint=across, potential=potential)
        self._set(distribution=distribution, inertia=inertia)
        require_moderate(velocity.tolist(), ("omega",), has_scale=potential is not None)
        if potential is None:
            return
        with np.errstate(all="ignore"):
            value, slope = potential.value(start), potential.strength(start)
        if not np.isfinite(value) or not np.isfinite(slope * slope):
            required = "a potential that is finite at the start, with its slope"
            raise InvalidInput(("potential",), required, f"the value {value}")

    def __repr__(self) -> str:
        kind = f"n={self.n}, rank={self.rank}"
        if self.rank is None:
            kind = f"{self.distribution.group!r}, dim 𝔥 = {self.distribution.constraints}"
        return f"LRSystem({kind}, |ω|={np.linalg.norm(self.omega):.6g})"

    @property
    def size(self) -> str:
        """Return dimension and rank, or the dimension of the group."""
        if self.rank is None:
            return f"dim G = {self.distribution.group.dimension}"
        return f"n = {self.n}, rank {self.rank}"

    @property
    def energy(self) -> float:
        """Return the energy or the Jacobi integral at the start."""
        return float(self._jacobi(self.g, self.omega))

    @property
    def energy_name(self) -> str:
        """Return ``energy`` where all constants c_s are zero, else ``jacobi_integral``."""
        return "jacobi_integral" if np.any(self.constraint) else "energy"

    @cached_property
    def turning(self) -> float:
        """Return the largest of |ω| at the start, √(2·kinetic energy/moment) and √(slope of
        v/moment), for a mean moment.
        """
        moment = np.ldexp(1.0, self.inertia.exponent)
        twice_energy = self.omega @ self.inertia(self.omega)
        slope = self.potential.strength(self.g) if self.potential else 0.0
        rates = np.sqrt([twice_energy / moment, slope / moment])
        return float(max(np.linalg.norm(self.omega), *rates))

    @property
    def moves(self) -> bool:
        """Return whether anything moves: a body at rest stays where no torque acts along 𝔡."""
        if np.any(self.omega) or self.potential is None:
            return bool(np.any(self.omega))
        torque = self.potential.gradient(self.distribution.group, self.g)
        return bool(np.any(self.distribution.components(self.g, torque)[0]))

    @property
    def start(self) -> Series:
        """Return the series at t = 0."""
        return {
            "omega": self.distribution.group.element(self.omega)[None],
            "frame": np.ascontiguousarray(self.g.T)[None],
        }

    def flow(self, formulation: str = "momentum") -> LRFlow:
        """Return the momentum equation on the group, or Euler–Poincaré with multipliers, in units
        of this problem.
        """
        unit = 1 / self.turning
        k = self.inertia.exponent
        inertia = self.inertia.rescale()
        velocity = self.omega * unit
        along = self.distribution.components(self.g, inertia(velocity))[0]
        across = self.constraint * unit
        potential = self.potential.scale(unit * unit * 2.0**-k) if self.potential else None
        kind = MomentumFlow if formulation == "momentum" else MultiplierFlow
        return kind(
            self.distribution, inertia, potential, unit, self.g, along, across, self._invariant[1]
        )

    def _split(self, series: Series) -> tuple[Array, Array]:
        """Return g and the coordinates of ω along series."""
        return np.swapaxes(series["frame"], -1, -2), self.distribution.group.coordinates(
            series["omega"]
        )

    def derive(self, name: str, series: Series) -> Array:
        """Return 𝓜 of (mom) as matrices (N, n, n), or the multipliers λ_s of (EPS), (N, m)."""
        g, omega = self._split(series)
        group = self.distribution.group
        if name == "momentum":
            return np.asarray(
                group.element(self.distribution.momentum(self.inertia, g, omega)), dtype=np.float64
            )
        force = group.bracket(self.inertia(omega), omega)
        if self.potential:
            force = force - self.potential.gradient(group, g)
        parts = self.distribution.parts(g, force)
        return np.concatenate(
            [
                multipliers_of(self.inertia.inverse, self.distribution.in_body(h)[1], f)[0]
                for h, f in parts
            ]
        )

    def _jacobi(self, g: Array, omega: Array) -> Array:
        value = self.distribution.jacobi(self.inertia, self.constraint, g, omega)
        return value + self.potential.value(g) if self.potential else value

    @cached_property
    def _invariant(self) -> tuple[Array, bool]:
        """Return the directions of 𝔡 (rows) along which v is constant, and whether it is along Σ
        c_s h_s.
        """
        d = self.distribution.rank
        if self.potential is None:
            return np.eye(d), True
        group, space, c = self.distribution.group, self.distribution.space, self.constraint
        directions = self.potential.invariant_directions(group, space[:d])
        if not np.any(c):
            return directions, True
        across = space[d:].T @ (c / np.max(np.abs(c)))
        return directions, len(self.potential.invariant_directions(group, across[None])) == 1

    def integrals(self, series: Series) -> dict[str, Array]:
        """Return the integrals of motion along series, by name, first axis the times.

        ``energy``      ½⟨𝓘ω,ω⟩ + v, where all c_s = 0; elsewhere it is not conserved
        ``jacobi_integral``  ½⟨𝓘ω,ω⟩ − ⟨𝓘ω, pr_{g⁻¹𝔥g} ω⟩ + v of Jacobi and Painlevé, where some
                        c_s ≠ 0; left out where v changes along the constants: it is no integral
        ``constraint``  c_s = ⟨ω, ℱ_s⟩, on SO(n) the w_pq of (4.1a), in units of ``turning``
        ``momentum``    the 𝔡-part of g𝓘ωg⁻¹, along the directions in which v does not change
        ``traces``      SO(n) without potential: the coefficients of λ^{k−j} in tr(𝓜/s + λΓ)^k, k =
                        2 … n, j = 2, 4 … k; s is the largest component of 𝓜 at t = 0
        ``group``       the largest entry of what is wrong with the frame
        """
        g, omega = self._split(series)
        directions, jacobi = self._invariant
        along = self.distribution.components(g, self.inertia(omega))[0] @ directions.T
        found = {self.energy_name: self._jacobi(g, omega)} if jacobi else {}
        if self.distribution.constraints:
            found["constraint"] = self.distribution.components(g, omega)[1] / (self.turning or 1.0)
        if along.shape[-1]:
            found["momentum"] = along
        if self.rank is not None and self.potential is None and self.n > 1:
            found["traces"] = self._traces(g, omega)
        return {**found, "group": self.distribution.group.defect(g)}

    def _traces(self, g: Array, omega: Array) -> Array:
        """Return the coefficients of tr(𝓜/s + λΓ)^k."""
        start = self.distribution.momentum(self.inertia, self.g, self.omega)
        size = float(np.max(np.abs(start))) or 1.0
        M = self.distribution.group.element(
            self.distribution.momentum(self.inertia, g, omega) / size
        )
        return trace_integrals(np.swapaxes(g[..., : self.rank, :], -1, -2), M)


def _read_state(
    group: MatrixGroup, g: Any, omega: Any, potential: Any
) -> tuple[Array, Array, GroupPotential | None]:
    """Return g, the coordinates of ω and the potential; raises InvalidRequest for faults of
    all.
    """
    faults = Faults()
    start = np.eye(group.size) if g is None else faults.attempt(group.validate, g)
    velocity: Any = None
    if omega is None:
        faults.add(("omega",), "a matrix of the Lie algebra (of so(n): skew)", "nothing")
    else:
        velocity = faults.attempt(group.algebra_element, omega, ("omega",))
    v = None if potential is None else faults.attempt(GroupPotential.of, potential, group.size)
    faults.require_none()
    return start, velocity, v
