"""Recorded evidence: messages and captures of other stacks.

Most of it is in `tests/evidence` of the repository. What must not be redistributed is in the folder
that `JAUS_SHARED` names, by default `../shared` beside the repository. A test without its evidence is
skipped, and fails if `JAUS_EVIDENCE=required` is set.
"""

import gzip
import json
import os
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parents[3]
GOLDEN = REPOSITORY / "tests/evidence/golden"
CAPTURES = REPOSITORY / "tests/evidence/captures"


def missing(reason):
    """Skips the test that lacks something, or fails it."""
    if os.environ.get("JAUS_EVIDENCE") == "required":
        pytest.fail(f"this test has to run here: {reason}")
    pytest.skip(reason)


def outside(part):
    """A file or folder of evidence outside the repository."""
    shared = Path(os.environ.get("JAUS_SHARED", REPOSITORY.parent / "shared"))
    path = shared / part
    if not path.exists():
        missing(f"{path} is not there; set JAUS_SHARED")
    return path


def golden_rows(source):
    """The vectors of a source: messages that another code generator's encoder wrote."""
    with gzip.open(GOLDEN / f"{source}.jsonl.gz", "rt") as lines:
        return [json.loads(line) for line in lines]


def golden_sources():
    """The names of the sources."""
    names = (path.name.removesuffix(".jsonl.gz") for path in GOLDEN.glob("*.jsonl.gz"))
    return sorted(name for name in names if not name.startswith("scaling_"))


def golden_families():
    """The sources that share their definitions: sets of one family use each other's types."""
    families = {}
    for source in golden_sources():
        family = source if source == "jts-examples" else source.partition("-")[0]
        families.setdefault(family, []).append(source)
    return families


def golden_definitions(family):
    """The directories with the definitions of a family, those with vectors first."""
    corpus = outside("jsidl-corpus")
    if family == "jts-examples":
        return [corpus / family, corpus / "jts"]
    sets = (source.partition("-")[2] for source in golden_families()[family])
    directories = [corpus / family / f"urn.jaus.jss.{set_}" for set_ in sets if set_]
    return [*directories, corpus / family]
