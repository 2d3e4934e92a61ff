//! JSON, there and back.

use std::fmt::Debug;

use jaus_codec::view::serde::Deserialize;
use jaus_codec::view::serde::de::value::{BytesDeserializer, Error as PlainError};
use jaus_codec::view::{Error, Object, Value, View};
use jaus_codec::{AnyMessage, Bytes, Message, Text};

use crate::messages::{Flags, Height, ReportSurvey, SURVEY, Shape, survey};

const VIEW: &str = r#"{"Mode":7,"Flags":{"Side":2,"Level":10,"_reserved":8},"Course":1.5,"Depth":12.34,"Mark":"N1","Photo":{"format":1,"data":"ffd8fe"},"Name":"dock","Samples":[1.0,-2.5,0.1],"Points":[{"East":-2,"Height":{"index":1,"units":"one","value":5}},{"East":300,"Height":{"index":3,"units":"meter","value":1.5}}],"Shape":{"Polygon":[10,20]}}"#;

fn read<T: View>(json: &str) -> Result<T, Error> {
    T::from_view(&serde_json::from_str(json).unwrap())
}

fn json(value: &impl View) -> String {
    serde_json::to_string(&value.view()).unwrap()
}

/// Each value has this JSON, which reads as the value.
fn assert_both_ways<T: View + PartialEq + Debug>(
    cases: impl IntoIterator<Item = (T, &'static str)>,
) {
    for (value, text) in cases {
        assert_eq!(json(&value), text);
        assert_eq!(read::<T>(text), Ok(value));
    }
}

/// Each JSON is refused with this sentence.
fn assert_refused<T: View + Debug>(cases: &[(&str, &str)]) {
    for (text, sentence) in cases {
        assert_eq!(
            read::<T>(text).unwrap_err().to_string(),
            *sentence,
            "{text}"
        );
    }
}

#[test]
fn a_message_is_the_tree_of_its_fields() {
    let dynamic: Box<dyn AnyMessage> = Box::new(survey());
    assert_eq!(serde_json::to_string(&survey()).unwrap(), VIEW);
    assert_eq!(serde_json::to_string(&*dynamic).unwrap(), VIEW);
    let read: ReportSurvey = serde_json::from_str(VIEW).unwrap();
    assert_eq!(Message::encode(&read).unwrap(), SURVEY);
    let value: serde_json::Value = serde_json::from_str(VIEW).unwrap();
    assert_eq!(serde_json::from_value::<ReportSurvey>(value).unwrap(), read);
}

#[test]
fn an_absent_field_is_left_out_and_may_be_null() {
    let least = ReportSurvey {
        depth: None,
        mark: None,
        photo: None,
        flags: Flags(0),
        shape: Shape::Circle(3),
        ..survey()
    };
    let text = json(&least);
    assert!(text.starts_with(r#"{"Mode":7,"Flags":{"Side":0,"Level":0},"Course":1.5,"Name""#));
    assert!(text.ends_with(r#""Shape":{"Circle":3}}"#));
    assert_eq!(read(&text), Ok(least.clone()));
    let with_null = text.replacen("\"Name\"", "\"Depth\":null,\"Mark\":null,\"Name\"", 1);
    assert_eq!(read(&with_null), Ok(least));
}

#[test]
fn a_view_may_use_names_and_leave_out_bits() {
    let text = VIEW
        .replace(":7,", ":\"Run\",")
        .replace(
            r#"{"Side":2,"Level":10,"_reserved":8}"#,
            r#"{"Side":"Right"}"#,
        )
        .replace(r#""units":"one","#, "")
        .replace(r#""Depth":12.34"#, r#""Depth":1,"Depth":12.3449"#);
    let expected = ReportSurvey {
        flags: Flags(0x04),
        ..survey()
    };
    assert_eq!(read(&text), Ok(expected), "the last of two keys counts");
}

#[test]
fn a_wrong_view_is_refused_with_the_path_to_what_is_wrong() {
    let cases = [
        (r#""Mode":7,"#, "", "Mode: required, but absent"),
        (
            r#""Mode":7,"#,
            r#""Mood":7,"#,
            "unknown key \"Mood\"; known keys: Mode, Flags, Course, Depth, Mark, Photo, Name, Samples, Points, Shape",
        ),
        (
            r#""Mode":7"#,
            r#""Mode":"Walk""#,
            "Mode: expected an integer or one of \"Off\", \"Run\", found \"Walk\"",
        ),
        (
            r#""Mode":7"#,
            r#""Mode":256"#,
            "Mode: expected an integer of 8 bits, found 256",
        ),
        (
            r#""Mode":7"#,
            r#""Mode":true"#,
            "Mode: expected an integer, found true",
        ),
        (
            r#""Mode":7"#,
            r#""Mode":null"#,
            "Mode: required, but absent",
        ),
        (
            r#""Level":10"#,
            r#""Level":16"#,
            "Flags.Level: expected an integer from 0 to 15, found 16",
        ),
        (
            r#""Side":2"#,
            r#""Side":4"#,
            "Flags.Side: expected an integer from 0 to 3, found 4",
        ),
        (
            r#""Side":2"#,
            r#""Side":"Up""#,
            "Flags.Side: expected an integer or one of \"Left\", \"Right\", found \"Up\"",
        ),
        (
            r#""_reserved":8"#,
            r#""_reserved":12"#,
            "Flags._reserved: expected an integer with no bits but 0x9, found 12",
        ),
        (
            r#""_reserved":8"#,
            r#""_reserved":256"#,
            "Flags._reserved: expected an integer with no bits but 0x9, found 256",
        ),
        (
            r#""_reserved":8"#,
            r#""_reserved":-1"#,
            "Flags._reserved: expected an integer of 64 bits, found -1",
        ),
        (
            r#""_reserved":8"#,
            r#""Slope":8"#,
            "Flags: unknown key \"Slope\"; known keys: Side, Level, _reserved",
        ),
        (
            r#""Course":1.5"#,
            r#""Course":3.3"#,
            "Course: Course: 3.3 is not in -3.2767 to 3.2767 radian",
        ),
        (
            r#""Depth":12.34"#,
            r#""Depth":"deep""#,
            "Depth: expected a number, found \"deep\"",
        ),
        (
            r#""Mark":"N1""#,
            r#""Mark":1"#,
            "Mark: expected text or {\"hex\": …}, found 1",
        ),
        (
            r#""Mark":"N1""#,
            r#""Mark":{"hex":"4"}"#,
            "Mark.hex: expected text of hexadecimal digits, two for each octet, found \"4\"",
        ),
        (
            "\"ffd8fe\"",
            "\"ffd8fg\"",
            "Photo.data: expected text of hexadecimal digits, two for each octet, found \"ffd8fg\"",
        ),
        (
            "\"ffd8fe\"",
            "[255]",
            "Photo.data: expected text of hexadecimal digits, two for each octet, found an array",
        ),
        (
            "[1.0,-2.5,0.1]",
            "[1.0,-2.5]",
            "Samples: expected 3 elements, found 2",
        ),
        (
            "[1.0,-2.5,0.1]",
            "0.1",
            "Samples: expected an array, found 0.1",
        ),
        (
            "0.1]",
            "{}]",
            "Samples[2]: expected a number, found an object",
        ),
        (
            "\"East\":300",
            "\"East\":32768",
            "Points[1].East: expected an integer of 16 bits, found 32768",
        ),
        (
            "\"index\":3",
            "\"index\":2",
            "Points[1].Height.index: index 2 chooses no type",
        ),
        (
            "\"value\":1.5",
            "\"value\":[]",
            "Points[1].Height.value: expected a number, found an array",
        ),
        (
            ",\"value\":5",
            "",
            "Points[0].Height.value: required, but absent",
        ),
        (
            "{\"Polygon\":[10,20]}",
            "{\"Square\":1}",
            "Shape: unknown key \"Square\"; known keys: Circle, Polygon",
        ),
        (
            "[10,20]",
            "[10,\"x\"]",
            "Shape.Polygon[1]: expected an integer, found \"x\"",
        ),
        (
            "[10,20]}",
            "[],\"Circle\":1}",
            "Shape: expected an object whose one key names the alternative, found an object",
        ),
        (
            "{\"Polygon\":[10,20]}",
            "\"Polygon\"",
            "Shape: expected an object whose one key names the alternative, found \"Polygon\"",
        ),
    ];
    for (right, wrong, sentence) in cases {
        let text = VIEW.replacen(right, wrong, 1);
        assert_ne!(text, VIEW, "{right}");
        let error = read::<ReportSurvey>(&text).unwrap_err();
        assert_eq!(error.to_string(), sentence);
        let error = serde_json::from_str::<ReportSurvey>(&text).unwrap_err();
        assert_eq!(error.to_string(), sentence);
    }
    assert_refused::<ReportSurvey>(&[("null", "expected an object, found null")]);
}

#[test]
fn an_error_shows_a_short_text_and_names_a_long_one() {
    let [forty, more] = [40, 41].map(|length| "é".repeat(length));
    let found = |text: &String| Value::Text(text.clone().into()).to_string();
    assert_eq!(found(&forty), format!("{forty:?}"));
    assert_eq!(found(&more), "a long text");
    let error = Object::new(&read_value("{\"a\":1}"), &[]).unwrap_err();
    assert_eq!(error.to_string(), "unknown key \"a\"; known keys: none");
}

fn read_value(json: &str) -> Value {
    serde_json::from_str(json).unwrap()
}

#[test]
fn integers_are_exact_at_the_limits_of_their_types() {
    assert_both_ways([(0_u8, "0"), (u8::MAX, "255")]);
    assert_both_ways([(u16::MAX, "65535")]);
    assert_both_ways([(u32::MAX, "4294967295")]);
    assert_both_ways([(u64::MAX, "18446744073709551615")]);
    assert_both_ways([(i8::MIN, "-128"), (i8::MAX, "127")]);
    assert_both_ways([(i16::MIN, "-32768")]);
    assert_both_ways([(i32::MIN, "-2147483648")]);
    assert_both_ways([(i64::MIN, "-9223372036854775808"), (7, "7")]);
    assert_refused::<u16>(&[("-1", "expected an integer of 16 bits, found -1")]);
    assert_refused::<i64>(&[(
        "9223372036854775808",
        "expected an integer of 64 bits, found 9223372036854775808",
    )]);
}

#[test]
fn reals_are_their_shortest_decimals() {
    assert_both_ways([(0.1_f64, "0.1"), (-2.5e9, "-2500000000.0")]);
    assert_both_ways([(0.1_f32, "0.1"), (16777216.0, "16777216.0")]);
    assert_both_ways([(f64::INFINITY, "\"Infinity\"")]);
    assert_both_ways([(f64::NEG_INFINITY, "\"-Infinity\"")]);
    assert_both_ways([(f32::INFINITY, "\"Infinity\"")]);
    assert_both_ways([(f32::NEG_INFINITY, "\"-Infinity\"")]);
    assert_eq!(
        (&*json(&f32::NAN), &*json(&f64::NAN)),
        ("\"NaN\"", "\"NaN\"")
    );
    assert!(read::<f32>("\"NaN\"").unwrap().is_nan());
    assert!(read::<f64>("\"NaN\"").unwrap().is_nan());
    assert_eq!(f32::from_view(&f32::MAX.view()), Ok(f32::MAX));
    assert_eq!((read("3"), read("-3")), (Ok(3.0_f64), Ok(-3.0_f64)));
    let wide = (f64::from(f32::MAX) * 2.0).view();
    let error = f32::from_view(&wide).unwrap_err().to_string();
    assert_eq!(
        error,
        format!("expected a number in the range of a float, found {wide}")
    );
    assert_refused::<f64>(&[("\"infinity\"", "expected a number, found \"infinity\"")]);
}

#[test]
fn text_that_is_not_utf_8_and_octets_are_hexadecimal() {
    let broken = Text::from(Bytes::from_static(b"a\xFF\x0b"));
    assert_both_ways([
        (Text::from("a\"é"), "\"a\\\"é\""),
        (broken, "{\"hex\":\"61ff0b\"}"),
    ]);
    assert_both_ways([
        (Bytes::new(), "\"\""),
        (Bytes::from_static(b"\x0F\xA5"), "\"0fa5\""),
    ]);
    assert_eq!(read("\"0FA5\""), Ok(Bytes::from_static(b"\x0F\xA5")));
    assert_eq!(read("{\"hex\":\"616263\"}"), Ok(Text::from("abc")));
}

/// Bits 0 and 15 belong to no sub-field.
#[derive(Clone, Copy, PartialEq)]
struct Wide(u16);
jaus_codec::bit_field!(Wide(u16), [("Most", 1, 14)]);

#[test]
fn a_bit_field_holds_every_number_of_its_width() {
    assert_both_ways([(Flags(0xF6), "{\"Side\":3,\"Level\":15}")]);
    assert_both_ways([
        (Wide(0x7FFE), "{\"Most\":16383}"),
        (Wide(0x8001), "{\"Most\":0,\"_reserved\":32769}"),
    ]);
    assert_refused::<Wide>(&[(
        "{\"_reserved\":65536}",
        "_reserved: expected an integer with no bits but 0x8001, found 65536",
    )]);
}

#[test]
fn lists_and_variable_fields_read_as_themselves() {
    assert_both_ways([(vec![1_u8, 2], "[1,2]"), (vec![], "[]")]);
    assert_both_ways([([[1_u8, 2], [3, 4]], "[[1,2],[3,4]]")]);
    assert_both_ways([(
        Height::Steps(5),
        "{\"index\":1,\"units\":\"one\",\"value\":5}",
    )]);
    assert_refused::<Height>(&[("{\"value\":5}", "index: required, but absent")]);
}

fn sorted(value: Value) -> Value {
    let Value::Object(mut members) = value else {
        unreachable!("it was written as an object")
    };
    members.sort_by(|one, other| one.0.cmp(&other.0));
    Value::Object(members)
}

#[test]
fn a_plain_value_is_whatever_a_format_holds() {
    let text = r#"{"a":[null,true,false],"b":[1,-1,1.5],"":"x"}"#;
    let value = read_value(text);
    assert_eq!(serde_json::to_string(&value).unwrap(), text);
    // Whether serde_json's own value keeps the order of members depends on its features.
    let through_another = serde_json::from_value(serde_json::from_str(text).unwrap()).unwrap();
    assert_eq!(sorted(through_another), sorted(value));
    let octets = BytesDeserializer::<PlainError>::new(b"x");
    assert_eq!(
        Value::deserialize(octets).unwrap_err().to_string(),
        "invalid type: byte array, expected a plain value"
    );
}
