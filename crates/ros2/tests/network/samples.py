"""Messages with values that tests on both sides know; with --golden, their octets as cyclonedds writes them."""

import sys

from messages import (
    BatteryState, Bool, DiagnosticArray, DiagnosticStatus, Empty, Header, KeyValue, NavSatFix, NavSatStatus, Odometry,
    Point, Pose, PoseWithCovariance, Quaternion, TFMessage, Time, Transform, TransformStamped, Twist,
    TwistWithCovariance, Vector3, encode,
)

header = Header(Time(1_764_220_000, 123_456_789), "map")
twist = Twist(Vector3(1.5, -0.25, 0.0), Vector3(0.0, 0.0, 0.75))
pose = Pose(Point(10.0, -20.5, 0.125), Quaternion(0.0, 0.0, 0.6, 0.8))

SAMPLES = {
    "std_msgs/msg/Bool": Bool(True),
    "std_msgs/msg/Empty": Empty(),
    "geometry_msgs/msg/Twist": twist,
    "nav_msgs/msg/Odometry": Odometry(
        header,
        "base_link",
        PoseWithCovariance(pose, [n / 4 for n in range(36)]),
        TwistWithCovariance(twist, [-n / 8 for n in range(36)]),
    ),
    "sensor_msgs/msg/NavSatFix": NavSatFix(
        header, NavSatStatus(-1, 9), 48.137, 11.575, 519.5, [n + 0.5 for n in range(9)], 2
    ),
    "sensor_msgs/msg/BatteryState": BatteryState(
        header, 24.5, 31.25, -3.5, 17.0, 20.0, 22.0, 0.875, 2, 1, 3, True, [4.0, 4.125, 4.25], [], "slot 1", "A-7"
    ),
    "diagnostic_msgs/msg/DiagnosticArray": DiagnosticArray(
        header,
        [
            DiagnosticStatus(0, "driver", "ready", "", [KeyValue("authority", "127"), KeyValue("é", "ü")]),
            DiagnosticStatus(2, "sensor", "no reports", "101.1.40", []),
        ],
    ),
    "tf2_msgs/msg/TFMessage": TFMessage(
        [
            TransformStamped(header, "odom", Transform(Vector3(1.0, 2.0, 3.0), Quaternion())),
            TransformStamped(header, "base_link", Transform(Vector3(-1.0, 0.5, 0.0), Quaternion(0.0, 0.0, -0.6, 0.8))),
        ]
    ),
}

if __name__ == "__main__" and "--golden" in sys.argv:
    for name, message in SAMPLES.items():
        for order, little in [("little", True), ("big", False)]:
            print(name, order, encode(message, little).hex())
