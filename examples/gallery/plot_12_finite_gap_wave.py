r"""
A wave of two phases
====================

The theta functions of the body are those of waves in shallow water. For a
curve of genus two, :math:`u(x,t) = -2\,\partial_x^2 \log\theta(Ux + Wt)`
solves the Korteweg–de Vries equation :math:`u_t = 6uu_x - u_{xxx}`. Two
trains of crests pass through each other. The fast ones come out advanced,
the slow ones delayed.
"""

import numpy as np
from matplotlib import pyplot as plt

from veselova import curves, theta

curve = curves.RealHyperelliptic([0, 0.06, 1, 1.1, 2.6])
T = curve.riemann_matrix
U, along = (
    curve.normalized_differentials[:, 1],
    curve.normalized_differentials[:, 0],
)


def wave(phases, direction=U):
    """Return u at phases (N, 2), by the derivatives of θ."""
    value, first, second = (
        theta.riemann_theta(phases, T, derivatives=k) for k in range(3)
    )
    slope = (first @ direction) / value
    bend = np.einsum("nij,i,j->n", second, direction, direction) / value
    return -2 * (bend - slope**2).real


# %%
# W is a combination of U and of the other column of differentials. Its two
# coefficients are those for which the equation holds on the torus; that it
# holds everywhere is the theorem.

size = 64
axis = np.arange(size) / size
grid = np.stack(np.meshgrid(axis, axis, indexing="ij"), axis=-1).reshape(
    -1, 2
)
u = wave(grid).reshape(size, size)
k = 2j * np.pi * np.fft.fftfreq(size, 1 / size)


def derivative(direction, order=1):
    rates = direction[0] * k[:, None] + direction[1] * k[None, :]
    return np.fft.ifft2(rates**order * np.fft.fft2(u)).real


right = 6 * u * derivative(U) - derivative(U, 3)
basis = np.stack([derivative(U).ravel(), derivative(along).ravel()], axis=1)
weights, *_ = np.linalg.lstsq(basis, right.ravel(), rcond=None)
W = weights[0] * U + weights[1] * along
rest = np.abs(right - derivative(W)).max() / np.abs(right).max()
print(f"the equation holds to {rest:.0e}")

# %%
# The wave in the frame in which its crests stand out.

x, t = np.linspace(0, 36, 500), np.linspace(0, 12, 400)
frame = weights[0] + 1.5  # a wave may be watched from any carriage
X, S = np.meshgrid(x, t)
phases = X[..., None] * U + S[..., None] * (W - frame * U)
field = -wave(phases.reshape(-1, 2)).reshape(X.shape)
figure, axes = plt.subplots(1, 2, figsize=(12, 5), layout="constrained")
image = axes[0].pcolormesh(
    x, t, field, cmap="magma", shading="gouraud", rasterized=True
)
figure.colorbar(image, label="$-u$")
axes[0].set(xlabel="$x$", ylabel="$t$", title="crests in space and time")
for row, height in zip(range(0, 400, 16), np.arange(25), strict=True):
    line = field[row] / np.ptp(field) * 4 + height
    axes[1].fill_between(
        x, line, height - 3, color="white", zorder=100 - height
    )
    axes[1].plot(
        x,
        line,
        color=plt.cm.magma(height / 32),
        linewidth=1.2,
        zorder=100 - height,
    )
axes[1].set(
    xlabel="$x$",
    yticks=[],
    ylabel="time, upwards",
    xlim=(0, 36),
    title="profiles",
)
plt.show()
