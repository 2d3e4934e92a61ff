//! The `.msg` texts of the types that this crate brings.

/// The name of a type and the text of its `.msg` file.
macro_rules! text {
    ($name:literal) => {
        ($name, include_str!(concat!("../../msg/", $name, ".msg")))
    };
}

/// Every bundled type.
pub(super) const TEXTS: &[(&str, &str)] = &[
    text!("builtin_interfaces/msg/Duration"),
    text!("builtin_interfaces/msg/Time"),
    text!("std_msgs/msg/Bool"),
    text!("std_msgs/msg/Empty"),
    text!("std_msgs/msg/Header"),
    text!("std_msgs/msg/String"),
    text!("geometry_msgs/msg/Point"),
    text!("geometry_msgs/msg/Pose"),
    text!("geometry_msgs/msg/PoseStamped"),
    text!("geometry_msgs/msg/PoseWithCovariance"),
    text!("geometry_msgs/msg/Quaternion"),
    text!("geometry_msgs/msg/Transform"),
    text!("geometry_msgs/msg/TransformStamped"),
    text!("geometry_msgs/msg/Twist"),
    text!("geometry_msgs/msg/TwistStamped"),
    text!("geometry_msgs/msg/TwistWithCovariance"),
    text!("geometry_msgs/msg/Vector3"),
    text!("nav_msgs/msg/Odometry"),
    text!("sensor_msgs/msg/BatteryState"),
    text!("sensor_msgs/msg/Imu"),
    text!("sensor_msgs/msg/NavSatFix"),
    text!("sensor_msgs/msg/NavSatStatus"),
    text!("diagnostic_msgs/msg/DiagnosticArray"),
    text!("diagnostic_msgs/msg/DiagnosticStatus"),
    text!("diagnostic_msgs/msg/KeyValue"),
    text!("tf2_msgs/msg/TFMessage"),
];
