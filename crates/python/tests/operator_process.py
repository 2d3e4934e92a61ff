"""An operator that drives at 40 % and then ends as told: ``SUBSYSTEM GROUP HOW``."""

from __future__ import annotations

import asyncio
import signal
import sys
import time

from messages import SetWrenchEffort, set_effort

import jaus


async def main(subsystem: str, group: str, how: str) -> None:
    node = jaus.Node(f"{subsystem}.1", loopback=True, group=group)
    if how == "leave":
        await drive(await node.start(), how)
    else:
        async with node:
            await drive(node, how)


async def drive(node: jaus.Node, how: str) -> None:
    operator = await node.component(1, kind="ocu", name="Operator").start()
    driver = await operator.find(SetWrenchEffort)
    control = await operator.control(driver, watch=None if how == "unwatched" else 0.5)
    await control.resume()
    await control.deliver(set_effort(40))
    print("drives")
    if how == "sleep":
        time.sleep(3600)
    # What has arrived may still wait there, and the release would overtake it.
    await asyncio.sleep(0.2 if how == "leave" else 3600)


if __name__ == "__main__":
    # A shell ignores it for what it runs in the background.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    asyncio.run(main(*sys.argv[1:]))
