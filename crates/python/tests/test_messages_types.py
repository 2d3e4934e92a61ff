"""What type checkers know about the classes."""

import importlib.util
import subprocess
import sys
from pathlib import Path

import evidence
import jaus.messages

USAGE = """
from jaus import messages
from jaus.messages import core, mobility
from jaus.messages.mobility import ReportLocalPose, v0_6

pose = ReportLocalPose(x_m=2.5, time_stamp=ReportLocalPose.TimeStamp(day=1))
octets: bytes = pose.encode()
again: ReportLocalPose = ReportLocalPose.decode(octets)
x: float | None = again.x_m
scaled: ReportLocalPose.X | None = again.x
raw: int = scaled.raw if scaled else 0
pose.x_m = None
pose = mobility.ReportLocalPose(x_m=ReportLocalPose.X.from_raw(3))
older: v0_6.ReportAccelerationState = v0_6.ReportAccelerationState.decode(octets)
message = messages.decode(octets)
if isinstance(message, core.ReportIdentification):
    name: str | bytes = message.identification
query = core.QueryIdentification(query_type=core.QueryIdentification.QueryType.SYSTEM_IDENTIFICATION)
code: int = query.code
nodes: list[core.ReportServices.NodeSeq] = core.ReportServices().node_list
mobility.SetGlobalWaypoint(latitude_deg=1, longitude_deg=2)
mobility.QueryLocalPose()
copied: ReportLocalPose = pose.replace(x_m=1)
"""

REFUSED = [
    "mobility.ReportLocalPose(x_metres=1)",
    "mobility.ReportLocalPose(x_m='a')",
    "mobility.ReportLocalPose().x_metres",
    "mobility.ReportLocalPos",
    "mobility.SetGlobalWaypoint(latitude_deg=1)",
    "mobility.ReportLocalPose().x.raw",
    "mobility.ReportLocalPose.TimeStamp(day='1')",
    "mobility.ReportLocalPose.X(1).raw = 2",
]


def type_errors(directory, *files):
    """What the type checker says about files, one error a line."""
    if importlib.util.find_spec("mypy") is None:
        evidence.missing("mypy is not installed")
    command = [sys.executable, "-m", "mypy", "--strict", "--no-error-summary"]
    command += ["--cache-dir", str(directory / "cache"), *map(str, files)]
    return subprocess.run(command, capture_output=True, text=True, cwd=directory).stdout


def test_the_type_checker_knows_the_classes_and_refuses_mistakes(tmp_path):
    refused = "\n".join(REFUSED)
    usage = tmp_path / "usage.py"
    usage.write_text(f"{USAGE}\n{refused}\n")
    errors = type_errors(tmp_path, usage)
    lines = {int(line.split(":")[1]) for line in errors.splitlines()}
    first = len(f"{USAGE}\n".splitlines()) + 1
    assert lines == set(range(first, first + len(REFUSED))), errors


def test_stubs_and_classes_agree():
    """The names of each stub are those of the classes."""
    folder = Path(jaus.messages.__file__).parent
    for stub in folder.glob("*.pyi"):
        names = {"IntEnum": object, "Literal": dict, "overload": lambda it: it}
        module = compile(stub.read_text(), str(stub), "exec", flags=_annotations())
        exec(module, names)
        set_ = __import__(f"jaus.messages.{stub.stem}", fromlist=["v1_0"])
        for name in set_.__all__:
            assert name in names, f"{stub.name} lacks {name}"
        for type_ in set_._set:
            assert_agree(type_, names[type_.name] if type_.name in names else None)


def assert_agree(type_, stub):
    if stub is None:
        return
    for member in type_._members:
        assert member.key in stub.__annotations__, f"{type_}.{member.key}"
    accessors = {member.keyword for member in type_._members}
    assert accessors <= set(stub.__annotations__), type_
    assert len(stub.__init__.__kwdefaults__ or {}) + len(type_._required) == len(type_._members)


def _annotations():
    import __future__

    return __future__.annotations.compiler_flag
