"""Classes and stubs of definitions that are read at run time."""

import copy
import pickle
import warnings
from pathlib import Path

import evidence
import jaus.stubs
import pytest
from jaus import messages
from jaus.errors import DecodeError, DefinitionError, FieldError
from jaus.messages import _library
from test_messages_golden import rebuilt
from test_messages_types import type_errors

LAMPS = Path(__file__).parents[1] / "examples/lamps.xml"


@pytest.fixture(scope="module", autouse=True)
def forget():
    """Other tests do not know the definitions of these tests."""
    yield
    _library._loaded.clear()


@pytest.fixture(scope="module")
def lamps():
    return messages.load(LAMPS)


@pytest.fixture(scope="module")
def constructs():
    """Every construct of the language."""
    return messages.load(evidence.REPOSITORY / "jsidl/tests/rust")


def test_own_messages_have_classes_at_run_time(lamps):
    Set = lamps.SetLamps
    assert Set is lamps.example_lamps.SetLamps is lamps.v1_0.SetLamps
    assert (Set.code, Set.is_command, Set.service) == (0xD101, True, "urn:example:lamps:Lamps")
    lamp = Set.Lamp(place=Set.Place.FRONT_LEFT, brightness_percent=40)
    message = Set(lamp_list=[lamp])
    octets = message.encode()
    assert octets.hex() == "01d101010166"
    assert lamps.decode(octets) == message
    assert messages.decode(octets) == message
    assert Set.from_json(message.to_json()) == message
    assert "SetLamps" in dir(lamps) and "example_lamps" in dir(lamps)
    with pytest.raises(AttributeError, match="did you mean SetLamps?"):
        lamps.SetLamp


def test_counts_are_checked_when_a_message_is_encoded(lamps):
    Set = lamps.SetLamps
    with pytest.raises(TypeError, match="SetLamps needs lamp_list"):
        Set()
    with pytest.raises(FieldError, match="LampList: count 0 is outside 1 to 8"):
        Set(lamp_list=[])
    message = Set(lamp_list=[{"place": 1}])
    message.lamp_list.extend([Set.Lamp(place=2)] * 8)
    with pytest.raises(FieldError, match="^SetLamps: LampList: count 9 is outside 1 to 8$"):
        message.encode()
    with pytest.raises(DecodeError, match="count 9 is outside 1 to 8"):
        Set.decode(bytes.fromhex("01d109") + b"\0\1" * 9)


def test_own_messages_are_pickled_with_the_path_of_their_definition(lamps):
    message = lamps.SetLamps(lamp_list=[{"place": 1, "brightness_percent": 3}])
    for value in (message, message.lamp_list[0].place, message.lamp_list[0].brightness):
        assert pickle.loads(pickle.dumps(value)) == value
    assert copy.deepcopy(message) == message


def test_definitions_that_are_loaded_again_replace_the_first_ones(tmp_path):
    path = tmp_path / "lamps.xml"
    path.write_text(LAMPS.read_text().replace("D101", "D102"))
    messages.load(path)
    assert messages.decode(bytes.fromhex("02d101000100")[:5]).name == "SetLamps"
    path.write_text(LAMPS.read_text().replace("D101", "D103"))
    messages.load(path)
    assert isinstance(messages.decode(bytes.fromhex("02d1")), messages.Unknown)


def test_definitions_that_are_forgotten_are_unknown(tmp_path):
    path = tmp_path / "lamps.xml"
    path.write_text(LAMPS.read_text().replace("D101", "D104"))
    octets = bytes.fromhex("04d1010001")
    namespace = messages.load(path)
    assert messages.decode(octets).name == "SetLamps"
    namespace.forget()
    assert isinstance(messages.decode(octets), messages.Unknown)
    assert namespace.decode(octets).name == "SetLamps"


def test_mistakes_in_definitions_have_a_line(tmp_path):
    path = tmp_path / "broken.xml"
    path.write_text(LAMPS.read_text().replace("unsigned byte", "unsigned bite"))
    with pytest.raises(DefinitionError, match=r"broken\.xml:\d+:\d+: error: "):
        messages.load(path)
    with pytest.warns(UserWarning, match="error"):
        namespace = messages.load(path, skip_errors=True)
    assert list(namespace) == []
    with pytest.raises(FileNotFoundError, match="nowhere.xml"):
        messages.load(tmp_path / "nowhere.xml")
    with pytest.raises(TypeError):
        messages.load()


def test_values_of_every_construct_pass_through_their_classes(constructs):
    """Each class of which a message of zeros can be read."""
    read = 0
    for type_ in constructs:
        for length in range(2, 900):
            octets = type_.code.to_bytes(2, "little") + bytes(length - 2)
            try:
                message = type_.decode(octets)
            except DecodeError:
                continue
            assert message.encode() == octets
            assert type_.from_json(message.to_json()).encode() == octets
            assert rebuilt(message).encode() == octets
            assert pickle.loads(pickle.dumps(message)) == message
            repr(message), message._repr_html_(), type_.__doc__, type_.__signature__
            read += 1
            break
    assert read > 20


def test_arrays_are_nested_lists_with_the_first_dimension_outermost(constructs):
    Arrays = next(type_ for type_ in constructs if type_.name == "ReportArrays")
    octets = Arrays.code.to_bytes(2, "little") + bytes(900)
    for length in range(2, 900):
        try:
            arrays = Arrays.decode(octets[:length])
            break
        except DecodeError:
            pass
    assert [len(arrays.vector), len(arrays.matrix), len(arrays.matrix[0])] == [3, 2, 3]
    assert [len(arrays.cube), len(arrays.cube[0]), len(arrays.cube[0][0])] == [2, 3, 4]
    arrays.matrix[1][0] = 0x0102
    # After the presence vector and a vector of three; the first index is the fastest.
    assert arrays.encode()[2 + 1 + 12 :][:4] == b"\0\0\2\1"
    assert Arrays.decode(arrays.encode()) == arrays
    arrays.matrix[1].append(3)
    with pytest.raises(FieldError, match="Matrix.*4 slots, but the definition has 3"):
        arrays.encode()
    with pytest.raises(FieldError, match="Vector: 2 slots, but the definition has 3"):
        arrays.vector = [1, 2]


def test_a_number_of_four_octets_is_its_shortest_decimal(constructs):
    Numbers = constructs.ReportNumbers
    zeros = Numbers.decode(Numbers.code.to_bytes(2, "little") + bytes(42))
    numbers = zeros.replace(float_=1 / 3)
    assert numbers.float_ == 0.33333334
    assert Numbers.decode(numbers.encode()) == numbers
    assert zeros.replace(float_=0.1).float_ == 0.1
    with pytest.raises(FieldError, match="Float: 1e\\+39 does not fit float"):
        zeros.replace(float_=1e39)


def test_stubs_are_written_for_own_definitions(tmp_path, capsys):
    assert jaus.stubs.main([str(LAMPS), "-o", str(tmp_path)]) == 0
    stub = tmp_path / "example_lamps.pyi"
    assert capsys.readouterr().out.strip() == str(stub)
    text = stub.read_text()
    assert "class SetLamps(typed.Message):" in text
    assert "brightness_percent: float | v1_0.SetLamps.Brightness | None = ..." in text
    assert jaus.stubs.main([str(tmp_path / "nowhere.xml")]) == 1
    assert "nowhere.xml" in capsys.readouterr().err


def test_the_type_checker_accepts_the_stubs_of_every_construct(tmp_path):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        written = jaus.stubs.write([evidence.REPOSITORY / "jsidl/tests/rust"], tmp_path)
    for file in written:
        compile(file.read_text(), str(file), "exec")
    assert type_errors(tmp_path, *written) == ""
