"""The HTTP client, synchronous and asynchronous from one core. Loads neither engine.

with veselova.Client("http://127.0.0.1:8000") as client:
    trajectory = client.trajectory(problem, times=[0, 1, 2])

Both share the same coroutines. Those of a Client block instead of waiting, so that their first step
completes them. A sweep is a RemoteJob, whose methods are those of its client.
"""

from __future__ import annotations

import logging
import os
import random
import re
import threading
import time
from collections.abc import Awaitable, Callable, Coroutine, Mapping
from contextlib import AbstractAsyncContextManager, AbstractContextManager, suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import IO, Any, ParamSpec, Protocol, TypeVar, cast, overload

import anyio
import httpx2 as httpx
from anyio import to_thread

from veselova.mechanics.core.arguments import whole_number
from veselova.mechanics.core.errors import (
    InvalidInput,
    ProblemResponse,
    ServiceError,
    ServiceUnreachable,
    show,
)
from veselova.mechanics.core.problem import Problem
from veselova.service.api.media_types import MEDIA_TYPES
from veselova.service.api.request_models import read_request
from veselova.service.api.sweep_request import SweepRequest, sweep_document
from veselova.service.client import requests
from veselova.service.client.requests import Call, part_of, read_answer, reading, target_path

T = TypeVar("T")
T_co = TypeVar("T_co", covariant=True)
P = ParamSpec("P")

_LOG = logging.getLogger("veselova.client")

#: Seconds that the answer may take on its way beyond the budget of the work itself.
_TRANSFER_S = 10.0

#: Seconds that a finished table may be prepared, or a job be ended, before the first byte.
_PREPARATION_S = 60.0

#: Seconds between two polls of a job, from the first to the longest.
_FIRST_POLL_S = 0.1
_LONGEST_POLL_S = 2.0

#: Seconds before the second attempt and, at most, before a further one; a random part comes on top.
_FIRST_WAIT_S = 0.2
_LONGEST_WAIT_S = 5.0
_JITTER_S = 0.2

#: Longest pause that a server can ask for.
_LONGEST_PAUSE_S = 30.0

#: What may pass if the same request is sent again: too many requests, overload, and failures of
#: the connection. A late answer does not: asking again would double the load.
_PASSING_STATUSES = (429, 503)
_PASSING = (httpx.NetworkError, httpx.ConnectTimeout, httpx.PoolTimeout, httpx.RemoteProtocolError)


class _Method(Protocol[P, T_co]):
    """A method of both clients, whose answer that of an AsyncClient is awaited."""

    @overload
    def __get__(self, client: Client, kind: object) -> Callable[P, T_co]: ...
    @overload
    def __get__(self, client: AsyncClient, kind: object) -> Callable[P, Awaitable[T_co]]: ...


def _method(build: Callable[P, Call[T]]) -> _Method[P, T]:
    """Return the method that sends the call of these arguments."""

    def method(self: _Core, /, *args: P.args, **kwargs: P.kwargs) -> Any:
        return self.run(self.ask(build(*args, **kwargs)))

    method.__doc__ = build.__doc__
    return cast(_Method[P, T], method)


class _Core:
    """What both clients share: the address, the key, the retries and the names of failures."""

    _kind: Callable[..., Any]
    _send: Callable[[Call[Any], IO[bytes] | None], Coroutine[Any, Any, Any]]
    run: Callable[[Coroutine[Any, Any, Any]], Any]
    sleep: Callable[[float], Coroutine[Any, Any, None]]

    def __init__(
        self,
        base_url: str = "http://127.0.0.1:8000",
        *,
        attempts: int = 4,
        api_key: str | None = None,
        transport: Any = None,
    ) -> None:
        key = os.environ.get("VESELOVA_API_KEY", "") if api_key is None else api_key
        if not isinstance(key, str) or not re.fullmatch(r"[\x21-\x7e]*", key):
            raise InvalidInput(("api_key",), "printable ASCII without spaces", "something else")
        self._base_url = _address(base_url)
        self._attempts = whole_number(attempts, ("attempts",), 1, 1000)
        headers = {"authorization": f"Bearer {key}"} if key else {}
        self._http = self._kind(base_url=base_url, headers=headers, transport=transport)

    def job(self, job_id: str) -> RemoteJob:
        """Return a job of the server by its id."""
        return RemoteJob(self, job_id)

    trajectory = _method(requests.trajectory_call)
    download = _method(requests.download_call)
    compare = _method(requests.compare_call)
    solve_many = _method(requests.solve_many_call)
    torus = _method(requests.torus_call)
    closed_form = _method(requests.closed_form_call)
    curve = _method(requests.curve_call)
    theta = _method(requests.theta_call)
    geodesics = _method(requests.geodesics_call)

    def sweep(
        self,
        problem: Problem | Mapping[str, Any],
        vary: Mapping[str, Any],
        *,
        times: Any = None,
        **options: Any,
    ) -> Any:
        """Begin a sweep and return its job; arguments are those of ``veselova.sweep`` that say what
        is asked for.

        ``client.sweep(problem, {"/A/0": [2, 3]}).dataset()`` waits for its end. The methods of an
        AsyncClient's job are awaited.
        """
        asked = {**sweep_document(problem, vary, times), **options}
        body = read_request(SweepRequest, asked).canonical
        call = Call("/v1/sweeps", lambda job: RemoteJob(self, job["id"]), body, _PREPARATION_S)
        return self.run(self.ask(call))

    async def ask(self, call: Call[T]) -> T:
        """Return the result of a call; raises a permanent failure, or that of the last attempt."""
        attempt, where = 0, f"{self._base_url}{call.path}"
        with part_of(call.target) as file:
            while True:
                attempt += 1
                try:
                    result: T = await self._send(call, file)
                    return result
                except (ProblemResponse, httpx.HTTPError, RuntimeError) as error:
                    pause = _pause_after(error, attempt)
                    if pause is None or attempt == self._attempts:
                        if isinstance(error, ProblemResponse):
                            raise
                        lost = isinstance(error, httpx.TransportError)
                        kind = ServiceUnreachable if lost else ServiceError
                        raise kind(f"{where} failed: {type(error).__name__}: {error}") from error
                    _LOG.info("%s is retried in %.2g s: %s", where, pause, error)
                await self.sleep(pause)

    def _request(self, call: Call[Any], file: IO[bytes] | None) -> dict[str, Any]:
        headers = {"accept": call.accept or "*/*"}
        if call.content is not None:
            headers["content-type"] = "application/json"
        elif file is not None and file.tell():  # a stored file: only the rest is asked for again
            headers |= {"accept-encoding": "identity", "range": f"bytes={file.tell()}-"}
        patience = min(call.budget_s + _TRANSFER_S, threading.TIMEOUT_MAX)
        return {
            "method": call.method,
            "url": call.path,
            "headers": headers,
            "content": call.content,
            "timeout": httpx.Timeout(_TRANSFER_S, read=patience),
        }


def _pause_after(failure: Exception, attempt: int) -> float | None:
    """Return the seconds before a retry, None for a permanent failure."""
    if isinstance(failure, ProblemResponse):
        if failure.status not in _PASSING_STATUSES:
            return None
        if failure.retry_after is not None:
            return min(failure.retry_after, _LONGEST_PAUSE_S)
    elif not isinstance(failure, _PASSING):
        return None
    pause = min(_LONGEST_WAIT_S, _FIRST_WAIT_S * 2.0 ** (attempt - 1))
    return pause + random.uniform(0.0, _JITTER_S)


def _address(base_url: Any) -> str:
    """Return the address of a server; raises InvalidInput for what is none."""
    with suppress(httpx.InvalidURL, TypeError):
        url = httpx.URL(base_url)
        if url.scheme in ("http", "https") and url.host:
            return str(base_url)
    required = "the address of a server, such as http://127.0.0.1:8000"
    raise InvalidInput(("base_url",), required, show(base_url))


class Client(_Core, AbstractContextManager["Client"]):
    """A synchronous client. Every method answers with the same types as the library itself.

    ``api_key`` is sent with every request; default: the environment variable VESELOVA_API_KEY.
    ``attempts`` bounds the attempts for connection errors, 429 and 503. Raises InvalidInput before
    anything is sent, ProblemResponse with the server's problem document, ServiceUnreachable when no
    answer comes, ServiceError for an answer that is no result. A failed download leaves an existing
    file unchanged. Threads may share a client.
    """

    _kind = httpx.Client

    async def _send(self, call: Call[T], file: IO[bytes] | None) -> T:
        with self._http.stream(**self._request(call, file)) as response:
            if file is None or not response.is_success:
                response.read()
            result = read_answer(call, response, file)
            if file is not None:
                for chunk in response.iter_bytes():
                    file.write(chunk)
            return result

    async def sleep(self, seconds: float) -> None:
        """Wait."""
        time.sleep(seconds)

    def run(self, work: Coroutine[Any, Any, T]) -> T:
        """Return what a coroutine of this client gives."""
        try:
            work.send(None)
        except StopIteration as end:
            return cast(T, end.value)
        raise AssertionError("a coroutine of a synchronous client waits for an event loop")

    def close(self) -> None:
        """Close the connections."""
        self._http.close()

    def __exit__(self, *_: object) -> None:
        self.close()


class AsyncClient(_Core, AbstractAsyncContextManager["AsyncClient"]):
    """The asynchronous client: the same methods, awaited, in one event loop."""

    _kind = httpx.AsyncClient

    async def _send(self, call: Call[T], file: IO[bytes] | None) -> T:
        async with self._http.stream(**self._request(call, file)) as response:
            if file is None or not response.is_success:
                await response.aread()
            result = read_answer(call, response, file)
            if file is not None:
                async for chunk in response.aiter_bytes():
                    await to_thread.run_sync(file.write, chunk)
            return result

    async def sleep(self, seconds: float) -> None:
        """Wait."""
        await anyio.sleep(seconds)

    def run(self, work: Coroutine[Any, Any, T]) -> Coroutine[Any, Any, T]:
        """Return what a coroutine of this client gives."""
        return work

    async def close(self) -> None:
        """Close the connections."""
        await self._http.aclose()

    async def __aexit__(self, *_: object) -> None:
        await self.close()


class RemoteJob:
    """A sweep on a server. Every method of an AsyncClient's job is to be awaited; those of a
    Client's job return at once.

    ``id``: the same request has the same, so that ``client.job(id)`` finds it again.
    """

    def __init__(self, client: Any, job_id: str) -> None:
        if not isinstance(job_id, str) or not re.fullmatch(r"[\w-]{1,200}", job_id, re.ASCII):
            raise InvalidInput(("job_id",), "the id of a job", show(job_id))
        self._client = client
        self.id = job_id

    def __repr__(self) -> str:
        return f"<RemoteJob {self.id}>"

    def status(self) -> Any:
        """Return the document of the job: state, done, total, rate, eta_s, detail …"""
        return self._client.run(self._ask("GET"))

    def wait(self, progress: Callable[[int, int], object] | None = None) -> Any:
        """Return the document of the job when it has finished; ``progress(done, total)`` is told on
        the way.

        Raises ServiceError where it has failed or was cancelled.
        """
        return self._client.run(self._finish(progress))

    def cancel(self) -> Any:
        """Stop the job, keeping what is done, and return its document; the same sweep asked for
        again goes on from there.
        """
        return self._client.run(self._ask("DELETE"))

    def remove(self) -> Any:
        """Stop the job and forget it, with its results."""
        return self._client.run(self._ask("DELETE", "?remove=true", accept=""))

    def download(self, target: str | Path) -> Any:
        """Write the table, as Parquet, to a file when the job has finished."""
        return self._client.run(self._download(target_path(target)))

    def dataset(self, progress: Callable[[int, int], object] | None = None) -> Any:
        """Return the results as an xarray Dataset (see ``veselova.sweep``) when the job has
        finished.
        """
        return self._client.run(self._dataset(progress))

    def _ask(self, method: str, part: str = "", **options: Any) -> Any:
        """Return the coroutine that asks for the job or a part of it, by options of a Call."""
        path = f"/v1/jobs/{self.id}{part}"
        call = Call(path, dict, budget_s=_PREPARATION_S, method=method, **options)
        return self._client.ask(call)

    async def _finish(self, progress: Callable[[int, int], object] | None = None) -> Any:
        pause = _FIRST_POLL_S
        while True:
            document = await self._ask("GET")
            if progress is not None:
                progress(document["done"], document["total"])
            if document["state"] == "finished":
                return document
            if document["finished_at"] is not None:
                detail = document["detail"] or "no detail given"
                raise ServiceError(f"job {self.id} is {document['state']}: {detail}")
            await self._client.sleep(pause)
            pause = min(2 * pause, _LONGEST_POLL_S)

    async def _download(self, target: Path) -> None:
        await self._finish()
        await self._ask("GET", "/result", accept=MEDIA_TYPES["parquet"], target=target)

    async def _dataset(self, progress: Callable[[int, int], object] | None) -> Any:
        from veselova.service.api.sweep_request import sweep_dataset

        document = await self._finish(progress)
        with TemporaryDirectory() as folder:
            table, packed = Path(folder) / "table.parquet", None
            await self._ask("GET", "/result", accept=MEDIA_TYPES["parquet"], target=table)
            if "trajectories" in document["links"]:
                packed = Path(folder) / "trajectories.zarr.zip"
                await self._ask("GET", "/trajectories", accept="application/zip", target=packed)
            with reading(f"job {self.id}"):
                sweep = read_request(SweepRequest, document["request"])
                return sweep_dataset(sweep, table, packed)
