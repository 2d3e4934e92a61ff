"""A node of ROS 2 as rmw_zenoh's documents describe it, with cyclonedds's encoding and eclipse-zenoh.

ros.py ENDPOINT publish            publishes every sample until its standard input ends; prints `ready`
ros.py ENDPOINT subscribe COUNT    prints `ready`, then `ok TYPE` for each sample that arrives as it is known, or what
                                   differs, until so many have arrived
ros.py ENDPOINT tokens             prints the liveliness tokens of domain 0
ros.py ENDPOINT spoil              publishes to the topic of each sample octets that are no message, prints `ready`, and
                                   waits for the end of its standard input
"""

import json
import struct
import sys
import threading
import time

import xxhash
import zenoh

from messages import encode, type_name
from samples import SAMPLES

DOMAIN = 0
# The type hashes that ROS publishes.
HASHES = {
    "std_msgs/msg/Bool": "feb91e995ff9ebd09c0cb3d2aed18b11077585839fb5db80193b62d74528f6c9",
    "std_msgs/msg/Empty": "20b625256f32d5dbc0d04fee44f43c41e51c70d3502f84b4a08e7a9c26a96312",
    "geometry_msgs/msg/Twist": "9c45bf16fe0983d80e3cfe750d6835843d265a9a6c46bd2e609fcddde6fb8d2a",
    "nav_msgs/msg/Odometry": "3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0",
    "sensor_msgs/msg/NavSatFix": "62223ab3fe210a15976021da7afddc9e200dc9ec75231c1b6a557fc598a65404",
    "sensor_msgs/msg/BatteryState": "4bee5dfce981c98faa6828b868307a0a73f992ed0789f374ee96c8f840e69741",
    "diagnostic_msgs/msg/DiagnosticArray": "5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e",
    "tf2_msgs/msg/TFMessage": "e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087",
}


def topic(name):
    """The topic of a sample, such as /test/odometry."""
    return "/test/" + name.rsplit("/", 1)[1].lower()


def typed(name):
    """The chunks of a key that say the type."""
    return f"{type_name(type(SAMPLES[name]))}/RIHS01_{HASHES[name]}"


def key(name):
    """The key of the messages of a topic."""
    return f"{DOMAIN}{topic(name)}/{typed(name)}"


class Node:
    """A node with its liveliness tokens."""

    def __init__(self, session, name):
        self.session, self.name, self.entities, self.tokens = session, name, 0, []
        self.declare("NN", "")

    def declare(self, kind, rest):
        """Declares the token of the node or of an entity, and returns its gid."""
        token = f"@ros2_lv/{DOMAIN}/{self.session.zid()}/0/{self.entities}/{kind}/%/%/{self.name}{rest}"
        self.entities += 1
        self.tokens.append(self.session.liveliness().declare_token(token))
        return gid(token)

    def declare_endpoint(self, kind, name):
        mangled = topic(name).replace("/", "%")
        return self.declare(kind, f"/{mangled}/{typed(name)}/::,10:,:,:,,")


def gid(token):
    """The identity of the entity that has this token."""
    digest = xxhash.xxh3_128(token.encode()).intdigest()
    return digest.to_bytes(16, "little")


def publish(session):
    node = Node(session, "python_talker")
    publishers = [(message, session.declare_publisher(key(name)), node.declare_endpoint("MP", name))
                  for name, message in SAMPLES.items()]
    print("ready", flush=True)
    ended = threading.Event()
    threading.Thread(target=lambda: (sys.stdin.read(), ended.set()), daemon=True).start()
    sequence = 0
    while not ended.wait(0.05):
        sequence += 1
        for message, publisher, identity in publishers:
            attachment = struct.pack("<qqB16s", sequence, time.time_ns(), 16, identity)
            publisher.put(encode(message), attachment=attachment)


def difference(session, name, sample):
    """What is not as rmw_zenoh and cyclonedds would have sent it."""
    payload = sample.payload.to_bytes()
    if payload != encode(SAMPLES[name]):
        return f"payload {payload.hex()}"
    if type(SAMPLES[name]).deserialize(payload) != SAMPLES[name]:
        return "values"
    attachment = sample.attachment.to_bytes()
    if len(attachment) != 33 or attachment[16] != 16:
        return f"attachment {attachment.hex()}"
    sequence, stamp = struct.unpack("<qq", attachment[:16])
    if sequence < 1 or abs(time.time_ns() - stamp) > 120e9:
        return f"sequence {sequence} stamp {stamp}"
    mangled = topic(name).replace("/", "%")
    publishers = [token for token in tokens(session) if f"/MP/%/%test/rover/{mangled}/{typed(name)}/" in token]
    if [gid(token) for token in publishers] != [attachment[17:]]:
        return f"gid {attachment[17:].hex()} of {publishers}"
    return None


def subscribe(session, count):
    node = Node(session, "python_listener")
    arrivals = []
    arrived = threading.Condition()

    def receive(name):
        def take(sample):
            with arrived:
                arrivals.append((name, sample))
                arrived.notify()

        return take

    subscribers = [session.declare_subscriber(key(name), receive(name)) for name in SAMPLES]
    for name in SAMPLES:
        node.declare_endpoint("MS", name)
    print("ready", flush=True)
    for _ in range(count):
        with arrived:
            arrived.wait_for(lambda: arrivals, 60)
            name, sample = arrivals.pop(0)
        wrong = difference(session, name, sample)
        print(f"{name} {wrong}" if wrong else f"ok {name}", flush=True)
    del subscribers


def tokens(session):
    replies = session.liveliness().get(f"@ros2_lv/{DOMAIN}/**", timeout=20)
    return sorted(str(reply.ok.key_expr) for reply in replies if reply.ok)


def spoil(session):
    good = struct.pack("<qqB16s", 1, 0, 16, bytes(16))
    for name, message in SAMPLES.items():
        for payload, attachment in [
            (b"no message", good),
            (encode(message), None),
            (encode(message), b"no attachment"),
            (bytes((1 << 20) + 1), good),
        ]:
            block = zenoh.CongestionControl.BLOCK
            session.put(key(name), payload, attachment=attachment, congestion_control=block)
    print("ready", flush=True)
    sys.stdin.read()


def connect(endpoint):
    """A session that connects to a router."""
    config = zenoh.Config()
    config.insert_json5("mode", json.dumps("client"))
    config.insert_json5("connect/endpoints", json.dumps([endpoint]))
    config.insert_json5("scouting/multicast/enabled", "false")
    return zenoh.open(config)


def main(endpoint, action, count=None):
    with connect(endpoint) as session:
        if action == "publish":
            publish(session)
        elif action == "subscribe":
            subscribe(session, int(count))
        elif action == "tokens":
            print(*tokens(session), sep="\n", flush=True)
        elif action == "spoil":
            spoil(session)


if __name__ == "__main__":
    main(*sys.argv[1:])
