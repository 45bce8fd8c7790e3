"""Attitudes that turn with a rate known as a function on a torus, E' = W(z)E along z = z⁰ + fτ₁.

Where no column of E is known beforehand, E is no quadrature. Let one phase go round once. What
turns E meanwhile is a function M of the other phases x, and so are its iterates

    M_{2j}(x) = M_j(x + jρ) M_j(x),    ρ_l = f_l/|f_k|.

Where the motion of E is quasi-periodic these have about as many Fourier modes as M. So E after any
number of rounds is a product of as many of them as that number has binary digits.

Where there is one other phase, the eigenfunctions of M, as an operator on functions of it, give
Floquet's form, E = Re Σ_j ψ_j(z) e^{2πi α_jτ₁} ψ_j(z⁰)*, with Fourier series ψ_j.

A phase that goes round changes signs, W(z + e_l) = D_l W(z) D_l, and so does M. E is counted by
rounds in the signs of the first one.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import schur

from veselova.analytic.time_map.modes import LinearFlow
from veselova.mechanics.core.budget import checkpoint
from veselova.mechanics.core.errors import Unsolved
from veselova.mechanics.geometry.natural_frame import orthonormalize

__all__ = ["AttitudeOnTorus"]

Array = NDArray[np.float64]

#: Method: Gauss' nodes of a panel, panels of a round at first, points of a phase in the first grid.
_NODES, _PANELS, _FIRST = 10, 8, 16

#: Budget: panels of a round; starts for which they are tried; rounds in which E is followed from
#: panel to panel, and panels at once; points of the last grid.
_MOST_PANELS, _TRIED, _NEAR, _AT_ONCE, _MOST = 512, 64, 2000, 2000, 16_384

#: Calibrated: modes of M and of its products that are resolved, the part of those of a grid above
#: which they are to be, and what twice as many panels may change.
_RESOLVED, _OUTER_OF_M, _OUTER, _CONVERGED = 1e-14, 0.35, 0.45, 2e-14

#: Budget: modes of ψ_j in each phase. Calibrated: the outermost ones, and what ψ_j are off being
#: orthonormal, at most.
_MOST_IN_FORM, _ENDS, _SKEW = 256, 1e-13, 1e-11


class Floquet(NamedTuple):
    """E = Re Σ_j ψ_j(z) e^{2πi α_jτ₁} ψ_j(z⁰)*.

    - rates: (n,) α, cycles in τ₁
    - orders: (T, g) M; columns: (T,) nj + i; coefficients: (T,) c, largest first: entry i of ψ_j is
      the sum of its c e^{πi M·z}
    - start: (n, n) rows ψ_j(z⁰)*, of an inverse matrix
    - skew: what ψ_j are off being orthonormal
    """

    rates: Array
    orders: NDArray[np.int64]
    columns: NDArray[np.int64]
    coefficients: NDArray[np.complex128]
    start: NDArray[np.complex128]
    skew: float


@dataclass(frozen=True)
class AttitudeOnTorus:
    """The solution with E = 1 at z⁰.

    - rate: W at phases (N, g) and τ₁ from there on, (N, K), as (N, K, n, n)
    - flow: z⁰ and f, (g,)
    - signs: (g, n) the diagonals of D_l
    """

    rate: Callable[[Array, Array], Array]
    flow: LinearFlow
    signs: Array

    @cached_property
    def _fastest(self) -> int:
        """Return k, the phase that goes round."""
        return int(np.argmax(np.abs(self.flow.rates)))

    @cached_property
    def _period(self) -> float:
        return float(1 / np.abs(self.flow.rates[self._fastest]))

    @cached_property
    def _advance(self) -> Array:
        """Return ρ."""
        return np.delete(self.flow.rates, self._fastest) * self._period

    @cached_property
    def _halves(self) -> Array:
        """Return h (g−1, n, n): entries of M have the modes m + h."""
        D = np.delete(self.signs, self._fastest, axis=0)
        return np.asarray((1 - D[:, :, None] * D[:, None, :]) / 4)

    @cached_property
    def _panels(self) -> int:
        """Return the panels of a round. Raises Unsolved (``too-far``)."""
        z = np.random.default_rng(5).uniform(0.0, 1.0, (_TRIED, self.flow.rates.size))
        panels, found = _PANELS, self._along(z, _PANELS)[-1]
        while panels < _MOST_PANELS:
            finer = self._along(z, 2 * panels)[-1]
            if np.max(np.abs(finer - found)) <= _CONVERGED:
                return panels
            panels, found = 2 * panels, finer
        raise Unsolved("too-far", "the attitude turns too fast for panels")

    @cached_property
    def _round(self) -> Array:
        """Return what turns E until the borders of P panels of a round, (P+1, …, n, n), on a grid
        of the other phases that begins at z⁰. Raises Unsolved (``too-far``).
        """
        sides = (_FIRST,) * len(self._advance)
        while math.prod(sides) <= _MOST:
            others = _grid(sides).reshape(math.prod(sides), len(sides))
            z = self.flow.start + np.insert(others, self._fastest, 0.0, axis=1)
            found = self._along(z, self._panels)
            found = found.reshape(-1, *sides, *found.shape[-2:])
            open_ = self._unresolved(found[-1], _OUTER_OF_M)
            if not any(open_):
                return found
            sides = tuple(n << grows for n, grows in zip(sides, open_, strict=True))
        raise Unsolved("too-far", f"the attitude has more than {_MOST} Fourier modes")

    def _along(self, z: Array, panels: int) -> Array:
        """Return what turns E from phases z (N, g) until the borders of panels, (P+1, N, n, n)."""
        c, length, n = _gauss()[0], self._period / panels, self.signs.shape[1]
        found = [np.broadcast_to(np.eye(n), (len(z), n, n))]
        for p in range(panels):
            checkpoint("attitude", p, panels)
            rates = self.rate(z, np.broadcast_to(length * (p + c), (len(z), c.size)))
            found.append(orthonormalize(_transfer(rates, np.full(len(z), length)) @ found[-1]))
        return np.stack(found)

    def at(self, tau1: Array) -> Array:
        """Return E at τ₁ (N,), (N, n, n). Raises Unsolved (``too-far``)."""
        length = float(self._period / self._panels)
        border = np.floor(tau1 / length).astype(np.int64)
        near = np.max(np.abs(border)) <= _NEAR * self._panels
        E = (self._follow if near else self._jump)(border)
        first = np.asarray(border * length, dtype=np.float64)
        return orthonormalize(self._stretch(first, tau1 - first) @ E)

    def floquet(self) -> Floquet:
        """Return Floquet's form. Raises Unsolved (``too-many-modes``)."""
        if self._advance.size > 1:
            raise Unsolved(
                "too-many-modes", "documents have shells with two phases at most; solve at times"
            )
        turns, psi, shift = self._eigenfunctions()
        k, n, rho = self._fastest, self.signs.shape[1], float(np.sum(self._advance))
        half, count = (1 - self.signs[k]) / 4, 2 * len(psi) if self._advance.size else 1
        # ψ_j at the beginning of a round, where the other phase is x beyond z⁰, but for half waves
        x, order = np.arange(count) / count, np.arange(len(psi)) - len(psi) // 2
        begin = np.tensordot(np.exp(2j * np.pi * np.outer(x, order)), psi, 1)
        wave = np.exp(2j * np.pi * np.outer(x, shift))[:, :, None]
        z = self.flow.start + np.insert(np.outer(x, np.ones(self._advance.size)), k, 0.0, axis=1)
        panels = max(self._panels, _FIRST)
        while panels <= _MOST_IN_FORM:
            values = self._along(z, panels)[:-1] @ (wave * begin) / wave
            s, modes = np.arange(panels) / panels, np.fft.fftfreq(count, 1 / count)
            # s of a round later that phase is x + ρs
            late = np.exp(-2j * np.pi * np.multiply.outer(s, rho * (modes[:, None] + shift) + half))
            later = late[..., None] * np.exp(-2j * np.pi * np.outer(s, turns))[:, None, None]
            found = np.fft.fft(np.fft.fft(values, axis=1) * later, axis=0) / (count * panels)
            sizes = np.max(np.abs(found), axis=(2, 3))
            outer = [np.abs(np.fft.fftfreq(size)) > _OUTER for size in sizes.shape]
            if max(np.max(sizes[outer[0]]), np.max(sizes[:, outer[1]], initial=0.0)) < _ENDS:
                break
            panels *= 2
        else:
            raise Unsolved(
                "too-many-modes", f"the attitude has modes beyond {_MOST_IN_FORM}; solve at times"
            )
        along = np.sign(self.flow.rates[k]) * np.fft.fftfreq(panels, 1 / panels)
        doubled = np.empty((*found.shape, self.signs.shape[0]), np.int64)
        halves = np.sign(self.flow.rates[k]) * half
        doubled[..., k] = np.rint(2 * (along[:, None, None, None] + halves[:, None]))
        if self._advance.size:
            doubled[..., 1 - k] = np.rint(2 * (modes[:, None] + shift))[None, :, :, None]
        columns = np.broadcast_to(np.arange(n)[:, None] + n * np.arange(n), found.shape).ravel()
        orders = doubled.reshape(-1, doubled.shape[-1])
        coefficients = found.ravel() * np.exp(-1j * np.pi * (orders @ self.flow.start))
        first = np.argsort(-np.abs(coefficients))
        start = np.linalg.inv(psi.sum(axis=0))
        skew = float(np.max(np.abs(start - psi.sum(axis=0).conj().T)))
        terms = orders[first], columns[first], coefficients[first]
        return Floquet(turns / self._period, *terms, start, skew)

    def _eigenfunctions(self) -> tuple[Array, NDArray[np.complex128], Array]:
        """Return a (n,) with D_kM(x)ψ_j(x) = e^{2πi a_j}ψ_j(x + ρ), the modes of ψ_j but for half
        waves, (L, n, n) with j last, and the half waves (n,) of their entries.
        """
        k, n, rho = self._fastest, self.signs.shape[1], float(np.sum(self._advance))
        M = self._spectrum(self.signs[k][:, None] * self._round[-1]).reshape(-1, n, n)
        shift, halves = np.zeros(n), np.zeros((n, n))
        if self._advance.size:
            shift, halves = (1 - np.delete(self.signs, k, axis=0)[0]) / 4, self._halves[0]
        between = np.rint(shift[:, None] - shift - halves).astype(np.int64)
        size = 2 * len(M) if self._advance.size else 1
        if size > _MOST_IN_FORM:
            raise Unsolved("too-many-modes", "the attitude has too many Fourier modes")
        order = np.arange(size) - size // 2
        apart = np.subtract.outer(order, order)[:, None, :, None] + between[:, None, :]
        known = M[apart % len(M), np.arange(n)[:, None, None], np.arange(n)]
        known = np.where(2 * np.abs(apart) <= len(M), known, 0)
        known = known * np.exp(-2j * np.pi * rho * (order[:, None] + shift))[:, :, None, None]
        operator = known.reshape(size * n, size * n)
        if size > 1:
            values, vectors = np.linalg.eig(operator)
        else:  # orthogonal, and often the identity
            triangle, vectors = schur(operator, output="complex")
            values = np.diag(triangle)
        vectors = vectors.reshape(size, n, -1)
        # any e^{2πimx}ψ_j is one too: those of the lowest modes
        lowest = np.argsort(order**2 @ np.sum(np.abs(vectors) ** 2, axis=1))
        at_zero, chosen = vectors.sum(axis=0), [int(lowest[0])]
        for c in lowest[1:].tolist():
            together = np.abs(at_zero[:, chosen].conj().T @ at_zero[:, c])
            if len(chosen) < n and np.max(together) < 0.5:
                chosen.append(c)
        psi, turns = vectors[:, :, chosen], np.angle(values[chosen]) / (2 * np.pi)
        skew = np.abs(at_zero[:, chosen].conj().T @ at_zero[:, chosen] - np.eye(len(chosen)))
        ends = np.max(np.abs(psi[[0, -1]])) if size > 1 else 0.0
        if len(chosen) == n and np.max(skew) < _SKEW and ends < _ENDS:
            return turns, psi, shift
        raise Unsolved("too-many-modes", "the attitude is resonant to rounding; solve at times")

    def _stretch(self, first: Array, lengths: Array) -> Array:
        """Return what turns E from τ₁ (N,) on along stretches, (N, n, n)."""
        steps = first[:, None] + lengths[:, None] * _gauss()[0]
        rates = self.rate(self.flow.start[None], steps.reshape(1, -1))
        return _transfer(rates.reshape(*steps.shape, *rates.shape[-2:]), lengths)

    def _follow(self, border: NDArray[np.int64]) -> Array:
        """Return E at borders of panels, by those from z⁰ until there."""
        length, n = self._period / self._panels, self.signs.shape[1]
        low, high = min(int(border.min()), 0), max(int(border.max()), 0)
        found = np.empty((high - low + 1, n, n))
        found[-low] = np.eye(n)
        for direction, last in ((1, high), (-1, low)):
            for i in range(0, last, direction * _AT_ONCE):
                checkpoint("attitude", abs(i), high - low)
                places = np.arange(i, direction * min(abs(i) + _AT_ONCE, abs(last)), direction)
                first = np.asarray(places * length, dtype=np.float64)
                steps = self._stretch(first, np.full(places.size, direction * length))
                for k, step in zip((places - low).tolist(), steps, strict=True):
                    found[k + direction] = orthonormalize(step @ found[k])
        return found[border - low]

    def _jump(self, border: NDArray[np.int64]) -> Array:
        """Return E at borders of panels, by rounds."""
        borders, signs = self._round, self.signs[self._fastest]
        rounds, panel = np.divmod(border, self._panels)
        E = self._after(rounds, signs[:, None] * borders[-1])
        for p in np.unique(panel).tolist():
            rows = panel == p
            E[rows] = self._interpolate(borders[p], rounds[rows, None] * self._advance) @ E[rows]
        odd = (rounds % 2 != 0)[:, None, None]
        return np.asarray(np.where(odd, signs[:, None], 1.0) * E)

    def _after(self, rounds: NDArray[np.int64], M: Array) -> Array:
        """Return E after so many rounds (N,), before z⁰ where they are negative."""
        E = np.broadcast_to(np.eye(M.shape[-1]), (rounds.size, *M.shape[-2:])).copy()
        left, length = np.abs(rounds), 1
        begin = np.minimum(rounds, 0)
        while True:
            odd = np.flatnonzero(left % 2)
            E[odd] = self._interpolate(M, begin[odd, None] * self._advance) @ E[odd]
            begin[odd] += length
            left //= 2
            if not np.any(left):
                break
            checkpoint("attitude")
            M = orthonormalize(self._shift(M, length * self._advance) @ M)
            length *= 2
            if any(self._unresolved(M, _OUTER)):
                raise Unsolved("too-far", "the attitude has more and more Fourier modes")
        E[rounds < 0] = np.swapaxes(E[rounds < 0], 1, 2)
        return E

    def _half_waves(self, x: Array) -> Array:
        """Return e^{2πi h·x} at x (…, g−1), (…, n, n)."""
        return np.asarray(np.exp(2j * np.pi * np.tensordot(np.mod(x, 2.0), self._halves, 1)))

    def _spectrum(self, M: Array) -> NDArray[np.complex128]:
        """Return the Fourier coefficients of M but for its half waves, axes as of M."""
        sides = M.shape[:-2]
        axes = tuple(range(len(sides)))
        return np.fft.fftn(M / self._half_waves(_grid(sides)), axes=axes) / math.prod(sides)

    def _unresolved(self, M: Array, part: float) -> list[bool]:
        """Return whether M has modes in the outer part of those of its grid, for each axis."""
        sizes = np.max(np.abs(self._spectrum(M)), axis=(-2, -1))
        outer = [np.abs(np.fft.fftfreq(n)) > part for n in sizes.shape]
        parts = [np.compress(rows, sizes, axis=k) for k, rows in enumerate(outer)]
        return [bool(np.max(x) > _RESOLVED) for x in parts]

    def _shift(self, M: Array, x: Array) -> Array:
        """Return M at the places of the grid moved by x (g−1,)."""
        found, sides = self._spectrum(M) * math.prod(M.shape[:-2]), M.shape[:-2]
        for k, n in enumerate(sides):
            waves = _waves(n, x[k : k + 1])[0]
            found = found * waves.reshape(-1, *(1,) * (found.ndim - k - 1))
        periodic = np.fft.ifftn(found, axes=tuple(range(len(sides))))
        return np.asarray((periodic * self._half_waves(_grid(sides) + x)).real)

    def _interpolate(self, M: Array, x: Array) -> Array:
        """Return M at x (N, g−1) beyond z⁰, (N, n, n)."""
        found = np.broadcast_to(self._spectrum(M), (len(x), *M.shape))
        for k, n in enumerate(M.shape[:-2]):
            found = np.einsum("nm,nm...->n...", _waves(n, x[:, k]), found)
        return np.asarray((found * self._half_waves(x)).real)


def _grid(sides: tuple[int, ...]) -> Array:
    """Return the points x_k = j/N_k, (…, g−1)."""
    return np.asarray(np.moveaxis(np.indices(sides), 0, -1) / np.array(sides), dtype=np.float64)


def _waves(count: int, x: Array) -> NDArray[np.complex128]:
    """Return e^{2πi mx} for the modes m of a grid, (N, count)."""
    return np.exp(2j * np.pi * np.outer(np.mod(x, 1.0), np.fft.fftfreq(count, 1 / count)))


@lru_cache
def _gauss() -> tuple[Array, Array, Array]:
    """Return Gauss' nodes of [0, 1], their weights, and the matrix that takes values at the nodes
    to integrals from 0 to each of them.
    """
    places, weights = np.polynomial.legendre.leggauss(_NODES)
    known = np.polynomial.legendre.legvander(places, _NODES)
    # ∫_{−1}^x P_k = (P_{k+1} − P_{k−1})/(2k + 1) with P_{−1} = −1
    before = np.column_stack([-np.ones(_NODES), known[:, : _NODES - 1]])
    of_values = (weights[:, None] * known[:, :-1]).T
    return (1 + places) / 2, weights / 2, (known[:, 1:] - before) @ of_values / 4


def _transfer(rates: Array, lengths: Array) -> Array:
    """Return E(h), E' = WE, E(0) = 1, from W at Gauss' nodes of [0, h], (N, K, n, n), by
    collocation there.
    """
    count, nodes, n, _ = rates.shape
    _, weights, inner = _gauss()
    scaled = rates * lengths[:, None, None, None]
    system = np.eye(nodes * n) - np.einsum("ij,gjab->giajb", inner, scaled).reshape(
        count, nodes * n, nodes * n
    )
    ones = np.broadcast_to(np.tile(np.eye(n), (nodes, 1)), (count, nodes * n, n))
    inside = np.linalg.solve(system, ones).reshape(count, nodes, n, n)
    return np.asarray(np.eye(n) + np.einsum("j,gjab,gjbc->gac", weights, scaled, inside))
