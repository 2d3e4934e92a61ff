"""Reads an MCAP recording of `jaus` with the reader of the MCAP project.

recording.py MCAP PCAPNG WANTED...    every sample fits its schema, the wanted channels are there, and the
                                      frames are those of the pcapng file
"""

import base64
import json
import struct
import sys

from mcap.reader import NonSeekingReader, make_reader
from schemas import check


def frames_of_pcapng(path):
    """The octets of all enhanced packet blocks."""
    frames, at = [], 0
    data = open(path, "rb").read()
    while at < len(data):
        kind, length = struct.unpack_from("<II", data, at)
        if kind == 6:
            _, _, _, captured, _ = struct.unpack_from("<IIIII", data, at + 8)
            frames.append(data[at + 28 : at + 28 + captured])
        at += length
    return frames


def main(mcap, pcapng, wanted):
    frames, counts = [], {}
    with open(mcap, "rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        for schema, channel, message in reader.iter_messages(log_time_order=False):
            assert (channel.message_encoding, schema.encoding) == ("json", "jsonschema")
            sample = json.loads(message.data)
            check(sample, schema.data.decode())
            counts[channel.topic] = counts.get(channel.topic, 0) + 1
            if channel.topic == "/jaus/frames":
                frames.append(base64.b64decode(sample["octets"]))
    assert summary.statistics.message_count == sum(counts.values())
    with open(mcap, "rb") as file:
        assert sum(1 for _ in NonSeekingReader(file).iter_messages()) == sum(counts.values())
    for name in wanted:
        assert any(name in topic for topic in counts), f"no {name} in {sorted(counts)}"
    assert frames == frames_of_pcapng(pcapng), "the frames differ"
    print(f"{len(frames)} frames, {sum(counts.values()) - len(frames)} samples on {len(counts) - 1} channels")


main(sys.argv[1], sys.argv[2], sys.argv[3:])
