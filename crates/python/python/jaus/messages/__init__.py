"""Typed messages of JAUS services.

    from jaus.messages import mobility

    report = mobility.ReportLocalPose(x_m=2.5, y_m=-1)
    octets = report.encode()
    assert mobility.ReportLocalPose.decode(octets) == report

Each set of services is a module: `core`, `mobility` and so on. `decode` finds the class of a message
by its code, and `load` makes classes from your own definitions (JSIDL).
"""

from __future__ import annotations

import os
import warnings

from jaus.messages import _library, typed
from jaus.messages._library import Namespace
from jaus.messages._records import Message, Unknown

__all__ = ["Message", "Namespace", "Unknown", "decode", "load", "typed"]


def decode(octets: bytes | bytearray | memoryview, service: str | None = None) -> Message | Unknown:
    """Decodes a message, from its code to its last octet.

    The first class that fits is used: definitions that were loaded at run time before those of the
    package, newer versions before older ones. `service` restricts the search to the messages of one
    service: its URN, or URN and version such as `urn:jaus:jss:core:Discovery@1.0`.

    A message whose code no definition has is an `Unknown`. Raises `jaus.DecodeError` if no definition
    of the code fits, and `ValueError` if there is no such service.
    """
    return _library.decode_with(_library.libraries(), octets, service)


def load(*paths: str | os.PathLike[str], skip_errors: bool = False) -> Namespace:
    """Makes the classes of definitions (JSIDL) in files, and in directories with `.xml` files.

    The definitions may refer to each other and to those of the package. From then on `decode` finds
    their messages, too, until `forget` of the result.

    Raises `jaus.DefinitionError` if a definition has errors. With `skip_errors` such definitions are
    left out with a warning.
    """
    if not paths:
        raise TypeError("load needs the path of at least one definition")
    source = tuple(os.path.abspath(os.fspath(path)) for path in paths)
    library = _library.load(source, skip_errors)
    if library.definitions.findings and skip_errors:
        warnings.warn(library.definitions.findings, stacklevel=2)
    return Namespace(library)
