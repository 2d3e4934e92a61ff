"""The base classes of the types inside messages: bit fields, scaled integers, alternatives."""

from __future__ import annotations

import reprlib
from collections.abc import Iterator, Mapping
from enum import IntEnum
from typing import Any, ClassVar, TypeVar

from jaus.messages._problems import Problem, expected, shown, unknown_field
from jaus.messages._text import described, table

_S = TypeVar("_S", bound="Scaled")
_B = TypeVar("_B", bound="Bits")
_V = TypeVar("_V", bound="Value")


class Value:
    """What all classes of a message share: where to find the class again after pickling."""

    __slots__ = ()
    #: The source of the definitions, the set, and the path of the class in it.
    _home: ClassVar[tuple[tuple[str, ...] | None, str, str]]

    def __reduce__(self) -> tuple[Any, ...]:
        from jaus.messages._library import restored

        return restored, self._home, self.__getstate__()

    def __getstate__(self) -> Any:
        raise NotImplementedError

    def __eq__(self, other: object) -> bool:
        if type(self) is not type(other):
            return NotImplemented
        return bool(self.__getstate__() == other.__getstate__())

    __hash__ = None  # type: ignore[assignment]

    @reprlib.recursive_repr()
    def __repr__(self) -> str:
        fields = ", ".join(f"{name}={described(value)}" for name, value, _ in self._fields())
        return f"{type(self).__name__}({fields})"

    def _repr_html_(self) -> str:
        return table(self)

    def _fields(self) -> Iterator[tuple[str, Any, str]]:
        """The name, value and unit of each field that is present."""
        raise NotImplementedError

    def copy(self: _V) -> _V:
        """An independent copy."""
        new = type(self).__new__(type(self))
        new.__setstate__(copied(self.__getstate__()))  # type: ignore[attr-defined]
        return new

    def __copy__(self: _V) -> _V:
        return self.copy()

    def __deepcopy__(self: _V, _: Any) -> _V:
        return self.copy()


def copied(value: Any) -> Any:
    if isinstance(value, list):
        return [copied(element) for element in value]
    if isinstance(value, tuple):
        return tuple(copied(element) for element in value)
    return value.copy() if isinstance(value, (Value, Formatted)) else value


class Bits(Value):
    """Several numbers in one integer. Bits outside them are preserved."""

    __slots__ = ("_raw",)
    _parts: ClassVar[Mapping[str, BitPart]] = {}
    _integer: ClassVar[Any]

    #: The integer on the wire.
    _raw: int

    def __init__(self, **parts: int) -> None:
        self._raw = 0
        for name, value in parts.items():
            if name not in self._parts:
                raise unknown_field(type(self).__name__, name, self._parts)
            setattr(self, name, value)

    @classmethod
    def from_raw(cls: type[_B], raw: int) -> _B:
        """The numbers in an integer of the wire."""
        try:
            return cls._of_tree(cls._integer.check(raw))
        except Problem as problem:
            problem.under(cls.__name__).throw()

    @property
    def raw(self) -> int:
        """The integer on the wire."""
        return self._raw

    @classmethod
    def _of_tree(cls: type[_B], tree: int) -> _B:
        bits = cls.__new__(cls)
        bits._raw = tree
        return bits

    def _tree(self) -> int:
        return self._raw

    def __getstate__(self) -> int:
        return self._raw

    def __setstate__(self, raw: int) -> None:
        self._raw = raw

    def _fields(self) -> Iterator[tuple[str, Any, str]]:
        for name, part in self._parts.items():
            yield name, part.__get__(self), ""


class BitPart:
    """A number in a bit field."""

    def __init__(self, part: Mapping[str, Any], names: Mapping[int, int]) -> None:
        self.name: str = part["name"]
        self.lower: int = part["lower"]
        self.upper: int = part["upper"]
        self.shift: int = part["from"]
        self.mask = (1 << (part["to"] - part["from"] + 1)) - 1
        self.names = names
        self.__doc__: str = part["doc"]

    def __get__(self, bits: Bits | None, owner: type | None = None) -> Any:
        if bits is None:
            return self
        number = bits._raw >> self.shift & self.mask
        return self.names.get(number, number)

    def __set__(self, bits: Bits, value: Any) -> None:
        number = value.__index__() if hasattr(type(value), "__index__") else None
        if number is None:
            expected("an integer", value).under(self.name).throw()
        if not self.lower <= number <= self.upper:
            problem = f"{shown(number)} is not in {self.lower} to {self.upper}"
            Problem(problem).under(self.name).throw()
        bits._raw = bits._raw & ~(self.mask << self.shift) | number << self.shift


class Scaled:
    """A real number in a range, carried as an integer. Immutable."""

    __slots__ = ("_number",)
    #: The limits of the number, and its unit.
    lower: ClassVar[float]
    upper: ClassVar[float]
    units: ClassVar[str]
    _scale: ClassVar[Any]
    _integer: ClassVar[Any]
    _field: ClassVar[str]
    #: Type, limits and rounding: classes with the same one have the same numbers.
    _key: ClassVar[tuple[Any, ...]]
    _home: ClassVar[tuple[tuple[str, ...] | None, str, str]]
    _number: int

    def __init__(self, value: float) -> None:
        from jaus.messages._layouts import real

        try:
            raw = self._raw(real(value))
        except Problem as problem:
            problem.under(self._field).throw()
        object.__setattr__(self, "_number", raw)

    @classmethod
    def from_raw(cls: type[_S], raw: int) -> _S:
        """The number that an integer of the wire stands for."""
        try:
            checked = cls._integer.check(raw)
        except Problem as problem:
            problem.under(cls._field).throw()
        scaled = cls.__new__(cls)
        object.__setattr__(scaled, "_number", checked)
        return scaled

    @classmethod
    def _raw(cls, value: float) -> int:
        raw: int | None = cls._scale.raw(value)
        if raw is None:
            unit = "" if cls.units in ("", "one") else f" {cls.units}"
            raise Problem(f"{value!r} is not in {cls.lower:g} to {cls.upper:g}{unit}")
        return raw

    def has_scale_of(self, other: type[Scaled]) -> bool:
        """Whether an integer stands for the same number in the other class."""
        return self._key == other._key

    def __setattr__(self, name: str, _: object) -> None:
        raise AttributeError(f"{name} of {type(self).__name__} cannot be set: it is immutable")

    @property
    def raw(self) -> int:
        """The integer on the wire."""
        return self._number

    @property
    def value(self) -> float:
        """The number in the unit of the field: the decimal with the fewest digits that stands for
        the integer."""
        value: float = self._scale.value(self._number)
        return value

    def __float__(self) -> float:
        return self.value

    def __eq__(self, other: object) -> bool:
        return isinstance(other, type(self)) and self._number == other._number

    def __hash__(self) -> int:
        return hash(self._number)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.value!r})"

    def __reduce__(self) -> tuple[Any, ...]:
        from jaus.messages._library import restored_number

        return restored_number, (*self._home, self._number)


class NamedValue(IntEnum):
    """The base class of named values."""

    def __reduce_ex__(self, _: Any) -> tuple[Any, ...]:
        from jaus.messages._library import restored_number

        home: tuple[Any, ...] = type(self)._home  # type: ignore[attr-defined]
        return restored_number, (*home, int(self))


class OneOf(Value):
    """One of several alternatives: `kind` names it, `value` is its value. Immutable."""

    __slots__ = ("_kind", "_content")
    #: The alternatives by name: number on the wire, layout, unit, and name in the definition.
    _kinds: ClassVar[Mapping[str, tuple[int, Any, str, str]]] = {}
    #: The names of the alternatives by their number on the wire.
    _numbers: ClassVar[Mapping[int, str]] = {}

    _kind: str
    _content: Any

    def __init__(self, **alternative: Any) -> None:
        owner = type(self).__name__
        for name in alternative:
            if name not in self._kinds:
                raise unknown_field(owner, name, self._kinds)
        if len(alternative) != min(1, len(self._kinds)):
            names = ", ".join(self._kinds)
            raise TypeError(f"{owner} is one of {names}; {len(alternative)} are given")
        self._kind, self._content = "", None
        for name, value in alternative.items():
            self._kind = name
            try:
                self._content = self._kinds[name][1].check(value)
            except Problem as problem:
                problem.under(name).throw()

    @property
    def kind(self) -> str:
        """The name of the alternative; empty if there are none."""
        return self._kind

    @property
    def value(self) -> Any:
        """The value of the alternative."""
        return self._content

    @classmethod
    def _of_tree(cls: type[_V], tree: tuple[int, Any]) -> _V:
        one_of = cls.__new__(cls)
        number, content = tree
        kind = cls._numbers.get(number, "")  # type: ignore[attr-defined]
        if kind:
            content = cls._kinds[kind][1].public(content)  # type: ignore[attr-defined]
        one_of._kind, one_of._content = kind, content  # type: ignore[attr-defined]
        return one_of

    def _tree(self) -> tuple[int, Any]:
        if not self._kind:
            return 0, None
        number, layout, _, name = self._kinds[self._kind]
        try:
            return number, layout.tree(self._content)
        except Problem as problem:
            raise problem.under(name) if name else problem

    def __getstate__(self) -> tuple[str, Any]:
        return self._kind, self._content

    def __setstate__(self, state: tuple[str, Any]) -> None:
        self._kind, self._content = state

    def _fields(self) -> Iterator[tuple[str, Any, str]]:
        if self._kind:
            yield self._kind, self._content, self._kinds[self._kind][2]


class Variant(OneOf):
    """A variant: one of several records, lists or fields."""

    __slots__ = ()


class Measure(OneOf):
    """A number in one of several units."""

    __slots__ = ()

    @property
    def units(self) -> str:
        """The unit of the value."""
        return self._kinds[self._kind][2] if self._kind else ""

    @property
    def raw(self) -> int | float:
        """The number on the wire."""
        raw: int | float = self._tree()[1]
        return raw


class Alternative:
    """The value of an alternative; `None` if another one is chosen."""

    def __init__(self, kind: str) -> None:
        self.kind = kind
        self.__doc__ = f"The value, if the kind is {kind}; otherwise `None`."

    def __get__(self, one_of: OneOf | None, owner: type | None = None) -> Any:
        if one_of is None:
            return self
        return one_of._content if one_of._kind == self.kind else None


class Formatted:
    """Octets in one of several formats; unknown ones are preserved."""

    __slots__ = ("data", "format")

    def __init__(self, format: int, data: bytes) -> None:
        self.format = format
        self.data = data

    def copy(self) -> Formatted:
        """An independent copy."""
        return Formatted(self.format, self.data)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Formatted):
            return NotImplemented
        return (self.format, self.data) == (other.format, other.data)

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return f"Formatted(format={int(self.format)}, data={described(self.data)})"

    def __reduce__(self) -> tuple[Any, ...]:
        return Formatted, (int(self.format), self.data)
