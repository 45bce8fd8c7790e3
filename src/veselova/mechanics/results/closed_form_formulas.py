"""The explicit formulas of one motion, from its closed-form document: in LaTeX, and as SymPy
expressions.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.errors import BackendMissing, Unsolved
from veselova.mechanics.core.exact_input import whole_number
from veselova.mechanics.results.closed_form_evaluation import lattice_within, standing_modes

__all__ = ["expressions", "latex"]

Array = NDArray[np.float64]

#: Modes of the time map that LaTeX shows; the rest are dots.
_SHOWN_MODES = 6

#: Digits of numbers in LaTeX: they are made of doubles.
_MOST_DIGITS = 15

#: Modes and terms up to which SymPy expressions are made: larger ones take minutes to print.
_MOST_TERMS = 20_000


def latex(document: Mapping[str, Any], arrays: Mapping[str, Array], digits: int) -> str:
    """Return the formulas of a document as an ``aligned`` block, numbers to so many digits."""
    digits = whole_number(digits, ("digits",), 1, _MOST_DIGITS)
    g = int(document["genus"])
    names = {"t": "t", "s": "s", "tau1": r"\tau"}
    number = _Numbers(digits)
    theta = [_function(halves) for halves in document["characteristics"]]
    lines = [
        r"\theta\!\left[{\varepsilon\atop\delta}\right]\!(z) &= \sum_{m\in\mathbb{Z}^g}"
        r" e^{-\pi(m+\varepsilon)^{T}T(m+\varepsilon)}\cos 2\pi(m+\varepsilon)\cdot(z+\delta),"
        rf"\qquad T = {number.matrix(document['riemann_matrix'])}"
    ]
    phases = zip(document["phases"], document["frequencies"], strict=True)
    lines += [
        rf"z_{s} &= {number(z0)} {number.signed(f)}\,\tau_1" for s, (z0, f) in enumerate(phases, 1)
    ]
    lines.append(_time_map(document, arrays, names[document["time"]], number))
    lines += [_quotient(f"x_{i}", pair, theta, number) for i, pair in enumerate(document["q"], 1)]
    for k, column in enumerate(document["normals"], 2):
        lines += [
            _quotient(f"(n_{k})_{i}", pair, theta, number) for i, pair in enumerate(column, 1)
        ]
    lines += [
        _quotient(rf"\gamma_{i}", pair, theta, number)
        for i, pair in enumerate(document["gamma"], 1)
    ]
    lines.append(rf"q &= D x,\qquad D = {number.matrix(document['directions'])}")
    normals = "".join(f"n_{k}," for k in range(2, g + 1))
    prime = "'" if "area" in document else ""
    frozen = f" + {number.matrix(document['frozen'])}" if np.any(arrays["frozen"]) else ""
    lines.append(
        rf"(e_2{prime},\dots) &= D\,({normals}\gamma)\,\mathfrak R{frozen},\qquad \mathfrak R = "
        rf"{number.matrix(document['rotation'])}"
    )
    if "area" in document:
        lines.append(
            rf"(\gamma,e_2,e_3) &= (q,e_2',e_3')\,{number.matrix(document['area']['attitude'])}"
        )
    if document["axes"] is not None:
        frame = r"(\gamma,e_2,e_3)" if "area" in document else r"(q,e_2,\dots)"
        axes = number.matrix(document["axes"])
        lines.append(rf"E &= V\,{frame},\qquad V = {axes}")
    return "\\begin{aligned}\n" + " \\\\\n".join(lines) + "\n\\end{aligned}"


class _Numbers:
    """Numbers in LaTeX, to so many significant digits."""

    def __init__(self, digits: int) -> None:
        self._digits = digits

    def __call__(self, value: Any) -> str:
        text = f"{float(value) + 0.0:.{self._digits}g}"  # no −0
        if "e" not in text:
            return text
        mantissa, exponent = text.split("e")
        return rf"{mantissa}\cdot 10^{{{int(exponent)}}}"

    def signed(self, value: Any) -> str:
        """Return the number with its sign, as a further term."""
        return f"{'-' if float(value) < 0 else '+'} {self(abs(float(value)))}"

    def matrix(self, rows: Sequence[Sequence[Any]]) -> str:
        """Return a matrix in brackets."""
        return (
            r"\begin{pmatrix}"
            + r"\\".join("&".join(self(x) for x in row) for row in rows)
            + r"\end{pmatrix}"
        )


def _function(halves: Sequence[Sequence[float]]) -> str:
    upper, lower = ("".join(r"\tfrac12" if x else "0" for x in row) for row in halves)
    return rf"\theta\!\left[{{{upper}\atop {lower}}}\right]\!(z)"


def _quotient(name: str, pair: Sequence[Any], theta: Sequence[str], number: _Numbers) -> str:
    return rf"{name} &= {number(pair[1])}\,\frac{{{theta[pair[0]]}}}{{{theta[0]}}}"


def _time_map(
    document: Mapping[str, Any], arrays: Mapping[str, Array], time: str, number: _Numbers
) -> str:
    modes = _time_modes(document)
    line = rf"{time} &= {number(document['mean_rate'])}\,\tau_1"
    for mode, value, turn in modes[:_SHOWN_MODES]:
        rate, angle = _pace(mode, turn, arrays)
        if rate == 0:
            line += rf" {number.signed(2 * value * np.cos(angle))}\,\tau_1"
            continue
        sine = rf"\sin 2\pi({_combination(mode)}{number.signed(turn) if turn else ''})"
        factor = number.signed(value / (np.pi * rate))
        line += rf" {factor}\,\left[{sine}\right]_{{0}}^{{\tau_1}}"
    return line + (r" + \cdots" if len(modes) > _SHOWN_MODES else "")


def _pace(mode: Sequence[int], turn: float, arrays: Mapping[str, Array]) -> tuple[float, float]:
    """Return m·f of a mode M = 2m, zero where it stands still, and 2π(m·z⁰ + turn)."""
    m = np.array(mode, dtype=np.float64) / 2
    stands = bool(standing_modes(m[None], arrays["frequencies"])[0])
    angle = 2 * np.pi * float(m @ arrays["phases"] + turn)
    return 0.0 if stands else float(m @ arrays["frequencies"]), angle


def _time_modes(document: Mapping[str, Any]) -> list[tuple[list[int], float, float]]:
    """Return the modes of the time map, doubled, their coefficients and turns: with an area
    constant the even and the odd part, largest first.
    """
    pairs = zip(document["modes"], document["coefficients"], strict=True)
    found = [([2 * m for m in mode], float(value), 0.0) for mode, value in pairs]
    if "area" not in document:
        return found
    odd = document["area"]["odd"]
    pairs = zip(odd["modes"], odd["coefficients"], strict=True)
    found += [(mode, float(value), float(odd["turn"])) for mode, value in pairs]
    return sorted(found, key=lambda mode: -abs(mode[1]))


def _combination(mode: Sequence[int]) -> str:
    """Return Σ M_s z_s/2 in words."""
    text = ""
    for s, doubled in enumerate(mode, 1):
        if not doubled:
            continue
        size = abs(doubled)
        factor = rf"\tfrac{{{size}}}{{2}}" if size % 2 else "" if size == 2 else str(size // 2)
        text += f"{'-' if doubled < 0 else '+'}{factor}z_{s}"
    return text.lstrip("+")


def expressions(document: Mapping[str, Any], arrays: Mapping[str, Array]) -> dict[str, Any]:
    """Return the formulas of a document as SymPy expressions in z_1 … z_g and tau_1, by name."""
    try:
        import sympy
    except ImportError:
        raise BackendMissing("sympy", "formulas as expressions", "pip install sympy") from None
    if document.get("reduction"):
        raise Unsolved(
            "too-many-terms",
            "beside a separatrix the plain theta series cancels; evaluate the document by ``at``",
        )
    g = int(document["genus"])
    T = arrays["riemann_matrix"]
    supports = [lattice_within(T, halves[0], 0.0) for halves in arrays["characteristics"]]
    time_modes = _time_modes(document)
    terms = sum(len(points) for points in supports) + len(time_modes)
    if terms > _MOST_TERMS:
        raise Unsolved(
            "too-many-terms", f"{terms} terms, and expressions are made of at most {_MOST_TERMS}"
        )
    z = sympy.symbols(f"z_1:{g + 1}", real=True)
    tau = sympy.Symbol("tau_1", real=True)
    found: dict[str, Any] = {}
    for j, (points, (_, delta)) in enumerate(zip(supports, arrays["characteristics"], strict=True)):
        weights = np.exp(-np.pi * np.einsum("xi,ij,xj->x", points, T, points))
        rows = zip(points, weights.tolist(), strict=True)
        shifted = [zs + sympy.Rational(int(2 * d), 2) for zs, d in zip(z, delta, strict=True)]
        halves = [[sympy.Rational(int(2 * x), 2) for x in point] for point in points]
        found[f"theta_{j}"] = sympy.Add(
            *(
                w * sympy.cos(2 * sympy.pi * _dot(half, shifted))
                for (_, w), half in zip(rows, halves, strict=True)
            )
        )
    for i, (place, constant) in enumerate(document["q"], 1):
        found[f"q_{i}"] = float(constant) * found[f"theta_{place}"] / found["theta_0"]
    for k, column in enumerate([*document["normals"], document["gamma"]], 2):
        for i, (place, constant) in enumerate(column, 1):
            name = f"gamma_{i}" if k == g + 1 else f"normal_{k}_{i}"
            found[name] = float(constant) * found[f"theta_{place}"] / found["theta_0"]
    starts = arrays["phases"].tolist()
    rates = arrays["frequencies"].tolist()
    line = [start + rate * tau for start, rate in zip(starts, rates, strict=True)]
    found |= {f"z_{s}": phase for s, phase in enumerate(line, 1)}
    time = float(document["mean_rate"]) * tau
    for mode, value, turn in time_modes:
        pace, _ = _pace(mode, turn, arrays)
        later, before = (
            2 * sympy.pi * (_dot(mode, phases) / 2 + turn) for phases in (line, starts)
        )
        if pace == 0:  # a resonance
            time += 2 * value * tau * sympy.cos(before)
        else:
            time += value / (sympy.pi * pace) * (sympy.sin(later) - sympy.sin(before))
    found["time"] = time
    return found


def _dot(left: Sequence[Any], right: Sequence[Any]) -> Any:
    return sum((a * b for a, b in zip(left, right, strict=True)), 0)
