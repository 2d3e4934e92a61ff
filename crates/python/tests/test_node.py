"""Nodes, components and clients in one process."""

from __future__ import annotations

import asyncio
import gc
import itertools
import logging
import multiprocessing
import os
from typing import Any

import pytest
from conftest import LIMIT, driver_of, Motor, sensor_of, until, within
from messages import (
    Note,
    QueryStatus,
    QueryVelocityState,
    QueryVelocityStateExt,
    ReportVelocityState,
    SetWrenchEffort,
    set_effort,
    velocity,
)

import jaus


def test_an_id_is_read_compared_and_shown() -> None:
    id = jaus.JausId("107.1.33")
    assert (id.subsystem, id.node, id.component) == (107, 1, 33)
    assert id == jaus.JausId(id) and hash(id) == hash(jaus.JausId("107.1.33"))
    assert id < jaus.JausId("107.1.34")
    assert (str(id), repr(id)) == ("107.1.33", "JausId('107.1.33')")
    for wrong in ["107.1", "107.1.x", 7]:
        with pytest.raises(jaus.ArgumentError):
            jaus.JausId(wrong)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "settings",
    [
        {},
        {"id": "107"},
        {"id": "0.1"},
        {"id": "107.1", "host": "default"},
        {"id": "107.1", "group": "nowhere"},
        {"id": "107.1", "peers": ["nobody at home"]},
    ],
)
def test_settings_that_are_wrong_are_refused(settings: dict[str, Any]) -> None:
    with pytest.raises(jaus.ArgumentError):
        jaus.Node(**settings)


async def test_a_published_report_answers_a_query(
    node: jaus.Node, operator: jaus.Component
) -> None:
    async with sensor_of(node) as sensor:
        sensor.publish(velocity(1.5))
        assert await operator.find(QueryVelocityState) == sensor.id
        assert operator.providers(QueryVelocityState) == [sensor.id]
        report = await operator.query(str(sensor.id), QueryVelocityState())
        assert report.velocity_x_m_per_s == pytest.approx(1.5, abs=0.01)


async def test_an_older_version_of_a_service_needs_only_its_own_queries(
    node: jaus.Node, operator: jaus.Component
) -> None:
    sensor = node.component(44, kind="vehicle", name="Rover")
    sensor.publishes(QueryVelocityState, version="1.0")
    async with sensor:
        sensor.publish(velocity(1.5))
        assert await operator.find(QueryVelocityState.service) == sensor.id
        report = await operator.query(sensor.id, QueryVelocityState())
        assert report.velocity_x_m_per_s == pytest.approx(1.5, abs=0.01)


async def test_a_function_answers_a_query(node: jaus.Node, operator: jaus.Component) -> None:
    sensor = node.component(44, kind="vehicle", name="Rover")
    sensor.declines(QueryVelocityStateExt)

    @sensor.answers(QueryVelocityState)
    async def speed(_query: Any, sender: jaus.JausId) -> ReportVelocityState:
        await asyncio.sleep(0)
        return velocity(sender.component)

    async with sensor:
        report = await operator.query(sensor.id, QueryVelocityState())
        assert report.velocity_x_m_per_s == pytest.approx(1, abs=0.01)


async def test_a_query_without_an_answer_says_what_was_asked(
    operator: jaus.Component,
) -> None:
    with pytest.raises(jaus.NoAnswerError, match="99.1.1 did not answer QueryVelocityState"):
        await operator.query("99.1.1", QueryVelocityState(), timeout=0.2)
    with pytest.raises(TimeoutError):
        await operator.query("99.1.1", QueryVelocityState(), timeout=0.2)


async def test_cancelling_a_query_ends_it(operator: jaus.Component) -> None:
    node = operator._node
    with pytest.raises(asyncio.TimeoutError):
        await asyncio.wait_for(operator.query("99.1.1", QueryVelocityState()), 0.05)
    assert not node._requests
    # As often as requests may wait at a time: nothing of them is left.
    for _ in range(1001):
        task = asyncio.ensure_future(operator.query("99.1.1", QueryVelocityState(), timeout=60))
        await asyncio.sleep(0)
        task.cancel()
    await asyncio.gather(task, return_exceptions=True)
    assert isinstance(task, asyncio.Task) and task.cancelled()
    with pytest.raises(jaus.NoAnswerError):
        await operator.query("99.1.1", QueryVelocityState(), timeout=0.1)


async def test_requests_have_a_bound(operator: jaus.Component) -> None:
    tasks = [
        asyncio.ensure_future(operator.query("99.1.1", QueryVelocityState(), timeout=60))
        for _ in range(1001)
    ]
    try:
        done, _ = await asyncio.wait(tasks, timeout=LIMIT, return_when=asyncio.FIRST_COMPLETED)
        assert isinstance(done.pop().exception(), jaus.LimitError)
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


async def test_a_subscription_yields_reports_and_ends_with_the_loop(
    node: jaus.Node, operator: jaus.Component
) -> None:
    async with sensor_of(node) as sensor:
        sensor.publish(velocity(0))

        async def publish() -> None:
            for speed in itertools.count(1):
                sensor.publish(velocity(speed))
                await asyncio.sleep(0.02)

        publishing = asyncio.ensure_future(publish())
        seen = 0
        async for report in operator.subscribe(sensor.id, QueryVelocityState()):
            seen += report.velocity_x_m_per_s > 0.5
            if seen == 3:
                break
        publishing.cancel()
        assert not operator._subscriptions, "leaving the loop ends it"


async def test_a_subscription_in_a_block_lasts_until_its_end(
    node: jaus.Node, operator: jaus.Component
) -> None:
    async with sensor_of(node) as sensor:
        sensor.publish(velocity(1.5))
        async with operator.subscribe(sensor.id, QueryVelocityState(), hz=20) as speeds:
            for _ in range(2):
                async for _report in speeds:
                    break
                gc.collect()
            assert speeds.is_up and speeds.hz == pytest.approx(20, abs=0.1)
            assert speeds.age is not None
            assert "up" in repr(speeds)
        assert not operator._subscriptions
        with pytest.raises(jaus.ClosedError):
            await speeds._start()


async def test_a_subscription_shows_an_outage(node: jaus.Node, operator: jaus.Component) -> None:
    sensor = await sensor_of(node).start()
    sensor.publish(velocity(1.5))
    speeds = operator.subscribe(sensor.id, QueryVelocityState(), hz=20)
    updates = speeds.updates()
    assert isinstance(await within(anext(updates)), jaus.Up)
    await sensor.close()
    while not isinstance(update := await within(anext(updates)), jaus.Down):
        pass
    assert update.why and not speeds.is_up
    del updates


async def test_a_slow_reader_misses_the_oldest_reports(
    node: jaus.Node, operator: jaus.Component
) -> None:
    async with sensor_of(node) as sensor:
        sensor.publish(velocity(0))
        subscription = operator.subscribe(sensor.id, QueryVelocityState(), hz=100, buffer=1)
        async with subscription as speeds:
            await until(lambda: speeds.missed > 2)
            assert len(speeds._waiting) == 1


async def test_a_subscription_to_what_is_not_there_is_an_error_and_can_be_cancelled(
    operator: jaus.Component,
) -> None:
    for hz in [5000, 0, float("nan")]:
        with pytest.raises(jaus.ArgumentError, match="Hz|hz|rate"):
            async for _ in operator.subscribe("99.1.1", QueryVelocityState(), hz=hz):
                pass
    with pytest.raises(asyncio.TimeoutError):
        await asyncio.wait_for(
            anext(operator.subscribe("99.1.1", QueryVelocityState()).updates()), 0.05
        )
    assert not operator._subscriptions


async def test_messages_of_own_services_arrive_and_their_failures_are_logged(
    node: jaus.Node, operator: jaus.Component, caplog: pytest.LogCaptureFixture
) -> None:
    notes: list[tuple[float, jaus.JausId]] = []
    board = node.component(50, name="Board")

    @board.receive(Note)
    async def take(note: Any, sender: jaus.JausId) -> None:
        notes.append((note.number, sender))
        raise ValueError("no room")

    async with board:
        await operator.deliver(board.id, Note(number=7))
        await until(lambda: bool(notes))
        assert notes == [(7, operator.id)]
        await until(lambda: "no room" in caplog.text)
        operator.send(board.id, Note(number=8), priority="high")
        await until(lambda: len(notes) == 2)


async def test_found_and_lost_components_and_the_standing_are_news(node: jaus.Node) -> None:
    news: list[tuple[jaus.JausId, bool]] = []
    standings: list[jaus.Standing] = []
    watcher = node.component(2, name="Watcher", management=True)
    watcher.on_discovery(lambda id, is_found: news.append((id, is_found)))
    watcher.on_standing(standings.append)
    async with watcher:
        sensor = await sensor_of(node).start()
        await until(lambda: (sensor.id, True) in news)
        assert watcher.standing == (jaus.State.STANDBY, None)
        watcher.fail()
        await until(lambda: jaus.Standing(jaus.State.FAILURE, None) in standings)
        assert "failure" in repr(watcher)
        watcher.recover()
        await until(lambda: standings[-1].state is jaus.State.STANDBY)


async def test_what_makes_a_service_safe_is_required(node: jaus.Node) -> None:
    for description, missing in [
        ({"management": False}, "management=True"),
        ({"management": True}, "on_stop"),
    ]:
        driver = node.component(60, kind="vehicle", name="Rover", **description)
        driver.command(SetWrenchEffort)(print)
        with pytest.raises(jaus.UnsafeServiceError, match=missing):
            await driver.start()
    sensor = node.component(61, kind="vehicle", name="Rover")
    sensor.publishes(QueryVelocityState)
    with pytest.raises(jaus.UnsafeServiceError, match="declines"):
        await sensor.start()
    with pytest.raises(jaus.ArgumentError, match="VelocityStateSensor 1.0"):
        sensor.publishes(QueryVelocityState, version="2.0")
    with pytest.raises(jaus.UnsafeServiceError, match="command"):
        node.component(62).receive(SetWrenchEffort)(print)
    with pytest.raises(jaus.ArgumentError, match="plain function"):
        node.component(63).on_stop(asyncio.sleep)


async def test_calls_in_the_wrong_state_say_what_to_do(group: str) -> None:
    node = jaus.Node("42.1", loopback=True, group=group)
    component = node.component(1)
    with pytest.raises(jaus.StateError, match="async with"):
        await component.start()
    await node.start()
    with pytest.raises(jaus.StateError, match="create a new one"):
        await node.start()
    component = await node.component(1).start()
    with pytest.raises(jaus.StateError, match="before"):
        component.publishes(QueryVelocityState)
    with pytest.raises(jaus.NotFoundError, match="publishes"):
        component.publish(velocity(1))
    with pytest.raises(jaus.ArgumentError, match="not a query"):
        await component.query("1.1.1", set_effort(1))
    with pytest.raises(jaus.ArgumentError, match="single component"):
        await component.deliver("1.255.1", Note(number=1))
    with pytest.raises(jaus.StartError):
        await node.component(1).start()
    assert repr(component) == "<jaus.Component 42.1.1, ready>"
    await node.close()
    await node.close()
    assert (repr(node), repr(component)) == (
        "<jaus.Node 42.1, closed>",
        "<jaus.Component 1, closed>",
    )
    with pytest.raises(jaus.ClosedError, match="create a new one"):
        await component.find("urn:example:notes")
    with pytest.raises(jaus.ClosedError, match="create a new one"):
        await node.component(2).start()


async def test_a_number_is_free_when_its_component_has_closed(node: jaus.Node) -> None:
    for _ in range(3):
        async with node.component(9):
            pass


def test_event_loops_follow_each_other_and_what_they_leave_open_ends(group: str) -> None:
    left: list[jaus.Component] = []

    async def leave() -> None:
        node = await jaus.Node("42.1", loopback=True, group=group).start()
        left.append(await node.component(1, name="Operator").start())

    async def other() -> None:
        with pytest.raises(jaus.StateError, match="another event loop"):
            await left[0].find("urn:example:notes")
        await left[0]._node.close()
        async with jaus.Node("43.1", loopback=True, group=group) as node:
            async with node.component(1, name="Operator"):
                pass

    asyncio.run(leave())
    asyncio.run(other())


def test_a_node_that_is_forgotten_warns_and_ends(group: str) -> None:
    async def forget() -> None:
        await jaus.Node("42.1", loopback=True, group=group).start()

    with pytest.warns(ResourceWarning, match="was not closed"):
        asyncio.run(forget())
        gc.collect()


async def test_several_nodes_in_one_loop_find_each_other(group: str) -> None:
    async with jaus.Node("101.1", loopback=True, group=group) as first:
        async with jaus.Node("102.1", loopback=True, group=group) as second:
            async with sensor_of(first) as sensor, second.component(1) as operator:
                sensor.publish(velocity(2))
                assert await operator.find(QueryVelocityState) == sensor.id
                await operator.query(sensor.id, QueryVelocityState())


def _in_child(node: jaus.Node, group: str, results: Any) -> None:
    async def use() -> str:
        try:
            node.dropped_events  # noqa: B018
        except jaus.ForkError as error:
            async with jaus.Node("43.1", loopback=True, group=group) as own:
                async with own.component(1):
                    return str(error)
        return "no error"

    results.put(asyncio.run(use()))
    results.close()
    results.join_thread()
    os._exit(0)


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
async def test_a_child_process_cannot_use_the_node_of_its_parent_but_one_of_its_own(
    node: jaus.Node, group: str
) -> None:
    context = multiprocessing.get_context("fork")
    results = context.Queue()
    child = context.Process(target=_in_child, args=(node, group, results))
    child.start()
    text = await within(asyncio.to_thread(results.get, True, LIMIT))
    assert "parent process" in text
    await asyncio.to_thread(child.join, LIMIT)
    assert node.dropped_events == 0


async def test_the_log_goes_to_the_logger_jaus(
    node: jaus.Node, operator: jaus.Component, caplog: pytest.LogCaptureFixture
) -> None:
    motor = Motor()
    caplog.set_level(logging.WARNING, "jaus")
    async with driver_of(node, motor) as driver:
        async with operator.control(driver.id) as control:
            await control.resume()
            control.send(set_effort(30))
            await until(lambda: "but the client sent it once" in caplog.text)
            status = await operator.query(driver.id, QueryStatus())
            assert status.status == jaus.State.READY
