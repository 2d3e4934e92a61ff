"""An operator: shows the speed that a sensor reports, and drives for three seconds."""

from __future__ import annotations

import asyncio

from place import place

import jaus
from jaus.messages import mobility


# ANCHOR: operator
async def show(console: jaus.Component) -> None:
    sensor = await console.find("urn:jaus:jss:mobility:VelocityStateSensor")
    speeds = console.subscribe(sensor, mobility.QueryVelocityState(), hz=10)
    async for update in speeds.updates():
        if isinstance(update, jaus.Down):
            print("no speed:", update.why, flush=True)
        elif not isinstance(update, jaus.Up):
            print(f"{update.velocity_x_m_per_s:g} m/s, {speeds.lost} lost", flush=True)


async def drive(console: jaus.Component) -> None:
    driver = await console.find("urn:jaus:jss:mobility:PrimitiveDriver")
    async with console.control(driver, authority=127) as control:
        await control.resume()
        for _ in range(30):
            control.send(mobility.SetWrenchEffort(propulsive_linear_effort_x_percent=40))
            await asyncio.sleep(0.1)
        await control.standby()


async def main() -> None:
    async with place(42) as node, node.component(1, kind="ocu", name="Operator") as console:
        showing = asyncio.create_task(show(console))
        await drive(console)
        showing.cancel()
    # ANCHOR_END: operator
    print("done")


asyncio.run(main())
