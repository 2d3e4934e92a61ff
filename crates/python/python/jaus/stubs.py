"""Writes type stubs for your own definitions: `python -m jaus.stubs lamps.xml -o typings`."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from jaus import _jaus
from jaus.errors import Error

__all__ = ["write"]


def write(paths: list[str], directory: str) -> list[Path]:
    """Writes a stub for each set of services in the definitions; returns the files.

    Raises `jaus.DefinitionError` if a definition has errors, and `OSError`.
    """
    target = Path(directory)
    stubs = _jaus.Definitions.stubs([str(path) for path in paths])
    target.mkdir(parents=True, exist_ok=True)
    written = []
    for name, text in stubs:
        file = target / name
        file.write_text(text, encoding="utf-8")
        written.append(file)
    return written


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m jaus.stubs",
        description="Write type stubs (.pyi) for message classes, one file for each set of services.",
    )
    parser.add_argument("paths", nargs="+", metavar="PATH", help="JSIDL files and directories")
    parser.add_argument(
        "-o", "--output", default=".", metavar="DIR", help="the directory to write to"
    )
    options = parser.parse_args(arguments)
    try:
        written = write(options.paths, options.output)
    except (Error, OSError) as error:
        print(error, file=sys.stderr)
        return 1
    for file in written:
        print(file)
    return 0


if __name__ == "__main__":
    sys.exit(main())
