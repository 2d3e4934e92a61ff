"""The README's component: reports its position to queries and subscriptions, until Ctrl-C."""

import asyncio

import jaus
from jaus.messages import mobility


async def main() -> None:
    async with jaus.Node("107.1", loopback=True) as node:
        rover = node.component(53, kind="vehicle", name="Rover")
        rover.publishes(mobility.QueryNavigation)
        async with rover:
            rover.publish(mobility.ReportNavigation(report_local_pose_ext_rec={"x_m": 2.5}))
            await asyncio.Event().wait()


asyncio.run(main())
