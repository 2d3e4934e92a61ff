"""Where an example runs: ``SUBSYSTEM [GROUP]`` for a node of its own on loopback, or ``--attach ADDRESS`` for the node
of this host.
"""

from __future__ import annotations

import sys

import jaus


def place(subsystem: int) -> jaus.Node:
    arguments = sys.argv[1:]
    if len(arguments) > 1 and arguments[0] == "--attach":
        return jaus.Node(host=arguments[1])
    if arguments:
        subsystem = int(arguments[0])
    group = arguments[1] if len(arguments) > 1 else None
    return jaus.Node(f"{subsystem}.1", loopback=True, group=group)
