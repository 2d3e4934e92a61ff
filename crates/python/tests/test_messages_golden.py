"""The messages of another code generator pass through the classes octet for octet."""

import copy
import pickle
import warnings

import evidence
import jaus.errors
import pytest
from jaus import messages


def types_of(namespace):
    """The classes by service, message and code."""
    return {
        (service, type_.name, type_.code): type_
        for type_ in namespace
        for service in type_.services
    }


def type_of(types, row):
    service = f"{row['service_id']} {row['version']}"
    return types[service, row["message"], int(row["message_id"], 16)]


@pytest.fixture(scope="module", params=evidence.golden_families())
def golden(request):
    """Each vector of a family: class and octets."""
    with warnings.catch_warnings():
        # Some published definitions have mistakes.
        warnings.simplefilter("ignore")
        definitions = evidence.golden_definitions(request.param)
        namespace = messages.load(*definitions, skip_errors=True)
    types = types_of(namespace)
    sources = evidence.golden_families()[request.param]
    rows = [row for source in sources for row in evidence.golden_rows(source)]
    yield [(type_of(types, row), bytes.fromhex(row["hex"])) for row in rows]
    namespace.forget()


def rebuilt(value):
    """The same content, set by an application."""
    if isinstance(value, messages.typed.Formatted):
        return messages.typed.Formatted(int(value.format), value.data)
    if isinstance(value, messages.typed.Bits) and not is_within_limits(value):
        return type(value).from_raw(value.raw)
    if isinstance(value, list):
        return [rebuilt(element) for element in value]
    if hasattr(value, "_fields"):
        fields = {name: rebuilt(it) for name, it, _ in value._fields()}
        return type(value)(**fields)
    return value


def is_within_limits(bits):
    parts = ((part, part.__get__(bits)) for part in bits._parts.values())
    return all(part.lower <= number <= part.upper for part, number in parts)


def test_golden_messages_are_decoded_and_encoded_octet_for_octet(golden):
    for type_, octets in golden:
        message = type_.decode(octets)
        assert message.encode() == octets, type_
        assert type_.decode(bytearray(octets)) == message
        assert copy.deepcopy(message) == message
        assert message.replace() == message
        repr(message), message._repr_html_()


def test_golden_messages_pass_through_json(golden):
    for type_, octets in golden:
        view = type_.decode(octets).to_json()
        assert type_.from_json(view).encode() == octets, type_


def test_golden_messages_are_rebuilt_from_the_values_of_their_fields(golden):
    for type_, octets in golden:
        assert rebuilt(type_.decode(octets)).encode() == octets, type_


def test_golden_messages_are_pickled(golden):
    for type_, octets in golden:
        message = type_.decode(octets)
        again = pickle.loads(pickle.dumps(message))
        assert again == message
        assert again.encode() == octets


def around(octets):
    """Octets that are almost a message: beginnings, one octet more, single octets changed."""
    places = range(0, len(octets), -(-len(octets) // 8))
    yield octets + b"\0"
    for place in places:
        yield octets[:place]
        for changed in (0xFF, octets[place] ^ 0x81):
            yield octets[:place] + bytes([changed]) + octets[place + 1 :]


def test_malformed_messages_are_refused_or_encoded_to_the_same_octets(golden):
    refused = 0
    for type_, octets in golden:
        for other in around(octets):
            try:
                message = type_.decode(other)
            except jaus.errors.DecodeError as error:
                assert error.message == type_.name
                assert str(error).endswith(f" at octet {error.offset}")
                refused += 1
            else:
                assert message.encode() == other, (type_, other.hex())
        with pytest.raises(jaus.errors.DecodeError, match="octets after the end"):
            type_.decode(octets + b"\0")
    assert refused >= 3 * len(golden)


def test_there_are_as_many_golden_messages_as_recorded():
    assert sum(len(evidence.golden_rows(it)) for it in evidence.golden_sources()) == 2116


def test_the_built_in_classes_read_the_golden_messages_of_their_services():
    types = types_of(iter_builtin())
    # Definitions that differ from those of the package: other codes or names.
    other = {
        ("fkie-iop", "CBDetailedMeasurement"),
        ("fkie-manipulator", "ReportJointPosition"),
        ("fkie-mobility", "ReportLocalVector"),
        ("fkie-mobility", "SetLocalVector"),
        ("jts-mobility", "ReportGlobalVector"),
        ("jts-mobility", "SetGlobalVector"),
        ("jts-ugv", "ReportPlatformSpecifications"),
    }
    read = 0
    for source in evidence.golden_sources():
        for row in evidence.golden_rows(source):
            service = f"{row['service_id']} {row['version']}"
            type_ = types.get((service, row["message"], int(row["message_id"], 16)))
            if type_ is None or (source, row["message"]) in other:
                continue
            octets = bytes.fromhex(row["hex"])
            message = type_.decode(octets)
            assert message.encode() == octets
            assert type_.from_json(message.to_json()).encode() == octets
            read += 1
    assert read > 500


def iter_builtin():
    from jaus.messages import _library

    library = _library.builtin()
    return (library.make(entry) for entry in library.entries)
