"""SAE JAUS nodes, components and clients for asyncio."""

from jaus.errors import CaptureError, DecodeError, DefinitionError, Error, FieldError

__all__ = ["CaptureError", "DecodeError", "DefinitionError", "Error", "FieldError"]
