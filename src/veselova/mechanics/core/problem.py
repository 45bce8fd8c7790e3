"""What every problem is: a system of the paper with its state at time zero, immutable and validated
on construction.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from functools import cached_property
from html import escape
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.arguments import (
    CheckedCall,
    read_only,
    require_name,
    require_truth_value,
)
from veselova.mechanics.core.decimals import (
    SHOWN_DIGITS,
    BallSeries,
    Objects,
    Pair,
    decimal_pair,
    working_digits,
)
from veselova.mechanics.core.errors import Faults, InvalidInput, Unsolved, show
from veselova.mechanics.core.exact_input import double_array, plain
from veselova.mechanics.core.flow import Flow

__all__ = ["NO_DIGIT", "Problem", "Series", "html_table"]

Array = NDArray[np.float64]

#: An error above this part of the state's extent leaves no digit of it.
NO_DIGIT = 0.1

#: Series by name, first axis the times.
Series = Mapping[str, Array]


#: Arguments of constructors that are true or false.
_SWITCHES = frozenset({"normalize", "strict", "homogeneous"})


class _ProblemClass(CheckedCall):
    """The class of systems: their switches are true or false, and a problem keeps the arguments of
    its constructor.
    """

    if not TYPE_CHECKING:  # type checkers read the constructors

        def __call__(cls, *arguments: Any, **options: Any) -> Any:
            faults = Faults()
            for name, parameter in cls.__signature__.parameters.items():
                if name in _SWITCHES & options.keys() and options[name] is not parameter.default:
                    faults.attempt(require_truth_value, options[name], name)
            usable = {**options, **{fault.path[0]: False for fault in faults.found}}
            made = faults.attempt(super().__call__, *arguments, **usable)
            faults.require_none()
            if "given" not in vars(made):
                bound = cls.__signature__.bind(*arguments, **options)
                bound.apply_defaults()
                given = {k: plain(x) for k, x in bound.arguments.items() if x is not None}
                made._set(given=given)
            return made


class Problem(metaclass=_ProblemClass):
    """A system and its start. A subclass is one system: its data, its series, its integrals, and
    the field that moves it.
    """

    #: The discriminator of the JSON, and the name of the independent variable.
    system: ClassVar[str]
    time: ClassVar[str] = "t"

    #: The series of a trajectory, with the names of the axes that follow the time axis; the order
    #: of every listing and file.
    outputs: ClassVar[Mapping[str, tuple[str, ...]]]
    #: Those that follow from the others, by ``derive``; and those whose true errors ``error``
    #: bounds.
    derived: ClassVar[tuple[str, ...]] = ()
    #: Derived series that are columns of the frame.
    columns_of_frame: ClassVar[Mapping[str, int]] = {}
    bounded: ClassVar[tuple[str, ...]]

    #: The attributes that ``repr`` shows.
    shown: ClassVar[tuple[str, ...]] = ("A", "q", "q_dot")

    #: The series that pictures show.
    portrait: ClassVar[str]

    #: Engines that serve the system, with their methods, and the formulations that the numerical
    #: one integrates; defaults first.
    engines: ClassVar[Mapping[str, tuple[str, ...]]] = {"numeric": ("dop853", "taylor")}
    formulations: ClassVar[tuple[str, ...]]

    #: Whether motions of the system run on tori that ``torus`` describes and ``closed_form`` writes
    #: as documents: all of them, or some.
    has_tori: ClassVar[bool] = False

    #: The arguments as given, JSON-ready.
    given: Mapping[str, Any]

    #: For pictures, None where there is no such thing: the semiaxes of the ellipsoid on which the
    #: portrait lies; 𝓘⁻¹ of a body in three dimensions up to a factor, (3, 3) along the body axes;
    #: the radius of a ball on its plane.
    semiaxes: Array | None = None
    inverse_inertia: Array | None = None
    rolling_radius: float | None = None

    def __setattr__(self, name: str, value: Any) -> None:
        raise AttributeError(f"{type(self).__name__} is immutable: {name} cannot be set")

    def _set(self, **fields: Any) -> None:
        """Set attributes once and for all: a problem is immutable, and its arrays are read-only."""
        for name, value in fields.items():
            object.__setattr__(
                self, name, read_only(np.array(value)) if isinstance(value, np.ndarray) else value
            )

    def __repr__(self) -> str:
        parts = [
            f"{name}={np.array2string(np.asarray(value), precision=6, threshold=9)}"
            for name, value in self._shown().items()
        ]
        if potential := self.given.get("potential"):
            parts.append(f"potential={potential}")
        return f"{type(self).__name__}({', '.join(parts)})".replace("\n", "")

    def _shown(self) -> Mapping[str, Any]:
        """Return the numbers that ``repr`` shows, by their names."""
        return {name: getattr(self, name) for name in self.shown}

    def _repr_html_(self) -> str:
        return html_table({"system": self.title, **{k: show(x) for k, x in self.given.items()}})

    @property
    def stored(self) -> tuple[str, ...]:
        """Return the outputs from which a trajectory can be rebuilt: the others
        follow from them.
        """
        return tuple(name for name in self.outputs if name not in self.derived)

    @abstractmethod
    def flow(self, formulation: str) -> Flow:
        """Return the field with this start; it must move."""

    @abstractmethod
    def integrals(self, series: Series) -> dict[str, Array]:
        """Return the integrals of motion along series, by name, first axis the times."""

    @property
    def title(self) -> str:
        """Return the system, its size and the energy that it conserves in a few words."""
        name = self.energy_name.replace("_", " ")
        return f"{self.system}, {self.size}, {name} {self.energy:.12g}"

    @property
    def size(self) -> str:
        """Return the dimension, or what else tells motions of the system apart."""
        known: Any = self
        return f"n = {known.n}"

    @property
    def energy(self) -> float:
        """Return the energy that the motion conserves, or the integral in its place."""
        return float(self.integrals(self.start)[self.energy_name][0])

    @property
    def vanishing(self) -> frozenset[str]:
        """Return the integrals whose value is zero, so that their drift is absolute."""
        return frozenset()

    @property
    def energy_name(self) -> str:
        """Return the name of the conserved energy among the integrals: ``energy``, or
        ``jacobi_integral`` where constraints do work and the kinetic energy is not conserved.
        """
        return "energy"

    @property
    @abstractmethod
    def start(self) -> Series:
        """Return the series at time zero, each with a first axis of length one."""

    @property
    @abstractmethod
    def turning(self) -> float:
        """Return the rate at which the state turns at the start, in radians per unit of time."""

    @property
    def moves(self) -> bool:
        """Return whether anything moves; a problem at rest stays at its start."""
        return True

    @property
    def badly_conditioned(self) -> str | None:
        """Return why neighbouring data part exponentially from the motion, None where it is not
        known that they do.
        """
        return None

    @property
    def without_closed_form(self) -> str | None:
        """Return why the motion has no closed form where others of the system have; None for
        motions like all others.
        """
        return None

    @property
    def default_engine(self) -> str:
        """Return the engine that serves this problem where none is asked for: the closed form where
        the problem has one.
        """
        return "numeric" if self.without_closed_form else next(iter(self.engines))

    @property
    def has_torus(self) -> bool:
        """Return whether the motion runs on a torus that ``torus`` describes, or rests."""
        return self.has_tori

    @property
    def tabulated(self) -> str:
        """Return the series that tables of a motion show."""
        return self.portrait

    @property
    def extent(self) -> float:
        """Return how large entries of the bounded series may be: 1 on a sphere, else the longest
        semiaxis where that is more.
        """
        return 1.0 if self.semiaxes is None else max(1.0, float(np.max(self.semiaxes)))

    def require_digit(self, times: Array, error: Array, cause: str) -> None:
        """Raise Unsolved (``no-digit-left``), with its cause, where the error of the bounded series
        is above a tenth of their extent, or is no number.
        """
        limit = NO_DIGIT * self.extent
        lost = times[~(error <= limit)]
        if lost.size:
            first = lost[np.argmin(np.abs(lost))]
            reason = f"at {self.time} = {first:.6g} the error reaches {limit:.3g}: {cause}"
            raise Unsolved("no-digit-left", reason)

    def derive(self, name: str, series: Series) -> Array:
        """Return one of the ``derived`` series, in floats from floats and in balls from balls."""
        return np.array(series["frame"][..., self.columns_of_frame[name]])

    def derive_decimals(
        self, name: str, midpoints: Mapping[str, Objects], radii: Mapping[str, Objects], digits: int
    ) -> Pair:
        """Return one of the ``derived`` series as decimals with radii, from the decimals of the
        stored ones.
        """
        if name in self.columns_of_frame:
            place = self.columns_of_frame[name]
            return midpoints["frame"][:, :, place], radii["frame"][:, :, place]
        with working_digits(digits):
            found = self.derive(name, BallSeries(midpoints, radii))
            return decimal_pair(found, digits + SHOWN_DIGITS)

    def complete(self, series: Series) -> Series:
        """Return the series of a flow, with what it leaves to the problem, along the axes in which
        the problem was given.
        """
        return series

    def bound(self, series: Series, error: Array) -> Array:
        """Return the error of all bounded series, from that of those among them which are not
        derived.
        """
        return error

    def rounding(self, series: Series) -> Array:
        """Return how far the bounded series are off where the stored ones are rounded to doubles,
        (N,): half a unit in the last place of their largest entry, or of 1.
        """
        known = [series[name] for name in self.bounded if name in series]
        rows = [np.max(np.abs(x).reshape(len(x), -1), axis=1) for x in known]
        return np.asarray(np.finfo(float).eps / 2 * np.maximum(1.0, np.max(rows, axis=0)))

    @cached_property
    def _flows(self) -> dict[str, Flow]:
        return {}

    def _flow_of(self, formulation: str | None) -> Flow:
        """Return the flow of a formulation, None for the first, made once."""
        name = self.formulations[0] if formulation is None else formulation
        require_name(name, ("formulation",), self.formulations)
        if not self.moves:
            raise Unsolved("at-rest", "nothing moves, so there is no field to integrate")
        if name not in self._flows:
            self._flows[name] = self.flow(name)
        return self._flows[name]

    def initial_state(self, formulation: str | None = None) -> Array:
        """Return the state y at time zero that ``rhs`` takes, (m,)."""
        return np.array(self._flow_of(formulation).initial)

    def rhs(self, time: float, y: Any, formulation: str | None = None) -> Array:
        """Return dy/d(time) of a state y (m,): the right-hand side for an integrator of one's own.

        The time is the problem's own. Entries of y are of order one, in units of the formulation
        (None for the first of ``formulations``); ``series_of`` gives the problem's series of them.
        The field is autonomous. Raises InvalidInput for an unknown formulation, Unsolved at rest.
        """
        flow = self._flow_of(formulation)
        required = f"an array of {flow.initial.size} numbers, as initial_state()"
        state = double_array(y, ("y",), required)
        if state.shape != flow.initial.shape:
            raise InvalidInput(("y",), required, f"one of shape {state.shape}")
        return flow.vector_field(time, state) / flow.time_unit

    def series_of(self, states: Any, formulation: str | None = None) -> dict[str, Array]:
        """Return all ``outputs`` by name, first axis the times, of states (N, m) that ``rhs``
        moves.

        Frames are made orthonormal; integrals are left as integrated. Raises as ``rhs``.
        """
        flow = self._flow_of(formulation)
        required = f"an array (N, {flow.initial.size}): for SciPy's solution.y its transpose"
        rows = double_array(states, ("states",), required)
        if rows.shape[1:] != flow.initial.shape:
            raise InvalidInput(("states",), required, f"one of shape {rows.shape}")
        series = dict(self.complete(flow.unpack(rows)))
        return {
            name: series[name] if name in series else self.derive(name, series)
            for name in self.outputs
        }

    def as_dict(self) -> dict[str, Any]:
        """Return the problem as given, JSON-ready: floats as they are, exact numbers as strings."""
        return {"system": self.system, **self.given}

    def as_request(self) -> dict[str, Any]:
        """Return ``as_dict`` where it is the JSON that a request states; raises InvalidInput for a
        problem that none can.
        """
        return self.as_dict()

    def conditioning_floor(self, times: Array) -> Array:
        """Return ε·max(1, |ω|·|t|): how far one rounding of the data moves the state, which no
        method can better.
        """
        angle = np.maximum(1.0, self.turning * np.abs(times))
        return np.asarray(np.finfo(float).eps * angle, dtype=np.float64)


def html_table(rows: Mapping[str, object]) -> str:
    """Return an HTML table with a row for each name and its value."""
    style = "style='text-align:left'"
    body = "".join(
        f"<tr><th {style}>{escape(name)}</th><td {style}>{escape(str(value))}</td></tr>"
        for name, value in rows.items()
    )
    return f"<table>{body}</table>"
