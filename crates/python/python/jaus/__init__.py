"""SAE JAUS nodes, components and clients for asyncio.

A sensor, and a client that asks it::

    import asyncio, jaus
    from jaus.messages import mobility

    async def main():
        async with jaus.Node("107.1", loopback=True) as node:
            rover = node.component(44, kind="vehicle", name="Rover")
            rover.publishes(mobility.QueryVelocityState)
            rover.declines(mobility.QueryVelocityStateExt)
            async with rover, node.component(1, kind="ocu", name="Operator") as operator:
                rover.publish(mobility.ReportVelocityState(velocity_x_m_per_s=1.5))
                print(await operator.query(rover.id, mobility.QueryVelocityState()))

    asyncio.run(main())
"""

from ._jaus import JausId, __version__
from .component import Component, Standing, State
from .control import Control
from .errors import (
    ArgumentError,
    CaptureError,
    ClosedError,
    ControlLostError,
    DecodeError,
    DefinitionError,
    Error,
    FieldError,
    ForkError,
    LimitError,
    NoAnswerError,
    NotFoundError,
    NotReadyError,
    RefusedError,
    SendError,
    StartError,
    StateError,
    UnsafeServiceError,
)
from .node import Node
from .subscription import Down, Subscription, Up

__all__ = [
    "ArgumentError",
    "CaptureError",
    "ClosedError",
    "Component",
    "Control",
    "ControlLostError",
    "DecodeError",
    "DefinitionError",
    "Down",
    "Error",
    "FieldError",
    "ForkError",
    "JausId",
    "LimitError",
    "NoAnswerError",
    "Node",
    "NotFoundError",
    "NotReadyError",
    "RefusedError",
    "SendError",
    "Standing",
    "StartError",
    "State",
    "StateError",
    "Subscription",
    "UnsafeServiceError",
    "Up",
    "__version__",
]
