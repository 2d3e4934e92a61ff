"""The messages of the tests: those of built-in services, and one of a service of the program's own."""

from __future__ import annotations

from pathlib import Path

from jaus.messages import load
from jaus.messages.core import QueryStatus
from jaus.messages.mobility import (
    QueryVelocityState,
    QueryVelocityStateExt,
    QueryWrenchEffort,
    ReportVelocityState,
    SetWrenchEffort,
)

__all__ = [
    "Note",
    "QueryStatus",
    "QueryVelocityState",
    "QueryVelocityStateExt",
    "QueryWrenchEffort",
    "ReportVelocityState",
    "SetWrenchEffort",
    "set_effort",
    "velocity",
]

Note = load(Path(__file__).with_name("notes.xml")).Note


def set_effort(percent: float) -> SetWrenchEffort:
    """A command with the forward effort."""
    return SetWrenchEffort(propulsive_linear_effort_x_percent=percent)


def velocity(forward: float) -> ReportVelocityState:
    """A report of the forward velocity in m/s."""
    return ReportVelocityState(velocity_x_m_per_s=forward)
