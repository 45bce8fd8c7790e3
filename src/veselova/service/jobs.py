"""Jobs as they are kept: what was asked, what is done, and the files of the finished chunks."""

from __future__ import annotations

import contextlib
import hashlib
import os
import shutil
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import orjson
import sqlalchemy as sa

from veselova.mechanics.errors import InvalidInput
from veselova.service.database import chunks, connect, idempotency_keys, in_utc, jobs
from veselova.service.problem_details import Refused
from veselova.service.schemas import read_request
from veselova.service.settings import Settings
from veselova.service.sweep_request import SweepPlan, SweepRequest
from veselova.service.whole_file import whole_file

__all__ = ["ENDED", "Job", "JobEnded", "JobStatus", "Jobs"]

#: States of a job that does not go on by itself; ``queued`` and ``running`` are the others.
ENDED = ("finished", "failed", "cancelled")

#: Jobs in one listing.
_LISTED = 100

#: What is asked of the database about a job: all but its request.
_STATUS_COLUMNS = [column.name for column in jobs.c if column is not jobs.c.request]
_DONE = sa.select(sa.func.coalesce(sa.func.sum(chunks.c.rows), 0)).where(chunks.c.job_id == jobs.c.id).scalar_subquery()
_STATUS = sa.select(*(jobs.c[name] for name in _STATUS_COLUMNS), _DONE.label("done"))


@dataclass(frozen=True)
class JobStatus:
    """How far a sweep is, as the database knows it. ``done`` counts the problems in finished chunks."""

    id: str
    state: str
    detail: str
    total: int
    chunk_rows: int
    created_at: datetime
    finished_at: datetime | None
    done: int

    @property
    def ended(self) -> bool:
        """Return whether the job does not go on by itself."""
        return self.state in ENDED

    @property
    def chunk_count(self) -> int:
        """Return the number of chunks."""
        return -(-self.total // self.chunk_rows)

    def rows(self, position: int) -> tuple[int, int]:
        """Return the first problem of a chunk, and the one after its last."""
        return position * self.chunk_rows, min((position + 1) * self.chunk_rows, self.total)


@dataclass(frozen=True)
class Job(JobStatus):
    """A sweep with its request, which may be megabytes of JSON."""

    request: bytes

    @property
    def sweep(self) -> SweepRequest:
        """Return the request."""
        return read_request(SweepRequest, orjson.loads(self.request))


class JobEnded(Exception):
    """A job that goes on no more: it was cancelled or removed, perhaps by another server, while this one worked at it."""


class Jobs:
    """The jobs of one database and one folder. A chunk counts when its file is on the disk and its hash in the database."""

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self._engine = connect(settings)
        self.folder = settings.data_dir / "jobs"
        self.folder.mkdir(parents=True, exist_ok=True, mode=0o700)

    def close(self) -> None:
        """Close the connections."""
        self._engine.dispose()

    def submit(self, sweep: SweepPlan | SweepRequest, key: str | None = None) -> Job:
        """Return the job of a sweep: a new one, or the one that the same request made, which goes on if it had been stopped,
        and is run again if its results were lost.

        ``key``: an Idempotency-Key. Raises InvalidInput where it came with another request, or beyond the limits of the settings,
        Refused (``too-many-jobs``, ``storage-full``) while others take the room.
        """
        try:
            self._submit(sweep, key)
        except sa.exc.IntegrityError:  # another asked for the same at the same moment: by now the job, or the key, is there
            self._submit(sweep, key)
        return self.get(sweep.id)

    def _submit(self, sweep: SweepPlan | SweepRequest, key: str | None) -> None:
        with self._engine.begin() as connection:
            if key is not None:
                self._claim(connection, key, sweep)
            state = connection.execute(sa.select(jobs.c.state).where(jobs.c.id == sweep.id)).scalar()
            if state is None:
                self._admit(connection, sweep)
                connection.execute(sa.insert(jobs).values(_new(sweep)))
            elif state in ("failed", "cancelled") or (state == "finished" and not self.result_path(sweep.id).exists()):
                again = {"state": "queued", "detail": "", "finished_at": None}
                connection.execute(sa.update(jobs).where(jobs.c.id == sweep.id).values(again))
            if key is not None and not _job_of(connection, key):
                connection.execute(sa.insert(idempotency_keys).values(key=key, job_id=sweep.id))

    def _claim(self, connection: sa.Connection, key: str, sweep: SweepPlan | SweepRequest) -> None:
        if _job_of(connection, key) not in (None, sweep.id):
            raise InvalidInput(("Idempotency-Key",), "a key of its own for every request", "one that came with another request")

    def _admit(self, connection: sa.Connection, sweep: SweepPlan | SweepRequest) -> None:
        """Refuse a sweep that is beyond the limits, before anything of it is stored."""
        limits, size = self._settings, sweep.total * sweep.row_values * 8
        if sweep.total > limits.max_sweep_problems:
            raise InvalidInput(("vary",), f"at most {limits.max_sweep_problems} problems on this server", str(sweep.total))
        if size > limits.max_sweep_bytes:
            room = f"at most {limits.max_sweep_bytes} bytes of results on this server"
            raise InvalidInput(("trajectories" if sweep.trajectories else "vary",), room, f"about {size}")
        waiting = connection.execute(sa.select(sa.func.count()).where(jobs.c.state.not_in(ENDED))).scalar_one()
        if waiting >= limits.max_jobs:
            raise Refused("too-many-jobs", f"{waiting} jobs are waiting or running; try again later.", retry_after=30)
        if size + self.stored_bytes() > limits.max_stored_bytes:
            detail = (
                "The results of earlier jobs take the room that this server has for them; remove some (DELETE …?remove=true)."
            )
            raise Refused("storage-full", detail)

    def get(self, job_id: str) -> Job:
        """Return a job with its request; raises Refused (``no-such-job``)."""
        row = self._row(_STATUS.add_columns(jobs.c.request).where(jobs.c.id == job_id), job_id)
        return Job(**_status(row), request=row["request"].encode())

    def status(self, job_id: str) -> JobStatus:
        """Return how far a job is; raises Refused (``no-such-job``)."""
        return JobStatus(**_status(self._row(_STATUS.where(jobs.c.id == job_id), job_id)))

    def _row(self, query: sa.Select[Any], job_id: str) -> sa.RowMapping:
        with self._engine.connect() as connection:
            found = connection.execute(query).mappings().first()
        if found is None:
            raise Refused("no-such-job", f"There is no job {job_id[:40]}.")
        return found

    def unfinished(self) -> list[str]:
        """Return the jobs that are to go on, oldest first."""
        with self._engine.connect() as connection:
            query = sa.select(jobs.c.id).where(jobs.c.state.not_in(ENDED)).order_by(jobs.c.created_at, jobs.c.id)
            return list(connection.execute(query).scalars())

    def newest(self) -> list[JobStatus]:
        """Return the jobs that were made last, newest first."""
        query = _STATUS.order_by(jobs.c.created_at.desc(), jobs.c.id).limit(_LISTED)
        with self._engine.connect() as connection:
            return [JobStatus(**_status(row)) for row in connection.execute(query).mappings()]

    def require_writable(self) -> None:
        """Raise sqlalchemy.exc.SQLAlchemyError unless the database can be written, OSError unless the folder can."""
        write_whole(self.folder / "probe", bytes(4096))
        with self._engine.begin() as connection:
            connection.execute(sa.update(jobs).where(jobs.c.id == "").values(detail=""))

    def counts(self) -> dict[str, int]:
        """Return how many jobs are in each state; fails where the database cannot be read."""
        with self._engine.connect() as connection:
            query = sa.select(jobs.c.state, sa.func.count()).group_by(jobs.c.state)
            return {str(state): int(count) for state, count in connection.execute(query).all()}

    def advance(self, job_id: str, state: str, detail: str = "") -> bool:
        """Put a job into a state, unless it has ended already; return whether it is there now."""
        changed: dict[str, Any] = {"state": state, "detail": detail[:2000]}
        if state in ENDED:
            changed["finished_at"] = datetime.now(UTC)
        with self._engine.begin() as connection:
            query = sa.update(jobs).where(jobs.c.id == job_id, jobs.c.state.not_in(ENDED)).values(changed)
            return connection.execute(query).rowcount > 0

    def remove(self, job_id: str) -> None:
        """Forget an ended job and its results. Raises Refused (``not-finished``) where it goes on, asked for again meanwhile."""
        with self._engine.begin() as connection:
            removed = connection.execute(sa.delete(jobs).where(jobs.c.id == job_id, jobs.c.state.in_(ENDED))).rowcount
        if not removed:
            raise Refused("not-finished", "The job has been asked for again and goes on; cancel it first.", retry_after=2)
        shutil.rmtree(self.folder / job_id, ignore_errors=True)

    def store(self, job_id: str, position: int, rows: int, table: bytes) -> None:
        """Keep a finished chunk: first its file, whole or not at all, then its hash. Raises JobEnded for a job that has ended."""
        with self._engine.connect() as connection:
            state = connection.execute(sa.select(jobs.c.state).where(jobs.c.id == job_id)).scalar()
        if state is None or state in ENDED:
            raise JobEnded(f"the job is {state or 'removed'}")
        write_whole(self.chunk_path(job_id, position), table)
        values = {"job_id": job_id, "position": position, "rows": rows, "sha256": hashlib.sha256(table).hexdigest()}
        with self._engine.begin() as connection:
            connection.execute(sa.delete(chunks).where(chunks.c.job_id == job_id, chunks.c.position == position))
            connection.execute(sa.insert(chunks).values(values))

    def missing(self, job: Job) -> list[int]:
        """Return the chunks that are still to be computed; those whose file is lost or damaged are forgotten first."""
        for path in (self.folder / job.id).rglob("*.part"):  # of a process that died
            path.unlink(missing_ok=True)
        if self.result_path(job.id).exists() and not self.trajectories_path(job.id).exists():
            return []
        with self._engine.connect() as connection:
            query = sa.select(chunks.c.position, chunks.c.sha256).where(chunks.c.job_id == job.id)
            stored = {int(position): str(digest) for position, digest in connection.execute(query).all()}
        damaged = [position for position, digest in stored.items() if self._digest(job.id, position) != digest]
        with self._engine.begin() as connection:
            for position in damaged:
                connection.execute(sa.delete(chunks).where(chunks.c.job_id == job.id, chunks.c.position == position))
        return [position for position in range(job.chunk_count) if position not in stored or position in damaged]

    def _digest(self, job_id: str, position: int) -> str:
        try:
            return hashlib.sha256(self.chunk_path(job_id, position).read_bytes()).hexdigest()
        except OSError:
            return ""

    def chunk_path(self, job_id: str, position: int) -> Path:
        """Return where the table of a chunk is kept."""
        return self.folder / job_id / "chunks" / f"{position:06d}.parquet"

    def result_path(self, job_id: str) -> Path:
        """Return where the table of a finished job is kept."""
        return self.folder / job_id / "summaries.parquet"

    def trajectories_path(self, job_id: str) -> Path:
        """Return where the Zarr store of a running job is kept."""
        return self.folder / job_id / "trajectories.zarr"

    def packed_path(self, job_id: str) -> Path:
        """Return where the Zarr store of a finished job is kept, in one file."""
        return self.folder / job_id / "trajectories.zarr.zip"

    def stored_bytes(self) -> int:
        """Return how many bytes all jobs have on the disk."""
        total = 0
        for folder, _, names in os.walk(self.folder):
            for name in names:
                with contextlib.suppress(FileNotFoundError):  # a part that was finished, or a job that was removed, meanwhile
                    total += (Path(folder) / name).stat().st_size
        return total


def _status(row: sa.RowMapping) -> dict[str, Any]:
    times = {name: row[name] and in_utc(row[name]) for name in ("created_at", "finished_at")}
    return {**{column: row[column] for column in _STATUS_COLUMNS}, **times, "done": int(row["done"])}


def _new(sweep: SweepPlan | SweepRequest) -> dict[str, Any]:
    return {
        "id": sweep.id,
        "request": sweep.canonical.decode(),
        "state": "queued",
        "total": sweep.total,
        "chunk_rows": sweep.chunk_rows,
        "created_at": datetime.now(UTC),
    }


def _job_of(connection: sa.Connection, key: str) -> str | None:
    query = sa.select(idempotency_keys.c.job_id).where(idempotency_keys.c.key == key)
    return connection.execute(query).scalar()


def write_whole(path: Path, content: bytes) -> None:
    """Write a file so that a death of the process or the machine leaves it whole or absent."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with whole_file(path) as part:
        part.write_bytes(content)
