"""Sets of message classes, made when they are used, and the search for a class by message code."""

from __future__ import annotations

import difflib
import functools
import json
import threading
from collections.abc import Iterable, Iterator
from typing import Any

from jaus import _jaus
from jaus.errors import DecodeError
from jaus.messages import _records, _values
from jaus.messages._classes import Maker


def _number_of(version: str) -> tuple[int, ...]:
    """`1.1` or `v1_1` as numbers, for comparison."""
    return tuple(int(part) for part in version.lstrip("v").replace("_", ".").split("."))


class Library:
    """The classes of definitions that were loaded together."""

    def __init__(self, definitions: Any, source: tuple[str, ...] | None) -> None:
        self.definitions = definitions
        #: The paths of the definitions; `None` for those of the package.
        self.source = source
        self._lock = threading.RLock()
        self._made: dict[int, type[_records.Message]] = {}
        self.entries: list[_Entry] = [
            _Entry(number, *entry) for number, entry in enumerate(definitions.index())
        ]
        self.sets: dict[str, Set] = {}
        self._by_code: dict[int, list[_Entry]] = {}
        for entry in self.entries:
            self.sets.setdefault(entry.set, Set(self, entry.set, entry.urn))._add(entry)
            self._by_code.setdefault(entry.code, []).append(entry)
        for entries in self._by_code.values():
            entries.sort(key=lambda it: _number_of(it.version), reverse=True)

    def set(self, name: str) -> Set:
        return self.sets[name]

    def by_code(self, code: int) -> list[_Entry]:
        """The messages with a code, the newest first."""
        return self._by_code.get(code, [])

    def make(self, entry: _Entry) -> type[_records.Message]:
        """The class of an entry."""
        made = self._made.get(entry.number)
        if made is None:
            with self._lock:
                # A class of two threads would be two classes.
                made = self._made.get(entry.number) or self._make(entry)
                self._made[entry.number] = made
        return made

    def _make(self, entry: _Entry) -> type[_records.Message]:
        module = f"jaus.messages.{entry.set}" if self.source is None else f"jaus.{entry.set}"
        maker = Maker(module, (self.source, entry.set), entry.path)
        attributes = {
            "code": entry.code,
            "name": entry.message,
            "service": entry.service,
            "version": entry.version,
            "services": tuple(f"{urn} {version}" for urn, version in entry.services),
            "_codec": self.definitions.codec(entry.number),
            "_library": self,
        }
        return maker.message(json.loads(self.definitions.layout(entry.number)), attributes)


class _Entry:
    """A class that may not be made yet."""

    def __init__(
        self,
        number: int,
        set_: str,
        urn: str,
        message: str,
        code: int,
        places: list[tuple[str, str]],
        newest: str | None,
        services: list[tuple[str, str]],
    ) -> None:
        self.number, self.set, self.urn = number, set_, urn
        self.message, self.code = message, code
        self.places, self.newest, self.services = places, newest, services
        #: The newest declaring service.
        self.service, self.version = max(services, key=lambda it: _number_of(it[1]))
        self.path = ".".join(places[0])

    def belongs_to(self, service: str) -> bool:
        """Whether a URN, or a URN with a version, is one of the declaring services."""
        urn, _, version = service.replace("@", " ").partition(" ")
        return any(urn == it[0] and version in ("", it[1]) for it in self.services)


class _Names:
    """An object whose members are classes, made when they are used."""

    def __init__(self, library: Library, name: str) -> None:
        self.__name__ = name
        self._library = library
        self._classes: dict[str, _Entry] = {}

    def __getattr__(self, name: str) -> Any:
        entry = self.__dict__.get("_classes", {}).get(name)
        if entry is None:
            raise AttributeError(self._advice(name))
        made = self._library.make(entry)
        self.__dict__[name] = made
        return made

    def _advice(self, name: str) -> str:
        text = f"{self.__name__} has no {name}"
        if name.startswith("_"):
            return text
        similar = difflib.get_close_matches(name, self._classes, n=1)
        return f"{text}; did you mean {similar[0]}?" if similar else text

    def __dir__(self) -> Iterable[str]:
        return [*super().__dir__(), *self._classes]

    def __iter__(self) -> Iterator[type[_records.Message]]:
        return (self._library.make(entry) for entry in self._classes.values())


class Version(_Names):
    """The messages of one version of a set's services: `mobility.v1_0`."""

    def __repr__(self) -> str:
        return f"<messages {self.__name__}>"


class Set(_Names):
    """The messages of a set of services, each in its newest layout; older ones are in `v1_0` and the
    like."""

    def __init__(self, library: Library, name: str, urn: str) -> None:
        super().__init__(library, name)
        #: The common part of the URNs of the services.
        self.urn = urn
        self._versions: dict[str, Version] = {}

    def _add(self, entry: _Entry) -> None:
        for version, ident in entry.places:
            if version not in self._versions:
                made = Version(self._library, f"{self.__name__}.{version}")
                self._versions[version] = self.__dict__[version] = made
            self._versions[version]._classes[ident] = entry
        if entry.newest is not None:
            self._classes[entry.newest] = entry

    def names(self) -> list[str]:
        """The names of all messages and versions."""
        return [*self._versions, *self._classes]

    def __repr__(self) -> str:
        return f"<messages of {self.urn}>"


class Namespace:
    """The messages of definitions that were loaded at run time.

    Each set of services is a member with the name of its URN (`urn:example:lamps` is
    `example_lamps`). A message is also a member itself, if only one set has one of its name.
    """

    def __init__(self, library: Library) -> None:
        self._library = library
        #: The paths of the definitions.
        self.paths: tuple[str, ...] = library.source or ()

    def __getattr__(self, name: str) -> Any:
        library: Library | None = self.__dict__.get("_library")
        if library is None or name.startswith("_"):
            raise AttributeError(name)
        if name in library.sets:
            return library.sets[name]
        found = [it for it in library.sets.values() if name in it.names()]
        if len(found) == 1:
            return getattr(found[0], name)
        if found:
            choices = " or ".join(f"{it.__name__}.{name}" for it in found)
            raise AttributeError(f"{name} is in several sets: {choices}")
        known = [name for it in library.sets.values() for name in it.names()]
        similar = difflib.get_close_matches(name, known, n=1)
        advice = f"; did you mean {similar[0]}?" if similar else ""
        raise AttributeError(f"the definitions have no message {name}{advice}")

    def __dir__(self) -> Iterable[str]:
        sets = self._library.sets
        return [*super().__dir__(), *sets, *(it for set_ in sets.values() for it in set_.names())]

    def __iter__(self) -> Iterator[type[_records.Message]]:
        return (self._library.make(entry) for entry in self._library.entries)

    def __repr__(self) -> str:
        return f"<messages of {', '.join(self.paths)}>"

    def decode(
        self, octets: bytes | bytearray | memoryview, service: str | None = None
    ) -> _records.Message | _records.Unknown:
        """Decodes a message of these definitions, as `jaus.messages.decode` does."""
        return decode_with([self._library], octets, service)

    def forget(self) -> None:
        """From now on, `jaus.messages.decode` does not know these definitions."""
        if _loaded.get(self.paths) is self._library:
            del _loaded[self.paths]


@functools.cache
def builtin() -> Library:
    """The classes of the definitions that come with the package."""
    return Library(_jaus.Definitions.catalogue(), None)


#: Definitions that were loaded at run time, by their paths; the last ones come first.
_loaded: dict[tuple[str, ...], Library] = {}
#: More are not kept: the oldest are forgotten.
MOST_LOADED = 256


def load(source: tuple[str, ...], skip_errors: bool) -> Library:
    definitions = _jaus.Definitions.load(source, skip_errors)
    library = Library(definitions, source)
    _loaded.pop(source, None)
    _loaded[source] = library
    while len(_loaded) > MOST_LOADED:
        del _loaded[next(iter(_loaded))]
    return library


def libraries() -> list[Library]:
    """All definitions, those that were loaded last first."""
    return [*reversed(_loaded.values()), builtin()]


def decode_with(
    among: list[Library], octets: Any, service: str | None
) -> _records.Message | _records.Unknown:
    octets = _records.as_bytes(octets)
    if len(octets) < 2:
        raise DecodeError(
            f"a message starts with the two octets of its code, but there are only {len(octets)}"
        )
    code = octets[0] | octets[1] << 8
    failure = None
    for library in among:
        for entry in library.by_code(code):
            if service is not None and not entry.belongs_to(service):
                continue
            try:
                return library.make(entry).decode(octets)
            except DecodeError as error:
                failure = failure or error
    if failure is not None:
        raise failure
    if service is not None:
        _require_service(among, service)
    return _records.Unknown(code, octets)


def _require_service(among: list[Library], service: str) -> None:
    entries = [entry for library in among for entry in library.entries]
    if any(entry.belongs_to(service) for entry in entries):
        return
    known = {f"{urn}@{version}" for entry in entries for urn, version in entry.services}
    similar = difflib.get_close_matches(service, sorted(known), n=1)
    advice = f"; did you mean {similar[0]}?" if similar else ""
    raise ValueError(f"there is no service {service}{advice}")


def report_of(query: Any) -> type[_records.Message] | None:
    """The class of a query's report."""
    if query._report is None:
        return None
    version, ident = query._report
    library: Library = query._library
    made: type[_records.Message] = getattr(getattr(library.set(query._home[1]), version), ident)
    return made


def _found(source: tuple[str, ...] | None, set_: str, path: str) -> Any:
    """A class by its home; definitions that are not loaded yet are loaded."""
    if source is None:
        library = builtin()
    else:
        library = _loaded.get(source) or load(source, skip_errors=True)
    found: Any = library.set(set_)
    for name in path.split("."):
        found = getattr(found, name)
    return found


def restored(source: tuple[str, ...] | None, set_: str, path: str) -> Any:
    """A new object of a class, for unpickling."""
    found = _found(source, set_, path)
    return found.__new__(found)


def restored_number(source: tuple[str, ...] | None, set_: str, path: str, number: int) -> Any:
    """A scaled integer or a named value, for unpickling."""
    found = _found(source, set_, path)
    return found.from_raw(number) if issubclass(found, _values.Scaled) else found(number)
