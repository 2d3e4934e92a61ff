"""JAUS messages of capture files: pcap and pcapng, as tcpdump and Wireshark write them.

For example:

    import jaus.capture

    for record in jaus.capture.read("drive.pcapng"):
        print(record.time, record.source, record.message or record.error)
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import Any

from jaus import _jaus
from jaus.errors import CaptureError, DecodeError
from jaus.messages import Message, Unknown, _library, decode
from jaus.messages._text import described

__all__ = ["CaptureError", "Record", "read"]

_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


@dataclass(frozen=True, repr=False)
class Record:
    """A message of a capture, or the reason why it cannot be read."""

    #: Capture time (UTC) in microseconds, if the capture has it. `to_json` has all its digits.
    time: datetime | None
    #: The sender, such as `101.1.33`.
    source: str | None
    #: The destination; 255 and 65535 mean all.
    destination: str | None
    #: Address and port of the sender.
    source_address: tuple[str, int] | None
    #: Address and port of the destination: a node or a multicast group.
    destination_address: tuple[str, int] | None
    #: The message; `None` if it cannot be read.
    message: Message | Unknown | None
    #: Why there is no message.
    error: str | None
    #: The message from its code on, if there is one.
    octets: bytes | None
    #: The line of `jaus watch --json`.
    line: str

    def to_json(self) -> dict[str, Any]:
        """The object that `jaus watch --json` prints for the message."""
        view: dict[str, Any] = json.loads(self.line)
        return view

    def __repr__(self) -> str:
        time = self.time.isoformat() if self.time else "?"
        content = described(self.message) if self.error is None else self.error
        return f"<{time} {self.source or '?'} → {self.destination or '?'}: {content}>"


def read(
    path: str | os.PathLike[str],
    filter: str = "",
    definitions: Iterable[str | os.PathLike[str]] = (),
) -> Iterator[Record]:
    """Reads the messages of a capture one by one, so the file may be larger than memory.

    Messages are recognised on any UDP and TCP port. Large messages are put together, and messages that
    were sent repeatedly, or captured on several links, come once. `filter` selects messages as
    `jaus watch` does, for example `message=ReportVelocityState from=101.1`.

    `definitions` are files or directories with your own services (JSIDL); those of
    `jaus.messages.load` are known already.

    A part of the file that is damaged or missing is a record with an `error`. Raises `CaptureError` if
    the file is no capture, and `OSError` if it cannot be opened.
    """
    for source in definitions:
        _library.load((os.path.abspath(os.fspath(source)),), skip_errors=False)
    loaded = [path for library in _library.libraries() for path in library.source or ()]
    reader = _jaus.CaptureReader(os.fspath(path), filter, loaded)
    return (_record(fields) for fields in reader)


def _record(fields: tuple[Any, ...]) -> Record:
    time, (source, destination), addresses, octets, has_body, error, line = fields
    message: Message | Unknown | None = None
    if octets is not None and error is None and not has_body:
        # Of the Reference Architecture, whose codes are those of other messages.
        message = Unknown(int.from_bytes(octets[:2], "little"), octets)
    elif octets is not None and error is None:
        try:
            message = decode(octets)
        except DecodeError as problem:
            error = str(problem)
    return Record(
        _time(time),
        source,
        destination,
        addresses[0] if addresses else None,
        addresses[1] if addresses else None,
        message,
        error,
        octets,
        line,
    )


def _time(time: tuple[int, int] | None) -> datetime | None:
    if time is None:
        return None
    seconds, nanoseconds = time
    try:
        return _EPOCH + timedelta(seconds=seconds, microseconds=nanoseconds // 1000)
    except OverflowError:
        # A time stamp that no calendar has.
        return None
