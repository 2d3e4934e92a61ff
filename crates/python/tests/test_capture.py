"""Messages of recorded traffic."""

import gzip
import json
import os
import struct
import threading
import time
from datetime import UTC, datetime
from pathlib import Path

import evidence
import jaus.capture
import pytest
from jaus import messages
from jaus.errors import CaptureError
from jaus.messages import _library, core


@pytest.fixture
def capture(tmp_path):
    """Unpacks a recording of another stack."""

    def unpack(name):
        path = tmp_path / name.replace("/", "-")
        path.write_bytes(gzip.decompress((evidence.CAPTURES / f"{name}.gz").read_bytes()))
        return path

    return unpack


def test_recorded_messages_have_time_ids_addresses_and_class(capture):
    records = list(jaus.capture.read(capture("jauspp/01-vehsim-client.pcap")))
    assert len(records) == 450
    first = records[0]
    assert first.message == core.QueryIdentification(query_type=2)
    assert (first.source, first.destination) == ("152.1.1", "65535.255.255")
    assert first.time == datetime(2026, 11, 21, 0, 32, 47, 680704, tzinfo=UTC)
    assert first.source_address[1] == 3794 and first.destination_address[1] == 3794
    assert first.octets == first.message.encode()
    assert not any(record.error for record in records)


def test_the_lines_are_those_of_the_tool_and_agree_with_the_classes(capture):
    compared = 0
    for name in ("01-vehsim-client", "02-rawvehicle-client", "07-cop-challenge2010"):
        for record in jaus.capture.read(capture(f"jauspp/{name}.pcap")):
            line = record.to_json()
            assert json.loads(record.line) == line
            assert line["source"] == record.source and line["message"] == record.message.name
            assert type(record.message).from_json(line["body"]) == record.message
            compared += 1
    assert compared > 700


def test_a_message_that_cannot_be_read_has_its_reason_and_octets(capture):
    records = list(jaus.capture.read(capture("jauspp/06-jtcp.pcap")))
    unknown = [record for record in records if record.error]
    assert len(unknown) == 12
    assert all("no loaded definition has the message code" in it.error for it in unknown)
    assert all(it.message is None and it.octets and it.source for it in unknown)
    assert "no loaded definition" in repr(unknown[0])


def test_messages_of_the_reference_architecture_are_not_taken_for_others(capture):
    records = list(jaus.capture.read(capture("openjaus33/openjaus33-opc-wire.pcap")))
    assert len(records) == 130
    assert all(isinstance(record.message, messages.Unknown) for record in records)


def test_a_filter_selects_messages(capture):
    path = capture("jauspp/01-vehsim-client.pcap")
    records = list(jaus.capture.read(path, filter="message=ReportStatus"))
    assert len(records) == 39
    assert all(isinstance(record.message, core.ReportStatus) for record in records)
    with pytest.raises(ValueError, match="component"):
        jaus.capture.read(path, filter="component=nobody")


def test_a_truncated_capture_gives_what_is_there_and_says_so(capture):
    path = capture("jauspp/01-vehsim-client.pcap")
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2])
    *records, last = jaus.capture.read(path)
    assert 200 < len(records) < 250
    assert "truncated" in last.error and last.message is None and last.time is None


def test_a_file_that_is_no_capture_is_an_error(tmp_path):
    with pytest.raises(FileNotFoundError):
        jaus.capture.read(tmp_path / "nowhere.pcap")
    for content in (b"", b"{}", b"\x1f\x8b rest", os.urandom(100)):
        path = tmp_path / "other"
        path.write_bytes(content)
        with pytest.raises(CaptureError, match="not a pcap or pcapng file"):
            jaus.capture.read(path)


def pcapng(packets):
    """A pcapng file of raw IP packets, with time stamps in nanoseconds."""

    def block(kind, body):
        body += bytes(-len(body) % 4)
        length = len(body) + 12
        return struct.pack("<II", kind, length) + body + struct.pack("<I", length)

    section = block(0x0A0D0D0A, struct.pack("<IHHq", 0x1A2B3C4D, 1, 0, -1))
    resolution = struct.pack("<HHB3xHH", 9, 1, 9, 0, 0)
    interface = block(1, struct.pack("<HHI", 101, 0, 0) + resolution)
    blocks = [section, interface]
    for stamp, packet in packets:
        size = len(packet)
        head = struct.pack("<IIIII", 0, stamp >> 32, stamp & 0xFFFFFFFF, size, size)
        blocks.append(block(6, head + packet))
    return b"".join(blocks)


def test_a_capture_in_pcapng_keeps_its_nanoseconds(tmp_path):
    # Recorded from JAUS++: 1000.1.7 asks all components who they are.
    payload = bytes.fromhex("02 00 1100 09 FFFFFFFF 0701E803 002B02 0000")
    udp = struct.pack(">HHHH", 3794, 3794, 8 + len(payload), 0) + payload
    ip = struct.pack(">BBHHHBBH4B4B", 0x45, 0, 20 + len(udp), 0, 0, 64, 17, 0, *[10, 0, 0, 1] * 2)
    path = tmp_path / "query.pcapng"
    path.write_bytes(pcapng([(1_600_000_000_123_456_789, ip + udp)]))
    (record,) = jaus.capture.read(path)
    assert record.message == core.QueryIdentification(query_type=2)
    assert record.source == "1000.1.7"
    assert record.source_address == ("10.0.0.1", 3794)
    assert record.time.microsecond == 123456
    assert record.to_json()["time"] == "2020-09-13T12:26:40.123456789Z"


def reading_threads():
    names = (path.read_text() for path in Path("/proc/self/task").glob("*/comm"))
    return [name for name in names if name.startswith("jaus capture")]


def test_a_reader_that_is_dropped_ends_its_thread(capture):
    path = capture("jauspp/01-vehsim-client.pcap")
    readers = [jaus.capture.read(path) for _ in range(5)]
    assert all(next(reader).message for reader in readers)
    assert len(reading_threads()) == 5
    readers.clear()
    while reading_threads():
        time.sleep(0.01)


def test_several_readers_share_nothing(capture):
    path = capture("jauspp/01-vehsim-client.pcap")
    readers = [jaus.capture.read(path) for _ in range(4)]
    results = [[] for _ in readers]
    threads = [
        threading.Thread(target=lambda it=it, to=to: to.extend(it))
        for it, to in zip(readers, results)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert [len(it) for it in results] == [450] * 4


def test_own_definitions_are_known_in_captures(capture, tmp_path):
    lamps = evidence.REPOSITORY / "crates/python/examples/lamps.xml"
    own = tmp_path / "own.xml"
    own.write_text(lamps.read_text().replace("D101", "D7A0"))
    path = capture("jauspp/06-jtcp.pcap")
    records = list(jaus.capture.read(path, definitions=[own]))
    _library._loaded.clear()
    # The definition does not fit these octets, but it is tried.
    assert any("SetLamps" in (record.error or "") for record in records)
