"""The examples, as processes: sensor, driver and operator, also mixed with those in C++.

``JAUS_CPP_EXAMPLES`` names the folder of the programs that ``make`` builds in ``crates/c/examples``.
"""

from __future__ import annotations

import itertools
import os
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from conftest import Program, within

import jaus

pytest.importorskip("jaus.messages")

EXAMPLES = Path(__file__).parent.parent / "examples"
CPP = os.environ.get("JAUS_CPP_EXAMPLES")
LANGUAGES = ["python", "cpp"] if CPP else ["python"]

Start = Callable[..., Program]


def command(language: str, name: str) -> list[str]:
    """The program of an example."""
    if language == "cpp":
        assert CPP is not None
        return [str(Path(CPP) / name)]
    # A script with the name of a module of the standard library would hide that.
    source = "console" if name == "operator" else name
    return [sys.executable, str(EXAMPLES / f"{source}.py")]


@pytest.mark.parametrize("languages", list(itertools.product(LANGUAGES, repeat=3)))
async def test_sensor_driver_and_operator_work_together(
    languages: tuple[str, str, str], group: str, start_command: Start
) -> None:
    names = ("sensor", "driver", "operator")
    ids = ("101", "102", "42")
    programs = [
        start_command(*command(language, name), id, group)
        for language, name, id in zip(languages, names, ids, strict=True)
    ]
    await work_together(*programs)


async def test_they_attach_to_the_node_of_the_host(
    group: str, tmp_path: Path, start_command: Start
) -> None:
    socket = str(tmp_path / "node.sock")
    async with jaus.Node("101.1", loopback=True, group=group, local=socket):
        programs = [
            start_command(*command("python", name), "--attach", socket)
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
