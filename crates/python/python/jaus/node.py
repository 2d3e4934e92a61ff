"""Nodes."""

from __future__ import annotations

import asyncio
import atexit
import warnings
import weakref
from collections.abc import Callable, Iterable, Sequence
from types import TracebackType
from typing import Any

from . import _jaus, _log
from .component import Component
from .errors import ClosedError, StateError

__all__ = ["Node"]

#: The nodes that run.
_running: weakref.WeakSet[Node] = weakref.WeakSet()


class Node:
    """A node of this process, or the connection to the node of this host.

    >>> async with jaus.Node("107.1", loopback=True) as node:
    ...     async with node.component(1, name="Operator") as operator:
    ...         print(await operator.find("urn:jaus:jss:mobility:VelocityStateSensor"))

    The arguments are those of the settings files, except ``loopback``:

    :param id: subsystem (1 to 65534) and node (1 to 254) of a node of this process
    :param host: instead of ``id``, the address of the node of this host, which another process runs:
        ``"default"``, the path of a socket, or a port of loopback such as ``"127.0.0.1:37940"``
    :param loopback: keeps the node on this host, on any free port, for tests and trials
    :param interfaces: uses only these interfaces, by name or address
    :param port: the UDP port, 3794 by default; 0 selects any free one
    :param group: the multicast group, such as ``"239.255.0.1:3794"``, or ``"off"``
    :param peers: also sends multicast traffic to these peers by unicast
    :param local: serves the component processes of this host at this address

    A node belongs to the event loop in which it is started. ``async with`` starts and closes it; in a notebook,
    ``await node.start()`` and ``await node.close()`` do the same.
    """

    #: Limit of events that are handled at once, so that other tasks run, too.
    _BATCH = 64

    def __init__(
        self,
        id: str | None = None,
        *,
        host: str | None = None,
        loopback: bool = False,
        interfaces: Sequence[str] | None = None,
        port: int | None = None,
        group: str | None = None,
        peers: Iterable[str] = (),
        local: str | None = None,
    ) -> None:
        self._name = id if host is None else f"host={host!r}"
        self._core = _jaus.Node(
            id,
            host,
            loopback=loopback,
            interfaces=None if interfaces is None else list(interfaces),
            port=port,
            group=group,
            peers=list(peers),
            local=local,
        )
        self._loop: asyncio.AbstractEventLoop | None = None
        self._state = "not started"
        self._requests: dict[int, asyncio.Future[Any]] = {}
        self._receivers: dict[int, Callable[..., None]] = {}
        self._components: list[Component] = []

    def __repr__(self) -> str:
        return f"<jaus.Node {self._name}, {self._state}>"

    async def __aenter__(self) -> Node:
        return await self.start()

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        await self.close()

    def __del__(self) -> None:
        if getattr(self, "_state", None) == "running":
            warnings.warn(f"{self!r} was not closed", ResourceWarning, source=self, stacklevel=2)
            # Its event loop has ended, or it would still hold the node.
            self._close_now()

    async def start(self) -> Node:
        """Opens the links of the node."""
        _log.follow_level()
        self._core.start()
        self._loop = asyncio.get_running_loop()
        self._loop.add_reader(self._core.descriptor(), self._on_readable)
        self._state = "running"
        _running.add(self)
        return self

    async def close(self) -> None:
        """Closes the node and its components: they stop what they move, and release what they control."""
        if self._state != "running":
            self._state = "closed"
            self._core.finish()
            return
        if self._loop is not asyncio.get_running_loop():
            self._close_now()
            return
        for component in list(self._components):
            await component.close()
        await self._wait(self._core.shutdown())
        self._end()

    @property
    def dropped_events(self) -> int:
        """How many events were dropped because the event loop was slow: more than 1024 waited."""
        return self._core.dropped()

    def component(
        self,
        number: int,
        *,
        kind: str = "other",
        name: str = "",
        management: bool = False,
        access_control: bool = False,
        authority: int = 1,
        timeout: int = 4,
        initializes: bool = False,
    ) -> Component:
        """A component of the node, which is described and then started with ``async with``.

        :param number: its number within the node, 1 to 254
        :param kind: the kind of its subsystem: ``"vehicle"``, ``"ocu"`` or ``"other"``
        :param name: the name of its subsystem
        :param management: offers Management: the component acts only while a client controls it and has made it
            ready. Needed by components with commands.
        :param access_control: offers Access Control alone: only the client in control may configure it
        :param authority: the lowest authority of clients that get control
        :param timeout: control ends a quarter late when it is not renewed for this time in seconds
        :param initializes: starts in the state Initialize, until :meth:`Component.recover` ends that
        """
        component = Component(
            self,
            number,
            kind=kind,
            name=name,
            management=management,
            access_control=access_control,
            authority=authority,
            timeout=timeout,
            initializes=initializes,
        )
        return component

    def _check_loop(self) -> asyncio.AbstractEventLoop:
        loop = asyncio.get_running_loop()
        if self._state == "running" and loop is not self._loop:
            raise StateError(f"{self!r} belongs to another event loop: create a node in this one")
        return loop

    async def _wait(self, number: int) -> Any:
        """The result of a request. Cancelling the wait cancels the request."""
        try:
            future = self._check_loop().create_future()
            self._requests[number] = future
            return await future
        except (asyncio.CancelledError, StateError):
            self._core.end(number)
            raise
        finally:
            self._requests.pop(number, None)

    def _on_readable(self) -> None:
        for _ in range(self._BATCH):
            event = self._core.fetch()
            if event is None:
                return
            kind, subject, values = event
            if kind == "done" or kind == "failed":
                self._finish(kind, subject, values[0])
                continue
            receiver = self._receivers.get(subject)
            if receiver is not None:
                receiver(kind, *values)
            if self._state != "running":
                return

    def _finish(self, kind: str, number: int, result: Any) -> None:
        future = self._requests.get(number)
        if future is None or future.done():
            # Nothing waits for what was obtained.
            self._core.end(number)
        elif kind == "done":
            future.set_result(result)
        else:
            future.set_exception(result)

    def _close_now(self) -> None:
        """Closes the node without its event loop, which has ended."""
        for component in self._components:
            for number in component._close_now():
                self._core.wait(number)
        self._core.wait(self._core.shutdown())
        self._end()

    def _end(self) -> None:
        self._state = "closed"
        _running.discard(self)
        if self._loop is not None and not self._loop.is_closed():
            self._loop.remove_reader(self._core.descriptor())
        self._core.finish()
        for future in self._requests.values():
            if not future.done() and not future.get_loop().is_closed():
                future.set_exception(ClosedError("the node was closed: create a new one"))


@atexit.register
def _close_all() -> None:
    for node in list(_running):
        try:
            node._close_now()
        except Exception:
            _log.log.exception("%r could not be closed", node)
