"""The base classes of messages and of the records in them, and their members."""

from __future__ import annotations

import inspect
import json
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar

from jaus.messages._problems import Problem, shown, unknown_field
from jaus.messages._text import described
from jaus.messages._values import Scaled, Value, copied

if TYPE_CHECKING:
    from jaus.messages._layouts import Layout

_M = TypeVar("_M", bound="Message")
_R = TypeVar("_R", bound="Record")


class Member:
    """A member of a record: its value is checked when it is set."""

    def __init__(self, slot: int, field: Mapping[str, Any], layout: Layout) -> None:
        self.slot, self.layout = slot, layout
        self.key: str = field["key"]
        #: The name in the definition.
        self.name: str = field["name"]
        self.is_optional: bool = field["optional"]
        self.units: str = field["units"]
        self.default = field["default"]
        self.__doc__: str = field["doc"]
        #: The name of the keyword and in `repr`.
        self.keyword = self.key
        #: The same member in its unit, if it is a scaled integer.
        self.in_units: InUnits | None = None

    def __get__(self, record: Record | None, owner: type | None = None) -> Any:
        return self if record is None else record._values[self.slot]

    def __set__(self, record: Record, value: Any) -> None:
        record._values[self.slot] = self.stored(value)

    def __delete__(self, record: Record) -> None:
        self.__set__(record, None)

    def stored(self, value: Any) -> Any:
        """A value of an application as it is stored."""
        if value is None:
            if self.is_optional:
                return None
            Problem("the member is required").under(self.name).throw()
        try:
            return self.layout.check(value)
        except Problem as problem:
            problem.under(self.name).throw()

    def shown(self, record: Record) -> Any:
        """The value as the application set it."""
        return record._values[self.slot]

    def initial(self) -> Any:
        """The value if it is not given; `None` if it is absent or must be given."""
        if self.is_optional:
            return None
        return self.layout.empty() if self.default is None else self.default

    def of_tree(self, tree: Any) -> Any:
        return self.layout.public(tree)

    def tree(self, stored: Any) -> Any:
        return self.layout.tree(stored)


class ScaledMember(Member):
    """A scaled integer: stores the integer, and is a `Scaled`."""

    layout: Any

    def __get__(self, record: Record | None, owner: type | None = None) -> Any:
        if record is None:
            return self
        raw = record._values[self.slot]
        return None if raw is None else self.layout.type.from_raw(raw)

    def stored(self, value: Any) -> Any:
        if value is not None and not isinstance(value, Scaled):
            problem = Problem(
                f"{shown(value)}, but the definition has a {self.layout.type.__name__}; "
                f"set {self.keyword} to a number",
                is_type=True,
            )
            problem.under(self.name).throw()
        return self.of_number(value)

    def of_number(self, value: Any) -> Any:
        if value is None:
            return super().stored(None)
        try:
            return self.layout.raw(value)
        except Problem as problem:
            problem.under(self.name).throw()

    def shown(self, record: Record) -> Any:
        raw = record._values[self.slot]
        return None if raw is None else self.layout.public(raw)

    def of_tree(self, tree: Any) -> Any:
        return tree

    def tree(self, stored: Any) -> Any:
        return stored


class InUnits:
    """A scaled integer as a number in its unit."""

    def __init__(self, member: ScaledMember, keyword: str) -> None:
        self.member = member
        self.slot = member.slot
        member.keyword = keyword
        self.__doc__ = member.__doc__

    def __get__(self, record: Record | None, owner: type | None = None) -> Any:
        return self if record is None else self.member.shown(record)

    def __set__(self, record: Record, value: Any) -> None:
        record._values[self.member.slot] = self.stored(value)

    def __delete__(self, record: Record) -> None:
        self.__set__(record, None)

    def stored(self, value: Any) -> Any:
        return self.member.of_number(value)


class _Signature:
    """The signature of a constructor, for `help` and editors."""

    def __get__(self, _: object, owner: type[Record]) -> inspect.Signature:
        def parameter(member: Member) -> inspect.Parameter:
            hint = member.layout.hint
            is_required = not member.is_optional and member.initial() is None
            return inspect.Parameter(
                member.keyword,
                inspect.Parameter.KEYWORD_ONLY,
                default=inspect.Parameter.empty if is_required else member.initial(),
                annotation=f"{hint} | None" if member.is_optional else hint,
            )

        return inspect.Signature([parameter(member) for member in owner._members])


class Record(Value):
    """A record or sequence: a group of fields, some of which may be absent (`None`)."""

    __slots__ = ("_values",)
    __signature__ = _Signature()
    _members: ClassVar[tuple[Member, ...]] = ()
    #: The members by keyword.
    _keywords: ClassVar[Mapping[str, Any]] = {}
    #: The members whose part of the tree is not their value, with their slots.
    _wrapped: ClassVar[tuple[tuple[int, Any], ...]] = ()
    #: The members with a value that is not given, with their slots.
    _initial: ClassVar[tuple[Any, ...]] = ()
    #: The members without one.
    _required: ClassVar[tuple[Member, ...]] = ()

    _values: list[Any]

    def __init__(self, **fields: Any) -> None:
        self._values = copied(list(self._initial))
        self._assign(fields)
        missing = [it.keyword for it in self._required if self._values[it.slot] is None]
        if missing:
            names = ", ".join(missing)
            raise TypeError(f"{type(self).__name__} needs {names}")

    def _assign(self, fields: Mapping[str, Any]) -> None:
        keywords = self._keywords
        for name, value in fields.items():
            member = keywords.get(name)
            if member is None:
                raise unknown_field(type(self).__name__, name, keywords)
            self._values[member.slot] = member.stored(value)

    @classmethod
    def _of_tree(cls: type[_R], tree: list[Any]) -> _R:
        for slot, of_tree in cls._wrapped:
            part = tree[slot]
            if part is not None:
                tree[slot] = of_tree(part)
        record = cls.__new__(cls)
        record._values = tree
        return record

    def _tree(self) -> list[Any]:
        tree = list(self._values)
        for member in self._members:
            value = tree[member.slot]
            if value is not None:
                try:
                    tree[member.slot] = member.tree(value)
                except Problem as problem:
                    raise problem.under(member.name)
        return tree

    def replace(self: _R, **fields: Any) -> _R:
        """A copy with other values for some fields."""
        new = self.copy()
        new._assign(fields)
        return new

    def __getstate__(self) -> list[Any]:
        return self._values

    def __setstate__(self, values: list[Any]) -> None:
        self._values = values

    def _fields(self) -> Iterator[tuple[str, Any, str]]:
        for member in self._members:
            value = member.shown(self)
            if value is not None:
                yield member.keyword, value, member.units


class _Report:
    """The class of a query's report."""

    def __get__(self, _: object, owner: type[Message]) -> type[Message] | None:
        from jaus.messages._library import report_of

        return report_of(owner)


class Message(Record):
    """A message: create it with keywords, or `decode` it."""

    __slots__ = ()

    #: The message code, for example 0x4B00.
    code: ClassVar[int]
    #: The name in the definition.
    name: ClassVar[str]
    #: The URN of the newest service that declares the message in this layout.
    service: ClassVar[str]
    #: The version of that service.
    version: ClassVar[str]
    #: All services that declare the message in this layout, such as
    #: `urn:jaus:jss:core:Discovery 1.0`.
    services: ClassVar[tuple[str, ...]]
    #: Whether only the controlling client may send it.
    is_command: ClassVar[bool]
    if TYPE_CHECKING:
        #: The class of the report, if the message is a query.
        report: ClassVar[type[Message] | None]
    else:
        report = _Report()

    _codec: ClassVar[Any]
    #: The place of each value in the codec's tree: members of the body, one value, or the sections.
    _content: ClassVar[str]
    #: Version and name of the class of the report.
    _report: ClassVar[tuple[str, str] | None] = None
    _library: ClassVar[Any]

    @classmethod
    def decode(cls: type[_M], octets: bytes | bytearray | memoryview) -> _M:
        """Decodes a whole message from its code to its last octet.

        Raises `jaus.DecodeError` if the octets are not one message of this type.
        """
        if type(octets) is not bytes:
            octets = as_bytes(octets)
        return cls._of_content(cls._codec.decode(octets))

    @classmethod
    def _of_content(cls: type[_M], tree: Any) -> _M:
        if cls._content == "whole":
            tree = [tree]
        return cls._of_tree(tree)

    def encode(self) -> bytes:
        """The octets, from the message code on.

        Raises `jaus.FieldError` if the definition does not permit a value, and `TypeError` for a
        value of another type.
        """
        octets: bytes = self._codec.encode(self._content_tree())
        return octets

    def to_json(self) -> dict[str, Any]:
        """The view that `jaus decode` prints, with the names of the definition."""
        view: dict[str, Any] = json.loads(self._codec.to_json(self._content_tree()))
        return view

    @classmethod
    def from_json(cls: type[_M], view: Mapping[str, Any] | str) -> _M:
        """The message of a JSON view: an object, or its text.

        Raises `jaus.FieldError` if it is not the view of such a message.
        """
        text = view if isinstance(view, str) else json.dumps(view, allow_nan=False)
        return cls._of_content(cls._codec.read_json(text))

    def _content_tree(self) -> Any:
        try:
            tree = self._tree()
        except Problem as problem:
            problem.throw(self.name)
        return tree[0] if self._content == "whole" else tree


class Unknown:
    """A message that no loaded definition has."""

    __slots__ = ("code", "octets")

    def __init__(self, code: int, octets: bytes) -> None:
        self.code = code
        self.octets = octets

    @property
    def name(self) -> str:
        """The message code, such as `EEEEh`."""
        return f"{self.code:04X}h"

    def encode(self) -> bytes:
        """The octets, from the message code on."""
        return self.octets

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Unknown) and self.octets == other.octets

    def __hash__(self) -> int:
        return hash(self.octets)

    def __repr__(self) -> str:
        return f"Unknown({self.name}, {described(self.octets)})"


def as_bytes(octets: Any) -> bytes:
    """Octets of an application. A number is an error: `bytes(5)` would be five zeros."""
    if isinstance(octets, (bytes, bytearray, memoryview)):
        return bytes(octets)
    raise TypeError(f"a message is bytes, not {type(octets).__name__}")
