"""The few messages that the tests need, encoded by hand: a code, a presence vector, and one field."""

from __future__ import annotations

from typing import Any, ClassVar

import jaus


class Message:
    code: ClassVar[int]
    name: ClassVar[str]
    service: ClassVar[str] = "urn:jaus:jss:mobility:VelocityStateSensor"
    version: ClassVar[str] = "1.1"
    report: ClassVar[Any] = None
    is_command: ClassVar[bool] = False
    #: The range of the field, and its width in octets.
    scale: ClassVar[tuple[float, float, int]] = (0, 0, 0)

    def __init__(self, value: float | None = None) -> None:
        self.value = value

    def __repr__(self) -> str:
        return f"{self.name}({self.value})"

    def encode(self) -> bytes:
        low, high, width = self.scale
        octets = self.code.to_bytes(2, "little") + b"\x01\x00"
        if self.value is None:
            return octets
        steps: int = 256**width - 1
        number = int(round((self.value - low) / (high - low) * steps))
        return octets + number.to_bytes(width, "little")

    @classmethod
    def decode(cls, octets: bytes) -> Message:
        low, high, width = cls.scale
        if len(octets) < 4 + width or int.from_bytes(octets[:2], "little") != cls.code:
            raise jaus.DecodeError(f"{octets!r} is no {cls.name}")
        number = int.from_bytes(octets[4 : 4 + width], "little")
        return cls(low + number / max(1, 256**width - 1) * (high - low))


class ReportVelocityState(Message):
    code, name, scale = 0x4404, "ReportVelocityState", (-327.68, 327.67, 4)


class QueryVelocityState(Message):
    code, name, report = 0x2404, "QueryVelocityState", ReportVelocityState


class ReportVelocityStateExt(Message):
    code, name = 0x44A4, "ReportVelocityStateExt"


class QueryVelocityStateExt(Message):
    code, name, report = 0x24A4, "QueryVelocityStateExt", ReportVelocityStateExt


class ReportWrenchEffort(Message):
    code, name = 0x4405, "ReportWrenchEffort"
    service = "urn:jaus:jss:mobility:PrimitiveDriver"


class QueryWrenchEffort(Message):
    code, name, report = 0x2405, "QueryWrenchEffort", ReportWrenchEffort
    service = "urn:jaus:jss:mobility:PrimitiveDriver"


class SetWrenchEffort(Message):
    code, name, scale = 0x0405, "SetWrenchEffort", (-100, 100, 2)
    service = "urn:jaus:jss:mobility:PrimitiveDriver"
    is_command = True


class ReportStatus(Message):
    code, name, scale = 0x4002, "ReportStatus", (0, 255, 1)
    service, version = "urn:jaus:jss:core:Management", "1.1"

    @classmethod
    def decode(cls, octets: bytes) -> Message:
        return cls(octets[2])


class QueryStatus(Message):
    code, name, report = 0x2002, "QueryStatus", ReportStatus
    service, version = "urn:jaus:jss:core:Management", "1.1"

    def encode(self) -> bytes:
        return self.code.to_bytes(2, "little")


class Note(Message):
    """A message of a service of the program's own."""

    code, name, scale = 0xD001, "Note", (0, 255, 1)
    service, version = "urn:example:notes", "1.0"
