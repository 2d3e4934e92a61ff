"""Handlers of messages, and the guard that keeps those of commands from moving what was stopped."""

from __future__ import annotations

import asyncio
import inspect
import types
from collections.abc import Callable, Coroutine, Generator
from typing import Any

from ._log import log
from .errors import DecodeError

__all__ = ["Handler", "call_plain"]


class Handler:
    """A function of the program for one message, with the tasks that run it if it is asynchronous."""

    #: Limit of calls of an asynchronous function that run at a time.
    MOST = 64

    def __init__(self, message: type[Any], function: Callable[..., Any], moves: bool) -> None:
        self.message = message
        self.function = function
        #: Whether it handles a command that moves something.
        self.moves = moves
        self.tasks: set[asyncio.Task[Any]] = set()

    def cancel(self) -> None:
        for task in self.tasks:
            task.cancel()

    def handle(self, octets: bytes, sender: Any, guard: Guard) -> None:
        """Calls the function for a message that was received."""
        try:
            message = self.message.decode(octets)
        except DecodeError as error:
            log.warning("malformed %s from %s: %s", self.message.name, sender, error)
            if self.moves:
                guard.stop()
            return
        try:
            result = self.function(message, sender)
        except Exception:
            self._fail(sender, guard)
            return
        finally:
            if self.moves and guard.is_stopped():
                # It was stopped while the function ran, which may have moved it afterwards.
                guard.stop_again()
        if inspect.iscoroutine(result):
            self._run(result, sender, guard)

    def _run(self, coroutine: Coroutine[Any, Any, Any], sender: Any, guard: Guard) -> None:
        if self.moves:
            # The newest command counts.
            self.cancel()
            coroutine = _until_stopped(coroutine, guard)
        elif len(self.tasks) >= self.MOST:
            log.warning("%s is dropped: %d calls still run", self.message.name, self.MOST)
            coroutine.close()
            return
        task = asyncio.get_running_loop().create_task(self._watch(coroutine, sender, guard))
        self.tasks.add(task)
        task.add_done_callback(self.tasks.discard)

    async def _watch(self, coroutine: Coroutine[Any, Any, Any], sender: Any, guard: Guard) -> None:
        try:
            await coroutine
        except Exception:
            self._fail(sender, guard)

    def _fail(self, sender: Any, guard: Guard) -> None:
        log.exception("the handler of %s from %s failed", self.message.name, sender)
        if self.moves:
            guard.fail()


class Guard:
    """Compares the number of stops of a component with that at the time of a message."""

    def __init__(self, component: Any, stops: int) -> None:
        self._component = component
        self._stops = stops

    def is_stopped(self) -> bool:
        """Whether the component was stopped since the message."""
        return bool(self._component.stops != self._stops)

    def stop(self) -> None:
        self._component.stop()

    def stop_again(self) -> None:
        self._component.call_stop()

    def fail(self) -> None:
        self._component.fail()


@types.coroutine
def _steps(coroutine: Coroutine[Any, Any, Any], guard: Guard) -> Generator[Any, Any, Any]:
    value: Any = None
    error: BaseException | None = None
    is_told = False
    while True:
        was_stopped = guard.is_stopped()
        if was_stopped and not is_told:
            is_told = True
            error = error or asyncio.CancelledError("the component was stopped")
        try:
            awaited = coroutine.send(value) if error is None else coroutine.throw(error)
        except StopIteration as end:
            return end.value
        finally:
            if not was_stopped and guard.is_stopped():
                guard.stop_again()
        value = error = None
        try:
            value = yield awaited
        except BaseException as raised:  # noqa: BLE001 - it belongs to the coroutine
            error = raised


async def _until_stopped(coroutine: Coroutine[Any, Any, Any], guard: Guard) -> Any:
    """Runs a coroutine. After a stop it does not go on: its ``await`` raises ``CancelledError``."""
    return await _steps(coroutine, guard)


def call_plain(function: Callable[..., Any], *arguments: Any) -> None:
    """Calls a function of the program for news. What it raises is logged."""
    try:
        function(*arguments)
    except Exception:
        log.exception("%r failed", function)
