"""The exceptions of the package."""

from __future__ import annotations


class Error(Exception):
    """The base class of the package's exceptions."""


class FieldError(Error, ValueError):
    """A value that the definition of a message does not permit.

    `message` is the message's name, and `path` the way to the field in the names of the definition,
    such as `NodeList[2].NodeID`. Both are empty while the field belongs to no message.
    """

    def __init__(self, text: str, message: str = "", path: str = "") -> None:
        super().__init__(text)
        self.message = message
        self.path = path

    def __reduce__(self) -> tuple[object, ...]:
        return type(self), (str(self), self.message, self.path)


class DecodeError(Error, ValueError):
    """Octets that are not a message of the type.

    `message` is the message's name, `path` the way to the field in the names of the definition, and
    `offset` the octet at which the field begins, from 0.
    """

    def __init__(self, text: str, message: str = "", path: str = "", offset: int = 0) -> None:
        super().__init__(text)
        self.message = message
        self.path = path
        self.offset = offset

    def __reduce__(self) -> tuple[object, ...]:
        return type(self), (str(self), self.message, self.path, self.offset)


class DefinitionError(Error, ValueError):
    """Definitions of services with errors: the text has file, line and column of each."""


class CaptureError(Error, ValueError):
    """A file that is not a pcap or pcapng capture."""
