"""The examples, as processes. The tests of ``crates/c`` mix them with programs in other languages."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

from conftest import Program, within

import jaus

EXAMPLES = Path(__file__).parent.parent / "examples"

Start = Callable[..., Program]


def command(name: str) -> list[str]:
    """The program of an example."""
    # A script with the name of a module of the standard library would hide that.
    source = "console" if name == "operator" else name
    return [sys.executable, str(EXAMPLES / f"{source}.py")]


async def test_sensor_driver_and_operator_work_together(group: str, start_command: Start) -> None:
    places = (("sensor", "101"), ("driver", "102"), ("operator", "42"))
    programs = [start_command(*command(name), id, group) for name, id in places]
    await work_together(*programs)


async def test_they_attach_to_the_node_of_the_host(
    group: str, tmp_path: Path, start_command: Start
) -> None:
    socket = str(tmp_path / "node.sock")
    async with jaus.Node("101.1", loopback=True, group=group, local=socket):
        programs = [
            start_command(*command(name), "--attach", socket)
            for name in ("sensor", "driver", "operator")
        ]
        await work_together(*programs)


async def work_together(_sensor: Program, driver: Program, operator: Program) -> None:
    speed = await operator.expect("", lambda line: "m/s" in line)
    assert 0 <= float(speed.split()[0]) <= 2.2
    await driver.expect("motor 39.9", lambda line: line.startswith(("motor 40", "motor 39.9")))
    await operator.expect("done")
    await driver.expect("motor 0", lambda line: line == "motor 0")
    assert await within(operator.code()) == 0
