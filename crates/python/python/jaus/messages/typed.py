"""The base classes of typed messages and of the types inside them.

Type stubs name them, and `isinstance` can tell them apart; applications create objects of the classes
that are made from definitions.
"""

from __future__ import annotations

from jaus.messages._records import Message, Record, Unknown
from jaus.messages._values import Bits, Formatted, Measure, NamedValue, OneOf, Scaled, Variant

__all__ = [
    "Bits",
    "Formatted",
    "Measure",
    "Message",
    "NamedValue",
    "OneOf",
    "Record",
    "Scaled",
    "Unknown",
    "Variant",
]
