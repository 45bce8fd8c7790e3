"""Jobs as they are kept: what was asked, by whom, what is done, and the files of the finished
chunks.
"""

from __future__ import annotations

import hashlib
import re
import shutil
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import Any

import orjson
import sqlalchemy as sa

from veselova.mechanics.core.errors import VeselovaError
from veselova.service.access.database import (
    chunks,
    connect,
    idempotency_keys,
    in_utc,
    jobs,
    writing,
)
from veselova.service.access.sqlite_file import vacuum
from veselova.service.api.problem_details import Refused
from veselova.service.api.request_models import read_request
from veselova.service.api.settings import Settings
from veselova.service.api.sweep_request import SweepPlan, SweepRequest
from veselova.service.sweeps.idempotency import claim
from veselova.service.sweeps.job_files import JobFiles, take, write_whole
from veselova.service.sweeps.job_limits import ENDED, JOB_BYTES, promised_bytes, require_room

__all__ = ["ENDED", "Job", "JobEnded", "JobStatus", "Jobs", "job_id_of"]

#: What the id of a job looks like; no other text is looked for.
_ID = re.compile(r"[0-9a-f]{32}")

#: Jobs in one listing.
_LISTED = 100

#: What is asked of the database about a job: all but its request.
_STATUS_COLUMNS = [column.name for column in jobs.c if column is not jobs.c.request]
_DONE = (
    sa.select(sa.func.coalesce(sa.func.sum(chunks.c.rows), 0))
    .where(chunks.c.job_id == jobs.c.id)
    .scalar_subquery()
)
_STATUS = sa.select(*(jobs.c[name] for name in _STATUS_COLUMNS), _DONE.label("done"))
_ALL = _STATUS.add_columns(jobs.c.request)


@dataclass(frozen=True)
class JobStatus:
    """How far a sweep is, as the database knows it. ``done`` counts the problems in finished
    chunks.
    """

    id: str
    state: str
    detail: str
    total: int
    chunk_rows: int
    created_at: datetime
    finished_at: datetime | None
    owner: str
    bytes: int
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
    """A job that goes on no more: it was cancelled or removed, perhaps by another server, while
    this one worked at it.
    """


#: How long an Idempotency-Key belongs to its request.
_KEYS_KNOWN = timedelta(days=7)


class Jobs(JobFiles):
    """The jobs of one database and one folder. A chunk counts when its file is on the disk and its
    hash in the database.

    Where an ``owner`` is asked for, jobs of another are as good as absent; None stands for all of
    them.
    """

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self._engine = connect(settings)
        super().__init__(settings.data_dir / "jobs")
        self._count_uncounted()

    def close(self) -> None:
        """Close the connections."""
        self._engine.dispose()

    def submit(
        self, sweep: SweepPlan | SweepRequest, key: str | None = None, owner: str = ""
    ) -> Job:
        """Return the owner's job of a sweep: a new one, or the one that the same request made,
        which goes on if it had been stopped, and is run again if its results were lost.

        ``key``: an Idempotency-Key. Raises InvalidInput where it came with another request, or
        beyond the limits of the settings,
        Refused (``too-many-jobs``, ``storage-full``) while others take the room.
        """
        job_id = job_id_of(sweep, owner)
        size = promised_bytes(sweep)
        with writing(self._engine, "submissions") as connection:
            if key is not None:
                claim(connection, owner, key, job_id)
            state = connection.execute(_state_of(job_id)).scalar()
            if state is None:
                require_room(connection, sweep, job_id, owner, self._settings)
                connection.execute(
                    sa.insert(jobs).values(
                        {**_new(sweep), "id": job_id, "owner": owner, "bytes": size}
                    )
                )
            elif state in ("failed", "cancelled") or (
                state == "finished" and not self.result_path(job_id).exists()
            ):
                require_room(connection, sweep, job_id, owner, self._settings)
                again = {"state": "queued", "detail": "", "finished_at": None, "bytes": size}
                connection.execute(sa.update(jobs).where(jobs.c.id == job_id).values(again))
            # Read before anyone can remove it.
            return _job(connection.execute(_ALL.where(jobs.c.id == job_id)).mappings().one())

    def get(self, job_id: str, owner: str | None = None) -> Job:
        """Return a job with its request; raises Refused (``no-such-job``)."""
        return _job(self._row(_ALL, job_id, owner))

    def status(self, job_id: str, owner: str | None = None) -> JobStatus:
        """Return how far a job is; raises Refused (``no-such-job``)."""
        return JobStatus(**_status(self._row(_STATUS, job_id, owner)))

    def _row(self, query: sa.Select[Any], job_id: str, owner: str | None) -> sa.RowMapping:
        found = None
        if _ID.fullmatch(job_id):
            with self._engine.connect() as connection:
                found = (
                    connection.execute(_of(query.where(jobs.c.id == job_id), owner))
                    .mappings()
                    .first()
                )
        if found is None:
            raise _absent(job_id)
        return found

    def unfinished(self) -> list[str]:
        """Return the jobs that are to go on, oldest first."""
        with self._engine.connect() as connection:
            query = (
                sa.select(jobs.c.id)
                .where(jobs.c.state.not_in(ENDED))
                .order_by(jobs.c.created_at, jobs.c.id)
            )
            return list(connection.execute(query).scalars())

    def newest(self, owner: str | None = None) -> list[JobStatus]:
        """Return the jobs that were made last, newest first."""
        query = _of(_STATUS, owner).order_by(jobs.c.created_at.desc(), jobs.c.id).limit(_LISTED)
        with self._engine.connect() as connection:
            return [JobStatus(**_status(row)) for row in connection.execute(query).mappings()]

    def require_writable(self) -> None:
        """Raise sqlalchemy.exc.SQLAlchemyError unless the database can be written, OSError unless
        the folder can.
        """
        write_whole(self.folder / "probe", bytes(4096))
        with writing(self._engine) as connection:
            connection.execute(sa.update(jobs).where(jobs.c.id == "").values(detail=""))

    def counts(self) -> dict[str, int]:
        """Return how many jobs are in each state; fails where the database cannot be read."""
        with self._engine.connect() as connection:
            query = sa.select(jobs.c.state, sa.func.count()).group_by(jobs.c.state)
            return {str(state): int(count) for state, count in connection.execute(query).all()}

    def advance(self, job_id: str, state: str, detail: str = "") -> bool:
        """Put a job into a state, unless it has ended already; return whether it is there now.

        An ended job has the bytes that it takes in place of those which were promised to it.
        """
        # Neither half of a surrogate pair nor, on PostgreSQL, a NUL can be stored.
        changed: dict[str, Any] = {
            "state": state,
            "detail": detail[:2000].encode("utf-8", "replace").decode().replace("\0", ""),
        }
        if state in ENDED:
            changed |= {
                "finished_at": datetime.now(UTC),
                "bytes": self.size(job_id) + JOB_BYTES + sa.func.length(jobs.c.request),
            }
        with writing(self._engine) as connection:
            query = (
                sa.update(jobs)
                .where(jobs.c.id == job_id, jobs.c.state.not_in(ENDED))
                .values(changed)
            )
            return connection.execute(query).rowcount > 0

    def remove(self, job_id: str) -> None:
        """Forget an ended job and its results. Raises Refused (``no-such-job``) where another has
        removed it, (``not-finished``) where it goes on, asked for again meanwhile, or another
        server has not heard yet that it ended.
        """
        lock = self.lock(job_id)
        try:
            # No other makes a job, or moves its folder, during this transaction.
            with writing(self._engine, "submissions") as connection:
                state = connection.execute(_state_of(job_id)).scalar()
                if state is None:
                    raise _absent(job_id)
                ran = (self.folder / job_id).exists()
                if state not in ENDED or (ran and not take(lock)):
                    raise Refused(
                        "not-finished",
                        "The job has been asked for again and goes on, or is still being stopped; "
                        "cancel it, and try again.",
                        retry_after=2,
                    )
                connection.execute(sa.delete(jobs).where(jobs.c.id == job_id))
                aside = self.set_aside(job_id)
        finally:
            lock.release()
        shutil.rmtree(aside, ignore_errors=True)

    def _forget(self, job_id: str, condition: sa.ColumnElement[bool]) -> bool:
        """Remove a job that meets a condition, and return whether it did.

        Its files leave their place before anyone can ask for the job anew.
        """
        with writing(self._engine, "submissions") as connection:
            gone = connection.execute(sa.delete(jobs).where(jobs.c.id == job_id, condition))
            if not gone.rowcount:
                return False
            aside = self.set_aside(job_id)
        shutil.rmtree(aside, ignore_errors=True)
        return True

    def store(self, job_id: str, position: int, rows: int, table: bytes) -> None:
        """Keep a finished chunk: first its file, whole or not at all, then its hash. Raises
        JobEnded for a job that has ended, or ends meanwhile, and keeps nothing then.
        """
        with self._engine.connect() as connection:
            state = connection.execute(_state_of(job_id)).scalar()
        path = self.chunk_path(job_id, position)
        if state is not None and state not in ENDED:
            write_whole(path, table)
            values = {
                "job_id": job_id,
                "position": position,
                "rows": rows,
                "sha256": hashlib.sha256(table).hexdigest(),
            }
            which = (chunks.c.job_id == job_id) & (chunks.c.position == position)
            with writing(self._engine) as connection:
                state = connection.execute(_state_of(job_id).with_for_update()).scalar()
                if state is not None and state not in ENDED:
                    connection.execute(sa.delete(chunks).where(which))
                    connection.execute(sa.insert(chunks).values(values))
                    return
            path.unlink(missing_ok=True)
        if state is None:
            self._remove_orphan(job_id)
        raise JobEnded(f"the job is {state or 'removed'}")

    def missing(self, job: Job) -> list[int]:
        """Return the chunks that are still to be computed; those whose file is lost or damaged are
        forgotten first.
        """
        self.remove_parts(job.id)
        if self.result_path(job.id).exists() and not self.trajectories_path(job.id).exists():
            return []
        with self._engine.connect() as connection:
            query = sa.select(chunks.c.position, chunks.c.sha256).where(chunks.c.job_id == job.id)
            stored = {
                int(position): str(digest) for position, digest in connection.execute(query).all()
            }
        damaged = [
            position
            for position, digest in stored.items()
            if self.digest(job.id, position) != digest
        ]
        if damaged:
            with writing(self._engine) as connection:
                which = (chunks.c.job_id == job.id) & chunks.c.position.in_(damaged)
                connection.execute(sa.delete(chunks).where(which))
        return [
            position
            for position in range(job.chunk_count)
            if position not in stored or position in damaged
        ]

    def remove_old(self, now: datetime) -> int:
        """Forget the jobs that ended, and the idempotency keys that came, longer ago than the
        settings say; return how many jobs.

        The room that they took goes back to the disk.
        """
        removed = 0
        if days := self._settings.retain_jobs_days:
            with self._engine.connect() as connection:
                old = (jobs.c.finished_at < now - timedelta(days=days)) & jobs.c.state.in_(ENDED)
                found = list(connection.execute(sa.select(jobs.c.id).where(old)).scalars())
            removed = sum(self._forget(job_id, old) for job_id in found)
        with writing(self._engine) as connection:
            expired = idempotency_keys.c.created_at < now - _KEYS_KNOWN
            connection.execute(sa.delete(idempotency_keys).where(expired))
        vacuum(self._engine)
        self.remove_aside()
        return removed

    def _remove_orphan(self, job_id: str) -> None:
        """Remove the files of a job that is not known, unless it has been asked for anew."""
        with writing(self._engine, "submissions") as connection:
            if connection.execute(_state_of(job_id)).scalar() is not None:
                return
            aside = self.set_aside(job_id)
        shutil.rmtree(aside, ignore_errors=True)

    def _count_uncounted(self) -> None:
        """Count the bytes of jobs that were made before bytes were counted."""
        uncounted = jobs.c.bytes == 0
        with self._engine.connect() as connection:
            found = connection.execute(sa.select(jobs.c.id, jobs.c.state).where(uncounted)).all()
        for job_id, state in found:
            size = self.size(job_id) + JOB_BYTES + len(self.get(job_id).request)
            if state not in ENDED:
                # of a version whose requests were others: it will fail when it is run
                with suppress(VeselovaError):
                    size = promised_bytes(self.get(job_id).sweep)
            with writing(self._engine) as connection:
                connection.execute(
                    sa.update(jobs).where(jobs.c.id == job_id, uncounted).values(bytes=size)
                )


def job_id_of(sweep: SweepPlan | SweepRequest, owner: str) -> str:
    """Return the id of an owner's job of a sweep: the same request of another owner
    is another job.
    """
    return (
        sweep.id if not owner else hashlib.sha256(f"{owner} {sweep.id}".encode()).hexdigest()[:32]
    )


def _state_of(job_id: str) -> sa.Select[str]:
    return sa.select(jobs.c.state).where(jobs.c.id == job_id)


def _absent(job_id: str) -> Refused:
    shown = job_id[:40].encode("utf-8", "replace").decode()
    return Refused("no-such-job", f"There is no job {shown}.")


def _of(query: sa.Select[Any], owner: str | None) -> sa.Select[Any]:
    return query if owner is None else query.where(jobs.c.owner == owner)


def _job(row: sa.RowMapping) -> Job:
    return Job(**_status(row), request=row["request"].encode())


def _status(row: sa.RowMapping) -> dict[str, Any]:
    times = {name: row[name] and in_utc(row[name]) for name in ("created_at", "finished_at")}
    return {
        **{column: row[column] for column in _STATUS_COLUMNS},
        **times,
        "done": int(row["done"]),
    }


def _new(sweep: SweepPlan | SweepRequest) -> dict[str, Any]:
    return {
        "request": sweep.canonical.decode(),
        "state": "queued",
        "total": sweep.total,
        "chunk_rows": sweep.chunk_rows,
        "created_at": datetime.now(UTC),
    }
