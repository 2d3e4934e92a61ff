"""The library's log, in Python's ``logging``."""

from __future__ import annotations

import logging

from . import _jaus

log = logging.getLogger("jaus")


def _pass_on(level: int, text: str) -> None:
    log.log(level, "%s", text)


def follow_level() -> None:
    """Passes the library's log on to the logger ``jaus``, with the level that this has now."""
    _jaus.set_log(_pass_on, min(log.getEffectiveLevel(), 255))
