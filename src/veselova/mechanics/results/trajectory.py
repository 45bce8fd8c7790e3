"""The one result type of both engines."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from veselova.mechanics.core.arguments import require_truth_value, takes_arrays
from veselova.mechanics.core.budget import Progress, limits
from veselova.mechanics.core.decimals import Decimals
from veselova.mechanics.core.errors import InvalidInput, Unsolved, did_you_mean, show
from veselova.mechanics.core.problem import Problem, Series, html_table
from veselova.mechanics.core.times import TimeGrid
from veselova.mechanics.core.upper import call_upper
from veselova.mechanics.results.sampled_motion import Provenance, SampledMotion
from veselova.mechanics.results.table import Target, read_decimals, reading, require_arrays

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from scipy.spatial.transform import Rotation

__all__ = ["Trajectory"]

Array = NDArray[np.float64]

#: Three axes of which no two neighbours are equal, all fixed or all moving.
_SEQUENCE = r"(?!.*(.)\1)([XYZ]{3}|[xyz]{3})"


@dataclass(frozen=True, eq=False, repr=False)
class Trajectory(SampledMotion):
    """A motion at given times. Its series are attributes: those of ``problem.outputs``, such as
    ``trajectory.q``.

    - times: (N,)
    - error: (N,) bounds the true error of every component of the bounded series at each time:
      true ≤ error; ``problem.bounded`` names the series
    - arrays: the series that do not follow from others, by name; the first axis is the times,
      which may be the last in memory
    - decimals: the same series to more digits, or with certified errors; None unless requested
    """

    @classmethod
    def on_grid(
        cls,
        problem: Problem,
        grid: TimeGrid,
        error: Array,
        arrays: Series,
        provenance: Provenance,
        dense: Callable[[Any], Trajectory] | None = None,
    ) -> Trajectory:
        """Return the trajectory at the times asked for, in their order, from what is known at those
        of a grid.
        """
        if grid.places is not None:
            error = error[grid.places]
            arrays = {name: values[grid.places] for name, values in arrays.items()}
        return cls(problem, grid.asked, error, arrays, provenance, dense)

    @classmethod
    def at_rest(
        cls,
        problem: Problem,
        grid: TimeGrid,
        provenance: Provenance,
        dense: Callable[[Any], Trajectory],
    ) -> Trajectory:
        """Return the trajectory of a problem that does not move: its start, to rounding."""
        count = grid.doubles.size
        error = np.full(count, np.finfo(float).eps)
        arrays = {name: np.repeat(x, count, axis=0) for name, x in problem.start.items()}
        return cls.on_grid(problem, grid, error, arrays, provenance, dense)

    @classmethod
    def of_decimals(
        cls,
        problem: Problem,
        times: Array,
        decimals: Decimals,
        provenance: Provenance,
        dense: Callable[[Any], Trajectory] | None = None,
    ) -> Trajectory:
        """Return the trajectory whose arrays are the decimals rounded to doubles, which its error
        includes.
        """
        arrays = {name: decimals.midpoints[name].astype(np.float64) for name in problem.stored}
        error = np.nextafter(decimals.error.astype(np.float64), np.inf) + problem.rounding(arrays)
        return cls(problem, times, error, arrays, provenance, dense, decimals)

    def __getattr__(self, name: str) -> Array:
        problem: Problem | None = self.__dict__.get("problem")
        if problem is None or name not in problem.outputs:  # no problem yet: while a pickle is read
            system = f" of system {problem.system}" if problem else ""
            # Names with underscores are asked for by protocols (copy, pickle, notebooks), and not
            # by people.
            hint = did_you_mean(name, dir(self)) if problem and not name.startswith("_") else ""
            raise AttributeError(f"a trajectory{system} has no {name!r}{hint}")
        return self.series(name)

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self.problem.outputs]

    @property
    def drift(self) -> dict[str, float]:
        """Return, per integral of motion, its largest change against the first time, relative to
        its size there (or to 1).
        """
        return {name: float(self.relative_change(name).max()) for name in self.integrals}

    @takes_arrays
    def at(
        self,
        times: ArrayLike | Sequence[Any] | Mapping[str, Any],
        *,
        budget_s: float | None = None,
        progress: Progress = None,
    ) -> Trajectory:
        """Return the same motion at other times; raises Unsolved without a dense answer."""
        if self.dense is None:
            raise Unsolved(
                "no-dense-answer",
                f"a trajectory of method {self.provenance.method} is known at its times "
                "only; solve again",
            )
        with limits(budget_s, progress):
            answer: Trajectory = self.dense(times)
        return answer

    @classmethod
    def from_arrays(cls, problem: Problem, archive: Mapping[str, Any]) -> Trajectory:
        """Return the trajectory of an open archive.

        Raises KeyError unless it has every series that does not follow from others, and all
        decimals or none.
        """
        provenance = Provenance(**json.loads(str(archive["provenance"])))
        certified = bool(provenance.details.get("certified"))
        decimals = read_decimals(problem, archive, provenance.digits, certified)
        series = {name: archive[name] for name in problem.stored}
        times, error = archive["times"], archive["error"]
        return cls(problem, times, error, series, provenance, None, decimals)

    @classmethod
    def from_npz(cls, source: Target, problem: Problem | None = None) -> Trajectory:
        """Return the trajectory that ``to_npz`` wrote, to the last bit, decimals included.

        ``problem``: None takes the problem that the file states. Raises InvalidInput for a file
        that is no such archive, or lacks a series that does not follow from others.
        """
        if problem is not None and not isinstance(problem, Problem):
            required = "a problem, such as veselova.Veselova(A, q, q_dot)"
            raise InvalidInput(("problem",), required, show(problem))
        with reading(source) as arrays:
            if problem is None and "problem" not in arrays:
                required = "the problem of the motion, which the file does not state"
                raise InvalidInput(("problem",), required, "none")
            known = problem or call_upper("read_problem", json.loads(str(arrays["problem"])))
            require_arrays(arrays, known)
            return cls.from_arrays(known, arrays)

    @property
    def rotations(self) -> Rotation:
        """Return the N rotations from body to space, g = Eᵀ, as a ``scipy`` Rotation, for n = 3.

        Space has the axes e_1, e_2, e_3 of ``frame``. Raises InvalidInput for another n, for a
        system without a frame, and for a reflected frame. ``error`` bounds the entries of the
        matrices.
        """
        if "frame" not in self.problem.outputs:
            raise InvalidInput(("problem",), "a system with a frame", self.problem.system)
        frame = self.series("frame")
        if frame.shape[1:] != (3, 3):
            given = f"{frame.shape[1]} × {frame.shape[2]} numbers"
            raise InvalidInput(("problem",), "a body with a frame of 3 × 3 numbers", given)
        if np.linalg.det(frame[0]) < 0:
            raise InvalidInput(("frame",), "a frame of determinant 1", "a reflected one")
        # Loaded here: who asks a server for motions loads no SciPy.
        from scipy.spatial.transform import Rotation

        return Rotation.from_matrix(np.swapaxes(frame, 1, 2))

    @takes_arrays
    def quaternions(self, *, scalar_first: bool = False) -> Array:
        """Return the unit quaternions of ``rotations``, (N, 4), scalar last; of the two signs, the
        one nearer to the time before. Raises as ``rotations`` does.
        """
        require_truth_value(scalar_first, "scalar_first")
        found = self.rotations.as_quat(scalar_first=scalar_first)
        # −p and p are one rotation. The product of signs so far keeps the list continuous.
        steps = np.sum(found[1:] * found[:-1], axis=1)
        signs = np.cumprod(np.concatenate([[1.0], np.where(steps < 0, -1.0, 1.0)]))
        return np.asarray(found * signs[:, None], dtype=np.float64)

    @takes_arrays
    def euler_angles(self, sequence: str, *, degrees: bool = False) -> Array:
        """Return the Euler angles of ``rotations``, (N, 3), in radians, or in degrees.

        ``sequence``: three letters as in SciPy, capitals for rotations about the moving axes, such
        as ``XZX``: its second angle is that between e_1 and the first body axis. Raises
        InvalidInput for other sequences, and as ``rotations`` does. SciPy warns where two of the
        axes coincide.
        """
        if not isinstance(sequence, str) or not re.fullmatch(_SEQUENCE, sequence):
            required = "three of the letters XYZ (or xyz), no two neighbours equal, such as XZX"
            raise InvalidInput(("sequence",), required, show(sequence))
        require_truth_value(degrees, "degrees")
        return np.asarray(self.rotations.as_euler(sequence, degrees=degrees), dtype=np.float64)

    def in_order_of_time(self) -> Trajectory:
        """Return the trajectory with its times in increasing order: itself, or its
        doubles alone.
        """
        order = np.argsort(self.times, kind="stable")
        if (np.diff(order) == 1).all():
            return self
        arrays = {name: values[order] for name, values in self.arrays.items()}
        times = self.times[order]
        error = self.error[order]
        return replace(self, times=times, error=error, arrays=arrays, decimals=None)

    @takes_arrays
    def plot(
        self,
        ax: Axes | None = None,
        *,
        outputs: Iterable[str] | None = None,
        times: Any = None,
        style: Any = "screen",
    ) -> Figure:
        """Return a matplotlib figure of the motion, one panel below the other.

        - ax: axes to draw one panel into; in space (``projection="3d"``) for the panel portrait
        - outputs: the panels: any series, over time; ``portrait``, the curve in space of a series
          with three components; ``path``, that of a ball on its plane; ``drift``, the relative
          change of the integrals; ``error``. By default the portrait, the path, the components
          of the portrait, and the spheroconic coordinates or the drift
        - times: those to draw, as ``at`` takes them; None for the trajectory's own
        - style: ``screen`` or ``print`` (one column of 86 mm, 8 points)

        The side of the sphere away from the viewer is dim. A curve of more than 40 turns is drawn
        as the density of its points. ``figure.savefig("motion.pdf")`` writes it. Raises
        InvalidInput for bad arguments, BackendMissing without matplotlib.
        """
        from veselova.mechanics.results.plot import picture

        motion = self if times is None else self.at(times)
        return picture(motion.in_order_of_time(), ax, outputs, style)

    @takes_arrays
    def view(self, height: int = 640) -> Any:
        """Return a widget that plays the motion in a notebook, ``height`` pixels high (100 to
        10000): the page of ``to_html``.

        Its attributes ``t`` (a text), ``speed`` and ``playing`` are those of the page, both ways.
        Raises BackendMissing without anywidget, and as ``to_html`` does.
        """
        return call_upper("view", self, height)

    @takes_arrays
    def animate(
        self,
        path: str | Path,
        seconds: float = 10,
        frames_per_second: float = 25,
        *,
        progress: Progress = None,
    ) -> None:
        """Write a film of the motion from its first to its last time, by the ending of the path:
        .gif, or .mp4 by ffmpeg, which the extra ``film`` brings.

        It shows a body in three dimensions in space, e_1 upwards, or a ball on its plane. Where the
        motion is known at its own times only, each is one frame. Raises InvalidInput for another
        ending, system or fewer than two times, and BackendMissing without matplotlib or ffmpeg.
        """
        from veselova.mechanics.results.animation import animate

        animate(self.in_order_of_time(), path, seconds, frames_per_second, progress)

    def to_html(self, target: Target) -> None:
        """Write the motion as one page that plays in a browser, without a server or a network.

        A motion with a closed form of genus 1 … 3 plays at any time up to 10¹², others play
        between their first and last times. Raises BackendMissing where the explorer was not built
        with this installation, and InvalidInput where times without closed form are too far apart.
        """
        call_upper("write_page", self, target)

    def __repr__(self) -> str:
        span = f"{self.times.size} times from {self.times.min():g} to {self.times.max():g}"
        how = f"{self.provenance.engine} ({self.provenance.method})"
        return (
            f"<Trajectory: {self.problem.title}, {span}, {how}, error ≤ {np.max(self.error):.2g}>"
        )

    def _repr_html_(self) -> str:
        rows = {
            "system": self.problem.title,
            "engine": f"{self.provenance.engine} ({self.provenance.method})",
            "times": f"{self.times.size} from {self.times.min():g} to {self.times.max():g}",
            "largest error": f"{np.max(self.error):.2g}",
            "seconds": f"{self.provenance.seconds:.3g}",
            **{f"drift of {name}": f"{value:.2g}" for name, value in self.drift.items()},
        }
        return html_table(rows)
