"""A node of ROS 2 that watches and drives a vehicle, written like ros.py.

rover.py ENDPOINT watch                  prints `odom EAST NORTH FORWARD` and `status TEXT` as they arrive
rover.py ENDPOINT drive FORWARD YAWRATE  publishes cmd_vel at 20 Hz until it is killed or its standard input ends
rover.py ENDPOINT goal EAST NORTH        publishes one goal
rover.py ENDPOINT emergency 0|1          publishes one emergency stop, or its end
rover.py ENDPOINT report TOPIC           prints the type and the octets of the first message of a topic
"""

import struct
import sys
import threading
import time

from messages import Bool, DiagnosticArray, Header, Odometry, Point, Pose, PoseStamped, Twist, Vector3, encode
from ros import DOMAIN, Node, connect, tokens

NAMESPACE = "/v101"


def subscription_key(session, name):
    """The rest of the key of a topic, type and hash, from the token of a subscription."""
    mangled = (NAMESPACE + name).replace("/", "%")
    while True:
        for token in tokens(session):
            chunks = token.split("/")
            if chunks[5] == "MS" and chunks[9] == mangled:
                return "/".join(chunks[10:12])
        time.sleep(0.05)


class Publisher:
    """A publisher of a topic that the bridge subscribes to."""

    def __init__(self, session, name):
        typed = subscription_key(session, name)
        mangled = (NAMESPACE + name).replace("/", "%")
        self.publisher = session.declare_publisher(f"{DOMAIN}{NAMESPACE}{name}/{typed}")
        # The tokens are withdrawn with the node.
        self.node = Node(session, "python_pilot")
        self.gid = self.node.declare("MP", f"/{mangled}/{typed}/::,10:,:,:,,")
        self.sequence = 0

    def publish(self, message):
        self.sequence += 1
        attachment = struct.pack("<qqB16s", self.sequence, time.time_ns(), 16, self.gid)
        self.publisher.put(encode(message), attachment=attachment)


def write(line):
    """Writes a line at once: callbacks of zenoh run in several threads."""
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


def watch(session):
    def odometry(sample):
        it = Odometry.deserialize(sample.payload.to_bytes())
        position = it.pose.pose.position
        write(f"odom {position.x} {position.y} {it.twist.twist.linear.x}")

    def status(sample):
        for it in DiagnosticArray.deserialize(sample.payload.to_bytes()).status:
            values = ", ".join(f"{value.key}={value.value}" for value in it.values)
            write(f"status {it.name}: {it.message}; {values}")

    write("ready")
    subscribers = [session.declare_subscriber(f"{DOMAIN}{NAMESPACE}/odom/**", odometry),
                   session.declare_subscriber(f"{DOMAIN}{NAMESPACE}/status/**", status)]
    sys.stdin.read()
    del subscribers


def drive(session, forward, yaw_rate):
    publisher = Publisher(session, "/cmd_vel")
    print("ready", flush=True)
    ended = threading.Event()
    threading.Thread(target=lambda: (sys.stdin.read(), ended.set()), daemon=True).start()
    while not ended.wait(0.05):
        publisher.publish(Twist(linear=Vector3(x=float(forward)), angular=Vector3(z=float(yaw_rate))))


def once(session, name, message):
    publisher = Publisher(session, name)
    time.sleep(0.2)
    publisher.publish(message)
    print("ready", flush=True)
    sys.stdin.read()


def report(session, name):
    samples = session.declare_subscriber(f"{DOMAIN}{NAMESPACE}{name}/**")
    print("ready", flush=True)
    sample = samples.recv()
    print(str(sample.key_expr).split("/")[-2], sample.payload.to_bytes().hex(), flush=True)


def main(endpoint, action, *arguments):
    with connect(endpoint) as session:
        if action == "watch":
            watch(session)
        elif action == "drive":
            drive(session, *arguments)
        elif action == "goal":
            east, north = map(float, arguments)
            pose = Pose(position=Point(x=east, y=north))
            once(session, "/goal_pose", PoseStamped(header=Header(frame_id="map"), pose=pose))
        elif action == "emergency":
            once(session, "/emergency_stop", Bool(data=arguments[0] == "1"))
        elif action == "report":
            report(session, *arguments)


main(*sys.argv[1:])
