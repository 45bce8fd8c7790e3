"""The store of jobs: a row of the database and a folder for each."""

from __future__ import annotations

import contextlib
import hashlib
import re
import shutil
import uuid
from collections.abc import Iterable
from dataclasses import dataclass, fields
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import orjson
import sqlalchemy as sa

from veselova.mechanics.core.errors import InvalidInput
from veselova.service.access.database import connect, jobs, writing
from veselova.service.api.private_files import atomic_file, make_private, own_folder
from veselova.service.api.problem_details import Refused
from veselova.service.api.request_models import read_request
from veselova.service.api.settings import Settings
from veselova.service.api.sweep_request import SweepRequest

#: States of a job that does not go on by itself; ``queued`` and ``running`` are the others.
ENDED = ("finished", "failed", "cancelled")

#: What the id of a job looks like; no other text is looked for.
_ID = re.compile(r"[0-9a-f]{32}")

#: Jobs in one listing.
_LISTED = 100

#: Owners whose results fill a server.
_OWNERS = 4

#: How long a process has a job that it claimed; it renews its claim every few seconds.
_LEASE = timedelta(seconds=10)


@dataclass(frozen=True)
class Job:
    """A requested sweep and its status. ``done`` counts the problems in finished chunks;
    ``request`` is JSON, which may be megabytes and is empty where it was not read.
    """

    id: str
    owner: str
    state: str
    detail: str
    total: int
    done: int
    chunk_rows: int
    created_at: datetime
    finished_at: datetime | None
    request: str = ""

    @property
    def ended(self) -> bool:
        """Return whether the job does not go on by itself."""
        return self.state in ENDED

    @property
    def sweep(self) -> SweepRequest:
        """Return the request."""
        return read_request(SweepRequest, orjson.loads(self.request))


#: What is read of a job: all but its request, and all.
_STATUS = sa.select(*(jobs.c[field.name] for field in fields(Job) if field.name != "request"))
_WHOLE = _STATUS.add_columns(jobs.c.request)


class JobEnded(Exception):
    """A job that was cancelled or removed while this process ran it."""


class Jobs:
    """The jobs of one database and one folder. A chunk counts when its file is on the disk.

    Only jobs of an ``owner`` that is given are visible; None sees all. Every method may block, and
    raises OSError or sqlalchemy.exc.SQLAlchemyError where the disk or the database fails.
    """

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self._engine = connect(settings)
        self._holder = uuid.uuid4().hex
        self.folder = settings.data_dir / "jobs"
        own_folder(self.folder)

    def close(self) -> None:
        """Close the connections."""
        self._engine.dispose()

    def submit(self, sweep: SweepRequest, owner: str = "") -> Job:
        """Return the owner's job of a sweep: a new one, or the one that the same request made,
        which goes on if it had been stopped, and is run again if its results were lost.

        Raises InvalidInput where its results are beyond the settings, Refused (``storage-full``)
        while those of others take the room.
        """
        job_id = job_id_of(sweep, owner)
        one = jobs.c.id == job_id
        values: dict[str, Any] = {}
        with writing(self._engine) as connection:
            state = connection.scalar(sa.select(jobs.c.state).where(one))
            lost = state == "finished" and not self.result_path(job_id).exists()
            if state in (None, "failed", "cancelled") or lost:
                self._require_room(connection, sweep, job_id, owner)
                values = {"state": "queued", "detail": "", "finished_at": None}
                values["bytes"] = estimated_bytes(sweep)
            if state is None or lost:
                values["done"] = 0
            if state is None:
                connection.execute(sa.insert(jobs).values(_new(sweep, job_id, owner) | values))
            elif values:
                connection.execute(sa.update(jobs).where(one).values(values))
            return Job(**connection.execute(_WHOLE.where(one)).mappings().one())

    def _require_room(
        self, connection: sa.Connection, sweep: SweepRequest, job_id: str, owner: str
    ) -> None:
        """Raise as ``submit`` does unless the results of a job have room beside those of others.
        ``connection`` is that of ``writing``, so that no two jobs get the same room.
        """
        size, most = estimated_bytes(sweep), self._settings.max_stored_bytes
        others = sa.select(sa.func.sum(jobs.c.bytes)).where(jobs.c.id != job_id)
        limits = [("all jobs", others, most)]
        if owner:
            limits.append(("the jobs of this key", _of(others, owner), most // _OWNERS))
        for whose, query, room in limits:
            if size > room:
                field = "trajectories" if sweep.trajectories else "vary"
                required = f"at most {room} bytes of results, which {whose} share"
                raise InvalidInput((field,), required, f"about {size}")
            if size + (connection.scalar(query) or 0) > room:
                detail = f"Results of {whose} take the room for them; remove some "
                raise Refused("storage-full", detail + "(DELETE …?remove=true).")

    def get(self, job_id: str, owner: str | None = None) -> Job:
        """Return a job with its request; raises Refused (``no-such-job``)."""
        return Job(**self._row(_WHOLE, job_id, owner))

    def status(self, job_id: str, owner: str | None = None) -> Job:
        """Return the status of a job; raises Refused (``no-such-job``)."""
        return Job(**self._row(_STATUS, job_id, owner))

    def _row(self, query: sa.Select[Any], job_id: str, owner: str | None) -> sa.RowMapping:
        if _ID.fullmatch(job_id):
            with self._engine.connect() as connection:
                visible = _of(query.where(jobs.c.id == job_id), owner)
                if found := connection.execute(visible).mappings().first():
                    return found
        raise _absent(job_id)

    def unfinished(self) -> list[str]:
        """Return the jobs that are to go on and that no process runs, oldest first."""
        free = jobs.c.state.not_in(ENDED) & self._free()
        query = sa.select(jobs.c.id).where(free).order_by(jobs.c.created_at, jobs.c.id)
        with self._engine.connect() as connection:
            return list(connection.scalars(query))

    def newest(self, owner: str | None = None) -> list[Job]:
        """Return the jobs that were made last, newest first."""
        query = _STATUS.order_by(jobs.c.created_at.desc(), jobs.c.id).limit(_LISTED)
        with self._engine.connect() as connection:
            return [Job(**row) for row in connection.execute(_of(query, owner)).mappings()]

    def counts(self) -> dict[str, int]:
        """Return how many jobs are in each state."""
        query = sa.select(jobs.c.state, sa.func.count()).group_by(jobs.c.state)
        with self._engine.connect() as connection:
            return {str(state): int(count) for state, count in connection.execute(query)}

    def require_writable(self) -> None:
        """Fail unless the database can be written and its table is there."""
        with writing(self._engine) as connection:
            connection.execute(sa.select(jobs.c.id).limit(1))

    def claim(self, job_id: str) -> bool:
        """Claim a job for some seconds, or renew the claim, unless the job has ended or another
        process has it; return whether this process has it.
        """
        until = datetime.now(UTC) + _LEASE
        return self._update(
            (jobs.c.id == job_id) & jobs.c.state.not_in(ENDED) & self._free(),
            claimed_by=self._holder,
            claimed_until=until,
        )

    def release(self, job_id: str) -> None:
        """Give back a job that this process has claimed."""
        mine = (jobs.c.id == job_id) & (jobs.c.claimed_by == self._holder)
        self._update(mine, claimed_by=None, claimed_until=None)

    def _free(self) -> sa.ColumnElement[bool]:
        """Return the condition that no other process has a job."""
        held, until = jobs.c.claimed_by, jobs.c.claimed_until
        return held.is_(None) | (held == self._holder) | (until < datetime.now(UTC))

    def advance(self, job_id: str, state: str, detail: str = "") -> bool:
        """Put a job into a state, unless it has ended already; return whether it is there now. An
        ended job counts the bytes that it takes.
        """
        # Neither half of a surrogate pair nor, on PostgreSQL, a NUL can be stored.
        text = detail[:2000].encode("utf-8", "replace").decode().replace("\0", "")
        changes: dict[str, Any] = {"state": state, "detail": text}
        if state in ENDED:
            changes["finished_at"] = datetime.now(UTC)
            changes["bytes"] = self.size(job_id) + sa.func.length(jobs.c.request)
        if state == "finished":
            changes["done"] = jobs.c.total
        return self._update((jobs.c.id == job_id) & jobs.c.state.not_in(ENDED), **changes)

    def _update(self, which: sa.ColumnElement[bool], **values: Any) -> bool:
        """Change the rows that meet a condition, and return whether there are any."""
        with writing(self._engine) as connection:
            return connection.execute(sa.update(jobs).where(which).values(values)).rowcount > 0

    def remove(self, job_id: str) -> None:
        """Forget an ended job and its results. Raises Refused (``no-such-job``) where another has
        removed it, (``not-finished``) where it goes on, asked for again meanwhile, or its process
        has not heard yet that it ended.
        """
        with writing(self._engine) as connection:
            idle = jobs.c.state.in_(ENDED) & self._free()
            if not self._delete(connection, (jobs.c.id == job_id) & idle):
                if connection.scalar(sa.select(jobs.c.id).where(jobs.c.id == job_id)) is None:
                    raise _absent(job_id)
                raise Refused(
                    "not-finished",
                    "The job has been asked for again and goes on, or is still being stopped; "
                    "cancel it, and try again.",
                    retry_after=2,
                )

    def remove_old(self) -> None:
        """Forget the jobs that ended longer ago than the settings say."""
        if days := self._settings.retain_jobs_days:
            ended = jobs.c.finished_at < datetime.now(UTC) - timedelta(days=days)
            with writing(self._engine) as connection:
                self._delete(connection, jobs.c.state.in_(ENDED) & ended)

    def _delete(self, connection: sa.Connection, which: sa.ColumnElement[bool]) -> int:
        """Delete the jobs that meet a condition, and their files before anyone can ask for them
        anew; return how many.
        """
        found = connection.scalars(sa.delete(jobs).where(which).returning(jobs.c.id)).all()
        for job_id in found:
            self.remove_files(job_id)
        return len(found)

    def store(self, job: Job, start: int, stop: int, table: bytes) -> None:
        """Keep the table of the problems start … stop−1: its file, whole or not at all. Raises
        JobEnded for a job that has ended or that another process has, and keeps nothing of one that
        was removed.
        """
        one = jobs.c.id == job.id
        path = self.chunk_path(job.id, start, stop)
        make_private(path.parent)
        with atomic_file(path) as part:
            part.write_bytes(table)
        with writing(self._engine) as connection:
            done = _count(self.chunks(job.id))
            running = one & jobs.c.state.not_in(ENDED) & self._free()
            if connection.execute(sa.update(jobs).where(running).values(done=done)).rowcount:
                return
            state = connection.scalar(sa.select(jobs.c.state).where(one))
            if state is None:
                self.remove_files(job.id)
        raise JobEnded(f"the job is {state or 'removed'}")

    def missing(self, job: Job) -> list[tuple[int, int]]:
        """Return the problems (start, stop) that are still to be computed: whole chunks, or one by
        one those of a chunk over which a worker died.
        """
        self.remove_parts(job.id)
        if self.result_path(job.id).exists():
            return []
        done = self.chunks(job.id)
        self._update(jobs.c.id == job.id, done=_count(done))
        begun = {start // job.chunk_rows for start, _ in done}
        missing = list[tuple[int, int]]()
        for start in range(0, job.total, job.chunk_rows):
            stop = min(start + job.chunk_rows, job.total)
            if (start, stop) in done:
                continue
            step = 1 if start // job.chunk_rows in begun else stop - start
            parts = ((row, row + step) for row in range(start, stop, step))
            missing += [part for part in parts if part not in done]
        return missing

    def chunk_path(self, job_id: str, start: int, stop: int) -> Path:
        """Return where the table of the problems start … stop−1 is kept."""
        return self.chunk_folder(job_id) / f"{start:09d}-{stop:09d}.parquet"

    def chunk_folder(self, job_id: str) -> Path:
        """Return the folder of what a job is made of until it has finished."""
        return self.folder / job_id / "chunks"

    def result_path(self, job_id: str) -> Path:
        """Return where the table of a finished job is kept."""
        return self.folder / job_id / "summaries.parquet"

    def packed_path(self, job_id: str) -> Path:
        """Return where the Zarr store of a finished job is kept, in one file."""
        return self.folder / job_id / "trajectories.zarr.zip"

    def chunks(self, job_id: str) -> dict[tuple[int, int], Path]:
        """Return the tables on the disk by their problems (start, stop), in their order; of two
        that overlap, as a late process can leave them, the larger.
        """
        paths = self.chunk_folder(job_id).glob("*-*.parquet")
        stored = {(int(path.stem[:9]), int(path.stem[10:])): path for path in paths}
        found, end = dict[tuple[int, int], Path](), 0
        for start, stop in sorted(stored, key=lambda rows: (rows[0], -rows[1])):
            if start >= end:
                found[start, stop], end = stored[start, stop], stop
        return found

    def size(self, job_id: str) -> int:
        """Return how many bytes a job has on the disk."""
        total = 0
        for path in (self.folder / job_id).rglob("*"):
            with contextlib.suppress(FileNotFoundError):  # a part that was finished meanwhile
                total += path.stat().st_size
        return total

    def remove_files(self, job_id: str) -> None:
        """Remove all files of a job."""
        shutil.rmtree(self.folder / job_id, ignore_errors=True)

    def remove_parts(self, job_id: str) -> None:
        """Remove the unfinished files of dead processes."""
        for path in (self.folder / job_id).rglob("*.part"):
            path.unlink(missing_ok=True)


def estimated_bytes(sweep: SweepRequest) -> int:
    """Return the bytes that a job may take: its numbers as doubles, and its request."""
    return sweep.total * sweep.row_values * 8 + len(sweep.canonical)


def job_id_of(sweep: SweepRequest, owner: str) -> str:
    """Return the id of an owner's job of a sweep: the same request of another owner
    is another job.
    """
    return (
        sweep.id if not owner else hashlib.sha256(f"{owner} {sweep.id}".encode()).hexdigest()[:32]
    )


def _absent(job_id: str) -> Refused:
    shown = job_id[:40].encode("utf-8", "replace").decode()
    return Refused("no-such-job", f"There is no job {shown}.")


def _of(query: sa.Select[Any], owner: str | None) -> sa.Select[Any]:
    return query if owner is None else query.where(jobs.c.owner == owner)


def _new(sweep: SweepRequest, job_id: str, owner: str) -> dict[str, Any]:
    return {
        "id": job_id,
        "owner": owner,
        "request": sweep.canonical.decode(),
        "total": sweep.total,
        "chunk_rows": sweep.chunk_rows,
        "created_at": datetime.now(UTC),
    }


def _count(chunks: Iterable[tuple[int, int]]) -> int:
    """Return the number of problems in chunks (start, stop)."""
    return sum(stop - start for start, stop in chunks)
