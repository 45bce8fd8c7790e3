r"""
Chaos in a potential
====================

Without a potential the body's motion is quasi-periodic. In a potential that
separates in no coordinates it need not be. Each colour is one motion; a dot
is drawn where its γ crosses the plane :math:`\gamma_3 = 0` upwards.
Quasi-periodic motions draw curves, chaotic ones fill a region.
"""

import numpy as np
from matplotlib import pyplot as plt

import veselova as vs

inertia = np.array([1.0, 2.0, 3.0])
form = np.array(
    [[1.0, 0.3, 0.0], [0.3, 0.0, 0.4], [0.0, 0.4, 0.0]]
)  # V = (γ, Mγ)
terms = [([2, 0, 0], 1.0), ([1, 1, 0], 0.6), ([0, 1, 1], 0.8)]
potential = {
    "polynomial": [{"powers": p, "coefficient": c} for p, c in terms]
}


def field(state):
    """Return 𝓘Ω̇ = 𝓘Ω×Ω + γ×∂V/∂γ + λγ and γ̇ = γ×Ω of many bodies."""
    gamma, Omega = state
    force = np.cross(inertia * Omega, Omega) + np.cross(
        gamma, 2 * gamma @ form
    )
    multiplier = -(gamma / inertia * force).sum(1) / (
        gamma**2 / inertia
    ).sum(1)
    return np.stack(
        [
            np.cross(gamma, Omega),
            (force + multiplier[:, None] * gamma) / inertia,
        ]
    )


def advance(state, step):
    """Return the state a step of Runge and Kutta later."""
    a = field(state)
    b = field(state + step / 2 * a)
    c = field(state + step / 2 * b)
    return state + step / 6 * (a + 2 * b + 2 * c + field(state + step * c))


# %%
# Starts of equal energy on the plane, in several directions. A solution
# checks the step.

angle, turn = (
    x.ravel()
    for x in np.meshgrid(np.linspace(-3, 3, 6), np.linspace(0.2, 2.9, 8))
)
gamma = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
axis = np.sin(turn)[:, None] * [0, 0, 1] + np.cos(turn)[:, None] * np.cross(
    [0, 0, 1], gamma
)
twice = 2 * (2.6 - np.einsum("ni,ij,nj->n", gamma, form, gamma))
Omega = axis * np.sqrt(twice / (axis**2 @ inertia))[:, None]
state, step = np.stack([gamma, Omega]), 0.04
exact = vs.solve(
    vs.VeselovaSO3(inertia, gamma[0], Omega[0], potential, normalize=True),
    [10],
)
dots = []
for k in range(12_000):
    later = advance(state, step)
    if k == 249:
        print(
            "difference at t = 10:",
            f"{np.abs(later[0, 0] - exact.gamma[0]).max():.0e}",
        )
    low, high = state[0, :, 2], later[0, :, 2]
    for n in np.flatnonzero((low < 0) & (high >= 0)):
        crossing = state[:, n] - low[n] / (high[n] - low[n]) * (
            later[:, n] - state[:, n]
        )
        dots.append(
            (n, np.arctan2(crossing[0, 1], crossing[0, 0]), crossing[1, 2])
        )
    state = later

number, direction, rate = np.array(dots).T
figure, axes = plt.subplots(figsize=(9.5, 6.2), layout="constrained")
axes.scatter(
    direction, rate, s=1.8, c=number * 37 % 48, cmap="turbo", linewidths=0
)
axes.set(
    xlabel=r"direction of $\gamma$",
    ylabel=r"$\Omega_3$",
    xlim=(-np.pi, np.pi),
)
axes.set_title(r"crossings of $\gamma_3 = 0$, 48 motions of one energy")
plt.show()
