"""Control of peers."""

from __future__ import annotations

import asyncio
from collections.abc import Generator
from types import TracebackType
from typing import TYPE_CHECKING, Any

from .errors import ClosedError, Error, StateError

if TYPE_CHECKING:
    from . import _jaus
    from ._jaus import JausId
    from .component import Component

__all__ = ["Control"]


class Control:
    """Control of a peer. :meth:`Component.control` creates it.

    ``async with`` takes control and releases it; ``await`` takes it until :meth:`release`.

    Control can be lost at any time: to a client with a greater authority, in an emergency, after a restart of the
    peer, and when the event loop hangs. :meth:`send` then raises, and :meth:`lost` returns.
    """

    def __init__(
        self, component: Component, peer: str | JausId, authority: int, watch: float | None
    ) -> None:
        self.peer = peer
        #: The code of the state that the peer has reported last; see :class:`State`. ``None`` before.
        self.state: int | None = None
        self._component = component
        self._wanted = (authority, watch)
        self._core: _jaus.Control | None = None
        self._number: int | None = None
        self._over: asyncio.Event | None = None
        self._end: Error | None = None

    def __repr__(self) -> str:
        held = "held" if self.is_held else "not held"
        return f"<jaus.Control of {self.peer}, {held}>"

    def __await__(self) -> Generator[Any, Any, Control]:
        return self._take().__await__()

    async def __aenter__(self) -> Control:
        return await self._take()

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        await self.release()

    async def _take(self) -> Control:
        if self._number is not None or self._end is not None:
            raise StateError("control is taken once: call control() again")
        component, node = self._component, self._component._node
        client = component._running()
        self._over = asyncio.Event()
        request = client.control(self.peer, *self._wanted)
        # Before the first event.
        self._number = request
        node._receivers[request] = self._on_event
        component._controls[request] = self
        try:
            await node._wait(request)
            self._core = client.controlled(request)
        except BaseException:
            self._forget()
            raise
        return self

    @property
    def is_held(self) -> bool:
        """Whether control is held, as far as known now."""
        return self._core is not None and self._end is None

    def check(self) -> None:
        """Checks that commands can be sent.

        :raises ControlLostError: if control is lost
        :raises NotReadyError: if the peer was resumed and is no longer ready
        """
        self._held().check()

    async def resume(self) -> None:
        """Makes the peer act on commands, and waits until it reports that it is ready."""
        await self._component._node._wait(self._held().resume())

    async def standby(self) -> None:
        """Puts the peer into standby, and waits until it reports that."""
        await self._component._node._wait(self._held().standby())

    def send(self, command: Any, *, priority: str = "standard") -> None:
        """Sends a command, if commands can be sent, as :meth:`check` says. Does not wait.

        Efforts and velocities are in force for 500 ms: repeat them in a loop of your program.
        """
        self._held().send(priority, command.encode())

    async def deliver(self, command: Any, *, priority: str = "standard") -> None:
        """Sends a command, with retransmission, and waits until the peer acknowledges that it arrived."""
        await self._component._node._wait(self._held().deliver(priority, command.encode()))

    async def lost(self) -> Error:
        """Waits until control is lost or released, and returns the reason."""
        if self._over is None:
            raise StateError("control was not taken: use `async with` or `await`")
        await self._over.wait()
        return self._end or ClosedError("control was released")

    async def release(self) -> None:
        """Releases control, and waits for the peer's confirmation. Has no effect after its end."""
        request = self._release_now()
        if request is not None:
            await self._component._node._wait(request)

    def _release_now(self) -> int | None:
        core, self._core = self._core, None
        self._forget()
        self._end = self._end or ClosedError("control was released: call control() again")
        if self._over is not None:
            self._over.set()
        return None if core is None else core.release()

    def _forget(self) -> None:
        if self._number is not None:
            self._component._node._receivers.pop(self._number, None)
            self._component._controls.pop(self._number, None)

    def _held(self) -> _jaus.Control:
        if self._end is not None:
            raise self._end.with_traceback(None)
        if self._core is None:
            raise StateError("control was not taken: use `async with` or `await`")
        return self._core

    def _on_event(self, kind: str, *values: Any) -> None:
        if kind == "status":
            (self.state,) = values
        else:
            (self._end,) = values
            if self._over is not None:
                self._over.set()
