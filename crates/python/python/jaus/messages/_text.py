"""Messages as text for people: `repr`, and tables for notebooks."""

from __future__ import annotations

from collections.abc import Iterator
from enum import IntEnum
from html import escape
from itertools import islice
from typing import Any

#: Elements of a list, octets of a blob and rows of a table that are shown.
MOST_ELEMENTS = 20
MOST_OCTETS = 64
MOST_CHARACTERS = 400
MOST_ROWS = 200


def described(value: Any) -> str:
    """`repr`, shortened if it is long."""
    if isinstance(value, IntEnum):
        return f"{type(value).__name__}.{value.name}"
    if isinstance(value, bytes) and len(value) > MOST_OCTETS:
        return f"<{len(value)} octets: {value[:16].hex()}…>"
    if isinstance(value, str) and len(value) > MOST_CHARACTERS:
        return f"<{len(value)} characters: {value[:40]!r}…>"
    if isinstance(value, list):
        parts = [described(element) for element in value[:MOST_ELEMENTS]]
        if len(value) > MOST_ELEMENTS:
            parts.append(f"… {len(value) - MOST_ELEMENTS} more")
        return f"[{', '.join(parts)}]"
    return repr(value)


def table(value: Any) -> str:
    """An HTML table of field, value and unit."""
    rows = list(islice(_rows(value, "", 0), MOST_ROWS + 1))
    body = "".join(
        f"<tr><td style='text-align:left'>{escape(name)}</td>"
        f"<td style='text-align:left'>{escape(text)}</td><td>{escape(units)}</td></tr>"
        for name, text, units in rows[:MOST_ROWS]
    )
    if len(rows) > MOST_ROWS:
        body += "<tr><td colspan='3'>…</td></tr>"
    head = "<tr><th>field</th><th>value</th><th>unit</th></tr>"
    return f"<table><caption>{escape(type(value).__name__)}</caption>{head}{body}</table>"


def _rows(value: Any, path: str, depth: int) -> Iterator[tuple[str, str, str]]:
    for name, content, units in value._fields():
        yield from _field(f"{path}{name}", content, units, depth)


def _field(path: str, value: Any, units: str, depth: int) -> Iterator[tuple[str, str, str]]:
    is_nested = depth < 50
    if is_nested and hasattr(value, "_fields"):
        yield from _rows(value, f"{path}.", depth + 1)
    elif is_nested and isinstance(value, list) and any(hasattr(it, "_fields") for it in value):
        for at, element in enumerate(value):
            yield from _field(f"{path}[{at}]", element, units, depth + 1)
    else:
        yield path, described(value), "" if units == "one" else units
