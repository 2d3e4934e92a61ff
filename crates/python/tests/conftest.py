"""A multicast group of its own for each test, and processes that end with it."""

from __future__ import annotations

import asyncio
import itertools
import os
import signal
import subprocess
import sys
from collections.abc import AsyncIterator, Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import pytest_asyncio
from messages import QueryVelocityState, QueryVelocityStateExt, QueryWrenchEffort, SetWrenchEffort

import jaus

HERE = Path(__file__).parent
#: A step that should take a moment may take this long on a busy machine, in seconds.
LIMIT = 60.0

_groups = itertools.count(1)


@pytest.fixture
def group() -> str:
    """A multicast group that no other test and no other process uses."""
    process = os.getpid()
    return f"239.{192 + next(_groups) % 32}.{process >> 8 & 255}.{process & 255}:3794"


class Program:
    """A process of a test, whose lines can be waited for."""

    def __init__(self, *command: str) -> None:
        environment = {**os.environ, "PYTHONUNBUFFERED": "1", "PYTHONPATH": str(HERE)}
        self.process = subprocess.Popen(
            command,
            stdout=subprocess.PIPE,
            text=True,
            bufsize=1,
            env=environment,
        )
        self.seen: list[str] = []

    async def expect(self, beginning: str, is_it: Callable[[str], bool] | None = None) -> str:
        """Waits for a line with this beginning, or for one that is it."""
        is_it = is_it or (lambda line: line.startswith(beginning))
        try:
            found: str = await within(asyncio.to_thread(self._find, is_it))
        except asyncio.TimeoutError as error:
            raise AssertionError(f"no {beginning!r} after {self.seen}") from error
        return found

    def _find(self, is_it: Callable[[str], bool]) -> str:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self.seen.append(line.rstrip())
            if is_it(self.seen[-1]):
                return self.seen[-1]
        raise AssertionError(f"the process ended, after {self.seen}")

    async def code(self) -> int:
        """Waits for the end of the process."""
        return await asyncio.to_thread(self.process.wait)

    def signal(self, number: signal.Signals) -> None:
        self.process.send_signal(number)

    def end(self) -> None:
        self.process.kill()
        self.process.wait()


@pytest.fixture
def start_command() -> Iterator[Callable[..., Program]]:
    """Starts a process, which is killed at the end of the test."""
    programs: list[Program] = []

    def start(*command: str) -> Program:
        programs.append(Program(*command))
        return programs[-1]

    yield start
    for program in programs:
        program.end()


@pytest.fixture
def start(start_command: Callable[..., Program]) -> Callable[..., Program]:
    """Starts a Python file of the tests."""

    def start(source: str, *arguments: str) -> Program:
        return start_command(sys.executable, str(HERE / source), *arguments)

    return start


async def within(awaitable: Any) -> Any:
    """The result of something that takes a moment."""
    return await asyncio.wait_for(awaitable, LIMIT)


async def until(condition: Callable[[], bool]) -> None:
    """Waits until a condition holds."""

    async def check() -> None:
        while not condition():
            await asyncio.sleep(0.01)

    await within(check())


@pytest_asyncio.fixture
async def node(group: str) -> AsyncIterator[jaus.Node]:
    async with jaus.Node("42.1", loopback=True, group=group) as node:
        yield node


@pytest_asyncio.fixture
async def operator(node: jaus.Node) -> AsyncIterator[jaus.Component]:
    async with node.component(1, kind="ocu", name="Operator") as operator:
        yield operator


def sensor_of(node: jaus.Node, number: int = 44) -> jaus.Component:
    sensor = node.component(number, kind="vehicle", name="Rover")
    sensor.publishes(QueryVelocityState)
    sensor.declines(QueryVelocityStateExt)
    return sensor


class Motor:
    """What a driver of the tests moves."""

    def __init__(self) -> None:
        self.effort: float | None = 0.0
        self.moves = 0
        self.stops = 0

    def move(self, effort: float | None) -> None:
        self.effort = effort
        self.moves += 1

    def stop(self) -> None:
        self.effort = 0.0
        self.stops += 1


def driver_of(
    node: jaus.Node, motor: Motor, function: Callable[..., Any] | None = None, **command: Any
) -> jaus.Component:
    """A primitive driver that is described, with a handler of its own or one that sets the effort."""

    def drive(effort: Any, _sender: jaus.JausId) -> None:
        motor.move(effort.propulsive_linear_effort_x_percent)

    driver = node.component(33, kind="vehicle", name="Rover", management=True)
    driver.command(SetWrenchEffort, **command)(function or drive)
    driver.declines(QueryWrenchEffort)
    driver.on_stop(motor.stop)
    return driver
