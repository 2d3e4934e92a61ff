"""Problems of values, before it is known in which message they are."""

from __future__ import annotations

import difflib
import reprlib
from collections.abc import Iterable
from typing import NoReturn

from jaus.errors import FieldError

_repr = reprlib.Repr()
_repr.maxstring = _repr.maxother = 60


class Problem(Exception):
    """A value that its field cannot hold, and the way to it, innermost step first."""

    def __init__(self, text: str, is_type: bool = False) -> None:
        super().__init__(text)
        self.text = text
        self.is_type = is_type
        self.steps: list[str] = []

    def under(self, step: str) -> Problem:
        """The same problem, seen from outside a member `name` or an element `[index]`."""
        self.steps.append(step)
        return self

    def path(self) -> str:
        path = ""
        for step in reversed(self.steps):
            path += step if not path or step.startswith("[") else f".{step}"
        return path

    def throw(self, message: str = "") -> NoReturn:
        """Raises `FieldError`, or `TypeError` if the value has a type that no field could hold."""
        path = self.path()
        text = ": ".join(part for part in (message, path, self.text) if part)
        if self.is_type:
            raise TypeError(text) from None
        raise FieldError(text, message, path) from None


def expected(what: str, value: object) -> Problem:
    return Problem(f"{shown(value)}, but the definition has {what}", is_type=True)


def shown(value: object) -> str:
    """A value in an error, shortened."""
    if isinstance(value, int) and value.bit_length() > 200:
        return f"an integer of {value.bit_length()} bits"
    try:
        return _repr.repr(value)
    except Exception:
        return f"a {type(value).__name__}"


def unknown_field(owner: str, name: str, known: Iterable[str]) -> TypeError:
    """The error for a keyword that is no field, with the most similar field."""
    names = list(known)
    similar = difflib.get_close_matches(name, names, n=1, cutoff=0.5)
    if not similar:
        # A field without its unit, or with a part of its name.
        similar = [it for it in names if it.startswith(name[:3]) or name in it][:1]
    if similar:
        advice = f"; did you mean {similar[0]}?"
    elif names:
        advice = f"; it has {', '.join(names[:20])}"
    else:
        advice = "; it has none"
    return TypeError(f"{owner} has no field {name[:100]}{advice}")
