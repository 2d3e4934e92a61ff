"""A velocity sensor. The operator's example subscribes to it."""

from __future__ import annotations

import asyncio

from place import place

from jaus.messages import mobility


async def main() -> None:
    # ANCHOR: sensor
    async with place(101) as node:
        sensor = node.component(44, kind="vehicle", name="Rover")
        sensor.publishes(mobility.QueryVelocityState)
        sensor.declines(mobility.QueryVelocityStateExt)
        async with sensor:
            print(sensor.id, "is up", flush=True)
            speed = 0.0
            while True:
                sensor.publish(mobility.ReportVelocityState(velocity_x_m_per_s=speed))
                speed = speed + 0.1 if speed < 2 else 0.0
                await asyncio.sleep(0.05)
    # ANCHOR_END: sensor


asyncio.run(main())
