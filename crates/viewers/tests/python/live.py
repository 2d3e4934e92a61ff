"""A viewer of `jaus view` that shares no code with it: subscribes to everything, and checks what comes.

live.py URL WANTED...    ends when each wanted channel has sent samples that fit its schema
"""

import asyncio
import json
import struct
import sys

import websockets
from schemas import check


async def main(url, wanted):
    channels, counts = {}, {}
    async with websockets.connect(url, subprotocols=["foxglove.websocket.v1"], max_size=None) as socket:
        assert socket.subprotocol == "foxglove.websocket.v1", socket.subprotocol
        info = json.loads(await socket.recv())
        assert info["op"] == "serverInfo" and info["capabilities"] == [], info
        while not all(any(counts[topic] > 2 for topic in counts if name in topic) for name in wanted):
            message = await asyncio.wait_for(socket.recv(), 60)
            if isinstance(message, bytes):
                opcode, subscription, time = struct.unpack_from("<BIQ", message)
                assert opcode == 1 and time > 1_600_000_000_000_000_000, (opcode, time)
                topic, schema = channels[subscription]
                check(json.loads(message[13:]), schema)
                counts[topic] = counts.get(topic, 0) + 1
                continue
            request = json.loads(message)
            assert request["op"] == "advertise", request
            for channel in request["channels"]:
                assert channel["encoding"] == "json" and channel["schemaEncoding"] == "jsonschema"
                channels[channel["id"]] = channel["topic"], channel["schema"]
                subscription = {"id": channel["id"], "channelId": channel["id"]}
                await socket.send(json.dumps({"op": "subscribe", "subscriptions": [subscription]}))
    print(f"{sum(counts.values())} samples on {len(counts)} of {len(channels)} channels fit their schemas")


asyncio.run(main(sys.argv[1], sys.argv[2:]))
