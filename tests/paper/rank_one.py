"""The rank-one flow on T*Sⁿ⁻¹ with inertia (4.5, printed 5.11): extended to R²ⁿ, as a geodesic flow
in Chaplygin's time τ, and separated.

Every function takes the diagonal of A, shape (n,), and states of shape (..., n), and works along
the leading axes. Velocities and momenta in t are q̇ and p (``integrals.momentum``), those in τ, dτ
= √(det A/(Aq,q)) dt, are v = dq/dτ and p̃.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from paper.separation import neumann_polynomial
from veselova import InvalidInput, NeumannSystem, Veselova
from veselova.mechanics.core.exact_input import positive_number
from veselova.mechanics.geometry import integrals_of_motion as integrals
from veselova.mechanics.geometry.integrals_of_motion import tangent_basis, to_spheroconic
from veselova.mechanics.geometry.sphere import INPUT_TOLERANCE

__all__ = [
    "abel_jacobi_sums",
    "bracket_field",
    "chaplygin_rate",
    "constraint_multiplier",
    "dirac_tensor",
    "extended_field",
    "extended_hamiltonian",
    "geodesic_field",
    "geodesic_hamiltonian",
    "geodesic_lagrangian",
    "geodesic_momentum",
    "geodesic_to_neumann",
    "invariant_density",
    "neumann_to_geodesic",
    "nonholonomic_force",
    "separated_energies",
    "separation_constants",
    "spheroconic_velocity",
    "stackel_metric",
    "velocity",
]

Array = NDArray[np.float64]


def _dot(first: Array, second: Array) -> Array:
    """Return (x,y), with an axis of length one kept."""
    return np.asarray(np.sum(first * second, axis=-1, keepdims=True), dtype=np.float64)


def _weight(A: Array, q: Array) -> Array:
    """Return det A/(q,Aq), with an axis of length one kept."""
    scaled, k = integrals.unit_scale(A)
    return np.asarray(
        np.ldexp(np.prod(scaled) / _dot(q, scaled * q), k * (A.size - 1)), dtype=np.float64
    )


def velocity(A: Array, q: Array, p: Array) -> Array:
    """Return q̇ = det A/(q,Aq)·[A⁻¹p − (p,A⁻¹q)/(q,q) q], equation (dot_q), extended to R²ⁿ."""
    return np.asarray(_weight(A, q) * (p / A - _dot(p, q / A) / _dot(q, q) * q), dtype=np.float64)


def constraint_multiplier(A: Array, q: Array, p: Array) -> Array:
    """Return Λ = det A·[(p,A⁻¹p) − (p,q)(q,A⁻¹p)]/(q,Aq) of (dot_p, printed 6.7), ṗ = −Λq on the
    unit sphere, shape (...).
    """
    return np.asarray(
        (_weight(A, q) * (_dot(p, p / A) - _dot(p, q) * _dot(q, p / A)))[..., 0], dtype=np.float64
    )


def extended_field(A: Array, q: Array, p: Array) -> tuple[Array, Array]:
    """Return (q̇,ṗ) of the system (extended, printed 6.8) on R²ⁿ; it keeps (q,q) and (q,p)."""
    qq = _dot(q, q)
    force = _weight(A, q) * (_dot(p, p / A) * qq - _dot(p, q) * _dot(q, p / A)) / (qq * qq)
    return velocity(A, q, p), np.asarray(-force * q, dtype=np.float64)


def extended_hamiltonian(A: Array, q: Array, p: Array) -> Array:
    """Return Ĥ = ½ det A·(p,A⁻¹p)/(q,Aq), shape (...); the energy h where (q,p) = 0."""
    return np.asarray((_weight(A, q) * _dot(p, p / A) / 2)[..., 0], dtype=np.float64)


def nonholonomic_force(A: Array, q: Array, q_dot: Array) -> Array:
    """Return π_i = ∂Ψ/∂ξ_i = [(q̇,Aq̇)A_iq_i − (q̇,Aq)A_iq̇_i]/det A of (Pi, printed 6.3) and (43,
    printed 6.4), which is ∂L/∂q_i as well.
    """
    A, k = integrals.unit_scale(A)
    force = _dot(q_dot, A * q_dot) * A * q - _dot(q_dot, A * q) * A * q_dot
    return np.asarray(np.ldexp(force / np.prod(A), k * (2 - A.size)), dtype=np.float64)


def dirac_tensor(q: Array, p: Array) -> Array:
    """Return the tensor J of the Dirac bracket, {F,G}_* = ∇F·J∇G on R²ⁿ = (q,p), for φ₁ = (q,q), φ₂
    = (q,p), (..., 2n, 2n).

    {F,G}_* = {F,G} − ({F,φ₁}{G,φ₂} − {F,φ₂}{G,φ₁})/{φ₁,φ₂}; with the sign that is printed φ₁ and φ₂
    are no Casimir functions.
    """
    n = q.shape[-1]
    zero = np.zeros_like(q)
    standard = np.block([[np.zeros((n, n)), np.eye(n)], [-np.eye(n), np.zeros((n, n))]])
    first, second = (
        x @ standard.T
        for x in (np.concatenate([2 * q, zero], axis=-1), np.concatenate([p, q], axis=-1))
    )
    outer = first[..., :, None] * second[..., None, :] / (2 * _dot(q, q))[..., None]
    return np.asarray(standard - outer + np.swapaxes(outer, -1, -2), dtype=np.float64)


def bracket_field(A: Array, q: Array, p: Array) -> tuple[Array, Array]:
    """Return ({q,Ĥ}_*, {p,Ĥ}_* − π̂), which is (extended) where (q,p) = 0, whatever (q,q).

    Of π̂ the part orthogonal to q is taken: all of it, as printed, would not keep (q,p), for (q,π)
    = 2h.
    """
    twice_energy = 2 * extended_hamiltonian(A, q, p)[..., None]
    gradient = np.concatenate(
        [-twice_energy / _dot(q, A * q) * A * q, _weight(A, q) * p / A], axis=-1
    )
    field = np.einsum("...ij,...j->...i", dirac_tensor(q, p), gradient)
    q_dot = field[..., : q.shape[-1]]
    p_dot = field[..., q.shape[-1] :]
    force = nonholonomic_force(A, q, q_dot)
    return q_dot, p_dot - (force - _dot(q, force) / _dot(q, q) * q)


def invariant_density(A: Array, q: Array) -> Array:
    """Return (Aq,q)^(−(n−2)/2), the density of the invariant measure on T*Sⁿ⁻¹ (Corollary redLR),
    shape (...).
    """
    return np.asarray(_dot(q, A * q)[..., 0] ** (-(A.size - 2) / 2), dtype=np.float64)


def chaplygin_rate(A: Array, q: Array) -> Array:
    """Return dτ/dt = 𝒩 = √(det A/(Aq,q)), the reducing multiplier of Theorem main, shape (...)."""
    return np.asarray(np.sqrt(_weight(A, q)[..., 0]), dtype=np.float64)


def geodesic_lagrangian(A: Array, q: Array, v: Array) -> Array:
    """Return L* = [(Av,v)(Aq,q) − (Aq,v)²]/(2(q,Aq)), equation (L^*), v = dq/dτ, shape (...)."""
    w = integrals.sliding_velocity(A, q, v)
    return np.asarray((_dot(w, A * w) / 2)[..., 0], dtype=np.float64)


def geodesic_momentum(A: Array, q: Array, v: Array) -> Array:
    """Return p̃ = ∂L*/∂v = Av − (Aq,v)/(q,Aq) Aq = 𝒩p; (q,p̃) = 0."""
    return np.asarray(A * integrals.sliding_velocity(A, q, v), dtype=np.float64)


def geodesic_hamiltonian(A: Array, p_tilde: Array) -> Array:
    """Return H* = ½(p̃,A⁻¹p̃), the Legendre transform of L* on T*Sⁿ⁻¹, (q,p̃) = 0, shape (...)."""
    return np.asarray((_dot(p_tilde, p_tilde / A) / 2)[..., 0], dtype=np.float64)


def geodesic_field(A: Array, q: Array, p_tilde: Array) -> tuple[Array, Array]:
    """Return (dq/dτ, dp̃/dτ) = ({q,H*}_*, {p̃,H*}_*) = (A⁻¹p̃ − (q,A⁻¹p̃)q, (q,A⁻¹p̃)p̃ −
    (p̃,A⁻¹p̃)q), |q| = 1.
    """
    slope = p_tilde / A
    along = _dot(q, slope)
    return slope - along * q, along * p_tilde - _dot(p_tilde, slope) * q


def geodesic_to_neumann(A: Array, q: Array, v: Array) -> Array:
    """Return q' = v/√(2h), h = L*(q,v), the Neumann velocity of a geodesic's (Proposition N->Geo);
    then F_0(q,q') = 0.
    """
    return np.asarray(v / np.sqrt(2 * geodesic_lagrangian(A, q, v))[..., None], dtype=np.float64)


def neumann_to_geodesic(q_prime: Array, energy: float) -> Array:
    """Return v = √(2h) q', the velocity of the geodesic of energy h that a Neumann motion with F_0
    = 0 is in τ = τ₁/√(2h).
    """
    return np.asarray(np.sqrt(2 * energy) * q_prime, dtype=np.float64)


def spheroconic_velocity(A: Array, q: Array, q_dot: Array) -> Array:
    """Return dλ_1 … dλ_{n−1} from dq = q̇, of λ_s as ``to_spheroconic`` orders them, shape (...,
    n−1).

    With the unit eigenvector x_s of A⁻¹ restricted to q⊥, dλ_s = −2(x_s,q̇)(q,A⁻¹x_s): no pole
    where some q_i = 0.
    """
    basis = tangent_basis(q)
    vectors = basis @ np.linalg.eigh(np.swapaxes(basis, -1, -2) @ ((1 / A)[:, None] * basis))[1]
    along, weighted = (np.einsum("...i,...is->...s", x, vectors) for x in (q_dot, q / A))
    return np.asarray(-2 * along * weighted, dtype=np.float64)


def _products(A: Array, spheroconic: Array) -> tuple[Array, Array]:
    """Return Π_i(λ_s−I_i)·λ_s and Π_{k≠s}(λ_s−λ_k)."""
    difference = spheroconic[..., :, None] - spheroconic[..., None, :]
    difference = difference + np.eye(spheroconic.shape[-1])
    return np.prod(spheroconic[..., None] - 1 / A, axis=-1) * spheroconic, np.prod(
        difference, axis=-1
    )


def stackel_metric(A: Array, spheroconic: Array) -> Array:
    """Return the m_s > 0 of L* = ½ Σ m_s (dλ_s/dτ)², m_s = −Π_{k≠s}(λ_s−λ_k)/(4 Π_i(λ_s−I_i) λ_s),
    shape (..., n−1).

    The line after (prod_n, printed 6.14), with the minus sign that the print lacks. The momenta are
    μ_s = m_s dλ_s/dτ.
    """
    below, above = _products(A, spheroconic)
    return np.asarray(-above / (4 * below), dtype=np.float64)


def separated_energies(A: Array, spheroconic: Array, momenta: Array) -> Array:
    """Return −4 Π_i(λ_s−I_i) λ_s μ_s², which Stäckel's separation makes a polynomial 2h
    Π_{k≥2}(λ_s−c_k) in λ_s, (..., n−1).
    """
    below, _ = _products(A, spheroconic)
    return np.asarray(-4 * below * momenta * momenta, dtype=np.float64)


def separation_constants(A: Array, spheroconic: Array, momenta: Array) -> Array:
    """Return the coefficients of 2h Π_{k≥2}(λ−c_k), constant term first, from a point (λ,μ): the
    n−1 integrals, (..., n−1).
    """
    powers = spheroconic[..., :, None] ** np.arange(spheroconic.shape[-1])
    energies = separated_energies(A, spheroconic, momenta)
    return np.asarray(np.linalg.solve(powers, energies[..., None])[..., 0], dtype=np.float64)


def abel_jacobi_sums(A: Array, q: Array, q_prime: Array) -> Array:
    """Return Σ_s λ_s^(k−1) λ_s'/(2√R(λ_s)), k = 1 … n−1, of (quad_neumann, printed 6.26) in time
    τ₁, with R = −Φ²𝓕 of (Rad, printed 6.12), shape (..., n−1).

    Along a motion they are δ_{k,n−1}: (quad_N, printed 6.11) in τ = τ₁/√(2h). The sign of √R is
    that of λ_s' Π_{k≠s}(λ_s−λ_k).
    """
    P = q[..., :, None] * q_prime[..., None, :]
    squares = np.moveaxis((P - np.swapaxes(P, -1, -2)) ** 2, (-2, -1), (0, 1))[..., None]
    inverse = 1 / A
    spheroconic = to_spheroconic(A, q)
    rates = spheroconic_velocity(A, q, q_prime)
    invariant, _ = neumann_polynomial(
        spheroconic, inverse, np.moveaxis(q * q, -1, 0)[..., None], squares
    )
    R = -np.prod(spheroconic[..., None] - inverse, axis=-1) * invariant
    signs = np.sign(rates * _products(A, spheroconic)[1])
    terms = rates / (2 * signs * np.sqrt(np.abs(R)))
    return np.stack([np.sum(spheroconic**k * terms, axis=-1) for k in range(A.size - 1)], axis=-1)


def from_neumann(system: NeumannSystem, energy: Any, frame: Any = None) -> Veselova:
    """Return the problem of energy h > 0 whose motion in time τ₁ is that of a Neumann system
    (Theorem LR→Nn): q̇ = q' √(2h det A/(Aq,q)).

    Raises InvalidInput unless F_0 = 0, equation (4.8, printed 6.17), to 1e-9 of (Aq,q).
    """
    h = float(positive_number(energy, ("energy",)))
    A, q, v = system.A, system.q, system.q_prime
    F0 = float(system.integrals(system.start)["F0"][0] / (q @ (A * q)))
    if abs(F0) > INPUT_TOLERANCE:
        required = "F_0 = 0, equation (4.8), to 1e-9 of (Aq,q)"
        raise InvalidInput(("q_prime",), required, f"F_0/(Aq,q) = {F0:.3g}")
    return Veselova(A, q, v * np.sqrt(h / integrals.energy(A, q, v)), frame, normalize=True)
