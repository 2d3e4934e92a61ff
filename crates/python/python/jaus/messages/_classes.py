"""Makes the class of a message from its description."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from jaus import _jaus
from jaus.messages import _layouts as layouts
from jaus.messages import _records, _values

SECTIONS = {"header": 0, "body": 1, "footer": 2}


class Maker:
    """The nested classes of one message, made in the order of their use.

    `module` is where the class will be found, `home` the source of its definition and its set, and
    `path` its name there, such as `v1_0.ReportIdentification`.
    """

    def __init__(self, module: str, home: tuple[tuple[str, ...] | None, str], path: str) -> None:
        self.module, self.home, self.path = module, home, path
        self.nested: dict[str, Any] = {}

    def message(
        self, layout: Mapping[str, Any], attributes: Mapping[str, Any]
    ) -> type[_records.Message]:
        """The class of the message. `attributes` are its code, name and the like."""
        for definition in layout["types"]:
            ident = definition["ident"]
            make = getattr(self, f"_{definition['kind']}")
            self.nested[ident] = make(f"{self.path}.{ident}", definition)
        content = layout["content"]
        members = self._members(layout["fields"], SECTIONS if content == "sections" else None)
        body = {
            **attributes,
            **self.nested,
            **self._record_body(members, 3 if content == "sections" else len(members)),
            "is_command": layout["isCommand"],
            "_report": layout["report"] and tuple(layout["report"]),
            "_content": content,
        }
        made: type[_records.Message] = self._class(self.path, _records.Message, layout["doc"], body)
        made.__doc__ = _with_fields(layout["doc"], made._members)
        return made

    def _class(self, path: str, base: type, doc: str, body: Mapping[str, Any]) -> Any:
        names = {
            "__slots__": (),
            "__module__": self.module,
            "__qualname__": path,
            "__doc__": doc,
            "_home": (*self.home, path),
        }
        return type(base)(path.rpartition(".")[2], (base,), {**body, **names})

    def _layout(self, kind: Mapping[str, Any]) -> layouts.Layout:
        match kind["kind"]:
            case "number":
                return _number(kind["number"])
            case "named":
                return layouts.Named(kind["number"], self.nested[kind["ident"]])
            case "scaled":
                return layouts.Scaled(self.nested[kind["ident"]])
            case "defined":
                type_ = self.nested[kind["ident"]]
                return layouts.Defined(type_, f"a {type_.__name__}")
            case "text":
                return layouts.Text(kind["min"], kind["max"], kind["isFixed"])
            case "blob":
                return layouts.Blob(kind["min"], kind["max"])
            case "formatted":
                return layouts.Formatted(self.nested[kind["formats"]], kind["min"], kind["max"])
            case "list":
                return layouts.List(self._layout(kind["element"]), kind["min"], kind["max"])
            case _:
                return layouts.Array(self._layout(kind["element"]), kind["dimensions"])

    def _members(
        self, fields: list[Mapping[str, Any]], slots: Mapping[str, int] | None = None
    ) -> list[_records.Member]:
        members: list[_records.Member] = []
        for at, field in enumerate(fields):
            layout = self._layout(field["type"])
            slot = at if slots is None else slots[field["name"]]
            if isinstance(layout, layouts.Scaled):
                scaled = _records.ScaledMember(slot, field, layout)
                scaled.in_units = _records.InUnits(scaled, field["inUnits"])
                members.append(scaled)
            else:
                members.append(_records.Member(slot, field, layout))
        return members

    @staticmethod
    def _record_body(members: list[_records.Member], slots: int) -> dict[str, Any]:
        body: dict[str, Any] = {}
        keywords: dict[str, Any] = {}
        initial: list[Any] = [None] * slots
        for member in members:
            body[member.key] = member
            in_units = member.in_units
            if in_units is not None:
                body[member.keyword] = in_units
            keywords[member.keyword] = member if in_units is None else in_units
            initial[member.slot] = member.initial()
        plain = layouts.Layout.public
        wrapped = [
            (member.slot, member.layout.public)
            for member in members
            if member.in_units is None and getattr(member.layout.public, "__func__", None) != plain
        ]
        required = [it for it in members if not it.is_optional and initial[it.slot] is None]
        return {
            **body,
            "_members": tuple(members),
            "_keywords": keywords,
            "_wrapped": tuple(wrapped),
            "_initial": tuple(initial),
            "_required": tuple(required),
        }

    # One method for each kind of nested type.

    def _group(self, path: str, definition: Mapping[str, Any]) -> Any:
        members = self._members(definition["fields"])
        doc = _with_fields(definition["doc"], members)
        return self._class(path, _records.Record, doc, self._record_body(members, len(members)))

    def _scaled(self, path: str, definition: Mapping[str, Any]) -> Any:
        key = tuple(definition[it] for it in ("number", "lower", "upper", "rounding"))
        number, lower, upper, rounding = key
        body = {
            "lower": lower,
            "upper": upper,
            "units": definition["units"],
            "_field": definition["name"],
            "_key": key,
            "_scale": _jaus.Scale(number, lower, upper, rounding),
            "_integer": layouts.Integer(number),
        }
        return self._class(path, _values.Scaled, definition["doc"], body)

    def _named(self, path: str, definition: Mapping[str, Any]) -> Any:
        name = path.rpartition(".")[2]
        values = [(ident, index) for ident, index, _ in definition["values"]]
        enumeration: Any = _values.NamedValue
        made = enumeration(name, values, module=self.module, qualname=path)
        docs = [f"{ident} = {index}: {doc}" for ident, index, doc in definition["values"]]
        made.__doc__ = "\n\n".join([definition["doc"], *docs])
        made._home = (*self.home, path)
        return made

    def _bits(self, path: str, definition: Mapping[str, Any]) -> Any:
        parts = {}
        for part in definition["parts"]:
            names = self.nested[part["values"]]._value2member_map_ if part["values"] else {}
            parts[part["key"]] = _values.BitPart(part, names)
        integer = layouts.Integer(definition["number"])
        body = {**parts, "_parts": parts, "_integer": integer}
        docs = [f"{key}: {part.__doc__}" for key, part in parts.items()]
        return self._class(path, _values.Bits, "\n\n".join([definition["doc"], *docs]), body)

    def _variant(self, path: str, definition: Mapping[str, Any]) -> Any:
        alternatives = definition["alternatives"]
        kinds = {
            it["key"]: (tag, self._layout(it["type"]), it["units"], it["name"])
            for tag, it in enumerate(alternatives)
        }
        return self._one_of(path, _values.Variant, definition["doc"], kinds)

    def _measure(self, path: str, definition: Mapping[str, Any]) -> Any:
        kinds = {
            it["key"]: (it["index"], self._layout(it["type"]), it["units"], "")
            for it in definition["choices"]
        }
        return self._one_of(path, _values.Measure, definition["doc"], kinds)

    def _one_of(self, path: str, base: type, doc: str, kinds: Mapping[str, Any]) -> Any:
        members = {
            kind: _values.Alternative(kind)
            for kind in kinds
            if kind not in ("kind", "value", "units", "raw")
        }
        numbers = {number: kind for kind, (number, *_) in reversed(list(kinds.items()))}
        return self._class(path, base, doc, {**members, "_kinds": kinds, "_numbers": numbers})


def _number(number: str) -> layouts.Layout:
    match number:
        case "f32":
            return layouts.Single()
        case "f64":
            return layouts.Double()
        case _:
            return layouts.Integer(number)


def _with_fields(doc: str, members: list[_records.Member] | tuple[_records.Member, ...]) -> str:
    """The documentation of a record with that of its fields."""
    if not members:
        return doc
    lines = [doc, "Fields:"]
    for member in members:
        text = "\n      ".join((member.__doc__ or "").split("\n\n"))
        lines.append(f"    {member.keyword}: {member.layout.hint}\n      {text}")
    return "\n\n".join(lines)
