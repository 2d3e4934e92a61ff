"""Components: services that they offer, and what they do as clients of others."""

from __future__ import annotations

import enum
import inspect
from collections.abc import Callable
from types import TracebackType
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

from . import _jaus
from ._handlers import Guard, Handler, call_plain
from ._log import log
from .control import Control
from .errors import ArgumentError
from .subscription import Subscription

if TYPE_CHECKING:
    from ._jaus import JausId
    from .node import Node

__all__ = ["Component", "Standing", "State"]

Function = TypeVar("Function", bound=Callable[..., Any])

_KINDS = {
    "vehicle": 10001,
    "ocu": 20001,
    "other": 30001,
    "node": 40001,
    "payload": 50001,
    "component": 60001,
}


class State(enum.IntEnum):
    """The state of a component with Management."""

    INITIALIZE = 0
    READY = 1
    STANDBY = 2
    SHUTDOWN = 3
    FAILURE = 4
    EMERGENCY = 5


class Standing(NamedTuple):
    """The state of a component, and the client in control."""

    state: State
    controller: JausId | None


class Component:
    """A component of a node. :meth:`Node.component` creates it.

    A component is described first, and then started with ``async with`` or :meth:`start`::

        rover = node.component(44, kind="vehicle", name="Rover")
        rover.publishes(mobility.QueryVelocityState)
        rover.declines(mobility.QueryVelocityStateExt)
        async with rover:
            rover.publish(mobility.ReportVelocityState(velocity_x_m_per_s=1.5))

    Every query of a service of the standard must be published, answered or declined.
    """

    def __init__(self, node: Node, number: int, *, kind: str, name: str, **guard: Any) -> None:
        if kind not in _KINDS:
            raise ArgumentError(f"kind {kind!r}: choose one of {', '.join(map(repr, _KINDS))}")
        self._node = node
        self._number = number
        self._id: JausId | None = None
        self._core = _jaus.Component(number, _KINDS[kind], name, **guard)
        self._client: _jaus.Client | None = None
        self._stop_function: Callable[[], Any] | None = None
        self._on_standing: list[Callable[[Standing], Any]] = []
        self._on_discovery: list[Callable[[JausId, bool], Any]] = []
        self._handlers: dict[int, Handler] = {}
        self._subscriptions: dict[int, Subscription] = {}
        self._controls: dict[int, Control] = {}
        self._has_ended = False
        #: Why the component was stopped last, in words; ``None`` before the first time.
        self.last_stop: str | None = None

    def __repr__(self) -> str:
        if self._client is None:
            state = "closed" if self._has_ended else "not started"
            return f"<jaus.Component {self._number}, {state}>"
        standing = self.standing
        by = "" if standing.controller is None else f", controlled by {standing.controller}"
        return f"<jaus.Component {self._id}, {standing.state.name.lower()}{by}>"

    # Description.

    def publishes(self, query: type[Any], *, version: str | None = None) -> None:
        """Answers a query with the report that :meth:`publish` was given last, also to subscribers.

        Offers the newest version of the service that has the query, or ``version``, such as ``"1.0"``.
        """
        report = None if query.report is None else query.report.code
        self._core.publishes(*_service(query, version), query.code, report)

    def declines(self, *queries: type[Any]) -> None:
        """Leaves queries without an answer."""
        for query in queries:
            self._core.declines(*_service(query), query.code)

    def answers(self, query: type[Any]) -> Callable[[Function], Function]:
        """Answers a query with the report that a function returns, for instance
        ``def report(query, sender)``. Clients cannot subscribe to it: :meth:`publishes` is for that.
        """

        def register(function: Function) -> Function:
            def answer(message: Any, sender: JausId) -> Any:
                report = function(message, sender)
                if inspect.isawaitable(report):
                    return self._answer_later(report, sender)
                if report is not None:
                    self.send(sender, report)
                return None

            self._handle(query, answer, "receive")
            return function

        return register

    async def _answer_later(self, report: Any, sender: JausId) -> None:
        report = await report
        if report is not None:
            self.send(sender, report)

    def command(
        self, message: type[Any], *, validity: str | None = None
    ) -> Callable[[Function], Function]:
        """Handles a command that moves something: ``def drive(command, sender)``, or ``async def``.

        Commands come from the client in control while the component is ready. The component needs
        ``management=True`` and :meth:`on_stop`.

        A newer command cancels an asynchronous handler that still runs, and so does a stop. A handler that raises
        stops the component, which goes to the state Failure until :meth:`recover`. A malformed command stops it.

        :param validity: how long the command is in force if it is not repeated: ``"brief"`` (500 ms),
            ``"while-alive"`` (while its client shows life at least every second), or ``"until-done"`` (as long as
            control lasts). The default is that of the standard's command, and brief for your own.
        """
        return self._registering(message, "command", validity)

    def configure(self, message: type[Any]) -> Callable[[Function], Function]:
        """Handles a message that configures something, from the client in control. The component needs
        ``access_control=True`` or ``management=True``.
        """
        return self._registering(message, "configure")

    def receive(self, message: type[Any]) -> Callable[[Function], Function]:
        """Handles a message from any sender. Refused for commands of services that need control."""
        return self._registering(message, "receive")

    def _registering(
        self, message: type[Any], how: str, validity: str | None = None
    ) -> Callable[[Function], Function]:
        def register(function: Function) -> Function:
            self._handle(message, function, how, validity)
            return function

        return register

    def _handle(
        self,
        message: type[Any],
        function: Callable[..., Any],
        how: str,
        validity: str | None = None,
    ) -> None:
        urn, version = _service(message)
        number = self._core.handles(urn, version, message.code, how, validity)
        self._handlers[number] = Handler(message, function, moves=how == "command")

    def on_stop(self, function: Function) -> Function:
        """Sets the function that stops everything that commands have started: ``def stop()``.

        It is called when a command is not repeated in time, when control or readiness is lost, in an emergency, when
        the component ends, and when the event loop hangs for 500 ms. It is also called when nothing moves, and may be
        called twice.

        It runs on a thread of its own, so that it also runs while the event loop hangs. It must be quick and
        thread-safe, and must not wait for anything that a handler may hold, such as a lock.
        """
        if inspect.iscoroutinefunction(function):
            raise ArgumentError("the stop function runs without an event loop: give a plain function")
        self._core.on_stop(self._call_stop)
        self._stop_function = function
        return function

    def on_standing(self, function: Function) -> Function:
        """Calls a function when the component's state or its controller has changed:
        ``def show(standing)``, with a :class:`Standing`.
        """
        self._on_standing.append(function)
        return function

    def on_discovery(self, function: Function) -> Function:
        """Calls a function when a component is found or its services have changed, and when it is lost:
        ``def show(id, is_found)``.
        """
        self._on_discovery.append(function)
        return function

    # Life.

    async def __aenter__(self) -> Component:
        return await self.start()

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        await self.close()

    async def start(self) -> Component:
        """Starts the component on its node."""
        self._node._check_loop()
        receivers = self._node._receivers
        request = self._core.start(self._node._core)
        receivers[self._core.subject] = self._on_event
        for number in self._handlers:
            receivers[number] = self._receiver(number)
        self._node._components.append(self)
        try:
            self._id = await self._node._wait(request)
            self._client = self._core.client()
        except BaseException:
            await self.close()
            raise
        return self

    async def close(self) -> None:
        """Ends the component: it stops what it moves, and releases what it controls."""
        for control in list(self._controls.values()):
            await control.release()
        self._end()
        request = self._core.close()
        if request is not None:
            await self._node._wait(request)
        self._forget()

    def _close_now(self) -> list[int]:
        """Begins to close the component without an event loop; returns the requests."""
        requests = [control._release_now() for control in list(self._controls.values())]
        self._end()
        requests.append(self._core.close())
        return [request for request in requests if request is not None]

    def _end(self) -> None:
        self._client = None
        self._has_ended = True
        for subscription in list(self._subscriptions.values()):
            subscription.end()
        for handler in self._handlers.values():
            handler.cancel()

    def _forget(self) -> None:
        for number in (self._core.subject, *self._handlers):
            self._node._receivers.pop(number, None)
        if self in self._node._components:
            self._node._components.remove(self)

    @property
    def id(self) -> JausId:
        """The component's id, while it runs."""
        if self._id is None:
            self._running()
        assert self._id is not None
        return self._id

    @property
    def standing(self) -> Standing:
        """The state of the component, and the client in control."""
        state, controller = self._core.standing()
        return Standing(State(state), controller)

    def publish(self, report: Any) -> None:
        """Publishes a report: queries are answered with it from now on, and subscribers get it."""
        self._core.publish(report.encode())

    def fail(self) -> None:
        """Stops the component. It goes to the state Failure, which ends control, until :meth:`recover`."""
        self._core.stop()
        self._core.set_condition("failed")

    def recover(self) -> None:
        """Reports that the component is ready for work: initialized, or repaired."""
        self._core.set_condition("initialized")

    def press_stop(self) -> None:
        """Stops the component, as a stop input does. An emergency begins that no client can clear, until
        :meth:`release_stop`."""
        self._core.stop()
        self._core.set_condition("stopped")

    def release_stop(self) -> None:
        """Ends the emergency of :meth:`press_stop`. Emergencies that clients have set remain."""
        self._core.set_condition("stop released")

    def declare_safe(self) -> None:
        """Ends all emergencies. For the case that the person responsible on site has checked the vehicle."""
        self._core.set_condition("safe")

    # Events.

    def _receiver(self, number: int) -> Callable[..., None]:
        handler = self._handlers[number]

        def receive(_kind: str, octets: bytes, sender: JausId, stops: int) -> None:
            if self._has_ended:
                return
            guard = Guard(_Stops(self), stops)
            if handler.moves and (not self._core.settle() or guard.is_stopped()):
                # It is no longer in force.
                return
            handler.handle(octets, sender, guard)

        return receive

    def _on_event(self, kind: str, *values: Any) -> None:
        if kind == "stopped":
            (self.last_stop,) = values
            log.info("%s stopped: %s", self._id, self.last_stop)
            for handler in self._handlers.values():
                if handler.moves:
                    handler.cancel()
        elif kind == "standing":
            state, controller = values
            for function in self._on_standing:
                call_plain(function, Standing(State(state), controller))
        else:
            for discovered in self._on_discovery:
                call_plain(discovered, *values)

    def _call_stop(self) -> None:
        if self._stop_function is None:
            return
        try:
            self._stop_function()
        except Exception:
            log.critical("the stop function of %s failed", self._id, exc_info=True)

    # As a client.

    def _running(self) -> _jaus.Client:
        if self._client is None:
            # It says why not.
            return self._core.client()
        return self._client

    async def find(self, service: Any, *, timeout: float = 10.0) -> JausId:
        """Waits until another component is known that offers a service, in any version.

        :param service: its URN, or a message class of it
        :raises NotFoundError: after ``timeout`` seconds
        """
        id: JausId = await self._node._wait(self._running().find(_urn(service), timeout))
        return id

    def providers(self, service: Any) -> list[JausId]:
        """The known components that offer a service: its URN, or a message class of it."""
        return self._running().providers(_urn(service))

    async def query(self, peer: str | JausId, query: Any, *, timeout: float | None = None) -> Any:
        """Sends a query to a component, and waits for its report. The query is repeated until ``timeout``
        seconds have passed, 1.5 by default.

        :raises NoAnswerError: if there is none
        """
        report = _report(query)
        request = self._running().query(peer, query.encode(), report.code, timeout)
        return report.decode(await self._node._wait(request))

    def subscribe(
        self,
        peer: str | JausId,
        query: Any,
        *,
        hz: float | None = None,
        at_least: float | None = None,
        buffer: int = 64,
    ) -> Subscription:
        """Subscribes to the answers to a query::

            async for report in operator.subscribe("107.1.44", mobility.QueryVelocityState(), hz=10):
                print(report)

        The subscription renews itself and survives failures of the peer. It ends when the loop is left.

        :param hz: the rate, 1/60 to 1092; ``None`` means on every change
        :param at_least: the lowest rate that suffices; the default accepts any
        :param buffer: how many reports wait for a slow reader; then the oldest is dropped
        """
        return Subscription(self, peer, query, _report(query), hz, at_least, buffer)

    def control(
        self, peer: str | JausId, *, authority: int = 127, watch: float | None = 1.0
    ) -> Control:
        """Takes control of a peer that offers Access Control or Management::

            async with operator.control("107.1.33", authority=127) as control:
                await control.resume()
                control.send(mobility.SetWrenchEffort(propulsive_linear_effort_x_percent=30))

        It renews itself until it is released, at the end of the block.

        :param authority: 0 to 255; the higher one wins
        :param watch: releases control when the event loop has not run for this time in seconds, at least 0.1.
            ``None`` renews control as long as the process lives, even if the program hangs.
        """
        return Control(self, peer, authority, watch)

    def send(self, destination: str | JausId, message: Any, *, priority: str = "standard") -> None:
        """Sends a message without acknowledgement. The destination may have wildcards.

        :param priority: ``"low"``, ``"standard"``, ``"high"`` or ``"safety-critical"``
        """
        self._running().send(destination, priority, message.encode())

    async def deliver(
        self, destination: str | JausId, message: Any, *, priority: str = "standard"
    ) -> None:
        """Sends a message, with retransmission, and waits until the receiver acknowledges."""
        request = self._running().deliver(destination, priority, message.encode())
        await self._node._wait(request)

    async def set_emergency(self, peer: str | JausId) -> None:
        """Sets an emergency at a peer that offers Management, and waits until it reports that. The peer
        stops until :meth:`clear_emergency`. This needs no control.
        """
        await self._node._wait(self._running().set_emergency(peer))

    async def clear_emergency(self, peer: str | JausId) -> None:
        """Clears an emergency that this component has set."""
        await self._node._wait(self._running().clear_emergency(peer))


class _Stops:
    """What handlers of commands need of their component."""

    def __init__(self, component: Component) -> None:
        self._component = component

    @property
    def stops(self) -> int:
        return self._component._core.stops

    def stop(self) -> None:
        if not self._component._has_ended:
            self._component._core.stop()

    def call_stop(self) -> None:
        self._component._call_stop()

    def fail(self) -> None:
        if not self._component._has_ended:
            self._component.fail()


def _service(message: type[Any], version: str | None = None) -> tuple[str, tuple[int, int]]:
    """The URN and the version of the service that defines a message; the newest if none is given."""
    if version is None:
        version = message.version
    elif f"{message.service} {version}" not in message.services:
        versions = ", ".join(message.services)
        raise ArgumentError(f"version {version!r} does not have {message.__name__}: these do: {versions}")
    major, _, minor = version.partition(".")
    return message.service, (int(major), int(minor or 0))


def _urn(service: Any) -> str:
    return service if isinstance(service, str) else str(service.service)


def _report(query: Any) -> Any:
    """The class of the report that answers a query."""
    report = getattr(query, "report", None)
    if report is None:
        raise ArgumentError(f"{query!r} is not a query: send it instead")
    return report
