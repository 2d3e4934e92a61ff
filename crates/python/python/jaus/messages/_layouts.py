"""Layouts: how the values of fields are checked, shown and laid out.

Each layout has three methods. `public` turns a part of the codec's tree into the value that an
application sees; `check` turns what an application sets into such a value, or raises `Problem`;
`tree` is the reverse of `public`. Lists are mutable, so `tree` checks their elements again.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Mapping
from enum import IntEnum
from typing import Any

from jaus import _jaus
from jaus.messages import _records, _values
from jaus.messages._problems import Problem, expected, shown

# Name in the language, least and greatest number.
INTEGERS = {
    "u8": ("unsigned byte", 0, 0xFF),
    "u16": ("unsigned short integer", 0, 0xFFFF),
    "u32": ("unsigned integer", 0, 0xFFFF_FFFF),
    "u64": ("unsigned long integer", 0, 2**64 - 1),
    "i8": ("byte", -0x80, 0x7F),
    "i16": ("short integer", -0x8000, 0x7FFF),
    "i32": ("integer", -0x8000_0000, 0x7FFF_FFFF),
    "i64": ("long integer", -(2**63), 2**63 - 1),
}


def real(value: Any) -> float:
    """A number of an application as `float`."""
    if isinstance(value, (str, bytes, bytearray)) or not hasattr(type(value), "__float__"):
        raise expected("a number", value)
    try:
        return float(value)
    except OverflowError:
        raise Problem(f"{shown(value)} does not fit long float") from None
    except (TypeError, ValueError):
        raise expected("a number", value) from None


class Layout:
    """A layout whose tree is the public value."""

    #: The type in help texts.
    hint = ""

    def public(self, tree: Any) -> Any:
        return tree

    def check(self, value: Any) -> Any:
        raise NotImplementedError

    def tree(self, value: Any) -> Any:
        return self.check(value)

    def empty(self) -> Any:
        """The value of a member that is not given; `None` if one must be given."""
        return None


class Integer(Layout):
    hint = "int"

    def __init__(self, number: str) -> None:
        self.name, self.least, self.greatest = INTEGERS[number]

    def check(self, value: Any) -> int:
        try:
            number = operator.index(value)
        except TypeError:
            raise expected("an integer", value) from None
        if not self.least <= number <= self.greatest:
            raise Problem(f"{shown(number)} does not fit {self.name}")
        return number


class Double(Layout):
    hint = "float"

    def check(self, value: Any) -> float:
        return real(value)


class Single(Layout):
    """A number of four octets, as the decimal with the fewest digits that stands for it."""

    hint = "float"

    def check(self, value: Any) -> float:
        number = _jaus.single(real(value))
        if number is None:
            raise Problem(f"{shown(value)} does not fit float")
        return number


class Named(Layout):
    """An integer with named values; others are preserved."""

    def __init__(self, number: str, names: type[IntEnum]) -> None:
        self.integer = Integer(number)
        self.names = names._value2member_map_
        self.hint = f"{names.__name__} | int"

    def public(self, tree: int) -> Any:
        return self.names.get(tree, tree)

    def check(self, value: Any) -> Any:
        return self.public(self.integer.check(value))

    def tree(self, value: Any) -> int:
        return self.integer.check(value)


class Scaled(Layout):
    """A real number in a range. As an element it is a `float`; members store the integer."""

    hint = "float"

    def __init__(self, type_: type[_values.Scaled]) -> None:
        self.type = type_
        self.units = type_.units

    def public(self, tree: int) -> Any:
        return self.type._scale.value(tree)

    def raw(self, value: Any) -> int:
        """The integer for a number, or that of a `Scaled` with the same scale."""
        if isinstance(value, _values.Scaled):
            if not value.has_scale_of(self.type):
                raise expected(f"a {self.type.__name__}", value)
            return value.raw
        return self.type._raw(real(value))

    def check(self, value: Any) -> Any:
        return self.public(self.raw(value))

    def tree(self, value: Any) -> int:
        return self.raw(value)


class Text(Layout):
    hint = "str | bytes"

    def __init__(self, least: int, most: int, is_fixed: bool) -> None:
        self.least, self.most, self.is_fixed = least, most, is_fixed

    def public(self, tree: bytes) -> str | bytes:
        try:
            return tree.decode()
        except UnicodeDecodeError:
            return tree

    def check(self, value: Any) -> str | bytes:
        self.tree(value)
        return value if isinstance(value, str) else bytes(value)

    def tree(self, value: Any) -> bytes:
        if isinstance(value, str):
            try:
                octets = value.encode()
            except UnicodeEncodeError:
                raise Problem("half of a surrogate pair") from None
        elif isinstance(value, (bytes, bytearray, memoryview)):
            octets = bytes(value)
        else:
            raise expected("a string", value)
        length = len(octets)
        if self.is_fixed and length > self.most:
            raise Problem(f"{length} octets of text in a field of {self.most}")
        check_count(length, self.least, self.most)
        return octets

    def empty(self) -> str | None:
        return "" if self.least == 0 else None


class Blob(Layout):
    hint = "bytes"

    def __init__(self, least: int, most: int) -> None:
        self.least, self.most = least, most

    def check(self, value: Any) -> bytes:
        if not isinstance(value, (bytes, bytearray, memoryview)):
            raise expected("octets", value)
        octets = bytes(value)
        check_count(len(octets), self.least, self.most)
        return octets

    def empty(self) -> bytes | None:
        return b"" if self.least == 0 else None


class Formatted(Layout):
    hint = "Formatted"

    def __init__(self, formats: type[IntEnum], least: int, most: int) -> None:
        self.format = Named("u8", formats)
        self.data = Blob(least, most)

    def public(self, tree: tuple[int, bytes]) -> _values.Formatted:
        return _values.Formatted(self.format.public(tree[0]), tree[1])

    def check(self, value: Any) -> _values.Formatted:
        if not isinstance(value, _values.Formatted):
            raise expected("octets in a format", value)
        return _values.Formatted(self.format.check(value.format), self.data.check(value.data))

    def tree(self, value: Any) -> tuple[int, bytes]:
        checked = self.check(value)
        return int(checked.format), checked.data


class List(Layout):
    def __init__(self, element: Layout, least: int, most: int) -> None:
        self.element, self.least, self.most = element, least, most
        self.hint = f"list[{element.hint}]"

    def public(self, tree: list[Any]) -> list[Any]:
        public = self.element.public
        return [public(element) for element in tree]

    def check(self, value: Any) -> list[Any]:
        return each(self.element.check, sequence(value, self.least, self.most))

    def tree(self, value: Any) -> list[Any]:
        return each(self.element.tree, sequence(value, self.least, self.most))

    def empty(self) -> list[Any] | None:
        return [] if self.least == 0 else None


class Array(Layout):
    """Nested lists; the first dimension varies fastest on the wire. The language limits their size."""

    def __init__(self, element: Layout, dimensions: list[int]) -> None:
        self.element, self.dimensions = element, dimensions
        self.hint = element.hint
        for _ in dimensions:
            self.hint = f"list[{self.hint}]"

    def public(self, tree: list[Any]) -> Any:
        return self._nested([self.element.public(element) for element in tree], 0, 1, 0)

    def _nested(self, elements: list[Any], dimension: int, stride: int, first: int) -> Any:
        if dimension == len(self.dimensions):
            return elements[first]
        size = self.dimensions[dimension]
        return [
            self._nested(elements, dimension + 1, stride * size, first + at * stride)
            for at in range(size)
        ]

    def check(self, value: Any) -> Any:
        return self.public(self.tree(value))

    def tree(self, value: Any) -> list[Any]:
        elements: list[Any] = [None] * math.prod(self.dimensions)
        self._place(value, elements, 0, 1, 0)
        return elements

    def _place(
        self, value: Any, elements: list[Any], dimension: int, stride: int, first: int
    ) -> None:
        if dimension == len(self.dimensions):
            elements[first] = self.element.tree(value)
            return
        size = self.dimensions[dimension]
        inner = sequence(value, 0, 2**64)
        if len(inner) != size:
            raise Problem(f"{len(inner)} slots, but the definition has {size}")
        for at, one in enumerate(inner):
            try:
                self._place(one, elements, dimension + 1, stride * size, first + at * stride)
            except Problem as problem:
                raise problem.under(f"[{at}]")


class Defined(Layout):
    """A value of a class of the message: a record, bit field, variant or measure."""

    def __init__(
        self, type_: type[_records.Record | _values.Bits | _values.OneOf], what: str
    ) -> None:
        self.type, self.what = type_, what
        self.hint = type_.__name__
        self.public = type_._of_tree  # type: ignore[method-assign]

    def check(self, value: Any) -> Any:
        if isinstance(value, self.type):
            return value
        if isinstance(value, Mapping) and all(isinstance(key, str) for key in value):
            return self.type(**value)
        raise expected(self.what, value)

    def tree(self, value: Any) -> Any:
        return self.check(value)._tree()


def check_count(count: int, least: int, most: int) -> None:
    if not least <= count <= most:
        raise Problem(f"count {count} is outside {least} to {most}")


def sequence(value: Any, least: int, most: int) -> Any:
    """A list of an application, whose length is checked before its elements are read."""
    is_other = isinstance(value, (str, bytes, bytearray, memoryview, Mapping))
    if is_other or not hasattr(type(value), "__len__") or not hasattr(type(value), "__iter__"):
        raise expected("a list", value)
    check_count(len(value), least, most)
    return value


def each(act: Any, values: Any) -> list[Any]:
    results = []
    for at, value in enumerate(values):
        try:
            results.append(act(value))
        except Problem as problem:
            raise problem.under(f"[{at}]")
    return results
