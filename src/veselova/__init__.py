"""Motions of an n-dimensional rigid body under the Veselova constraint: in theta functions, and by
integration.

    import veselova as vs

    problem = vs.Veselova(
        A=[3, 2, 1.5, 1], q=[0.5, 0.5, 0.5, 0.5], q_dot=[0.5, -0.5, 0.3, -0.3]
    )
    trajectory = vs.solve(problem, times=[0, 1, 1000])
    trajectory.frame  # (3, 4, 4), columns e_i
    trajectory.error  # (3,) bounds every component of q and frame

Names are loaded when first used, ``vs.theta`` and ``vs.curves`` too.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from veselova.version import __version__ as __version__

if TYPE_CHECKING:
    from veselova import curves as curves
    from veselova import theta as theta
    from veselova.engines import closed_form as closed_form
    from veselova.engines import compare as compare
    from veselova.engines import from_torus as from_torus
    from veselova.engines import solve as solve
    from veselova.engines import torus as torus
    from veselova.ensembles import solve_many as solve_many
    from veselova.ensembles import tori as tori
    from veselova.flow_map import FlowMap as FlowMap
    from veselova.mechanics.core.errors import BackendMissing as BackendMissing
    from veselova.mechanics.core.errors import InternalContradiction as InternalContradiction
    from veselova.mechanics.core.errors import InvalidInput as InvalidInput
    from veselova.mechanics.core.errors import InvalidRequest as InvalidRequest
    from veselova.mechanics.core.errors import OverBudget as OverBudget
    from veselova.mechanics.core.errors import ProblemResponse as ProblemResponse
    from veselova.mechanics.core.errors import ServiceError as ServiceError
    from veselova.mechanics.core.errors import ServiceUnreachable as ServiceUnreachable
    from veselova.mechanics.core.errors import Unsolved as Unsolved
    from veselova.mechanics.core.errors import VeselovaError as VeselovaError
    from veselova.mechanics.groups.matrix_group import MatrixGroup as MatrixGroup
    from veselova.mechanics.results.closed_form import ClosedForm as ClosedForm
    from veselova.mechanics.results.comparison import Comparison as Comparison
    from veselova.mechanics.results.ensemble import Ensemble as Ensemble
    from veselova.mechanics.results.provenance import Provenance as Provenance
    from veselova.mechanics.results.tori import Tori as Tori
    from veselova.mechanics.results.torus import Torus as Torus
    from veselova.mechanics.results.trajectory import Trajectory as Trajectory
    from veselova.mechanics.systems.chaplygin_ball import ChaplyginBall as ChaplyginBall
    from veselova.mechanics.systems.ellipsoid import EllipsoidGeodesic as EllipsoidGeodesic
    from veselova.mechanics.systems.euler_poisson import EulerPoisson as EulerPoisson
    from veselova.mechanics.systems.lr_system import LRSystem as LRSystem
    from veselova.mechanics.systems.neumann import NeumannSystem as NeumannSystem
    from veselova.mechanics.systems.rolling_ball_n import ChaplyginBallN as ChaplyginBallN
    from veselova.mechanics.systems.rolling_ball_n import RubberBallN as RubberBallN
    from veselova.mechanics.systems.rubber_ball import RubberBall as RubberBall
    from veselova.mechanics.systems.separable_veselova import SeparableVeselova as SeparableVeselova
    from veselova.mechanics.systems.stiefel import StiefelFlow as StiefelFlow
    from veselova.mechanics.systems.veselova import Veselova as Veselova
    from veselova.mechanics.systems.veselova_so3 import VeselovaSO3 as VeselovaSO3
    from veselova.service.cli.local_sweep import sweep as sweep
    from veselova.service.client.client import AsyncClient as AsyncClient
    from veselova.service.client.client import Client as Client

#: Public name → the module that defines it.
_HOMES = {
    "AsyncClient": "veselova.service.client.client",
    "BackendMissing": "veselova.mechanics.core.errors",
    "ChaplyginBall": "veselova.mechanics.systems.chaplygin_ball",
    "ChaplyginBallN": "veselova.mechanics.systems.rolling_ball_n",
    "Client": "veselova.service.client.client",
    "ClosedForm": "veselova.mechanics.results.closed_form",
    "Comparison": "veselova.mechanics.results.comparison",
    "EllipsoidGeodesic": "veselova.mechanics.systems.ellipsoid",
    "Ensemble": "veselova.mechanics.results.ensemble",
    "EulerPoisson": "veselova.mechanics.systems.euler_poisson",
    "FlowMap": "veselova.flow_map",
    "InternalContradiction": "veselova.mechanics.core.errors",
    "InvalidInput": "veselova.mechanics.core.errors",
    "InvalidRequest": "veselova.mechanics.core.errors",
    "LRSystem": "veselova.mechanics.systems.lr_system",
    "MatrixGroup": "veselova.mechanics.groups.matrix_group",
    "NeumannSystem": "veselova.mechanics.systems.neumann",
    "OverBudget": "veselova.mechanics.core.errors",
    "ProblemResponse": "veselova.mechanics.core.errors",
    "Provenance": "veselova.mechanics.results.provenance",
    "RubberBall": "veselova.mechanics.systems.rubber_ball",
    "RubberBallN": "veselova.mechanics.systems.rolling_ball_n",
    "SeparableVeselova": "veselova.mechanics.systems.separable_veselova",
    "ServiceError": "veselova.mechanics.core.errors",
    "ServiceUnreachable": "veselova.mechanics.core.errors",
    "StiefelFlow": "veselova.mechanics.systems.stiefel",
    "Tori": "veselova.mechanics.results.tori",
    "Torus": "veselova.mechanics.results.torus",
    "Trajectory": "veselova.mechanics.results.trajectory",
    "Unsolved": "veselova.mechanics.core.errors",
    "Veselova": "veselova.mechanics.systems.veselova",
    "VeselovaError": "veselova.mechanics.core.errors",
    "VeselovaSO3": "veselova.mechanics.systems.veselova_so3",
    "closed_form": "veselova.engines",
    "compare": "veselova.engines",
    "from_torus": "veselova.engines",
    "solve": "veselova.engines",
    "solve_many": "veselova.ensembles",
    "sweep": "veselova.service.cli.local_sweep",
    "tori": "veselova.ensembles",
    "torus": "veselova.engines",
}

#: Public modules.
_MODULES = ("curves", "theta")

__all__ = ["__version__", *sorted([*_HOMES, *_MODULES])]


def __getattr__(name: str) -> Any:
    if name in _MODULES:
        return import_module(f"veselova.{name}")
    if name not in _HOMES:
        hint = ""
        if not name.startswith("_"):
            from veselova.mechanics.core.errors import did_you_mean

            hint = did_you_mean(name, __all__)
        raise AttributeError(f"module 'veselova' has no attribute {name!r}{hint}")
    import_module("veselova.methods").register_methods()
    try:
        value = getattr(import_module(_HOMES[name]), name)
    except ModuleNotFoundError as error:
        raise _missing(name, error) from None
    globals()[name] = value
    return value


#: Public names that need more than the core, and the extra that installs it.
_EXTRAS = {"AsyncClient": "client", "Client": "client", "sweep": "sweeps"}


def _missing(name: str, error: ModuleNotFoundError) -> ImportError:
    """Return what to raise where a public name cannot be loaded for want of a library."""
    library = (error.name or "").split(".")[0]
    # a fault of this package, or of the core
    if name not in _EXTRAS or library in ("", "veselova"):
        return error
    from veselova.mechanics.core.errors import BackendMissing
    from veselova.mechanics.core.installation import install_extra

    return BackendMissing(library, f"veselova.{name}", install_extra(_EXTRAS[name]))


def __dir__() -> list[str]:
    return list(__all__)
