"""Write the frozen motions: those of some 800 problems, to 30 digits where the closed form has
them, else as doubles with their errors; documents, curves and theta functions too.

    python tests/agreement/freeze.py [group ...]      default: every group that has no file yet

A file ``frozen/GROUP.jsonl.xz`` has one JSON object a line. ``test_frozen.py`` holds every engine
to them. They are written once, by the version that the line names, and are not made anew when the
engine changes: they are the truth that a new engine is measured against.
"""

from __future__ import annotations

import json
import lzma
import sys
import time
from collections.abc import Callable, Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parent.parent))

import veselova as vs
from draws import CLASSES, adversarial_data, near_resonance
from problems import BALLS_IN_MORE_DIMENSIONS, BODIES, TABLE
from veselova import curves
from veselova.mechanics.core.problem import Problem
from veselova.version import __version__

FOLDER = Path(__file__).parent / "frozen"

DIGITS = 30

#: Seconds for the digits of one problem; one that takes longer is left out.
PATIENCE_S = 60

Motion = tuple[str, Callable[[], Problem], list[Any]]

#: Classes whose numbers stay within 1e±30, with gaps and cuts down to 1e-14.
NARROW = tuple(name for name in CLASSES if name != "scaled")
NARROWEST = 14


def text(values: Any) -> list[str]:
    return [str(Fraction(x)) for x in values]


def times_of(rng: np.random.Generator, longest: float, count: int = 3) -> list[float]:
    """Return times of both signs, log-uniform from 0.1 to the longest."""
    sizes = 10 ** rng.uniform(-1, np.log10(longest), count)
    signs = rng.choice([-1, 1], count)
    return [float(f"{x:.6g}") for x in sizes * signs]


def start(rng: np.random.Generator, n: int, ratio: float) -> tuple[list[str], Any, Any]:
    """Return A with ratios up to ``ratio``, q and a velocity, as decimals of six digits."""
    A = np.exp(rng.uniform(0, np.log(ratio), n)) if ratio > 1 else np.ones(n)
    rows = [A, *rng.normal(size=(2, n))]
    return tuple([f"{x:.6g}" for x in row] for row in rows)  # type: ignore[return-value]


def random_veselova() -> Iterator[Motion]:
    for i in range(154):
        rng = np.random.default_rng([50, 1, i])
        n = 2 + i % 7
        ratio = 10 ** rng.uniform(0.1, 8) if i % 2 else 10 ** rng.uniform(0.1, 2)
        A, q, v = start(rng, n, ratio)
        yield (
            "random",
            lambda A=A, q=q, v=v: vs.Veselova(A, q, v, normalize=True),
            times_of(rng, 1000 if n < 5 else 30),
        )


def far_veselova() -> Iterator[Motion]:
    for i in range(30):
        rng = np.random.default_rng([50, 2, i])
        A, q, v = start(rng, 2 + i % 3, 10 ** rng.uniform(0.3, 1.3))
        times = [-1e4, 1e6, 1e9] if i % 3 < 2 else [-1e3, 1e5]
        yield "far", lambda A=A, q=q, v=v: vs.Veselova(A, q, v, normalize=True), times
    for i in range(10):
        rng = np.random.default_rng([50, 3, i])
        problem = near_resonance(rng, 3 + i % 2, 10.0 ** -(1 + i))[1]
        yield "near a resonance", lambda problem=problem: problem, [30.0, -3e3]


def special_veselova() -> Iterator[Motion]:
    for i in range(210):
        rng = np.random.default_rng([50, 4, i])
        n = 2 + i % 5
        name, A, q, v = adversarial_data(rng, n, (NARROW[i % len(NARROW)],), NARROWEST)
        yield (
            name,
            lambda A=A, q=q, v=v: vs.Veselova(text(A), text(q), text(v), normalize=True),
            times_of(rng, 30),
        )
    for case in TABLE:
        if "reference" not in case.tags and "scaled" not in case.tags:
            yield case.name, case.problem, [float(x) for x in case.times(4)]


def neumann() -> Iterator[Motion]:
    for i in range(70):
        rng = np.random.default_rng([50, 5, i])
        n = 2 + i % 5
        if i < 35:
            A, q, v = start(rng, n, 10 ** rng.uniform(0.1, 3))
            name = "random"
        else:
            name, *rows = adversarial_data(rng, n, (NARROW[i % len(NARROW)],), NARROWEST)
            A, q, v = map(text, rows)
        yield (
            name,
            lambda A=A, q=q, v=v: vs.NeumannSystem(A, q, v, normalize=True),
            times_of(rng, 100 if i % 3 else 1e4),
        )


def geodesics() -> Iterator[Motion]:
    for i in range(70):
        rng = np.random.default_rng([50, 6, i])
        n = 2 + i % 4
        if i < 35:
            A, q, v = start(rng, n, 10 ** rng.uniform(0.1, 4))
            name = "random"
        else:
            name, *rows = adversarial_data(rng, n, (NARROW[i % len(NARROW)],), NARROWEST)
            A, q, v = map(text, rows)
        X, V = ([str(Fraction(a) * Fraction(x)) for a, x in zip(A, r)] for r in (q, v))
        yield (
            name,
            lambda A=A, X=X, V=V: vs.EllipsoidGeodesic(A, X, V, normalize=True),
            times_of(rng, 100 if i % 3 else 1e4),
        )


def body(rng: np.random.Generator, plain: bool) -> tuple[list[str], list[str], list[str]]:
    """Return moments of inertia that a body has, γ and Ω; (Ω,γ) = 0 exactly where ``plain``."""
    parts = [Fraction(int(x), 1000) for x in rng.integers(50, 1000, 3)]
    inertia = [sum(parts) - x for x in parts]
    g, w = ([Fraction(int(x), 100) for x in rng.integers(-99, 100, 3)] for _ in range(2))
    g = g if any(g) else [Fraction(1)] * 3
    if plain:
        w = [w[(i + 1) % 3] * g[(i + 2) % 3] - w[(i + 2) % 3] * g[(i + 1) % 3] for i in range(3)]
    return text(inertia), text(g), text(w)


def bodies() -> Iterator[Motion]:
    for i in range(110):
        rng = np.random.default_rng([50, 7, i])
        plain, name = i % 2 == 0, "plain" if i % 2 == 0 else "area constant"
        inertia, g, w = body(rng, plain)
        if i % 10 in (4, 5):
            inertia[1], name = inertia[0], f"{name}, symmetric"
        if i % 10 in (6, 7):
            size = Fraction(1, 10 ** (1 + i % 14))
            inertia[1] = str(Fraction(inertia[0]) * (1 + size))
            name = f"{name}, nearly symmetric"
        yield (
            name,
            lambda inertia=inertia, g=g, w=w: vs.VeselovaSO3(inertia, g, w, normalize=True),
            times_of(rng, 1000 if i % 4 else 1e6),
        )
    for case in BODIES:
        if case.name != "fast":
            yield case.name, lambda case=case: case.problem("veselova-so3"), case.times().tolist()


def balls() -> Iterator[Motion]:
    for i in range(110):
        rng = np.random.default_rng([50, 8, i])
        inertia, g, w = body(rng, i % 5 == 0)
        if i % 10 in (6, 7):
            inertia[1] = inertia[0]
        kind = vs.RubberBall if i % 2 else vs.ChaplyginBall
        mass = f"{10 ** rng.uniform(-2, 1):.3g}"
        yield (
            kind.system,
            lambda kind=kind, inertia=inertia, mass=mass, g=g, w=w: kind(
                inertia, mass, "0.8", g, w, position=["1/2", "-2"], normalize=True
            ),
            times_of(rng, 300),
        )
    for case in BODIES:
        for system in ("rubber-ball", "chaplygin-ball"):
            if case.name != "fast":
                yield (
                    case.name,
                    lambda case=case, system=system: case.problem(system),
                    case.times().tolist(),
                )
    for case in BALLS_IN_MORE_DIMENSIONS:
        for system in ("rubber-ball", "chaplygin-ball"):
            yield (
                case.name,
                lambda case=case, system=system: case.problem(system),
                case.times().tolist(),
            )


def potentials() -> Iterator[Motion]:
    for i in range(60):
        rng = np.random.default_rng([50, 9, i])
        n = 2 + i % 4
        A, q, v = start(rng, n, 10 ** rng.uniform(0.2, 1.5))
        walls = [f"{x:.3g}" for x in rng.uniform(0, 0.5, n)] if i % 3 == 1 else [0] * n
        parts = {
            "quadratic": f"{rng.normal():.3g}",
            "quartic": f"{rng.normal():.3g}" if i % 2 else 0,
            "centrifugal": walls,
        }
        yield (
            "separable",
            lambda A=A, q=q, v=v, parts=parts: vs.SeparableVeselova(A, q, v, parts, normalize=True),
            times_of(rng, 30),
        )
    for i in range(40):
        rng = np.random.default_rng([50, 10, i])
        inertia, g, w = body(rng, True)
        numbers = [f"{x:.3g}" for x in rng.normal(size=5)]
        walls = [str(abs(Fraction(x))) for x in numbers[2:]]
        given: Any = {"clebsch": numbers[0]}
        if i % 2:
            given = {"family": [*numbers[:2], *(walls if all(map(Fraction, g)) else "000")]}
        yield (
            "body",
            lambda inertia=inertia, g=g, w=w, given=given: vs.VeselovaSO3(
                inertia, g, w, given, normalize=True
            ),
            times_of(rng, 30),
        )


MOTIONS: dict[str, Callable[[], Iterator[Motion]]] = {
    "veselova": random_veselova,
    "veselova-far": far_veselova,
    "veselova-special": special_veselova,
    "neumann": neumann,
    "geodesics": geodesics,
    "bodies": bodies,
    "balls": balls,
    "potentials": potentials,
}


def number(x: Any) -> str:
    """Return a decimal with the digits that are known, and no zeros that say nothing."""
    return f"{x:.{DIGITS + 2}g}" if abs(x) < 10**DIGITS else str(x)


def frozen_motion(name: str, problem: Problem, times: list[Any]) -> dict[str, Any] | None:
    """Return the row of a motion: its bounded series with ``error``, the largest radius or, of
    doubles, their error at each time; None where the closed form is refused.
    """
    row = {"class": name, "problem": problem.as_dict(), "times": times}
    try:
        found = vs.solve(problem, times, "analytic", digits=DIGITS, budget_s=PATIENCE_S)
        decimals = found.decimals
        assert decimals is not None
        series = {x: decimals.midpoints[x].ravel() for x in problem.bounded}
        row |= {"series": {x: list(map(number, v)) for x, v in series.items()}}
        return {**row, "error": [float(x) for x in decimals.error]}
    except (vs.InvalidInput, vs.Unsolved, vs.OverBudget) as refusal:
        print("  in doubles:", name, str(refusal)[:90], flush=True)
    try:
        found = vs.solve(problem, times, "analytic", budget_s=PATIENCE_S)
    except (vs.InvalidInput, vs.Unsolved, vs.OverBudget) as refusal:
        print("  left out:", name, str(refusal)[:90], flush=True)
        return None
    row |= {"series": {x: found.series(x).ravel().tolist() for x in problem.bounded}}
    return {**row, "error": found.error.tolist()}


def frozen_motions(motions: Iterator[Motion]) -> Iterator[dict[str, Any]]:
    for name, make, times in motions:
        try:
            problem = make()
        except vs.InvalidInput as refusal:
            print("  no problem:", name, str(refusal)[:90], flush=True)
            continue
        row = frozen_motion(name, problem, times)
        if row is not None:
            yield row


def documents() -> Iterator[dict[str, Any]]:
    """Yield closed forms with what they are at three times, in 30 digits of the motion."""
    chosen = {"veselova": 7, "veselova-special": 40, "neumann": 9, "bodies": 30, "balls": 30}
    for group, step in chosen.items():
        kept = 0
        for i, (name, make, times) in enumerate(MOTIONS[group]()):
            if kept == 4 or i % step:
                continue
            try:
                problem = make()
                document = vs.closed_form(problem)
            except (vs.InvalidInput, vs.Unsolved):
                continue
            row = frozen_motion(name, problem, times)
            stated = document.to_json()
            if row is not None and len(stated) < 60_000:
                kept += 1
                yield {**row, "document": json.loads(stated)}


def curves_of_real_points() -> Iterator[dict[str, Any]]:
    """Yield Riemann matrices and Abel images of curves, 30 digits, gaps down to 1e-14."""
    for i in range(36):
        rng = np.random.default_rng([50, 11, i])
        genus = 1 + i % 5
        count = 2 * genus + 1 + i % 2
        points = np.cumsum(rng.integers(100, 3000, count))
        exact = [Fraction(int(x), 1000) for x in points]
        if i % 3 == 2:
            at = int(rng.integers(1, count))
            exact[at] = exact[at - 1] + Fraction(1, 10 ** int(rng.integers(2, 15)))
            exact[at + 1 :] = [x + 5 for x in exact[at + 1 :]]
        curve = curves.RealHyperelliptic(text(exact), digits=DIGITS)
        numbers = curve.decimals.midpoints
        z = [f"{x:.5g}" for x in rng.uniform(0, 1, genus)]
        images = curve.invert_decimals([z]).midpoints
        yield {
            "points": text(exact),
            "riemann_matrix": list(map(number, np.ravel(numbers["riemann_matrix"]))),
            "z": z,
            "inverted": list(map(number, np.ravel(images["points"]))),
            "signs": [int(x) for x in np.ravel(images["signs"])],
        }


def theta_functions() -> Iterator[dict[str, Any]]:
    """Yield values of theta functions with characteristics, and gradients, by FLINT's sums."""
    from flint import acb, acb_mat, arb, ctx

    old, ctx.dps = ctx.dps, 50
    try:
        for i in range(24):
            rng = np.random.default_rng([50, 12, i])
            genus = 1 + i % 4
            basis = np.linalg.qr(rng.normal(size=(genus, genus)))[0]
            least = 0.05 if i % 3 == 2 else 0.4
            imaginary = basis @ np.diag(np.exp(rng.uniform(np.log(least), 1, genus))) @ basis.T
            real = rng.uniform(-1, 1, (genus, genus)) * (i % 2)
            tau = np.round((real + real.T) / 2, 6) + 1j * np.round((imaginary + imaginary.T) / 2, 6)
            z = np.round(rng.uniform(-1, 1, genus) + 0.3j * rng.uniform(-1, 1, genus) * (i % 2), 6)
            rows = [[acb(arb(x.real), arb(x.imag)) for x in row] for row in tau]
            column = acb_mat([[acb(arb(x.real), arb(x.imag))] for x in z])
            values = acb_mat(rows).theta(column).entries()
            yield {
                "tau": [[[x.real, x.imag] for x in row] for row in tau],
                "z": [[x.real, x.imag] for x in z],
                "values": [
                    [x.real.str(DIGITS, radius=False), x.imag.str(DIGITS, radius=False)]
                    for x in values
                ],
            }
    finally:
        ctx.dps = old


OTHERS: dict[str, Callable[[], Iterator[dict[str, Any]]]] = {
    "documents": documents,
    "curves": curves_of_real_points,
    "theta": theta_functions,
}


def write(group: str, rows: Iterator[dict[str, Any]]) -> None:
    begin = time.process_time()
    stated = ({"version": __version__, **row} for row in rows)
    lines = [json.dumps(row, separators=(",", ":")) for row in stated]
    packed = lzma.compress("\n".join(lines).encode() + b"\n", preset=9)
    (FOLDER / f"{group}.jsonl.xz").write_bytes(packed)
    seconds = time.process_time() - begin
    print(f"{group}: {len(lines)} rows, {len(packed)} bytes, {seconds:.0f} s", flush=True)


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    everything = [*MOTIONS, *OTHERS]
    missing = [x for x in everything if not (FOLDER / f"{x}.jsonl.xz").exists()]
    for group in sys.argv[1:] or missing:
        write(group, frozen_motions(MOTIONS[group]()) if group in MOTIONS else OTHERS[group]())
