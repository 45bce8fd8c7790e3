"""The integrals of one coordinate along a geodesic, which sums of Gauss–Legendre panels give.

In θ = β or ω − 90° both ellipsoidal coordinates have the same integrand, with X = K cos²θ,

    dJ = √(A₂−σX) dθ / √((K'+X)(X∓g)),   dS = (X∓g) dJ,   g = |γ|,   γ = X sin²α − Y cos²α

(− where θ turns at X = g, + where it goes round; σ = ±1, and K, K' are K₂, K₁ for β). In t = tan ψ,
sin ψ = sin θ/√(1−g/K), or t = tan θ, it is √(E(1, t²)/N) dt/√(X_1 X_2), four forms C + Dt² each.
With t = ϱ sinh x below one, and 1/t = √(p/P) sinh x above, every singularity lies on |Im x| = π/2,
whatever the ellipsoid and g are.
"""

from math import asinh, exp, sqrt
from typing import Any, NamedTuple

from veselova.analytic.kernel.compiler import jit

from .arithmetic import NODES, PANEL, WEIGHTS, whole, widen


class Shape(NamedTuple):
    """An ellipsoid whose middle semiaxis is one.

    - a, c: the others; A1, A2, A3: squares
    - K1, K2: (a−b)(a+b) and (b−c)(b+c)
    """

    a: Any
    c: Any
    A1: Any
    A2: Any
    A3: Any
    K1: Any
    K2: Any


class Form(NamedTuple):
    """The integrand over t: X_1 = P + pt², X_2 = Q + qt², E = E0 + E1t².

    - turns: whether θ turns; sigma: σ; width: K − g
    """

    turns: Any
    P: Any
    p: Any
    Q: Any
    q: Any
    E0: Any
    E1: Any
    sigma: Any
    width: Any


@jit
def turning(shape: Any, is_beta: Any, g: Any, width: Any) -> Any:
    """Return the form of β or ω where it turns; width: K − g, which would cancel."""
    if is_beta:
        q, E1 = shape.K1 + g, shape.A3 + width
        return Form(True, shape.K2, g, shape.K1 + shape.K2, q, shape.A3, E1, 1.0, width)
    q, E1 = shape.K2 + g, shape.A2 + g
    return Form(True, shape.K1, g, shape.K1 + shape.K2, q, shape.A1, E1, -1.0, width)


@jit
def circling(shape: Any, is_beta: Any, g: Any) -> Any:
    """Return the form of β or ω where it goes round."""
    K = shape.K1 + shape.K2
    if is_beta:
        return Form(False, shape.K2 + g, g, K, shape.K1, shape.A3, shape.A2, 1.0, 0 * g)
    return Form(False, shape.K1 + g, g, K, shape.K2, shape.A1, shape.A2, -1.0, 0 * g)


@jit
def panels(form: Any, first: Any, last: Any, scale: Any, inverted: Any) -> Any:
    """Return J, S and ∂J/∂g at fixed t over t, or 1/t where ``inverted``, = scale·sinh x."""
    J, S, G = 0.0, 0.0, 0.0
    count = max(whole((last - first) / PANEL + 0.5), 1)
    half = (last - first) / (2 * count)
    for i in range(count):
        middle = first + (2 * i + 1) * half
        for j in range(NODES.size):
            e = exp(middle + half * NODES[j])
            t, rise = scale * (e - 1 / e) / 2, half * WEIGHTS[j] * scale * (e + 1 / e) / 2
            below, above = 1.0, t * t
            if inverted:
                below, above = above, below
            N, E = below + above, form.E0 * below + form.E1 * above
            X1, X2 = form.P * below + form.p * above, form.Q * below + form.q * above
            w = 1 / sqrt(E * N * X1 * X2)
            k = rise * E * w
            J = J + k
            if form.turns:
                S = S + k * form.width * below / N
                # sums of products in place of three quotients
                slope = form.sigma * X1 * X2 + E * (X1 + X2)
                G = G - k * above * slope * N * w * w / 2
            else:
                S = S + k * X1 / N
                G = G - k * N * (N * E * X2 * w * w) / 2
    return widen(J, J), widen(S, S + form.p * J), G


@jit
def outward(form: Any, n: Any, d: Any, m: Any, e: Any) -> Any:
    """Return J, S and ∂J/∂g over t from n/d to m/e, 0 ≤ n/d ≤ m/e ≤ ∞."""
    J, S, G = 0.0, 0.0, 0.0
    if n < d:
        scale = sqrt(form.E0 / form.E1) if form.E0 < form.E1 else 1.0
        end = 1.0 if m > e else m / e
        J, S, G = panels(form, asinh(n / (d * scale)), asinh(end / scale), scale, False)
    if m > e:
        scale = sqrt(form.p / form.P)
        begin = 1.0 if n < d else d / n
        j, s, g = panels(form, asinh(e / (m * scale)), asinh(begin / scale), scale, True)
        J, S, G = J + j, S + s, G + g
    return J, S, G


@jit
def between(form: Any, n: Any, d: Any, m: Any, e: Any) -> Any:
    """Return J, S and ∂J/∂g over t from n/d to m/e, d, e ≥ 0; zero where that goes back."""
    if not (n < 0 < m or m * d > n * e):
        return 0.0, 0.0, 0.0
    if n >= 0:
        return outward(form, n, d, m, e)
    if m <= 0:
        return outward(form, -m, e, -n, d)
    J, S, G = outward(form, 0.0, 1.0, -n, d)
    j, s, g = outward(form, 0.0, 1.0, m, e)
    return J + j, S + s, G + g
