"""The public names, which ``__init__.py`` loads when they are first used."""

from veselova import curves as curves
from veselova import geodesics as geodesics
from veselova import theta as theta
from veselova.engines import closed_form as closed_form
from veselova.engines import compare as compare
from veselova.engines import from_torus as from_torus
from veselova.engines import solve as solve
from veselova.engines import torus as torus
from veselova.ensembles import FlowMap as FlowMap
from veselova.ensembles import solve_many as solve_many
from veselova.ensembles import tori as tori
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
from veselova.mechanics.systems.chaplygin_ball_n import ChaplyginBallN as ChaplyginBallN
from veselova.mechanics.systems.ellipsoid import EllipsoidGeodesic as EllipsoidGeodesic
from veselova.mechanics.systems.euler_poisson import EulerPoisson as EulerPoisson
from veselova.mechanics.systems.lr_system import LRSystem as LRSystem
from veselova.mechanics.systems.neumann import NeumannSystem as NeumannSystem
from veselova.mechanics.systems.rubber_ball import RubberBall as RubberBall
from veselova.mechanics.systems.rubber_ball_n import RubberBallN as RubberBallN
from veselova.mechanics.systems.separable_veselova import SeparableVeselova as SeparableVeselova
from veselova.mechanics.systems.stiefel import StiefelFlow as StiefelFlow
from veselova.mechanics.systems.veselova import Veselova as Veselova
from veselova.mechanics.systems.veselova_so3 import VeselovaSO3 as VeselovaSO3
from veselova.service.cli.local_sweep import sweep as sweep
from veselova.service.client.client import AsyncClient as AsyncClient
from veselova.service.client.client import Client as Client

__version__: str
