"""The README's speed sensor: reports its speed to queries and subscriptions, until Ctrl-C."""

import asyncio

import jaus
from jaus.messages import mobility


async def main() -> None:
    async with jaus.Node("107.1", loopback=True) as node:
        rover = node.component(44, kind="vehicle", name="Rover")
        rover.publishes(mobility.QueryVelocityState, version="1.0")
        async with rover:
            rover.publish(mobility.ReportVelocityState(velocity_x_m_per_s=1.5))
            await asyncio.Event().wait()


asyncio.run(main())
