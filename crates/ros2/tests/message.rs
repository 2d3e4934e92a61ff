//! Messages, by path and from trees.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

use jaus_ros2::{Interfaces, Message, Value};

fn message(name: &str) -> Message {
    Message::new(&Interfaces::bundled().unwrap().get(name).unwrap())
}

#[test]
fn a_new_message_has_the_values_of_its_type() {
    let odometry = message("nav_msgs/Odometry");
    assert_eq!(odometry.float("pose.pose.orientation.w"), Ok(1.0));
    assert_eq!(odometry.float("pose.covariance[35]"), Ok(0.0));
    assert_eq!(odometry.text("header.frame_id"), Ok(""));
    let fix = message("sensor_msgs/NavSatFix");
    assert_eq!(fix.get("status.status"), Ok(&Value::Signed(-2)));
    assert_eq!(fix.get("status.service"), Ok(&Value::Unsigned(0)));
}

#[test]
fn values_are_set_by_path() {
    let mut odometry = message("nav_msgs/Odometry");
    odometry.set("pose.pose.position.x", 4.5).unwrap();
    odometry.set("header.stamp.sec", 7_i64).unwrap();
    odometry.set("header.stamp.nanosec", 8_u32).unwrap();
    odometry.set("header.frame_id", "map").unwrap();
    odometry.set("pose.covariance[7]", 2_i32).unwrap();
    odometry.set("twist.covariance", [0.5; 36]).unwrap();
    assert_eq!(odometry.float("pose.pose.position.x"), Ok(4.5));
    assert_eq!(odometry.get("header.stamp.sec"), Ok(&Value::Signed(7)));
    assert_eq!(odometry.float("pose.covariance[7]"), Ok(2.0));
    assert_eq!(odometry.float("twist.covariance[35]"), Ok(0.5));
    assert_eq!(odometry.text("header.frame_id"), Ok("map"));
}

#[test]
fn sequences_grow_and_nested_messages_are_set_whole() {
    let mut transforms = message("tf2_msgs/TFMessage");
    transforms.resize("transforms", 2).unwrap();
    transforms
        .set("transforms[1].child_frame_id", "base_link")
        .unwrap();
    let mut one = message("geometry_msgs/TransformStamped");
    one.set("transform.translation.z", 3.0).unwrap();
    transforms.set("transforms[0]", one).unwrap();
    assert_eq!(
        transforms.float("transforms[0].transform.translation.z"),
        Ok(3.0)
    );
    assert_eq!(
        transforms.float("transforms[1].transform.rotation.w"),
        Ok(1.0)
    );
    assert_eq!(
        transforms.text("transforms[1].child_frame_id"),
        Ok("base_link")
    );
    transforms.resize("transforms", 1).unwrap();
    let error = transforms.get("transforms[1].child_frame_id").unwrap_err();
    assert!(error.to_string().contains("fewer elements"), "{error}");
}

#[test]
fn an_error_names_the_type_and_the_path() {
    let mut fix = message("sensor_msgs/NavSatFix");
    let mut array = message("diagnostic_msgs/DiagnosticArray");
    array.resize("status", 1).unwrap();
    for (error, part) in [
        (
            fix.set("status.state", 1),
            "`status.state`: sensor_msgs/msg/NavSatStatus has no field `state`",
        ),
        (
            fix.set("status.status", 128),
            "`status.status`: 128 is not from -128 to 127",
        ),
        (fix.set("status.service", -1), "-1 is not from 0 to 65535"),
        (
            fix.set("status.service", 1.0),
            "a floating-point number is not an integer",
        ),
        (fix.set("latitude", "x"), "a text is not a number"),
        (fix.set("latitude.x", 1.0), "`x` is not in a message"),
        (
            fix.set("latitude[0]", 1.0),
            "the field `latitude` is not an array",
        ),
        (
            fix.set("position_covariance", [1.0; 8]),
            "8 elements for an array of 9",
        ),
        (
            fix.set("position_covariance", vec!["a"; 9]),
            "`position_covariance[0]`: a text is not a number",
        ),
        (fix.set("position_covariance[9]", 1.0), "fewer elements"),
        (
            fix.set("position_covariance[]", 1.0),
            "`position_covariance[0]`",
        ),
        (
            fix.set("position_covariance.x", 1.0),
            "`x` is not in a message",
        ),
        (
            fix.resize("position_covariance", 3),
            "3 elements for an array of 9",
        ),
        (fix.resize("latitude", 3), "is not a sequence"),
        (
            fix.set("header", 1),
            "`header`: the value is not a std_msgs/msg/Header",
        ),
        (fix.set("header.frame_id", "a\0b"), "cannot contain NUL"),
        (fix.set("", 1), "has no field ``"),
        (array.set("status[0].values[0].key", ""), "fewer elements"),
        (
            array.set("status[1]", 1),
            "the value is not a diagnostic_msgs/msg/DiagnosticStatus",
        ),
    ] {
        let error = error.unwrap_err().to_string();
        assert!(error.contains(part), "{error}");
    }
}

#[test]
fn a_tree_in_the_order_of_the_fields_becomes_a_message() {
    let interfaces = Interfaces::bundled().unwrap();
    let status = interfaces.get("diagnostic_msgs/DiagnosticStatus").unwrap();
    let pair = |key: &str| Value::Message(vec![key.into(), "value".into()]);
    let tree = |values| {
        Value::Message(vec![
            2_u8.into(),
            "n".into(),
            "m".into(),
            "h".into(),
            values,
        ])
    };
    let value = tree(Value::Sequence(vec![pair("a"), pair("b")]));
    let message = Message::from_value(&status, value.clone()).unwrap();
    assert_eq!(message.text("values[1].key"), Ok("b"));
    assert_eq!(Value::from(message), value);

    let short = tree(Value::Sequence(vec![
        pair("a"),
        Value::Message(vec!["b".into()]),
    ]));
    let error = Message::from_value(&status, short).unwrap_err();
    assert_eq!(error.path, "values[1]");
    assert!(
        error.reason.contains("1 values for the 2 fields"),
        "{error}"
    );
    assert!(Message::from_value(&status, 1.into()).is_err());
}

#[test]
fn bounds_hold_and_a_float32_is_rounded() {
    let mut interfaces = Interfaces::default();
    let text = "string<=3 s\nuint8[<=2] a\nfloat32 f\nchar c\nint64 l\nuint64 u";
    interfaces.add("a/A", text).unwrap();
    let mut message = Message::new(&interfaces.get("a/A").unwrap());
    message.set("s", "äb").unwrap();
    assert!(message.set("s", "äbc").is_err());
    message.resize("a", 2).unwrap();
    assert!(message.resize("a", 3).is_err());
    assert!(message.set("a", vec![1, 2, 3]).is_err());
    message.set("f", 0.1).unwrap();
    assert_eq!(message.float("f"), Ok(f64::from(0.1_f32)));
    assert!(message.set("c", -1).is_err());
    message.set("l", i64::MIN).unwrap();
    assert!(message.set("l", u64::MAX).is_err());
    message.set("u", u64::MAX).unwrap();
    assert_eq!(message.get("u").unwrap().as_unsigned(), Some(u64::MAX));
}
