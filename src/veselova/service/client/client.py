"""The HTTP client, synchronous and asynchronous from one core. Loads neither engine.

with veselova.Client("http://127.0.0.1:8000") as client:
    trajectory = client.trajectory(problem, times=[0, 1, 2])
"""

from __future__ import annotations

import logging
import os
import random
import threading
import time
import uuid
from collections.abc import Awaitable, Callable, Mapping
from itertools import count
from typing import Any, Concatenate, ParamSpec, Self, TypeVar

import anyio
import httpx2 as httpx
from anyio import lowlevel, to_thread

from veselova.mechanics.core.errors import ServiceError, ServiceUnreachable
from veselova.mechanics.core.exact_input import whole_number
from veselova.mechanics.core.problem import Problem
from veselova.service.client.answer import (
    OWN_ID,
    REQUEST_ID,
    Retry,
    read_answer,
    require_own_answer,
)
from veselova.service.client.connection import Connections, credentials
from veselova.service.client.remote_job import Flow, Pause, RemoteJob, sweep_flow
from veselova.service.client.requests import (
    Call,
    closed_form_call,
    compare_call,
    curve_call,
    download_call,
    solve_many_call,
    theta_call,
    torus_call,
    trajectory_call,
)

__all__ = ["AsyncClient", "Client"]

T = TypeVar("T")
P = ParamSpec("P")

#: Seconds that the answer may take on its way beyond the budget of the work itself.
_TRANSFER_S = 10.0


#: Seconds before the second attempt and, at most, before a further one; a random part comes on top.
_FIRST_WAIT_S = 0.2
_LONGEST_WAIT_S = 5.0
_JITTER_S = 0.2
#: Doublings after which the wait has long reached the longest.
_MOST_DOUBLINGS = 30
#: Attempts beyond any patience.
_MOST_ATTEMPTS = 1_000_000_000
_LOG = logging.getLogger("veselova.client")

#: Longest pause that a server can ask for.
_LONGEST_PAUSE_S = 30.0
#: Failures of the connection. An answer that did not come in time is not among them: asking again
#: would double the load.
_PASSING = (httpx.NetworkError, httpx.ConnectTimeout, httpx.PoolTimeout, httpx.RemoteProtocolError)


class _Core:
    """What both clients share: the address, the retries, the reading of answers."""

    _connections: Connections[Any]

    def __init__(self, base_url: str, *, attempts: int = 4, api_key: str | None = None) -> None:
        self._base_url = base_url
        self._attempts = whole_number(attempts, ("attempts",), 1, _MOST_ATTEMPTS)
        self._credentials = credentials(
            os.environ.get("VESELOVA_API_KEY", "") if api_key is None else api_key
        )

    def job(self, job_id: str) -> RemoteJob:
        """Return a job of the server by its id."""
        return RemoteJob(self, job_id)  # type: ignore[arg-type]

    def _pause(self, call: Call[Any], retry: Retry, attempt: int) -> float:
        """Return the seconds after a failed attempt, doubled each time, and log them; raises the
        cause after the last.
        """
        if attempt >= self._attempts:
            raise retry.cause from None
        doubled = _FIRST_WAIT_S * 2.0 ** min(attempt - 1, _MOST_DOUBLINGS)
        pause = min(_LONGEST_WAIT_S, doubled) + random.uniform(0.0, _JITTER_S)
        pause = pause if retry.pause is None else min(retry.pause, _LONGEST_PAUSE_S)
        _LOG.info(
            "%s%s is asked again in %.2g s: %s", self._base_url, call.path, pause, retry.cause
        )
        return pause

    def _request(self, call: Call[Any]) -> dict[str, Any]:
        headers = {"accept": f"{call.accept}, application/problem+json;q=0.1", **self._credentials}
        headers[REQUEST_ID] = f"{OWN_ID}{uuid.uuid4().hex}"
        patience = min(float(call.budget_s) + _TRANSFER_S, threading.TIMEOUT_MAX)
        timeout = httpx.Timeout(_TRANSFER_S, read=patience)
        request = {"method": call.method, "url": call.path, "headers": headers, "timeout": timeout}
        if call.content is not None:
            headers["content-type"] = "application/json"
            request["content"] = call.content
        return request

    def _result(self, call: Call[T], response: httpx.Response) -> T:
        return read_answer(call, response, f"{self._base_url}{call.path}")

    def _failure(self, call: Call[Any], error: Exception) -> Exception:
        """Return the failure behind an exception of the HTTP library, to be retried where the
        connection itself failed.
        """
        failure: ServiceError
        if isinstance(error, httpx.TransportError):
            failure = ServiceUnreachable(
                f"{self._base_url}: {type(error).__name__}: {error or 'no answer'}"
                f"{self._connections.proxy()}"
            )
        elif isinstance(error, RuntimeError):
            closed = "the client is closed: " if self._connections.closed else ""
            failure = ServiceError(f"{closed}{self._base_url}{call.path} failed: {error}")
        else:
            failure = ServiceError(f"{self._base_url}{call.path} answered unreadably: {error}")
        failure.__cause__ = error
        passing = isinstance(error, _PASSING) and (call.sink is None or call.sink.untouched)
        return Retry(failure) if passing else failure


class Client(_Core):
    """A synchronous client. Every method answers with the same types as the library itself.

    ``api_key`` is shown with every request; left out, that of the environment variable
    VESELOVA_API_KEY.
    ``attempts`` bounds the tries for connection errors, 429 and 503. Raises InvalidInput before
    anything is sent, ProblemResponse with the server's problem document, ServiceUnreachable when no
    answer comes, ServiceError for an answer that is no result. A file that a download would replace
    stays as it was then. Threads and forked processes may share a client, and it can be pickled,
    with its key.
    """

    def __init__(
        self,
        base_url: str = "http://127.0.0.1:8000",
        *,
        attempts: int = 4,
        api_key: str | None = None,
        transport: Any = None,
    ) -> None:
        super().__init__(base_url, attempts=attempts, api_key=api_key)
        self._connections = Connections(httpx.Client, base_url, transport)

    def _send(self, call: Call[T]) -> T:
        for attempt in count(1):
            try:
                return self._attempt(call)
            except Retry as retry:
                pause = self._pause(call, retry, attempt)
            time.sleep(pause)
        raise AssertionError("attempts have no end but these")

    def _attempt(self, call: Call[T]) -> T:
        try:
            with self._connections.here().stream(**self._request(call)) as response:
                return self._receive(call, response)
        except (httpx.HTTPError, RuntimeError) as error:
            raise self._failure(call, error) from None

    def _receive(self, call: Call[T], response: httpx.Response) -> T:
        require_own_answer(response)
        if call.sink is None or not response.is_success:
            response.read()
            return self._result(call, response)
        result = self._result(call, response)  # the header, before the file is touched
        with call.sink.open() as write:
            for chunk in response.iter_bytes():
                write(chunk)
        return result

    @staticmethod
    def _method(call: Callable[P, Call[T]]) -> Callable[Concatenate[Client, P], T]:
        def method(self: Client, /, *args: P.args, **kwargs: P.kwargs) -> T:
            return self._send(call(*args, **kwargs))

        method.__doc__ = call.__doc__
        return method

    trajectory = _method(trajectory_call)
    download = _method(download_call)
    compare = _method(compare_call)
    solve_many = _method(solve_many_call)
    torus = _method(torus_call)
    closed_form = _method(closed_form_call)
    curve = _method(curve_call)
    theta = _method(theta_call)

    def run(self, flow: Flow) -> Any:
        """Carry out a flow of calls and pauses, and return what it ends with."""
        answer: Any = None
        while True:
            try:
                step = flow.send(answer)
            except StopIteration as end:
                return end.value
            if isinstance(step, Pause):
                time.sleep(step.seconds)
            else:
                answer = self._send(step)

    def sweep(
        self,
        problem: Problem | Mapping[str, Any],
        vary: Mapping[str, Any],
        *,
        times: Any = None,
        **options: Any,
    ) -> RemoteJob:
        """Begin a sweep and return its job; arguments are those of ``veselova.sweep`` that say what
        is asked for.

        ``client.sweep(problem, {"/A/0": [2, 3]}).dataset()`` waits for its end. The methods of an
        AsyncClient's job are awaited.
        """
        job: RemoteJob = self.run(sweep_flow(self, problem, vary, times, options))
        return job

    def close(self) -> None:
        """Close the connections."""
        if (http := self._connections.close()) is not None:
            http.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class AsyncClient(_Core):
    """The asynchronous client: the same methods, awaited. It belongs to the event loop of its
    first request, and raises ServiceError in another.
    """

    def __init__(
        self,
        base_url: str = "http://127.0.0.1:8000",
        *,
        attempts: int = 4,
        api_key: str | None = None,
        transport: Any = None,
    ) -> None:
        super().__init__(base_url, attempts=attempts, api_key=api_key)
        self._connections = Connections(httpx.AsyncClient, base_url, transport)

    async def _send(self, call: Call[T]) -> T:
        for attempt in count(1):
            try:
                return await self._attempt(call)
            except Retry as retry:
                pause = self._pause(call, retry, attempt)
            await anyio.sleep(pause)
        raise AssertionError("attempts have no end but these")

    async def _attempt(self, call: Call[T]) -> T:
        try:
            http = self._connections.here(lowlevel.current_token().native_token)
            async with http.stream(**self._request(call)) as response:
                return await self._receive(call, response)
        except (httpx.HTTPError, RuntimeError) as error:
            raise self._failure(call, error) from None

    async def _receive(self, call: Call[T], response: httpx.Response) -> T:
        require_own_answer(response)
        if call.sink is None or not response.is_success:
            await response.aread()
            return self._result(call, response)
        result = self._result(call, response)  # the header, before the file is touched
        with call.sink.open() as write:
            async for chunk in response.aiter_bytes():
                await to_thread.run_sync(write, chunk)
        return result

    @staticmethod
    def _method(call: Callable[P, Call[T]]) -> Callable[Concatenate[AsyncClient, P], Awaitable[T]]:
        def method(self: AsyncClient, /, *args: P.args, **kwargs: P.kwargs) -> Awaitable[T]:
            return self._send(call(*args, **kwargs))

        method.__doc__ = call.__doc__
        return method

    trajectory = _method(trajectory_call)
    download = _method(download_call)
    compare = _method(compare_call)
    solve_many = _method(solve_many_call)
    torus = _method(torus_call)
    closed_form = _method(closed_form_call)
    curve = _method(curve_call)
    theta = _method(theta_call)

    async def run(self, flow: Flow) -> Any:
        """Carry out a flow of calls and pauses, and return what it ends with."""
        answer: Any = None
        while True:
            try:
                step = flow.send(answer)
            except StopIteration as end:
                return end.value
            if isinstance(step, Pause):
                await anyio.sleep(step.seconds)
            else:
                answer = await self._send(step)

    async def sweep(
        self,
        problem: Problem | Mapping[str, Any],
        vary: Mapping[str, Any],
        *,
        times: Any = None,
        **options: Any,
    ) -> RemoteJob:
        job: RemoteJob = await self.run(sweep_flow(self, problem, vary, times, options))
        return job

    sweep.__doc__ = Client.sweep.__doc__

    async def close(self) -> None:
        """Close the connections."""
        if (http := self._connections.close(lowlevel.current_token().native_token)) is not None:
            await http.aclose()

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.close()
