"""Compact matrix groups by a basis of their Lie algebra: ad-invariant product, brackets, Ad_g,
projection onto the group.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from veselova.mechanics.core.arguments import (
    CheckedCall,
    Path,
    has_entries,
    read_only,
    require_each,
    whole_number,
)
from veselova.mechanics.core.errors import InvalidInput, show
from veselova.mechanics.core.flow import FLOATS, Operations
from veselova.mechanics.core.toolkit_arguments import complex_array
from veselova.mechanics.geometry.so_n import skew
from veselova.mechanics.geometry.sphere import INPUT_TOLERANCE
from veselova.mechanics.groups.projection import GroupProjection

__all__ = ["LARGEST", "MatrixGroup", "orthonormal_rows"]

Array = NDArray[np.float64]

#: Largest n of SO(n) and SU(n): dim SO(64) is 2016, and Ad_g has as many rows.
LARGEST = 64

#: Basis elements whose orthogonal parts are shorter than this, relative to the longest element,
#: count as dependent.
_INDEPENDENT = 1e-10


class MatrixGroup(metaclass=CheckedCall):
    """A compact connected matrix group with Lie algebra 𝔤, and the product ⟨X,Y⟩ = −½ Re tr XY,
    which is Ad-invariant.

    basis   (D, N, N) orthonormal basis Y_1 … Y_D of 𝔤, real and skew; a complex matrix A + iB is
        kept as [[A, −B], [B, A]]

    ``MatrixGroup(basis)`` takes any basis (skew-symmetric, or skew-Hermitian with complex entries),
    which is made orthonormal in the order given; ``so(n)``, ``su(n)`` and ``product(…)`` are
    ready-made. Elements of 𝔤 are coordinates (…, D) in ``basis``. Whether the group that 𝔤
    generates is closed is not checked: a dense winding of a torus is taken as it is, and a winding
    with unequal weights is kept on that torus, not on itself. Raises InvalidInput for a basis that
    is dependent, not closed under brackets, or not skew.
    """

    basis: Array

    def __init__(self, basis: ArrayLike | Sequence[Any]) -> None:
        matrices, halves = _matrices(basis)
        _require_skew(matrices)
        skew_part = (matrices - np.swapaxes(matrices, -1, -2)).reshape(len(matrices), -1)
        rows = orthonormal_rows(skew_part, ("basis",), "linearly independent matrices")
        self._become(rows.reshape(matrices.shape) * np.sqrt(2 / halves), halves, full=False)
        self._require_closed()

    def _become(self, basis: Array, weight: Array | float, *, full: bool) -> None:
        """Set the orthonormal basis; ``weight`` scales ⟨X,Y⟩ = ½ Σ X_ij Y_ij of its blocks,
        ``full`` says that 𝔤 = so(N).
        """
        self.basis = read_only(np.array(basis))
        # X is skew: its upper half says everything, and with it a symbolic field has half the
        # products.
        self._weight = np.broadcast_to(np.asarray(weight), basis.shape[1:])
        self._dual = read_only(np.triu(basis * self._weight).reshape(len(basis), -1).T)
        self._flat = read_only(basis.reshape(len(basis), -1))
        self._full = full

    @classmethod
    def _of(cls, basis: Array, weight: Array | float, *, full: bool = False) -> MatrixGroup:
        """Return the group of an orthonormal basis."""
        group = cls.__new__(cls)
        group._become(basis, weight, full=full)
        return group

    @classmethod
    def so(cls, n: int) -> MatrixGroup:
        """Return SO(n), n ≥ 2, with the basis E_i∧E_j, i < j, in lexicographic order."""
        size = whole_number(n, ("n",), 2, LARGEST)
        return cls._of(skew(np.eye(size * (size - 1) // 2), size), 1.0, full=True)

    @classmethod
    def su(cls, n: int) -> MatrixGroup:
        """Return SU(n), n ≥ 2: E_jk−E_kj and i(E_jk+E_kj), j < k, then n−1 diagonal elements (for n
        = 2 i times Pauli's).
        """
        size = whole_number(n, ("n",), 2, LARGEST)
        elements = []
        for j, k in combinations(range(size), 2):
            for one, other in ((1, -1), (1j, 1j)):
                matrix = np.zeros((size, size), complex)
                matrix[j, k], matrix[k, j] = one, other
                elements.append(matrix)
        diagonals = (np.array([1j] * k + [-1j * k] + [0] * (size - k - 1)) for k in range(1, size))
        elements += [
            np.diag(diagonal) * np.sqrt(2) / np.linalg.norm(diagonal) for diagonal in diagonals
        ]
        return cls._of(np.array([_real_form(matrix) for matrix in elements]), 0.5)

    @classmethod
    def product(cls, *factors: MatrixGroup) -> MatrixGroup:
        """Return the direct product, block-diagonal, with the sum of the products; the bases follow
        one another.
        """
        if not factors or not all(isinstance(factor, MatrixGroup) for factor in factors):
            raise InvalidInput(("factors",), "one or more matrix groups", show(factors))
        size = sum(factor.size for factor in factors)
        basis = np.zeros((sum(factor.dimension for factor in factors), size, size))
        weight = np.zeros((size, size))
        corner = first = 0
        for factor in factors:
            block = slice(corner, corner + factor.size)
            basis[first : first + factor.dimension, block, block] = factor.basis
            weight[block, block] = factor._weight
            corner = corner + factor.size
            first = first + factor.dimension
        return cls._of(basis, weight)

    def __repr__(self) -> str:
        return f"<MatrixGroup of dimension {self.dimension}, matrices {self.size} × {self.size}>"

    @property
    def size(self) -> int:
        """Return N, the size of the (real) matrices."""
        return int(self.basis.shape[1])

    @property
    def dimension(self) -> int:
        """Return D = dim 𝔤."""
        return int(self.basis.shape[0])

    @property
    def key(self) -> bytes:
        """Return a key that identifies this group's basis."""
        return self.basis.tobytes()

    def coordinates(self, X: Any, ops: Operations = FLOATS) -> Any:
        """Return the coordinates (…, D) of matrices of 𝔤, (…, N, N)."""
        return ops.dot(X.reshape((*X.shape[:-2], self.size**2)), self._dual)

    def element(self, x: Any, ops: Operations = FLOATS) -> Any:
        """Return the matrices (…, N, N) of elements with coordinates (…, D)."""
        return ops.dot(x, self._flat).reshape((*x.shape[:-1], self.size, self.size))

    def covector(self, S: Any, ops: Operations = FLOATS) -> Any:
        """Return Σ_ij S_ij (Y_a)_ij, the values (…, D) of a linear form on the basis."""
        return ops.dot(S.reshape((*S.shape[:-2], self.size**2)), self._flat.T)

    def bracket(self, x: Any, y: Any, ops: Operations = FLOATS) -> Any:
        """Return [x,y] in coordinates."""
        X = self.element(x, ops)
        Y = self.element(y, ops)
        return self.coordinates(ops.dot(X, Y) - ops.dot(Y, X), ops)

    def adjoint_matrix(self, g: Any, ops: Operations = FLOATS) -> Any:
        """Return R (…, D, D) whose row a has the coordinates of g⁻¹Y_a g; Ad_g = R acts on columns,
        Ad_{g⁻¹} = Rᵀ.
        """
        N = self.size
        D = self.dimension
        leading = g.shape[:-2]
        wide = self.basis.transpose(1, 0, 2).reshape(N, D * N)
        half = ops.dot(np.swapaxes(g, -1, -2), wide).reshape((*leading, N, D, N))
        tall = np.swapaxes(half, -3, -2).reshape((*leading, D * N, N))
        return ops.dot(ops.dot(tall, g).reshape((*leading, D, N * N)), self._dual)

    def adjoint(self, g: Array, x: Array) -> Array:
        """Return the coordinates of g x g⁻¹, leading axes along."""
        return np.asarray(
            self.coordinates(g @ self.element(x) @ np.swapaxes(g, -1, -2)), dtype=np.float64
        )

    def exponential(self, x: Array) -> Array:
        """Return exp of the element with coordinates x, (D,)."""
        from scipy.linalg import expm

        return np.asarray(expm(self.element(x)), dtype=np.float64)

    @cached_property
    def _projection(self) -> GroupProjection:
        return GroupProjection(self.basis, trivial=self._full)

    def project(self, g: Array) -> Array:
        """Return elements of the group next to matrices that are off it by rounding or truncation,
        (…, N, N).

        SO(n): one step of Newton–Schulz. Others: put back also into the group's associative
        algebra, its normaliser, and to unit determinants, each to second order. Elements of O(N)
        that normalise 𝔤 stay what they are: only Ad_g enters an LR system.
        """
        return self._projection.project(g)

    def defect(self, g: Array) -> Array:
        """Return how far matrices (…, N, N) are from the group, (…): the largest entry of what
        ``project`` has to mend.
        """
        return self._projection.defect(g)

    def validate(self, g: Any, path: Path = ("g",)) -> Array:
        """Return a given matrix (real, or complex where the group is) on the group; raises
        InvalidInput beyond 1e-9.
        """
        matrix = self._of_this_size(g, path)
        largest = float(np.max(np.abs(matrix)))
        # squares of huge entries overflow
        defect = float(self.defect(matrix)) if largest < 2 else largest
        if not defect <= INPUT_TOLERANCE:
            raise InvalidInput(
                path, "a matrix of the group to 1e-9", f"one that is off it by {defect:.3g}"
            )
        return self.project(matrix)

    def algebra_element(self, X: Any, path: Path) -> Array:
        """Return the coordinates of a given matrix of 𝔤; raises InvalidInput when it is off 𝔤 by
        more than 1e-9 of its size.
        """
        matrix = self._of_this_size(X, path)
        largest = float(np.max(np.abs(matrix)))
        if largest == 0:
            return np.zeros(self.dimension)
        unit = matrix / largest
        x = self.coordinates((unit - unit.T) / 2)
        distance = float(np.max(np.abs(self.element(x) - unit)))
        if distance > INPUT_TOLERANCE:
            required = "a matrix of the group's Lie algebra to 1e-9 of its largest entry"
            raise InvalidInput(path, required, f"one that is off by {distance:.3g} of it")
        return np.asarray(largest * x, dtype=np.float64)

    def _of_this_size(self, matrix: Any, path: Path) -> Array:
        rows = _square(matrix, path)
        found = (
            rows.real
            if not np.iscomplexobj(rows) and rows.shape[0] == self.size
            else _real_form(rows)
        )
        if found.shape != (self.size, self.size):
            raise InvalidInput(
                path, f"{self.size} rows of {self.size} numbers", f"{len(rows)} rows"
            )
        return np.array(found, dtype=np.float64)

    def _require_closed(self) -> None:
        products = self.basis[:, None] @ self.basis[None, :]
        brackets = products - np.swapaxes(products, 0, 1)
        distance = np.max(
            np.abs(self.element(self.coordinates(brackets)) - brackets), axis=(-2, -1)
        )
        a, b = (int(i) for i in np.unravel_index(np.argmax(distance), distance.shape))
        if distance[a, b] > INPUT_TOLERANCE:
            given = (
                f"a bracket of (orthonormalised) elements {a} and {b} that leaves their span "
                f"by {distance[a, b]:.3g}"
            )
            raise InvalidInput(("basis",), "a basis closed under brackets to 1e-9", given)


def _real_form(matrix: Any) -> Array:
    """Return A + iB as [[A, −B], [B, A]]."""
    return np.block([[matrix.real, -matrix.imag], [matrix.imag, matrix.real]])


def _square(value: Any, path: Path) -> Any:
    """Return a square matrix of validated numbers, real where it has no imaginary part."""
    matrix = complex_array(value, path, "a square matrix")
    if matrix.ndim != 2 or not 0 < len(matrix) == matrix.shape[1]:
        raise InvalidInput(path, "a square matrix", show(value))
    return matrix if np.any(matrix.imag) else matrix.real


def _matrices(basis: Any) -> tuple[Array, float]:
    """Return given basis matrices in real form, and the weight of ⟨X,Y⟩ there: ½ where they were
    complex.
    """
    items = list(basis) if isinstance(basis, (Sequence, np.ndarray)) and has_entries(basis) else []
    if not items:
        raise InvalidInput(("basis",), "a list of square matrices", show(basis))
    found = require_each(_square, items, ("basis",))
    for a, matrix in enumerate(found):
        if matrix.shape != found[0].shape:
            raise InvalidInput(
                ("basis", a), f"{len(found[0])} rows like the first", f"{len(matrix)} rows"
            )
    if any(np.iscomplexobj(matrix) for matrix in found):
        return np.array([_real_form(matrix) for matrix in found]), 0.5
    return np.array(found), 1.0


def _require_skew(matrices: Array) -> None:
    for a, matrix in enumerate(matrices):
        largest = float(np.max(np.abs(matrix)))
        defect = float(np.max(np.abs(matrix + matrix.T)))
        if largest == 0 or defect > INPUT_TOLERANCE * largest:
            required = (
                "a nonzero skew-symmetric (or skew-Hermitian) matrix, as the algebra of a "
                "compact group has"
            )
            raise InvalidInput(
                ("basis", a),
                required,
                "zero" if largest == 0 else f"one with |X + Xᵀ| up to {defect:.3g}",
            )


def orthonormal_rows(rows: Array, path: Path, required: str) -> Array:
    """Return rows after Gram–Schmidt (twice, so that they are orthonormal to rounding), in the
    order given. Raises InvalidInput for a row within 1e-10 of the span of those before it.
    """
    done = np.zeros((0, rows.shape[1]))
    for a, row in enumerate(rows):
        unit = row / (np.max(np.abs(row)) or 1.0)
        unit = unit / (np.linalg.norm(unit) or 1.0)
        for _ in range(2):
            unit = unit - (done @ unit) @ done
        length = float(np.linalg.norm(unit))
        if not length > _INDEPENDENT:
            given = f"one within {length:.1g} of the span of those before it"
            raise InvalidInput((*path, a), required, given)
        done = np.vstack([done, unit / length])
    return done
