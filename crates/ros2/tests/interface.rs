//! The text of `.msg` files, and sets of types.
#![allow(clippy::unwrap_used, clippy::panic, reason = "tests fail by panicking")]

use jaus_ros2::interface::{InterfaceError, Kind, Primitive, Size};
use jaus_ros2::{Interface, Interfaces, Message, Value};
use proptest::prelude::*;
use std::sync::Arc;

fn interface(text: &str) -> Result<Arc<Interface>, InterfaceError> {
    let mut interfaces = Interfaces::bundled()?;
    interfaces.add("test_msgs/msg/Test", text)?;
    interfaces.get("test_msgs/Test")
}

fn error(text: &str) -> String {
    interface(text).unwrap_err().to_string()
}

#[test]
fn a_text_gives_fields_constants_and_values() {
    let text = "# A comment\n\
        uint8 OK=1 # another\n\
        string NAME = \"a # b\"\n\
        float64 SMALL=-1.5e-3\n\n\
        bool is_set true\n\
        int16\t level -0x10\n\
        string<=5 name 'it\\'s'\n\
        float32[3] weights [1, 2.5, -3]\n\
        string[] words [\"a,b\", 'c']\n\
        uint8[<=4] data\n\
        geometry_msgs/Pose[] poses\n\
        std_msgs/msg/Header header\r\n";
    let interface = interface(text).unwrap();
    assert_eq!(interface.constant("OK"), Some(&Value::Unsigned(1)));
    assert_eq!(interface.constant("NAME"), Some(&"a # b".into()));
    assert_eq!(interface.constant("SMALL"), Some(&Value::Float(-0.0015)));
    let kinds: Vec<_> = interface.fields().iter().map(|it| it.size).collect();
    let (one, any) = (Size::One, Size::Any);
    let sizes = [
        one,
        one,
        one,
        Size::Fixed(3),
        any,
        Size::AtMost(4),
        any,
        one,
    ];
    assert_eq!(kinds, sizes);
    assert_eq!(
        interface.fields()[1].kind,
        Kind::Primitive(Primitive::Int16)
    );
    let message = Message::new(&interface);
    assert_eq!(message.get("is_set"), Ok(&Value::Bool(true)));
    assert_eq!(message.get("level"), Ok(&Value::Signed(-16)));
    assert_eq!(message.text("name"), Ok("it's"));
    assert_eq!(message.float("weights[1]"), Ok(2.5));
    assert_eq!(message.get("words"), Ok(&["a,b", "c"].into()));
    assert_eq!(message.get("poses"), Ok(&Value::Sequence(Vec::new())));
}

#[test]
fn an_error_names_the_type_the_line_and_the_remedy() {
    for (text, line, part) in [
        ("uint8 a\nuint9 b", 2, "`uint9` is not a type"),
        ("uint8", 1, "write a type and a name"),
        ("uint8 Data", 1, "lower case"),
        ("uint8 a__b", 1, "single underscores"),
        ("uint8 a_", 1, "single underscores"),
        ("uint8 a\n\nuint8 a", 3, "two fields `a`"),
        ("uint8 ok=1", 1, "upper case"),
        ("uint8 A=1\nuint8 A=1", 2, "two constants `A`"),
        ("uint8[2] A=1", 1, "a constant is one number"),
        ("uint8 A=256", 1, "256 is not from 0 to 255"),
        ("int8 A=--1", 1, "`--1` is not a value"),
        ("uint8 a b", 1, "`b` is not a value"),
        ("uint8[] a 1", 1, "write for example [1, 2, 3]"),
        ("uint8[2] a [1]", 1, "1 values for an array of 2"),
        ("uint8[<=1] a [1, 2]", 1, "2 values for an array of 1"),
        ("uint8[] a [1,,2]", 1, "missing between two commas"),
        ("uint8[0] a", 1, "`0` is not a size"),
        ("uint8[-1] a", 1, "`-1` is not a size"),
        ("uint8[2 a", 1, "ends with ]"),
        ("string<= a", 1, "`` is not a size"),
        ("string a 'b", 1, "does not end with the '"),
        ("string<=1 a 'bc'", 1, "at most 1"),
        ("geometry_msgs/Pose a 1", 1, "nested message has no value"),
        ("wstring a", 1, "use string"),
        ("time a", 1, "builtin_interfaces/Time"),
        ("uint8 a:1", 1, "cannot follow the name"),
        ("a/B/C d", 1, "is not a type"),
    ] {
        let error = error(text);
        let start = format!("test_msgs/msg/Test, line {line}: ");
        assert!(error.starts_with(&start), "{error}");
        assert!(error.contains(part), "{error}");
    }
}

#[test]
fn names_of_types_follow_the_rules_of_ros() {
    let interfaces = Interfaces::bundled().unwrap();
    for name in [
        "",
        "Pose",
        "Geometry/Pose",
        "geometry_msgs/srv/Pose",
        "a__b/C",
        "a/b/c/D",
    ] {
        let error = interfaces.get(name).unwrap_err().to_string();
        assert!(error.contains("geometry_msgs/msg/Twist"), "{error}");
    }
    let odometry = interfaces.get("nav_msgs/Odometry").unwrap();
    assert_eq!(odometry.name().dds(), "nav_msgs::msg::dds_::Odometry_");
}

#[test]
fn missing_types_and_cycles_are_refused() {
    let missing = error("Other other");
    assert!(
        missing.contains("its field `other` has the type test_msgs/msg/Other"),
        "{missing}"
    );
    let unknown = Interfaces::default().get("a/B").unwrap_err().to_string();
    assert!(
        unknown.contains("there is no message type a/msg/B"),
        "{unknown}"
    );
    let mut interfaces = Interfaces::default();
    for (name, text) in [("a/A", "B[] b"), ("a/B", "C[2] c"), ("a/C", "A[<=3] a")] {
        interfaces.add(name, text).unwrap();
    }
    for name in ["a/A", "a/B", "a/C"] {
        let error = interfaces.get(name).unwrap_err();
        assert!(matches!(error, InterfaceError::Cycle(_)), "{error}");
    }
}

#[test]
fn a_definition_may_be_added_again_but_not_changed() {
    let mut interfaces = Interfaces::bundled().unwrap();
    interfaces
        .add("std_msgs/msg/Bool", "bool data # the same")
        .unwrap();
    let error = interfaces.add("std_msgs/Bool", "uint8 data").unwrap_err();
    assert!(matches!(error, InterfaceError::Conflict(_)), "{error}");
}

#[test]
fn depth_and_size_of_a_message_have_bounds() {
    let mut interfaces = Interfaces::default();
    interfaces.add("a/M0", "uint8 a").unwrap();
    for level in 1..40 {
        let text = format!("M{0} a\nM{0} b", level - 1);
        interfaces.add(&format!("a/M{level}"), &text).unwrap();
    }
    interfaces.get("a/M10").unwrap();
    let error = interfaces.get("a/M25").unwrap_err();
    assert!(matches!(error, InterfaceError::TooLarge(_)), "{error}");
    let mut interfaces = Interfaces::default();
    interfaces.add("a/M0", "uint8 a").unwrap();
    for level in 1..40 {
        let text = format!("M{}[] a", level - 1);
        interfaces.add(&format!("a/M{level}"), &text).unwrap();
    }
    interfaces.get("a/M31").unwrap();
    let error = interfaces.get("a/M32").unwrap_err();
    assert!(matches!(error, InterfaceError::TooDeep(_)), "{error}");
    // A shallow field first does not hide the depth of a later one.
    interfaces.add("a/Both", "M31[] a").unwrap();
    let error = interfaces.get("a/Both").unwrap_err();
    assert!(matches!(error, InterfaceError::TooDeep(_)), "{error}");
}

proptest! {
    #[test]
    fn no_text_panics(text in "[ -~\n]{0,200}") {
        let _ = interface(&text);
    }

    #[test]
    fn no_text_that_looks_like_a_definition_panics(
        lines in prop::collection::vec(
            "(uint8|string<=[0-9]{0,3}|float64|A|a/B)(\\[(<=)?[0-9]{0,4}\\]?)?[ =]{0,2}[a-zA-Z_0-9]{0,6}[ =]{0,2}[-\\[\\]'\"\\\\é#,0-9xa-z]{0,8}",
            0..6,
        )
    ) {
        let _ = interface(&lines.join("\n"));
    }
}
