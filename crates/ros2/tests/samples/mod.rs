//! The messages of `tests/network/samples.py`, with the same values.

use jaus_ros2::{Interfaces, Message};

/// Every sample.
pub(crate) fn all() -> Vec<Message> {
    let twist = twist();
    vec![
        boolean(),
        new("std_msgs/Empty"),
        twist.clone(),
        odometry(twist),
        fix(),
        battery(),
        diagnostics(),
        transforms(),
    ]
}

fn new(name: &str) -> Message {
    Message::new(&Interfaces::bundled().unwrap().get(name).unwrap())
}

fn set_header(message: &mut Message, path: &str) {
    message
        .set(&format!("{path}.stamp.sec"), 1_764_220_000)
        .unwrap();
    message
        .set(&format!("{path}.stamp.nanosec"), 123_456_789)
        .unwrap();
    message.set(&format!("{path}.frame_id"), "map").unwrap();
}

fn boolean() -> Message {
    let mut message = new("std_msgs/Bool");
    message.set("data", true).unwrap();
    message
}

fn twist() -> Message {
    let mut message = new("geometry_msgs/Twist");
    message.set("linear.x", 1.5).unwrap();
    message.set("linear.y", -0.25).unwrap();
    message.set("angular.z", 0.75).unwrap();
    message
}

fn odometry(twist: Message) -> Message {
    let mut message = new("nav_msgs/Odometry");
    set_header(&mut message, "header");
    message.set("child_frame_id", "base_link").unwrap();
    message.set("pose.pose.position.x", 10.0).unwrap();
    message.set("pose.pose.position.y", -20.5).unwrap();
    message.set("pose.pose.position.z", 0.125).unwrap();
    message.set("pose.pose.orientation.z", 0.6).unwrap();
    message.set("pose.pose.orientation.w", 0.8).unwrap();
    message.set("twist.twist", twist).unwrap();
    for index in 0..36 {
        let (number, negative) = (f64::from(index), f64::from(-index));
        message
            .set(&format!("pose.covariance[{index}]"), number / 4.0)
            .unwrap();
        message
            .set(&format!("twist.covariance[{index}]"), negative / 8.0)
            .unwrap();
    }
    message
}

fn fix() -> Message {
    let mut message = new("sensor_msgs/NavSatFix");
    set_header(&mut message, "header");
    message.set("status.status", -1).unwrap();
    message.set("status.service", 9).unwrap();
    message.set("latitude", 48.137).unwrap();
    message.set("longitude", 11.575).unwrap();
    message.set("altitude", 519.5).unwrap();
    let covariance: Vec<_> = (0..9).map(|index| f64::from(index) + 0.5).collect();
    message.set("position_covariance", covariance).unwrap();
    message.set("position_covariance_type", 2).unwrap();
    message
}

fn battery() -> Message {
    let mut message = new("sensor_msgs/BatteryState");
    set_header(&mut message, "header");
    for (field, value) in [
        ("voltage", 24.5),
        ("temperature", 31.25),
        ("current", -3.5),
        ("charge", 17.0),
        ("capacity", 20.0),
        ("design_capacity", 22.0),
        ("percentage", 0.875),
    ] {
        message.set(field, value).unwrap();
    }
    for (field, value) in [("status", 2), ("health", 1), ("technology", 3)] {
        message
            .set(&format!("power_supply_{field}"), value)
            .unwrap();
    }
    message.set("present", true).unwrap();
    message.set("cell_voltage", [4.0, 4.125, 4.25]).unwrap();
    message.set("location", "slot 1").unwrap();
    message.set("serial_number", "A-7").unwrap();
    message
}

fn diagnostics() -> Message {
    let mut message = new("diagnostic_msgs/DiagnosticArray");
    set_header(&mut message, "header");
    message.resize("status", 2).unwrap();
    message.resize("status[0].values", 2).unwrap();
    for (path, text) in [
        ("status[0].name", "driver"),
        ("status[0].message", "ready"),
        ("status[0].values[0].key", "authority"),
        ("status[0].values[0].value", "127"),
        ("status[0].values[1].key", "é"),
        ("status[0].values[1].value", "ü"),
        ("status[1].name", "sensor"),
        ("status[1].message", "no reports"),
        ("status[1].hardware_id", "101.1.40"),
    ] {
        message.set(path, text).unwrap();
    }
    message.set("status[1].level", 2).unwrap();
    message
}

fn transforms() -> Message {
    let mut message = new("tf2_msgs/TFMessage");
    message.resize("transforms", 2).unwrap();
    for (index, child, [x, y, z]) in [
        (0, "odom", [1.0, 2.0, 3.0]),
        (1, "base_link", [-1.0, 0.5, 0.0]),
    ] {
        let at = format!("transforms[{index}]");
        set_header(&mut message, &format!("{at}.header"));
        message.set(&format!("{at}.child_frame_id"), child).unwrap();
        for (axis, value) in [("x", x), ("y", y), ("z", z)] {
            message
                .set(&format!("{at}.transform.translation.{axis}"), value)
                .unwrap();
        }
    }
    message
        .set("transforms[1].transform.rotation.z", -0.6)
        .unwrap();
    message
        .set("transforms[1].transform.rotation.w", 0.8)
        .unwrap();
    message
}
