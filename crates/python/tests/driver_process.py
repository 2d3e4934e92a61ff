"""A driver that hangs at an effort above 50 %: ``SUBSYSTEM GROUP HOW``."""

from __future__ import annotations

import asyncio
import sys
import threading
import time
from typing import Any

from conftest import Motor, driver_of

import jaus


def say(line: str) -> None:
    """Prints a line with one write: several threads do."""
    print(f"{line}\n", end="", flush=True)


async def main(subsystem: str, group: str, how: str) -> None:
    motor = Motor()

    def drive(effort: Any, _sender: jaus.JausId) -> None:
        say(f"handles {effort.propulsive_linear_effort_x_percent:.0f}")
        if effort.propulsive_linear_effort_x_percent <= 50:
            motor.effort = effort.propulsive_linear_effort_x_percent
            return
        if how == "sleep":
            time.sleep(3600)
        elif how == "spin":
            while True:
                pass
        elif how == "late":
            # Until it is stopped beside this.
            stops = motor.stops
            while motor.stops == stops:
                time.sleep(0.01)
            motor.effort = effort.propulsive_linear_effort_x_percent

    def show() -> None:
        last: Any = None
        while True:
            if motor.effort != last:
                last = motor.effort
                say(f"motor {round(last)}")
            time.sleep(0.01)

    async with jaus.Node(f"{subsystem}.1", loopback=True, group=group) as node:
        driver = driver_of(node, motor, drive, validity="until-done")

        @driver.on_standing
        def standing(standing: jaus.Standing) -> None:
            say(f"state {standing.state.name.lower()}, effort {round(motor.effort or 0)}")

        @driver.on_stop
        def stop() -> None:
            # Before a handler that waits for the stop goes on, so that its lines follow this one.
            say("stop")
            motor.stop()

        threading.Thread(target=show, daemon=True).start()
        async with driver:
            say("up")
            await asyncio.sleep(3600)


if __name__ == "__main__":
    asyncio.run(main(*sys.argv[1:]))
