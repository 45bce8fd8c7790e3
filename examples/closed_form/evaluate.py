"""Evaluate a closed-form document with NumPy alone: python evaluate.py [document.json
values.json]
"""

import itertools, json, sys  # noqa: E401
import numpy as np

def lattice(form, shift, margin):
    """Points x of Z^d + shift whose term exp(-pi x.form.x) counts beside one within a margin."""
    if len(form) == 0:
        return np.zeros((1, 0))
    reach = np.sqrt(39 / np.pi + shift @ form @ shift + margin**2 * np.sum(np.abs(form)))
    widths = reach * np.sqrt(np.diag(np.linalg.inv(form))) + margin
    ranges = [np.arange(np.ceil(-w - s), np.floor(w - s) + 1) + s for w, s in zip(widths, shift)]
    return np.array(list(itertools.product(*ranges)))

def theta(document, z):
    """Theta functions of the document at the phases z, up to one common factor."""
    T, g = np.array(document["riemann_matrix"], float), document["genus"]
    reduction = document["reduction"] or {"basis": np.eye(g), "waves": range(g)}
    U, F = np.array(reduction["basis"], float), list(reduction["waves"])
    G = [i for i in range(g) if i not in F]
    T = U @ T @ U.T
    inverse = np.linalg.inv(T[np.ix_(G, G)])
    C = T[np.ix_(F, G)] @ inverse
    S = T[np.ix_(F, F)] - C @ T[np.ix_(G, F)]
    values = []
    for epsilon, delta in document["characteristics"]:
        half, y = np.rint(np.linalg.inv(U)).T @ epsilon, U @ (z + np.array(delta))
        x = lattice(S, half[F], 0)
        k = np.rint(y[G]) + lattice(inverse, np.zeros(len(G)), 0.5)
        d = k - y[G]
        angles = (y[F] + d @ C.T) @ x.T + (k @ half[G])[:, None]
        sizes = np.einsum("ki,ij,kj->k", d, inverse, d)[:, None] + np.einsum("xi,ij,xj->x", x, S, x)
        values.append(np.sum(np.exp(-np.pi * sizes) * np.cos(2 * np.pi * angles)))
    return np.array(values)

def frame(document, t):
    """The matrix [e_1 ... e_n] at time t, columns along the principal axes."""
    f, z0, mean = np.array(document["frequencies"]), np.array(document["phases"]), document["mean_rate"]
    m, F = np.array(document["modes"], float).reshape(-1, len(f)), np.array(document["coefficients"])
    pace, turn, last = np.pi * m @ f, 2 * np.pi * m @ z0, np.eye(len(document["A"]))
    if area := document.get("area"):  # half-integer modes, and a rotation
        odd, last = np.reshape(area["odd"]["modes"], (-1, len(f))) / 2, area["attitude"]
        turn = np.append(turn, 2 * np.pi * (odd @ z0 + area["odd"]["turn"]))
        pace, F = np.append(pace, np.pi * odd @ f), np.append(F, area["odd"]["coefficients"])
    tau = t / mean
    for _ in range(100):  # Newton's method for t(tau) = t
        h = pace * tau
        time = mean * tau + np.sum(2 * F * np.cos(turn + h) * tau * np.sinc(h / np.pi))
        step = (time - t) / (mean + np.sum(2 * F * np.cos(turn + 2 * h)))
        tau -= step
        if abs(step) < 1e-15 * max(1, abs(tau)):
            break
    values = theta(document, z0 + f * tau)
    entries = lambda pairs: np.array([constant * values[place] / values[0] for place, constant in pairs])  # noqa: E731
    normals = np.column_stack([entries(column) for column in [*document["normals"], document["gamma"]]])
    D, rotation = np.array(document["directions"]), np.array(document["rotation"])
    return np.column_stack([D @ entries(document["q"]), D @ normals @ rotation + np.array(document["frozen"])]) @ last

files = sys.argv[1:] or ["body3.json", "body3.values.json"]
document, stored = (json.load(open(file)) for file in files)
assert "shell" not in document, "a shell: its frame is another sum, in section Shells of docs/closed-form.md"
errors = [np.abs(frame(document, t) - np.array(E)).max() for t, E in zip(stored["times"], stored["frame"])]
print(f"largest deviation {max(errors):.1e}")
