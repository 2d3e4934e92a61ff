"""A viewer of `jaus view` that shares no code with it: subscribes to everything, and checks what comes.

live.py URL WANTED...    ends when each wanted channel has sent samples that fit its schema, and a viewer that
                         connects afterwards has got the latest sample of each channel
"""

import asyncio
import json
import struct
import sys
import time as clock

import websockets
from schemas import check


def connect(url):
    return websockets.connect(url, subprotocols=["foxglove.websocket.v1"], max_size=None)


async def samples(socket):
    """Subscribes to all channels, and yields topic and time of each sample."""
    assert socket.subprotocol == "foxglove.websocket.v1", socket.subprotocol
    info = json.loads(await socket.recv())
    assert info["op"] == "serverInfo" and info["capabilities"] == [], info
    channels = {}
    while True:
        message = await asyncio.wait_for(socket.recv(), 60)
        if isinstance(message, bytes):
            opcode, subscription, time = struct.unpack_from("<BIQ", message)
            assert opcode == 1 and time > 1_600_000_000_000_000_000, (opcode, time)
            topic, schema = channels[subscription]
            check(json.loads(message[13:]), schema)
            yield topic, time
            continue
        request = json.loads(message)
        assert request["op"] == "advertise", request
        for channel in request["channels"]:
            assert channel["encoding"] == "json" and channel["schemaEncoding"] == "jsonschema"
            channels[channel["id"]] = channel["topic"], channel["schema"]
            subscription = {"id": channel["id"], "channelId": channel["id"]}
            await socket.send(json.dumps({"op": "subscribe", "subscriptions": [subscription]}))


async def main(url, wanted):
    counts = {}
    async with connect(url) as socket:
        async for topic, _ in samples(socket):
            counts[topic] = counts.get(topic, 0) + 1
            if all(any(counts[topic] > 2 for topic in counts if name in topic) for name in wanted):
                break
    print(f"{sum(counts.values())} samples on {len(counts)} channels fit their schemas")
    first, connected = {}, clock.time_ns()
    async with connect(url) as socket:
        async for topic, time in samples(socket):
            first.setdefault(topic, time)
            if counts.keys() <= first.keys():
                break
    earlier = [topic for topic in first if first[topic] < connected]
    assert earlier, (connected, first)
    print(f"a late viewer got a sample of each, {len(earlier)} of them from before it connected")


asyncio.run(main(sys.argv[1], sys.argv[2:]))
