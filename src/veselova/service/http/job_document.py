"""The JSON of a job."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

import orjson
from pydantic import BaseModel, Field

if TYPE_CHECKING:
    from veselova.service.sweeps.job_store import Job
    from veselova.service.sweeps.runner import Progress

__all__ = ["JobDocument", "JobList", "job_document"]


class JobDocument(BaseModel):
    """A sweep that was asked for, and how far it is."""

    id: str = Field(description="the same request has the same")
    state: Literal["queued", "running", "finished", "failed", "cancelled"]
    detail: str = Field(description="why a job failed, or what a running one waits for; empty else")
    total: int = Field(description="problems")
    done: int = Field(description="of them solved, or found to have no solution")
    rate: float | None = Field(
        description="problems per second since the server took the job; null unless it is running"
    )
    eta_s: float | None = Field(
        description="seconds to the end at this rate; null where it is unknown"
    )
    created_at: str
    finished_at: str | None
    request: dict[str, Any] | None = Field(
        description="the request, its defaults filled in; null in listings and events"
    )
    owner: str | None = Field(
        description="of the key that asked for it; null where no key is shown"
    )
    links: dict[str, str]


class JobList(BaseModel):
    """The last jobs, newest first."""

    jobs: list[JobDocument]


def job_document(
    job: Job, progress: Progress | None, trajectories: bool, root_path: str
) -> JobDocument:
    """Return the document of a job, with its request where ``job`` has it.

    ``progress`` is what the process that runs it knows beyond the database; ``trajectories``:
    whether there are some to be had; ``root_path``: the prefix of all links.
    """
    here = f"{root_path}/v1/jobs/{job.id}"
    rate = progress.rate if progress else None
    done = max(job.done, progress.done if progress else 0)
    links = {"self": here, "events": f"{here}/events"}
    if job.state == "finished":
        links["result"] = f"{here}/result"
        if trajectories:
            links["trajectories"] = f"{here}/trajectories"
    return JobDocument(
        id=job.id,
        state=job.state,  # type: ignore[arg-type]
        detail=f"waits for {progress.waits_for}" if progress and progress.waits_for else job.detail,
        total=job.total,
        done=done,
        rate=rate,
        eta_s=(job.total - done) / rate if rate else None,
        created_at=job.created_at.isoformat(),
        finished_at=None if job.finished_at is None else job.finished_at.isoformat(),
        request=orjson.loads(job.request) if job.request else None,
        owner=job.owner or None,
        links=links,
    )
