"""Are rank-one systems with nonhomogeneous constraints integrable for n > 3? Growth of neighbours.

    python benchmarks/closing_questions.py [time] [picture.svg]

The constraints are ⟨ω, e_p∧e_q⟩ = w_pq, 2 ≤ p < q, constant, the inertia is the special one, A from
1.8 to 0.4. With Θ = Σ w_pq e_p∧e_q and P̃ = Σ P_k e_k + 𝓘(Θ)q, P_k constant and |P| = 1.5,

    ξ = det A/(q,Aq) [A⁻¹P̃ − (P̃,A⁻¹q) q],    ω = q∧ξ + Θ,    ė_i = −ω e_i.

The distance of two motions, 1e-7 at first, is brought back to that every 5 units of time. Its
growth is summed. Three random starts of each kind. Prints (1/t) ln growth over the second half of
the time, and how far the integral ½⟨𝓘ω,ω⟩ − ⟨𝓘ω,Θ⟩ has moved. docs/closing-questions.md says what
this does not prove.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

DISTANCE = 1e-7
STRETCH = 5.0
STARTS = 3
KINDS = (
    ("n = 3, w ≠ 0", 3, "generic"),
    ("n = 4, w = 0", 4, "none"),
    ("n = 4, w generic", 4, "generic"),
    ("n = 4, w along P", 4, "along"),
    ("n = 4, w across P", 4, "across"),
)


@dataclass(frozen=True)
class System:
    """A (n,) · P (n−1,) · w (n, n), antisymmetric, zero in row and column 1."""

    A: Any
    P: Any
    w: Any

    @property
    def inertia(self) -> Any:
        """Return A_iA_j/det A."""
        return np.outer(self.A, self.A) / np.prod(self.A)

    def angular_velocity(self, E: Any) -> tuple[Any, Any]:
        """Return ω and Θ at frames (..., n, n)."""
        q = E[..., 0]
        Theta = E @ self.w @ np.swapaxes(E, -1, -2)
        momentum = E[..., 1:] @ self.P + np.einsum("...ij,...j->...i", self.inertia * Theta, q)
        across = momentum / self.A
        along = np.sum(across * q, axis=-1)[..., None]
        scale = np.prod(self.A) / np.sum(self.A * q * q, axis=-1)[..., None]
        xi = scale * (across - along * q)
        wedge = q[..., :, None] * xi[..., None, :]
        return wedge - np.swapaxes(wedge, -1, -2) + Theta, Theta

    def integral(self, E: Any) -> Any:
        """Return ½⟨𝓘ω,ω⟩ − ⟨𝓘ω,Θ⟩."""
        omega, Theta = self.angular_velocity(E)
        momentum = self.inertia * omega
        return np.sum(momentum * (omega / 2 - Theta), axis=(-1, -2)) / 2

    def advance(self, pair: Any, time: float) -> Any:
        """Return two frames (2, n, n) after a time, orthonormal."""

        def field(_: float, y: Any) -> Any:
            E = y.reshape(pair.shape)
            return -(self.angular_velocity(E)[0] @ E).ravel()

        found = solve_ivp(field, (0, time), pair.ravel(), "DOP853", rtol=1e-12, atol=1e-13)
        U, _, V = np.linalg.svd(found.y[:, -1].reshape(pair.shape))
        return U @ V


def systems() -> Iterator[tuple[str, System, Any]]:
    """Yield name, system and first frame of every run."""
    rng = np.random.default_rng(1)
    for name, n, kind in KINDS:
        for _ in range(STARTS):
            A = np.linspace(1.8, 0.4, n)
            E = np.linalg.qr(rng.normal(size=(n, n)))[0]
            P = rng.normal(size=n - 1)
            P *= 1.5 / np.linalg.norm(P)
            w = np.zeros((n, n))
            if n == 3:
                w[1, 2] = rng.normal()
            elif kind != "none":
                vector = rng.normal(size=3)
                if kind == "along":
                    vector = P * rng.uniform(0.3, 1)
                if kind == "across":
                    vector -= vector @ P / (P @ P) * P
                w[2, 3], w[1, 3], w[1, 2] = vector * [1, -1, 1]
            yield name, System(A, P, w - w.T), E


def growth(system: System, E: Any, time: float) -> tuple[Any, float]:
    """Return ln growth after every stretch, and the change of the integral."""
    X = np.random.default_rng(0).normal(size=E.shape)
    turn = np.eye(len(E)) + DISTANCE * (X - X.T) / np.linalg.norm(X - X.T)
    U, _, V = np.linalg.svd(turn @ E)
    pair = np.stack([E, U @ V])
    first = system.integral(E)
    before = np.linalg.norm(pair[1] - pair[0])
    sums = []
    for _ in range(round(time / STRETCH)):
        pair = system.advance(pair, STRETCH)
        apart = pair[1] - pair[0]
        length = np.linalg.norm(apart)
        sums.append(np.log(length / before))
        U, _, V = np.linalg.svd(pair[0] + apart * (DISTANCE / length))
        pair[1] = U @ V
        before = np.linalg.norm(pair[1] - pair[0])
    return np.cumsum(sums), float(abs(system.integral(pair[0]) - first))


def main() -> None:
    """Print one row for each start, and draw the growths where a file is named."""
    time = float(sys.argv[1]) if len(sys.argv) > 1 else 1600.0
    curves = []
    for name, system, E in systems():
        sums, off = growth(system, E, time)
        half = len(sums) // 2
        exponent = (sums[-1] - sums[half - 1]) / (STRETCH * (len(sums) - half))
        print(f"{name:18} exponent {exponent:8.4f}   integral off by {off:.0e}", flush=True)
        curves.append((name, sums))
    if len(sys.argv) > 2:
        draw(curves, sys.argv[2])


def draw(curves: list[tuple[str, Any]], file: str) -> None:
    """Write the picture: ln growth against time, one colour for each kind."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7, 4))
    axes = figure.subplots()
    names = [name for name, *_ in KINDS]
    for i, (name, sums) in enumerate(curves):
        label = name if i % STARTS == 0 else None
        axes.plot(STRETCH * (1 + np.arange(len(sums))), sums, f"C{names.index(name)}", label=label)
    axes.set_xlabel("t")
    axes.set_ylabel("ln growth of the distance")
    axes.legend()
    figure.tight_layout()
    figure.savefig(file)


if __name__ == "__main__":
    main()
