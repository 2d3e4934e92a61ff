"""Control of a driver, and what its handlers may do, in one process."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest
from conftest import Motor, driver_of, until, within
from messages import Note, SetWrenchEffort, set_effort

import jaus


async def test_a_driver_obeys_the_client_in_control_and_stops_at_the_end(
    node: jaus.Node, operator: jaus.Component
) -> None:
    motor = Motor()
    async with driver_of(node, motor) as driver:
        async with operator.control(driver.id, authority=200) as control:
            await control.resume()
            assert control.is_held
            assert tuple(driver.standing) == (jaus.State.READY, operator.id)
            await until(lambda: control.state == jaus.State.READY)
            await control.deliver(set_effort(30))
            await until(lambda: motor.effort == pytest.approx(30, abs=0.1))
            # It is not repeated.
            await until(lambda: motor.effort == 0)
            await until(lambda: driver.last_stop is not None)
            control.send(set_effort(40), priority="high")
            await until(lambda: motor.effort == pytest.approx(40, abs=0.1))
            await control.standby()
            await until(lambda: motor.effort == 0)
        assert driver.standing.controller is None
        with pytest.raises(jaus.ClosedError, match="control\\(\\) again"):
            control.send(set_effort(30))
        assert isinstance(await within(control.lost()), jaus.ClosedError)


async def test_control_goes_to_the_greater_authority_and_the_loser_is_told(
    node: jaus.Node, operator: jaus.Component
) -> None:
    async with driver_of(node, Motor()) as driver, node.component(2, name="Chief") as chief:
        control = await operator.control(driver.id, authority=10)
        with pytest.raises(jaus.RefusedError):
            await chief.control(driver.id, authority=5)
        async with chief.control(driver.id, authority=20):
            assert isinstance(await within(control.lost()), jaus.ControlLostError)
            with pytest.raises(jaus.ControlLostError):
                control.send(set_effort(30))
        await control.release()


async def test_cancelling_a_request_for_control_leaves_no_control(
    node: jaus.Node, operator: jaus.Component
) -> None:
    async with driver_of(node, Motor()) as driver:
        await operator.find(SetWrenchEffort)
        for turns in range(40):
            task = asyncio.ensure_future(operator.control(driver.id)._take())
            for _ in range(turns):
                await asyncio.sleep(0)
            if not task.cancel():
                await (await task).release()
            await asyncio.gather(task, return_exceptions=True)
            assert not operator._controls
            await until(lambda: driver.standing.controller is None)


async def test_an_emergency_stops_a_driver(node: jaus.Node, operator: jaus.Component) -> None:
    motor = Motor()
    async with driver_of(node, motor, validity="until-done") as driver:
        async with operator.control(driver.id) as control:
            await control.resume()
            control.send(set_effort(30))
            await until(lambda: motor.effort != 0)
            await operator.set_emergency(driver.id)
            await until(lambda: motor.effort == 0)
            assert driver.standing.state is jaus.State.EMERGENCY
            await operator.clear_emergency(driver.id)


async def test_a_pressed_stop_ends_only_by_its_release_and_leaves_the_emergencies_of_clients(
    node: jaus.Node, operator: jaus.Component
) -> None:
    motor = Motor()
    async with driver_of(node, motor, validity="until-done") as driver:
        async with operator.control(driver.id) as control:
            await control.resume()
            control.send(set_effort(30))
            await until(lambda: motor.effort != 0)
            driver.press_stop()
            await until(lambda: motor.effort == 0)
            await until(lambda: driver.standing.state is jaus.State.EMERGENCY)
            await operator.set_emergency(driver.id)
            await operator.clear_emergency(driver.id)
            assert driver.standing.state is jaus.State.EMERGENCY
            await operator.set_emergency(driver.id)
            driver.release_stop()
            await asyncio.sleep(0.2)
            assert driver.standing.state is jaus.State.EMERGENCY
            await operator.clear_emergency(driver.id)
            await until(lambda: driver.standing.state is not jaus.State.EMERGENCY)


async def test_a_command_handler_that_raises_stops_the_component_until_it_recovers(
    node: jaus.Node, operator: jaus.Component, caplog: pytest.LogCaptureFixture
) -> None:
    motor = Motor()

    def drive(effort: Any, _sender: jaus.JausId) -> None:
        motor.effort = effort.propulsive_linear_effort_x_percent
        raise ValueError("the motor is on fire")

    async with driver_of(node, motor, drive, validity="until-done") as driver:
        async with operator.control(driver.id) as control:
            await control.resume()
            control.send(set_effort(30))
            assert isinstance(await within(control.lost()), jaus.ControlLostError)
        await until(lambda: motor.effort == 0)
        assert driver.standing.state is jaus.State.FAILURE
        assert "the motor is on fire" in caplog.text and "Traceback" in caplog.text
        driver.recover()
        await until(lambda: driver.standing.state is jaus.State.STANDBY)


async def test_a_malformed_command_stops_what_moves(
    node: jaus.Node, operator: jaus.Component, caplog: pytest.LogCaptureFixture
) -> None:
    class Malformed(SetWrenchEffort):
        def encode(self) -> bytes:
            return super().encode()[:-1]

    motor = Motor()
    async with driver_of(node, motor, validity="until-done") as driver:
        async with operator.control(driver.id) as control:
            await control.resume()
            control.send(set_effort(30))
            await until(lambda: motor.effort != 0)
            control.send(Malformed(propulsive_linear_effort_x_percent=30))
            await until(lambda: motor.effort == 0)
            assert "malformed SetWrenchEffort" in caplog.text
            control.send(set_effort(30))
            await until(lambda: motor.effort != 0)


async def test_a_stop_ends_an_asynchronous_handler_before_it_goes_on(
    node: jaus.Node, operator: jaus.Component
) -> None:
    motor = Motor()
    ends: list[str] = []
    released: asyncio.Event = asyncio.Event()

    async def drive(effort: Any, _sender: jaus.JausId) -> None:
        motor.effort = effort.propulsive_linear_effort_x_percent
        try:
            await released.wait()
        except asyncio.CancelledError:
            ends.append("cancelled")
            raise
        motor.effort = -1

    async with driver_of(node, motor, drive, validity="until-done") as driver:
        async with operator.control(driver.id) as control:
            await control.resume()
            control.send(set_effort(30))
            await until(lambda: motor.effort == pytest.approx(30, abs=0.1))
            control.send(set_effort(40))
            await until(lambda: motor.effort == pytest.approx(40, abs=0.1))
            assert ends == ["cancelled"], "the newer command counts"
            # Stopped and released in one turn of the loop: the handler is ready to go on.
            driver._core.stop()
            released.set()
            await until(lambda: len(ends) == 2)
            await until(lambda: motor.effort == 0)


async def test_a_stop_during_a_handler_is_repeated_after_it(
    node: jaus.Node, operator: jaus.Component
) -> None:
    motor = Motor()

    def drive(effort: Any, _sender: jaus.JausId) -> None:
        driver._core.stop()
        while motor.stops == stops:
            # The stop thread calls the stop function meanwhile.
            pass
        motor.effort = effort.propulsive_linear_effort_x_percent

    driver = driver_of(node, motor, drive, validity="until-done")
    async with driver, operator.control(driver.id) as control:
        await control.resume()
        stops = motor.stops
        control.send(set_effort(30))
        await until(lambda: motor.stops > stops)
        # More often where the handler takes so long that the driver counts as hung.
        assert motor.effort == 0 and motor.stops >= stops + 2


async def test_a_stop_function_that_raises_is_logged(
    node: jaus.Node, caplog: pytest.LogCaptureFixture
) -> None:
    driver = driver_of(node, Motor())

    @driver.on_stop
    def stop() -> None:
        raise ValueError("no brakes")

    async with driver:
        driver.fail()
        await until(lambda: "no brakes" in caplog.text)


async def test_a_message_that_configures_comes_from_the_client_in_control(
    node: jaus.Node, operator: jaus.Component
) -> None:
    notes: list[int] = []
    board = node.component(50, name="Board", access_control=True)
    board.configure(Note)(lambda note, _sender: notes.append(note.number))
    async with board:
        await operator.deliver(board.id, Note(number=1))
        async with operator.control(board.id) as control:
            await control.deliver(Note(number=2))
            await until(lambda: bool(notes))
        assert notes == [2]


async def test_control_is_refused_with_a_watch_that_is_too_short(
    operator: jaus.Component,
) -> None:
    with pytest.raises(jaus.ArgumentError, match="at least 0.1"):
        await operator.control("42.1.33", watch=0.01)
    with pytest.raises(jaus.StateError, match="await"):
        operator.control("42.1.33").send(set_effort(1))
