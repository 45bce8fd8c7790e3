"""The Abel–Jacobi map in real angles, both ways: z_k = Σ_s G_sk(ψ_s), and Newton's method back."""

from typing import Any, NamedTuple

from .arithmetic import EPSILON, assign, cos, dot, jit, largest, pi, sin, solve

#: Method: one of so many terms of the series serves from afar, until a step, in radians, is short,
#: for so many steps at most.
ROUGH, NEAR, MOST_ROUGH = 3, 0.03, 10


#: Calibrated: residual in EPSILON that rounding leaves, from which z is right to its digits. Beside
#: a separatrix two ψ together move by 1e-6 with it, and the frame does not.
STALLED = 32.0


class AngleSeries(NamedTuple):
    """∂z_k/∂ψ_s = Σ_m slopes_ksm cos mψ, the sines of z_k, slopes_ksm/m; room for harmonics."""

    counts: Any  # (g,) terms on each cut
    few: Any  # (g,) those that serve from afar
    slopes: Any  # (g, g, N)
    sines: Any  # (g, g, N)
    harmonics: Any  # (2, N)


@jit
def abel(angles: Any, psi: Any, z: Any, slopes: Any) -> Any:
    """Fill z (g,) and ∂z_k/∂ψ_s (g, g) at ψ."""
    sum_series(angles, angles.counts, psi, z, slopes)


@jit
def sum_series(angles: Any, counts: Any, psi: Any, z: Any, slopes: Any) -> Any:
    """Fill the same from so many terms of each series (g,)."""
    g = psi.size
    for k in range(g):
        z[k] = psi[k] / (2 * pi)
    c, s = angles.harmonics[0], angles.harmonics[1]
    for i in range(g):
        count = counts[i]
        set_multiples(psi[i], count, c, s)
        for k in range(g):
            slopes[k, i] = dot(angles.slopes[k, i], c, count)
            z[k] = z[k] + dot(angles.sines[k, i], s, count)


@jit
def set_multiples(psi: Any, count: Any, c: Any, s: Any) -> Any:
    """Fill cos mψ and sin mψ, m < count, and four of them at least: each from the fourth before, so
    that four go at once.
    """
    x, y = cos(psi), sin(psi)
    c[0], s[0] = 1.0, 0.0
    for m in range(1, 4):
        c[m], s[m] = c[m - 1] * x - s[m - 1] * y, s[m - 1] * x + c[m - 1] * y
    x, y = c[2] * c[2] - s[2] * s[2], 2 * c[2] * s[2]
    for m in range(4, count):
        c[m], s[m] = c[m - 4] * x - s[m - 4] * y, s[m - 4] * x + c[m - 4] * y


@jit
def converged(step: Any, last: Any) -> Any:
    """Return whether a step of Newton's method is the last one: steps are x, Cx², C³x⁴ …, so the
    next one would be step³/last²; and where C happens to vanish, step² at most.
    """
    return step * (step / last) * (step / last) < EPSILON / 4 and step * step < 16 * EPSILON


@jit
def invert(angles: Any, target: Any, psi: Any, room: Any) -> Any:
    """Bring ψ to z(ψ) = target by Newton's method from the given ψ; return whether it converged.

    A step that makes things worse is shortened, and so is one of more than a radian; it is the
    whole step that convergence is judged by. ``room.slopes`` are those at the last step.
    """
    z, slopes, step, work = room.z, room.slopes, room.step, room.work
    g = z.size
    noise = EPSILON**0.65
    residual, part, last = 0.0, 1.0, 1.0
    for turn in range(80):
        abel(angles, psi, z, slopes)
        for k in range(g):
            z[k] = z[k] - target[k]
            assign(slopes[k], work[k])
        worst = largest(z)
        if turn > 0 and residual / 4 < worst < STALLED * EPSILON:
            return True
        if turn > 0 and worst > residual and worst > noise:
            for k in range(g):
                psi[k] = psi[k] + part * step[k] * 3 / 4
            part, last = part / 4, 1.0
            continue
        solve(work, z, step)
        longest = largest(step)
        residual, part = worst, 1.0 if longest < 1 else 1.0 / longest
        for k in range(g):
            psi[k] = psi[k] - part * step[k]
        if converged(longest, last):
            return True
        last = min(longest, 1.0)
    return False


@jit
def invert_all(angles: Any, targets: Any, psi: Any, room: Any) -> Any:
    """Bring rows of ψ (N, g) to z(ψ) = their targets; return how many until one does not settle."""
    done = 0
    while done < len(targets) and invert(angles, targets[done], psi[done], room):
        done += 1
    return done


@jit
def approach(angles: Any, target: Any, psi: Any, room: Any) -> Any:
    """Bring ψ nearer to z(ψ) = target from afar, so that ``invert`` takes few steps: Newton's
    method, of a radian at most, with the first terms of the series.
    """
    for _ in range(MOST_ROUGH):
        sum_series(angles, angles.few, psi, room.z, room.slopes)
        for k in range(psi.size):
            room.z[k] = room.z[k] - target[k]
        solve(room.slopes, room.z, room.step)
        longest = largest(room.step)
        part = 1.0 if longest < 1 else 1.0 / longest
        for k in range(psi.size):
            psi[k] = psi[k] - part * room.step[k]
        if longest < NEAR:
            return
