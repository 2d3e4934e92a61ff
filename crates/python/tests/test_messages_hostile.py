"""Hostile octets, values, texts and definitions: clear exceptions, no panic, bounded memory."""

import math
import pickle
import random
import resource

import evidence
import pytest
from jaus import messages
from jaus.errors import DecodeError, DefinitionError, FieldError
from jaus.messages import _library, core, mobility

Pose = mobility.ReportLocalPose


@pytest.fixture(scope="module", autouse=True)
def forget():
    """Other tests do not know the definitions of these tests."""
    yield
    _library._loaded.clear()


HEADER = (
    '<header name="Header"><record name="HeaderRec" optional="false">'
    '<fixed_field name="MessageID" optional="false" field_type="unsigned short integer"'
    ' field_units="one"/></record></header>'
)


def definition(body, urn="urn:example:hostile:One", name="ReportHostile"):
    return (
        f'<service_def name="One" id="{urn}" version="1.0" xmlns="urn:jaus:jsidl:1.1">'
        "<description>One.</description><assumptions/><message_set><input_set>"
        f'<message_def name="{name}" message_id="D1F0" is_command="false">'
        f'<description>One.</description>{HEADER}<body name="Body">{body}</body>'
        '<footer name="Footer"/></message_def></input_set><output_set/></message_set></service_def>'
    )


BYTE = (
    '<record name="Rec" optional="false">'
    '<fixed_field name="X" optional="false" field_type="unsigned byte" field_units="one"/>'
    "</record>"
)


@pytest.fixture
def load(tmp_path):
    def load(body, **more):
        path = tmp_path / "hostile.xml"
        path.write_text(definition(body, **more))
        return messages.load(path)

    return load


def test_any_octets_are_a_message_or_an_error():
    chance = random.Random(21)
    codes = sorted({entry.code for entry in _library.builtin().entries})
    for _ in range(20_000):
        code = chance.choice(codes)
        octets = code.to_bytes(2, "little") + chance.randbytes(chance.randrange(40))
        try:
            message = messages.decode(octets)
        except DecodeError:
            continue
        assert message.encode() == octets
        repr(message), message._repr_html_()


def test_a_huge_count_allocates_no_memory(load):
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    namespace = load(
        '<list name="Many" optional="false">'
        '<count_field field_type_unsigned="unsigned integer"/>'
        f"{BYTE}</list>"
    )
    with pytest.raises(DecodeError, match="octets needed"):
        namespace.ReportHostile.decode(bytes.fromhex("f0d1ffffffff00"))

    class Endless:
        def __len__(self):
            return 2**40

        def __iter__(self):
            while True:
                yield {"x": 1}

    with pytest.raises(FieldError, match="Many: count 1099511627776 is outside 0 to 4294967295"):
        namespace.ReportHostile(many=Endless())
    with pytest.raises(TypeError, match="a list"):
        namespace.ReportHostile(many=iter(Endless()))
    after = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    assert after - before < 200_000, "KiB"


def test_a_huge_array_is_refused_in_its_definition(load):
    array = (
        '<record name="Rec" optional="false"><array name="Cells" optional="false">'
        '<fixed_field name="Cell" optional="false" field_type="unsigned byte" field_units="one"/>'
        '<dimension name="A" size="{}"/><dimension name="B" size="1000"/>'
        "</array></record>"
    )
    with pytest.raises(DefinitionError, match="the array has at least 60000000 octets"):
        load(array.format(60000))
    Large = load(array.format(100)).ReportHostile
    cells = [[7] * 1000] * 100
    message = Large.decode(Large(cells=cells).encode())
    assert message.cells == cells and len(repr(message)) < 10_000
    with pytest.raises(FieldError, match="Cells: 0 slots, but the definition has 100"):
        Large(cells=[])
    with pytest.raises(DecodeError, match="octets needed"):
        Large.decode(bytes.fromhex("f0d100"))


def test_deep_definitions_work_or_are_refused(load):
    def nested(depth):
        inner = (
            '<record name="Leaf" optional="false"><fixed_field name="X" optional="false"'
            ' field_type="unsigned byte" field_units="one"/></record>'
        )
        for level in range(depth):
            inner = f'<sequence name="S{level}" optional="false">{inner}</sequence>'
        return inner

    Deep = load(nested(28)).ReportHostile
    message = Deep.decode(bytes.fromhex("f0d105"))
    assert message.encode().hex() == "f0d105"
    assert pickle.loads(pickle.dumps(message)) == message.copy() == message
    assert Deep.from_json(message.to_json()) == message
    repr(message), message._repr_html_()
    with pytest.raises(DefinitionError, match="nested"):
        load(nested(5000))


@pytest.mark.parametrize(
    "text",
    ["", "<", "<a/>", "\0", "<service_def/>", "<!DOCTYPE a [<!ENTITY b 'c'>]><a>&b;</a>", "é" * 9],
)
def test_other_files_are_no_definitions(tmp_path, text):
    path = tmp_path / "other.xml"
    path.write_text(text)
    with pytest.raises((DefinitionError, OSError)):
        messages.load(path)
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises((DefinitionError, OSError)):
        messages.load(path)


def test_names_of_python_are_no_obstacle(load):
    names = ["class", "None", "self", "def", "code", "encode", "__init__", "_values", "list", "int"]
    names += ["__class__", "__slots__", "__dict__", "copy", "typed", "raw", "v1_0", "Message"]
    fields = "".join(
        f'<fixed_field name="{name}" optional="true" field_type="unsigned byte"'
        ' field_units="meter"><scale_range real_lower_limit="0" real_upper_limit="255"'
        ' integer_function="round"/></fixed_field>'
        for name in names
    )
    body = '<record name="Rec" optional="false"><presence_vector field_type_unsigned='
    body += f'"unsigned integer"/>{fields}</record>'
    Odd = load(body, name="Message").Message
    octets = bytes.fromhex("f0d1ffff0300") + bytes(range(18))
    message = Odd.decode(octets)
    assert message.encode() == octets
    assert [int(value) for _, value, _ in message._fields()] == list(range(18))
    assert Odd(**{name: value for name, value, _ in message._fields()}) == message
    assert pickle.loads(pickle.dumps(message)) == message


HOSTILE = [
    "a",
    "x" * 10_000_000,
    b"\0" * 1000,
    10**10_000,
    -(10**400),
    math.nan,
    math.inf,
    -math.inf,
    1j,
    object(),
    object,
    [],
    [[]],
    {},
    {"a": 1},
    {1: 2},
    (),
    set(),
    lambda: 1,
    True,
    2**64,
    -1,
    "\ud800",
    NotImplemented,
    Ellipsis,
]


class Liar:
    """Methods that fail or return something else."""

    def __float__(self):
        raise ZeroDivisionError

    def __index__(self):
        return 10**30

    def __len__(self):
        return 3

    def __iter__(self):
        return iter([self] * 3)

    def __repr__(self):
        raise RuntimeError

    def keys(self):
        raise RuntimeError


def types():
    yield from (Pose, Pose.TimeStamp, core.ReportServices, core.QueryIdentification)
    yield from (core.ReportIdentification, core.SetElement, mobility.ReportLocalPoseExt)


@pytest.mark.parametrize("type_", list(types()), ids=lambda type_: type_.__qualname__)
def test_hostile_values_are_clear_errors(type_):
    names = getattr(type_, "_keywords", None) or type_._parts
    for name in names:
        for value in [*HOSTILE, Liar()]:
            try:
                made = type_(**{name: value})
            except (FieldError, TypeError, ZeroDivisionError) as error:
                assert len(str(error)) < 2000
            else:
                repr(made)


def test_values_in_lists_are_checked_when_a_message_is_encoded():
    for value in [*HOSTILE, Liar()]:
        report = core.ReportServices()
        report.node_list.append(value)
        with pytest.raises((FieldError, TypeError)):
            report.encode()
        with pytest.raises((FieldError, TypeError)):
            report.to_json()


def test_a_list_in_itself_is_an_error():
    report = core.ReportServices()
    report.node_list.append(report.node_list)
    with pytest.raises(TypeError, match=r"NodeList\[0\]"):
        report.encode()
    report.node_list[0] = report
    with pytest.raises(TypeError, match=r"NodeList\[0\]"):
        report.encode()
    with pytest.raises(RecursionError):
        report.copy()
    assert "ReportServices(" in repr(report)
    report._repr_html_()


def test_long_values_are_shortened_in_text():
    Report = core.ReportServices
    report = Report(node_list=[{"node_rec": {"node_id": 1}}] * 255)
    assert len(repr(report)) < 5000 and "235 more" in repr(report)
    assert len(report._repr_html_()) < 100_000
    with pytest.raises(TypeError) as caught:
        Pose(x_m="x" * 10_000_000)
    assert len(str(caught.value)) < 300
    with pytest.raises(TypeError) as caught:
        Pose(**{"x" * 10_000_000: 1})
    assert len(str(caught.value)) < 300


def test_hostile_json_is_an_error():
    deep = "[" * 100_000 + "]" * 100_000
    for text in (
        deep,
        '{"X":' + deep + "}",
        '{"X": 1e999}',
        '{"X": "1"}',
        "null",
        "[]",
        '{"X":[]}',
    ):
        with pytest.raises(ValueError):
            Pose.from_json(text)
    recursive = {}
    recursive["X"] = recursive
    with pytest.raises(ValueError):
        Pose.from_json(recursive)
    with pytest.raises(TypeError):
        Pose.from_json({"X": object()})


def test_nan_keeps_its_bits():
    constructs = messages.load(evidence.REPOSITORY / "jsidl/tests/rust")
    for type_ in constructs:
        kinds = [type(member.layout).__name__ for member in type_._members]
        if "Single" not in kinds or "Double" not in kinds:
            continue
        for octet in (0x7F, 0xFF):
            # All ones, and signalling ones.
            for fill in (0xFF, 0xBF, 0x01):
                octets = bytearray(type_.code.to_bytes(2, "little"))
                for length in range(2, 300):
                    octets = octets[:2] + bytes([fill, 0xF0 & octet, octet] * 100)[: length - 2]
                    try:
                        message = type_.decode(octets)
                    except DecodeError:
                        continue
                    assert message.encode() == octets
                    break


def test_pickles_of_definitions_that_are_gone_are_an_error(tmp_path):
    path = tmp_path / "gone.xml"
    path.write_text(definition(BYTE, urn="urn:example:gone:A"))
    stored = pickle.dumps(messages.load(path).ReportHostile(x=1))
    _library._loaded.clear()
    path.unlink()
    with pytest.raises(FileNotFoundError, match="gone.xml"):
        pickle.loads(stored)
