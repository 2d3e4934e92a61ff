"""A primitive driver: it obeys the client in control while it is ready. The operator's example drives it."""

from __future__ import annotations

import asyncio
import threading
import time

from place import place

import jaus
from jaus.messages import mobility


def say(line: str) -> None:
    """Prints a line with one write: two threads do."""
    print(f"{line}\n", end="", flush=True)


class Motor:
    """A motor that gets its effort every 50 ms. A real one stops by itself 200 ms after the last command, for the
    case that this program dies.
    """

    def __init__(self) -> None:
        self.effort = 0.0
        threading.Thread(target=self._run, daemon=True).start()

    def _run(self) -> None:
        last = -1.0
        while True:
            effort = self.effort
            if effort or last:
                say(f"motor {effort:g}")
            last = effort
            time.sleep(0.05)


async def main() -> None:
    motor = Motor()
    # ANCHOR: driver
    async with place(102) as node:
        driver = node.component(33, kind="vehicle", name="Rover", management=True)
        driver.declines(mobility.QueryWrenchEffort)

        @driver.command(mobility.SetWrenchEffort)
        def drive(effort: mobility.SetWrenchEffort, sender: jaus.JausId) -> None:
            motor.effort = effort.propulsive_linear_effort_x_percent or 0.0

        @driver.on_stop
        def stop() -> None:
            motor.effort = 0.0

        @driver.on_standing
        def show(standing: jaus.Standing) -> None:
            say(f"state {standing.state.value}")

        async with driver:
            say(f"{driver.id} is up")
            await asyncio.Event().wait()
    # ANCHOR_END: driver


asyncio.run(main())
