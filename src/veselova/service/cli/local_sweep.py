"""Sweeps without a server: the same jobs, run in this process and its workers, and resumed where
they were interrupted.
"""

from __future__ import annotations

import multiprocessing
import time
from collections.abc import Mapping
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Any

from veselova.mechanics.core.arguments import whole_number
from veselova.mechanics.core.budget import Progress, reporting
from veselova.mechanics.core.errors import Unsolved, install_extra, needs
from veselova.mechanics.core.folders import expand_home
from veselova.mechanics.core.problem import Problem
from veselova.service.api.request_models import read_request
from veselova.service.api.settings import Settings
from veselova.service.api.sweep_request import SweepRequest, sweep_document
from veselova.service.http.server import settings_of_environment

if TYPE_CHECKING:
    from veselova.service.sweeps.job_store import Job, Jobs


#: So many motions, or chunks of tori, are computed in this process: to start others takes seconds.
_FEW = 50
_FEW_CHUNKS = 10

#: Beyond the processors of any machine.
_MOST_WORKERS = 10_000

#: Seconds between two polls of a job that another process runs.
_POLL_S = 0.2


def sweep(
    problem: Problem | Mapping[str, Any],
    vary: Mapping[str, Any],
    *,
    samples: int = 1,
    seed: int = 0,
    times: Any = None,
    engine: str | None = None,
    method: str | None = None,
    formulation: str | None = None,
    outputs: list[str] | None = None,
    trajectories: bool = False,
    budget_s: float = 10.0,
    workers: int | None = None,
    folder: str | Path | None = None,
    progress: Progress = None,
) -> Any:
    """Return the tori and, with ``times``, the motions of many problems as an xarray Dataset.

    ``vary``: places in the problem's JSON, such as ``"/A/0"`` or ``"/q_dot"``, each with a list or
    an array of values, a grid ``{"start", "stop", "count", "spacing"}``, or a distribution
    ``{"uniform": [low, high]}``, ``{"log_uniform": [low, high]}``, ``{"normal": [mean,
    deviation]}``: ``samples`` draws are taken for each combination of the others, fixed by
    ``seed``. Without ``times`` each problem gives its torus (constants, frequencies, actions,
    regime …); with them also the largest error, the drift of the integrals and the extremes of the
    ``outputs``, and with ``trajectories`` these themselves. A problem that cannot be solved, or not
    within ``budget_s`` seconds, has its reason in ``outcome`` and ``detail``. What is done is kept
    in ``folder`` (default: that of the account's state), and a second call with the same arguments
    goes on from there. ``workers``: processes; all processors when left out. ``progress``: as
    in ``veselova.solve``, of problems. Raises InvalidInput or InvalidRequest for bad input,
    BackendMissing without the extra ``sweeps``.
    """
    options: dict[str, Any] = {"engine": engine, "method": method, "formulation": formulation}
    options |= {"samples": samples, "seed": seed, "budget_s": budget_s}
    options |= {"outputs": outputs, "trajectories": trajectories}
    request = read_request(SweepRequest, {**sweep_document(problem, vary, times), **options})
    settings = local_settings(folder, workers)
    job, jobs = run_sweep(request, settings, progress)
    from veselova.service.api.sweep_request import sweep_dataset

    kept = jobs.packed_path(job.id)
    return sweep_dataset(request, jobs.result_path(job.id), kept if kept.exists() else None)


def local_settings(folder: str | Path | None, workers: int | None) -> Settings:
    """Return the settings of sweeps in this process; those of a server in the environment hold, but
    for the folder.
    """
    settings = settings_of_environment()
    home = expand_home(folder) if folder is not None else settings.data_dir / "local"
    changes: dict[str, Any] = {"data_dir": home.absolute(), "database_url": ""}
    if workers is not None:
        changes["sweep_workers"] = whole_number(workers, ("workers",), 1, _MOST_WORKERS)
    return Settings(**{**settings.model_dump(), **changes})


def run_sweep(
    request: SweepRequest, settings: Settings, progress: Progress = None
) -> tuple[Job, Jobs]:
    """Run a sweep to its end and return its job, with the store in which its results are.

    Raises Unsolved where the job could not be run to its end, BackendMissing without the extra
    ``sweeps``, InvalidInput for a folder that others may write, Refused where its storage fails or
    is damaged.
    """
    with needs("pyarrow", "A sweep", install_extra("sweeps")):
        from veselova.service.access.database import named_outages
        from veselova.service.sweeps.job_store import Jobs
        from veselova.service.sweeps.runner import Sweeps

    with named_outages("storage-unavailable", f"{settings.data_dir} cannot keep the sweep"):
        jobs = Jobs(settings)

    with closing(jobs), reporting(progress) as report:

        def tell(done: int, total: int) -> None:
            if report is not None:
                report("sweep", done, total)

        job = jobs.submit(request)
        if not job.ended:
            processes = _needs_processes(request, settings)
            with closing(Sweeps(settings, jobs, processes, serving=False)) as sweeps:
                sweeps.run(job.id, tell)
                while not jobs.status(job.id).ended:  # another process has the job, or died with it
                    time.sleep(_POLL_S)
                    sweeps.run(job.id, tell)
        job = jobs.get(job.id)
        if job.state != "finished":
            raise Unsolved("sweep-not-finished", job.detail or f"the sweep is {job.state}")
        tell(job.total, job.total)
    return job, jobs


def _needs_processes(request: SweepRequest, settings: Settings) -> bool:
    """Return whether worker processes save more time than their start takes."""
    if settings.dask_scheduler:
        return True
    if multiprocessing.current_process().daemon:  # which may start no process
        return False
    return request.total > (_FEW_CHUNKS * request.chunk_rows if request.times is None else _FEW)
