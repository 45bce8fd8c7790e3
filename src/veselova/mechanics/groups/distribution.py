"""Right-invariant distributions D_g = 𝔡·g on a compact group, and the momentum (mom, printed 2.8)
that an inertia operator makes with one.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.bodies.inertia_operator import apply_operator
from veselova.mechanics.core.arguments import read_only
from veselova.mechanics.core.errors import InvalidInput, show
from veselova.mechanics.core.flow import FLOATS, Operations
from veselova.mechanics.groups.matrix_group import MatrixGroup, orthonormal_rows

__all__ = ["Distribution"]

Array = NDArray[np.float64]

#: Entries of Ad_g that are held at once, some tens of megabytes.
_MOST_ENTRIES = 2_000_000


@dataclass(frozen=True, eq=False)
class Distribution:
    """The splitting 𝔤 = 𝔡 ⊕ 𝔥 that a right-invariant distribution is.

    - space: (D, D) orthonormal coordinate rows: w_1 … w_d of 𝔡, then h_1 … h_m of 𝔥
    - rank: d = dim 𝔡

    At g the constraints are ω ∈ g⁻¹𝔡g, or f_s = ⟨ω, ℱ_s⟩ = c_s with ℱ_s = g⁻¹h_s g, equation
    (dist, printed 2.3); 𝒲_k = g⁻¹w_k g.
    """

    group: MatrixGroup
    space: Array
    rank: int

    @classmethod
    def of_rank(cls, n: int, rank: int) -> Distribution:
        """Return D_r of (4.1, printed 5.3) on SO(n): 𝔥 is spanned by E_p∧E_q, r < p < q ≤ n, the
        last elements of the basis.
        """
        group = MatrixGroup.so(n)
        constraints = (n - rank) * (n - rank - 1) // 2
        return cls(group, np.eye(group.dimension), group.dimension - constraints)

    @classmethod
    def orthogonal_to(cls, group: MatrixGroup, h: Any) -> Distribution:
        """Return the distribution whose 𝔥 is spanned by given matrices of 𝔤; none leaves the group
        free. Raises InvalidInput.
        """
        if isinstance(h, (str, bytes)) or not isinstance(h, (Sequence, np.ndarray)):
            raise InvalidInput(("h",), "a list of matrices of the Lie algebra", show(h))
        rows = [group.algebra_element(matrix, ("h", s)) for s, matrix in enumerate(h)]
        given = np.array(rows).reshape(-1, group.dimension)
        constraints = orthonormal_rows(given, ("h",), "linearly independent elements, none zero")
        # The orthogonal complement: the last right singular vectors of the rows of 𝔥.
        rest = np.eye(group.dimension)
        if len(constraints):
            rest = np.linalg.svd(constraints, full_matrices=True)[2][len(constraints) :]
        return cls(group, read_only(np.vstack([rest, constraints])), len(rest))

    @property
    def constraints(self) -> int:
        """Return m = dim 𝔥."""
        return self.group.dimension - self.rank

    @property
    def key(self) -> tuple[bytes, bytes, int]:
        """Return a key that identifies this distribution."""
        return self.group.key, self.space.tobytes(), self.rank

    @cached_property
    def _is_basis(self) -> bool:
        return bool(np.array_equal(self.space, np.eye(len(self.space))))

    def in_body(self, g: Any, ops: Operations = FLOATS) -> tuple[Any, Any]:
        """Return the coordinates of 𝒲_k = g⁻¹w_k g, (…, d, D), and of ℱ_s = g⁻¹h_s g, (…, m, D)."""
        rows = self.group.adjoint_matrix(g, ops)
        if not self._is_basis:
            rows = ops.dot(self.space, rows)
        return rows[..., : self.rank, :], rows[..., self.rank :, :]

    def parts(self, *arrays: Array) -> Iterator[tuple[Array, ...]]:
        """Return arrays along times cut into parts short enough for ``in_body`` of one to fit in
        memory.
        """
        count = len(arrays[0]) * self.group.dimension * self.group.size**2 // _MOST_ENTRIES + 1
        return zip(
            *(np.array_split(array, min(count, len(array))) for array in arrays), strict=True
        )

    def components(self, g: Array, x: Array) -> tuple[Array, Array]:
        """Return ⟨x, 𝒲_k⟩ and ⟨x, ℱ_s⟩ of elements x (…, D) in body coordinates, leading axes
        along.
        """
        spatial = self.group.adjoint(g, x) @ self.space.T
        return spatial[..., : self.rank], spatial[..., self.rank :]

    def body(self, g: Array, along: Array, across: Array) -> Array:
        """Return Σ along_k 𝒲_k + Σ across_s ℱ_s in coordinates."""
        spatial = np.concatenate([along, across], axis=-1) @ self.space
        return self.group.adjoint(np.swapaxes(g, -1, -2), spatial)

    def momentum(self, inertia: Any, g: Array, omega: Array) -> Array:
        """Return 𝓜 = pr_{g⁻¹𝔡g} 𝓘ω + pr_{g⁻¹𝔥g} ω, equation (mom, printed 2.8), in coordinates;
        ``inertia`` maps rows.
        """
        along, _ = self.components(g, inertia(omega))
        _, across = self.components(g, omega)
        return self.body(g, along, across)

    def jacobi(self, inertia: Any, across: Array, g: Array, omega: Array) -> Array:
        """Return ½⟨𝓘ω,ω⟩ − ⟨𝓘ω, pr_{g⁻¹𝔥g} ω⟩ for ⟨ω, ℱ_s⟩ = c_s, the c_s being ``across``, shape
        (…).
        """
        momentum = inertia(omega)
        vertical = self.components(g, momentum)[1] @ across
        return np.asarray(np.sum(momentum * omega, axis=-1) / 2 - vertical)

    @property
    def uses_inverse(self) -> bool:
        """Return whether ``velocity`` solves m equations with 𝓘⁻¹ rather than d with 𝓘: whichever
        are fewer.
        """
        return self.constraints <= self.rank

    def velocity(
        self, operator: Any, W: Any, F: Any, m: Any, c: Any, ops: Operations = FLOATS
    ) -> Any:
        """Return the ω with ⟨𝓘ω, 𝒲_k⟩ = m_k and ⟨ω, ℱ_s⟩ = c_s, the inverse of (mom), (…, D).

        ``operator`` is 𝓘⁻¹ where ``uses_inverse``, else 𝓘. Either 𝓘ω = Σ m_k𝒲_k + Σ s_l ℱ_l with m
        equations for s, or ω = Σ u_k 𝒲_k + Σ c_s ℱ_s with d equations for u.
        """
        given, unknown, known, wanted = (m, F, W, c) if self.uses_inverse else (c, W, F, m)
        part = combine(given, known, ops)
        if unknown.shape[-2] == 0:
            return apply_operator(operator, part, ops) if self.uses_inverse else part
        rotated = apply_operator(operator, unknown, ops)
        matrix = ops.dot(rotated, np.swapaxes(unknown, -1, -2))
        solution = ops.solve(matrix, wanted[..., None] - ops.dot(rotated, part[..., None]))[..., 0]
        if self.uses_inverse:
            return apply_operator(operator, part, ops) + combine(solution, rotated, ops)
        return part + combine(solution, unknown, ops)


def combine(coefficients: Any, rows: Any, ops: Operations) -> Any:
    """Return Σ coefficients_k rows_k, (…, D)."""
    return ops.dot(coefficients[..., None, :], rows)[..., 0, :]
