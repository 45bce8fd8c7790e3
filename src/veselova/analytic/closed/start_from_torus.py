"""The other way in: the start that has given constants of motion and phases."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.kernel.abel import approach, invert
from veselova.analytic.kernel.compiler import prepare
from veselova.analytic.kernel.frame import set_frame
from veselova.analytic.kernel.rate import PHYSICAL
from veselova.analytic.kernel.start import NARROWEST, Start
from veselova.analytic.kernel.torus import is_regular, make_room, make_torus
from veselova.mechanics.core.errors import InvalidInput, Unsolved, show
from veselova.mechanics.core.exact_input import exact_number, exact_vector, to_float

__all__ = ["start_on_torus"]

Array = NDArray[np.float64]


def start_on_torus(
    A: Any, energy: Any, constants: Any, phases: Any, signs: Any
) -> tuple[Array, Array]:
    """Return (q, q̇) along the axes of A, each (n,), for distinct A's and constants that leave
    every cut open.

    Raises InvalidInput where the constants admit no real motion, or a length or a sign is wrong,
    Unsolved (``beyond-floats``).
    """
    diagonal = exact_vector(A, ("A",))
    n = len(diagonal)
    if n < 2:
        raise InvalidInput(("A",), "at least 2 numbers (n ≥ 2)", str(n))
    for i, a in enumerate(diagonal):
        if a <= 0:
            raise InvalidInput(("A", i), "a number greater than 0", show(A[i]))
    order = sorted(range(n), key=lambda i: -diagonal[i])
    for before, after in itertools.pairwise(order):
        if diagonal[before] == diagonal[after]:
            raise InvalidInput(
                ("A", after),
                "distinct entries (phases do not determine a start otherwise)",
                show(A[after]),
            )
    h = exact_number(energy, ("energy",))
    if h <= 0:
        raise InvalidInput(("energy",), "a number greater than 0", show(energy))
    unit = diagonal[order[-1]]
    inverse = [unit / diagonal[i] for i in order]
    prepare()
    torus = _torus(inverse, _scale_constants(constants, inverse, unit))
    z = np.mod(to_float(exact_vector(phases, ("phases",), n - 1)), 1.0)
    wanted = _signs(signs, n)[order]
    # The roots of the frame have their own signs at ψ; ς makes q_i, or where it vanishes q̇_i, have
    # the wanted one.
    room, frame, velocity = make_room(n - 1), np.empty((n, n)), np.empty(n)
    set_frame(torus, _angles(torus, z, room), room, frame, velocity)
    position = frame[:, 0]
    seen = np.where(np.abs(position) > 8 * np.finfo(float).eps, position, velocity)
    turn = np.where(np.sign(seen) * wanted < 0, -1.0, 1.0)
    q = np.empty(n)
    v = np.empty(n)
    q[order], v[order] = turn * position, turn * velocity
    # dτ₁/dt = √(2h det A/(q,Aq)), τ₁ in units of the smallest A's; det A alone leaves the range of
    # doubles for large n
    weight = sum(a * Fraction(x) ** 2 for a, x in zip(diagonal, q.tolist(), strict=True))
    return q, v * math.sqrt(2 * h * math.prod(diagonal) / (unit * weight))


def _scale_constants(constants: Any, inverse: Sequence[Fraction], unit: Fraction) -> list[Fraction]:
    """Return c_2 … c_{n−1} in units of the largest I; raises InvalidInput unless max(c_s, I_s) <
    min(c_{s+1}, I_{s+1}).
    """
    n = len(inverse)
    scaled = [c * unit for c in exact_vector(constants, ("constants",), n - 2)]
    c = [Fraction(), *scaled]
    for s in range(n - 1):
        low = max(c[s], inverse[s])
        high = min(c[s + 1], inverse[s + 1]) if s < n - 2 else inverse[s + 1]
        if not low < high:
            field = ("constants", min(max(s - 1, 0), n - 3)) if n > 2 else ("A",)
            required = (
                f"constants with max(c_{s + 1}, I_{s + 1}) < min(c_{s + 2}, I_{s + 2}), I "
                "the sorted inverses of A"
            )
            raise InvalidInput(
                field, required, f"{float(low / unit):.6g} against {float(high / unit):.6g}"
            )
    for k, value in enumerate(scaled):
        if value in inverse:
            required = "a constant that is not an I_i (a separatrix has no phases)"
            raise InvalidInput(("constants", k), required, f"{float(value / unit):.6g}")
    return scaled


def _signs(signs: Any, n: int) -> Array:
    given = exact_vector(signs, ("signs",), n)
    for i, sign in enumerate(given):
        if sign not in (1, -1):
            raise InvalidInput(("signs", i), "1 or -1", show(signs[i]))
    return to_float(given)


def _torus(inverse: Sequence[Fraction], constants: Sequence[Fraction]) -> Any:
    """Return the kernel's torus of these I and c, at ψ of no meaning. Raises Unsolved
    (``beyond-floats``).
    """
    labelled = [(x, 0, i) for i, x in enumerate(inverse)]
    labelled += [(c, 1, k) for k, c in enumerate([Fraction(), *constants])]
    labelled.sort()
    points = [x for x, _, _ in labelled]
    place = {(kind, i): j for j, (_, kind, i) in enumerate(labelled)}
    g = len(inverse) - 1
    start = Start(
        np.array([to_float([y - x for y in points]) for x in points]),
        np.array(to_float(points)),  # writable: the kernel is compiled once
        np.array([place[0, i] for i in range(g + 1)]),
        np.array([place[1, k] for k in range(g)]),
        np.ones(g + 1),
        np.ones((2, g)),
        np.ones(g, dtype=bool),
        np.ones(1),
    )
    found = make_torus(start, np.array([PHYSICAL]), np.eye(g)[-1])
    if np.min(np.diagonal(found.d, 1)) < NARROWEST or not is_regular(found):
        raise Unsolved("beyond-floats", "a constant is too near an I for doubles")
    return found


def _angles(torus: Any, z: Array, room: Any) -> Array:
    """Return the ψ of phases (g,)."""
    psi = 2 * np.pi * z
    approach(torus.angles, z, psi, room)
    if not invert(torus.angles, z, psi, room):
        raise Unsolved("beyond-floats", "the phases have no angles in doubles")
    return psi
