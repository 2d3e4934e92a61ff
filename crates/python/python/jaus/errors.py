"""The exceptions of the package. Their texts say what to do."""

from __future__ import annotations

__all__ = [
    "ArgumentError",
    "CaptureError",
    "ClosedError",
    "ControlLostError",
    "DecodeError",
    "DefinitionError",
    "Error",
    "FieldError",
    "ForkError",
    "LimitError",
    "NoAnswerError",
    "NotFoundError",
    "NotReadyError",
    "RefusedError",
    "SendError",
    "StartError",
    "StateError",
    "UnsafeServiceError",
]


class Error(Exception):
    """The base of all exceptions of the package."""


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


class ArgumentError(Error, ValueError):
    """An argument is out of range or malformed."""


class StateError(Error, RuntimeError):
    """The call does not fit the state of its object, for instance a setting after the start."""


class ClosedError(Error, RuntimeError):
    """The node, component, subscription or control is closed."""


class ForkError(Error, RuntimeError):
    """The object belongs to the parent process."""


class LimitError(Error, RuntimeError):
    """A limit is reached: of services, requests, subscriptions or controls."""


class StartError(Error, OSError):
    """The node or the component could not be started."""


class UnsafeServiceError(Error):
    """A service lacks what makes it safe: Management, a stop function, or an answer to a query."""


class NotFoundError(Error, LookupError):
    """No component with the service was found in time, or the peer does not offer it."""


class NoAnswerError(Error, TimeoutError):
    """The peer did not answer in time."""


class SendError(Error, OSError):
    """The message could not be sent, or its delivery is not confirmed."""


class RefusedError(Error):
    """The peer refuses: control, a subscription, or a state."""


class ControlLostError(Error):
    """Control of the peer is lost."""


class NotReadyError(Error):
    """The peer is under control, but not ready for commands; ``await control.resume()`` may help."""
