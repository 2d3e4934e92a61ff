"""A driver or an operator that dies or hangs does not keep a vehicle moving."""

from __future__ import annotations

import asyncio
import contextlib
import signal
from collections.abc import AsyncIterator, Callable
from typing import Any

import pytest
from conftest import Motor, Program, driver_of, until, within
from messages import QueryStatus, SetWrenchEffort, set_effort

import jaus

Start = Callable[..., Program]


@contextlib.asynccontextmanager
async def driven(operator: jaus.Component) -> AsyncIterator[jaus.Control]:
    """Control of the driver that is found, made ready."""
    driver = await within(operator.find(SetWrenchEffort))
    control = await within(operator.control(driver))
    try:
        await within(control.resume())
        yield control
    finally:
        await control.release()


@contextlib.asynccontextmanager
async def driving(control: jaus.Control, effort: float) -> AsyncIterator[None]:
    """Sends an effort again and again, as drivers need it."""

    async def drive() -> None:
        with contextlib.suppress(jaus.Error):
            while True:
                control.send(set_effort(effort))
                await asyncio.sleep(0.05)

    task = asyncio.ensure_future(drive())
    try:
        yield
    finally:
        task.cancel()


async def status(operator: jaus.Component, driver: Any) -> jaus.State:
    report = await within(operator.query(driver, QueryStatus()))
    return jaus.State(report.status)


@pytest.mark.parametrize("how", ["sleep", "spin"])
async def test_a_driver_whose_event_loop_hangs_is_stopped_and_fails(
    how: str, operator: jaus.Component, group: str, start: Start
) -> None:
    driver = start("driver_process.py", "102", group, how)
    async with driven(operator) as control:
        control.send(set_effort(30))
        await driver.expect("motor 30")
        # It would last until it is done: only the watch over the event loop stops it.
        control.send(set_effort(60))
        await driver.expect("handles 60")
        await driver.expect("stop")
        assert isinstance(await within(control.lost()), jaus.ControlLostError)
        assert await status(operator, control.peer) is jaus.State.FAILURE


async def test_a_handler_that_returns_late_does_not_move_anything(
    operator: jaus.Component, group: str, start: Start
) -> None:
    driver = start("driver_process.py", "102", group, "late")
    async with driven(operator) as control:
        async with driving(control, 60):
            await driver.expect("handles 60")
            await driver.expect("stop")
            # The handler returns and sets an effort, so it is stopped again.
            await driver.expect("stop")
            await driver.expect("state standby")
    async with driven(operator):
        assert await driver.expect("state ready") == "state ready, effort 0"


async def test_commands_that_waited_for_a_hung_event_loop_are_not_handled(
    operator: jaus.Component, group: str, start: Start
) -> None:
    driver = start("driver_process.py", "102", group, "late")
    async with driven(operator) as control:
        control.send(set_effort(60))
        await driver.expect("handles 60")
        control.send(set_effort(30))
        await driver.expect("state standby")
        assert "handles 30" not in driver.seen


async def test_a_driver_that_was_suspended_stops_before_it_handles_what_waits(
    operator: jaus.Component, group: str, start: Start
) -> None:
    driver = start("driver_process.py", "102", group, "plain")
    async with driven(operator) as control, driving(control, 42):
        await driver.expect("motor 42")
        driver.signal(signal.SIGSTOP)
        # At least as long as a component may be held up while something moves.
        await asyncio.sleep(0.8)
        driver.signal(signal.SIGCONT)
        await driver.expect("stop")
        await within(control.lost())


async def test_the_client_of_a_driver_that_was_killed_loses_control(
    operator: jaus.Component, group: str, start: Start
) -> None:
    driver = start("driver_process.py", "102", group, "plain")
    async with driven(operator) as control:
        # Its motor gets no commands any more, and stops by its own deadline.
        driver.signal(signal.SIGKILL)
        assert isinstance(await within(control.lost()), jaus.ControlLostError)


@pytest.mark.parametrize("how", ["kill", "sleep", "leave", "interrupt"])
async def test_an_operator_that_is_killed_hangs_or_ends_loses_control_and_the_vehicle_stops(
    how: str, node: jaus.Node, group: str, start: Start
) -> None:
    motor = Motor()
    # Only the end of control ends the motion.
    async with driver_of(node, motor, validity="until-done") as driver:
        operator = start("operator_process.py", "43", group, how)
        await operator.expect("drives")
        # It may have stopped again already, by the end of an operator that leaves at once.
        await until(lambda: motor.moves > 0)
        if how == "kill":
            operator.signal(signal.SIGKILL)
        if how == "interrupt":
            operator.signal(signal.SIGINT)
        if how in ("interrupt", "leave"):
            await within(operator.code())
        await until(lambda: driver.standing.controller is None)
        await until(lambda: motor.effort == 0)


async def test_an_operator_whose_event_loop_idles_keeps_control(
    node: jaus.Node, group: str, start: Start
) -> None:
    async with driver_of(node, Motor()) as driver:
        operator = start("operator_process.py", "43", group, "idle")
        await operator.expect("drives")
        # Several times the limit of its watch.
        await asyncio.sleep(1.5)
        assert driver.standing.controller is not None
