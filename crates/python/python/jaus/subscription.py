"""Subscriptions to the reports of peers."""

from __future__ import annotations

import asyncio
from collections import deque
from types import TracebackType
from typing import TYPE_CHECKING, Any, NamedTuple

from ._log import log
from .errors import ArgumentError, ClosedError, DecodeError, Error, RefusedError, StateError

if TYPE_CHECKING:
    from ._jaus import JausId
    from .component import Component

__all__ = ["Down", "Subscription", "Up"]


class Up(NamedTuple):
    """Reports arrive from now on, at this rate in hertz; ``None`` for reports on change."""

    hz: float | None


class Down(NamedTuple):
    """No reports arrive at present. The subscription goes on and tries to get them again."""

    why: str


class Subscription:
    """A subscription to the reports of a peer. :meth:`Component.subscribe` creates it.

    ``async for`` yields the reports, and ends the subscription when it is left. In ``async with`` it lasts until
    the end of the block. :meth:`updates` also yields outages.
    """

    def __init__(
        self,
        component: Component,
        peer: str | JausId,
        query: Any,
        report: Any,
        hz: float | None,
        at_least: float | None,
        buffer: int,
    ) -> None:
        if buffer < 1:
            raise ArgumentError(f"buffer {buffer}: choose at least 1")
        self.peer = peer
        self._component = component
        self._query = query
        self._report = report
        self._wanted = (hz, at_least)
        self._waiting: deque[Any] = deque()
        self._buffer = buffer
        self._wakes: asyncio.Future[None] | None = None
        self._number: int | None = None
        self._is_held = False
        self._end: Error | None = None
        self._has_ended = False
        self._arrived: float | None = None
        #: Why no reports arrive at present; ``None`` while they do.
        self.outage: str | None = "not subscribed yet"
        #: The rate in hertz that the peer has confirmed; ``None`` for reports on change.
        self.hz: float | None = None
        #: How many reports were lost in transit.
        self.lost = 0
        #: How many reports were dropped because they were not read in time.
        self.missed = 0
        #: How many reports could not be decoded.
        self.unreadable = 0

    def __repr__(self) -> str:
        state = "ended" if self._has_ended else self.outage or "up"
        return f"<jaus.Subscription to {self._report.name} of {self.peer}, {state}>"

    @property
    def is_up(self) -> bool:
        """Whether reports arrive, as far as known now."""
        return self.outage is None

    @property
    def age(self) -> float | None:
        """Seconds since the last report arrived; ``None`` before the first."""
        if self._arrived is None:
            return None
        return asyncio.get_running_loop().time() - self._arrived

    async def __aenter__(self) -> Subscription:
        self._is_held = True
        await self._start()
        return self

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.end()

    def __aiter__(self) -> _Reader:
        return _Reader(self, only_reports=True)

    def updates(self) -> _Reader:
        """Reports, and between them :class:`Up` and :class:`Down`."""
        return _Reader(self, only_reports=False)

    def end(self) -> None:
        """Ends the subscription. Has no effect on one that has ended."""
        self._has_ended = True
        if self._number is not None:
            self._component._node._core.end(self._number)
            self._forget()
        self._wake()

    async def _start(self) -> None:
        if self._has_ended:
            raise self._end or ClosedError("the subscription has ended: subscribe again")
        if self._number is not None:
            return
        component, node = self._component, self._component._node
        request = component._running().subscribe(
            self.peer, self._query.encode(), self._report.code, *self._wanted
        )
        # Before the first event.
        self._number = request
        node._receivers[request] = self._on_event
        component._subscriptions[request] = self
        try:
            await node._wait(request)
        except BaseException:
            self._has_ended = True
            self._forget()
            raise

    def _forget(self) -> None:
        if self._number is not None:
            self._component._node._receivers.pop(self._number, None)
            self._component._subscriptions.pop(self._number, None)
            self._number = None

    def _on_event(self, kind: str, *values: Any) -> None:
        if kind == "report":
            self._on_report(*values)
        elif kind == "up":
            (self.hz,) = values
            self.outage = None
            self._add(Up(self.hz))
        elif kind == "down":
            (self.outage,) = values
            self._add(Down(str(self.outage)))
        else:
            (why,) = values
            self._end = None if why is None else RefusedError(f"{self!r}: {why}")
            self.outage = why or "the component has stopped"
            self._has_ended = True
            self._forget()
            self._wake()

    def _on_report(self, octets: bytes, age: float, lost: int) -> None:
        self.lost = lost
        try:
            report = self._report.decode(octets)
        except DecodeError as error:
            self.unreadable += 1
            log.debug("unreadable report of %s: %s", self.peer, error)
            return
        self._arrived = asyncio.get_running_loop().time() - age
        self._add(report)

    def _add(self, update: Any) -> None:
        if len(self._waiting) >= self._buffer:
            self._waiting.popleft()
            self.missed += 1
        self._waiting.append(update)
        self._wake()

    def _wake(self) -> None:
        if self._wakes is not None and not self._wakes.done():
            self._wakes.set_result(None)

    async def _next(self) -> Any:
        if self._number is None and not self._has_ended:
            await self._start()
        while not self._waiting:
            if self._has_ended:
                raise self._end or StopAsyncIteration
            if self._wakes is not None:
                raise StateError("another task reads the subscription: subscribe in each task")
            self._wakes = asyncio.get_running_loop().create_future()
            try:
                await self._wakes
            finally:
                self._wakes = None
        return self._waiting.popleft()


class _Reader:
    """An iterator over a subscription, which ends when it is dropped, unless ``async with`` holds it."""

    def __init__(self, subscription: Subscription, *, only_reports: bool) -> None:
        self._subscription = subscription
        self._only_reports = only_reports

    def __aiter__(self) -> _Reader:
        return self

    async def __anext__(self) -> Any:
        while True:
            update = await self._subscription._next()
            if not self._only_reports or not isinstance(update, (Up, Down)):
                return update

    def __del__(self) -> None:
        if not self._subscription._is_held:
            self._subscription.end()
