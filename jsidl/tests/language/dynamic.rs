//! The dynamic codec on hand-written definitions: layout, limits, errors with their location, and
//! the JSON view.

use crate::support::{byte, count, emptiness, everything, framed, group, item, list, message};
use jsidl::dynamic::{
    DecodeProblem, EncodeProblem, Limits, Raw, Value, decode, decode_with, encode, encode_with,
    from_json, to_json,
};
use jsidl::model::{Message, Unsigned};
use serde_json::{Value as Json, json};

/// A value of [`everything`], as JSON.
fn sample() -> Json {
    json!({
        "Numbers": {
            "U8": 255, "U16": 65535, "U32": 4294967295_u32, "U64": 18446744073709551615_u64,
            "I8": -128, "I16": -32768, "I32": -2147483648, "I64": -9223372036854775808_i64,
            "F32": 0.1, "F64": 1e300
        },
        "Scaled": { "Speed": 0.4, "Latitude": 0.0 },
        "Flags": { "Bits": { "High": 15, "Low": 1 }, "State": 1 },
        "Texts": {
            "Fixed": "Ab", "Name": "grüß", "Blob": "0aff",
            "Image": { "format": 3, "data": "00" }
        },
        "Measured": { "Joint": { "index": 1, "units": "radian", "value": -10.0 } },
        "Matrix": { "Cells": [[1, 2, 3], [4, 5, 6]] },
        "Points": [{ "X": 1, "Y": 2 }],
        "Choice": { "One": { "X": 3, "Y": 4 } },
        "Nothing": {},
        "More": [{ "B": 7 }, { "B": 8 }]
    })
}

fn sample_octets() -> Vec<u8> {
    let hex = concat!(
        "a1f0",
        "01", // code, presence vector
        "ff",
        "ffff",
        "ffffffff",
        "ffffffffffffffff", // unsigned
        "80",
        "0080",
        "00000080",
        "0000000000000080", // signed
        "cdcccc3d",
        "9c7500883ce4377e", // floating point
        "0200",
        "01",
        "00000080", // Scaled: Latitude is present, Angle is not
        "01f0",
        "01", // Flags
        "41620000",
        "066772c3bcc39f",
        "02000aff",
        "030100000000", // Texts
        "010000",       // Measured
        "010402050306", // Matrix: the first dimension is the fastest
        "010102",
        "000304",
        "00",       // Points, Choice, Nothing
        "02000708", // More
    );
    let digits = |pair: &[u8]| u8::from_str_radix(std::str::from_utf8(pair).unwrap(), 16).unwrap();
    hex.as_bytes().chunks(2).map(digits).collect()
}

#[test]
fn every_construct_lies_on_the_wire_as_stated() {
    let definition = everything();
    let value = from_json(&definition, &sample()).unwrap();
    let octets = encode(&definition, &value).unwrap();
    assert_eq!(octets, sample_octets());
    assert_eq!(decode(&definition, &octets).unwrap(), value);
    assert_eq!(to_json(&definition, &value).unwrap(), sample());
}

#[test]
fn keys_stand_in_document_order() {
    let definition = everything();
    let value = decode(&definition, &sample_octets()).unwrap();
    let text = to_json(&definition, &value).unwrap().to_string();
    assert_eq!(text, sample().to_string());
}

#[test]
fn a_message_cut_short_is_an_error_at_every_octet() {
    let (definition, octets) = (everything(), sample_octets());
    for end in 0..octets.len() {
        let error = decode(&definition, &octets[..end]).unwrap_err();
        assert!(
            matches!(error.problem, DecodeProblem::Short { .. }),
            "{end}: {error}"
        );
        assert!(error.offset <= end, "{end}: {error}");
    }
}

#[test]
fn errors_name_message_field_and_octet() {
    let definition = everything();
    let mut octets = sample_octets();
    let tag = octets.len() - 8;
    octets[tag] = 9;
    let error = decode(&definition, &octets).unwrap_err();
    assert_eq!(
        error.to_string(),
        format!(
            "Everything: Choice: tag 9 selects none of the variant's 2 alternatives at octet {tag}"
        )
    );
    let octets = &sample_octets()[..tag - 1];
    let error = decode(&definition, octets).unwrap_err();
    assert_eq!(
        error.to_string(),
        format!(
            "Everything: Points[0].Y: octets needed: 1, left: 0 at octet {}",
            tag - 1
        )
    );
}

#[test]
fn what_could_not_be_encoded_again_is_refused() {
    let definition = everything();
    let refused = |at: usize, octet: u8| {
        let mut octets = sample_octets();
        octets[at] = octet;
        decode(&definition, &octets).unwrap_err().problem
    };
    assert_eq!(
        refused(0, 0),
        DecodeProblem::Code {
            expected: 0xF0A1,
            found: 0xF000
        }
    );
    assert_eq!(
        refused(2, 0x83),
        DecodeProblem::Presence {
            vector: 0x83,
            undefined: 0x82
        }
    );
    let nothing = sample_octets().len() - 5;
    assert_eq!(
        refused(nothing, 1),
        DecodeProblem::Tag {
            tag: 1,
            alternatives: 0
        }
    );
    let trailing = [sample_octets(), vec![0]].concat();
    let error = decode(&definition, &trailing).unwrap_err();
    assert_eq!(error.problem, DecodeProblem::Trailing { left: 1 });
    assert_eq!(error.offset, trailing.len() - 1);
}

/// A list of octets with 2 to 3 elements.
fn limited() -> Message {
    let element = item("Element", group(vec![item("B", byte())]));
    message(
        1,
        "Limited",
        Some(item("List", list(count(Unsigned::U8, 2, 3), element))),
    )
}

#[test]
fn counts_keep_to_their_limits_unless_told_otherwise() {
    let definition = limited();
    for octets in [&[1, 0, 1, 7][..], &[1, 0, 4, 7, 7, 7, 7]] {
        let refused = decode(&definition, octets).unwrap_err().problem;
        let count = octets[2].into();
        assert_eq!(
            refused,
            DecodeProblem::Count {
                count,
                min: 2,
                max: 3
            }
        );
        let value = decode_with(&definition, octets, Limits::Ignored).unwrap();
        assert_eq!(
            encode_with(&definition, &value, Limits::Ignored).unwrap(),
            octets
        );
        let refused = encode(&definition, &value).unwrap_err().problem;
        assert_eq!(
            refused,
            EncodeProblem::Count {
                count,
                min: 2,
                max: 3
            }
        );
    }
}

#[test]
fn a_count_that_its_type_cannot_hold_is_refused_even_without_limits() {
    let definition = limited();
    let element = Value::Group(vec![Some(Value::Number(Raw::Unsigned(0)))]);
    let value = Value::List(vec![element; 256]);
    let refused = encode_with(&definition, &value, Limits::Ignored)
        .unwrap_err()
        .problem;
    assert_eq!(
        refused,
        EncodeProblem::Count {
            count: 256,
            min: 0,
            max: 255
        }
    );
}

#[test]
fn elements_without_octets_do_not_multiply() {
    let definition = emptiness();
    let few = [0xA2, 0xF0, 3, 0, 0, 0];
    let value = decode(&definition, &few).unwrap();
    assert_eq!(value, Value::List(vec![Value::Group(Vec::new()); 3]));
    assert_eq!(encode(&definition, &value).unwrap(), few);
    let many = [0xA2, 0xF0, 0xFF, 0xFF, 0xFF, 0xFF];
    let error = decode(&definition, &many).unwrap_err();
    assert_eq!(error.problem, DecodeProblem::EmptyElements);
    let value = Value::List(vec![Value::Group(Vec::new()); 100_000]);
    assert_eq!(
        encode(&definition, &value).unwrap_err().problem,
        EncodeProblem::EmptyElements
    );
}

#[test]
fn a_count_that_the_octets_cannot_pay_for_is_refused() {
    let element = item("Element", group(vec![item("B", byte())]));
    let count = count(Unsigned::U64, 0, u64::MAX);
    let lists = message(1, "Lists", Some(item("List", list(count, element))));
    let octets = [[1, 0].as_slice(), &[0xFF; 10]].concat();
    let error = decode(&lists, &octets).unwrap_err();
    assert_eq!(error.problem, DecodeProblem::Short { needed: 1, left: 0 });
}

#[test]
fn a_header_and_a_footer_of_its_own_are_shown() {
    let definition = framed();
    let octets = [0xA3, 0xF0, 1, 2, 3];
    let value = decode(&definition, &octets).unwrap();
    let view = to_json(&definition, &value).unwrap();
    let expected =
        json!({ "header": { "Length": 1 }, "body": { "Load": 2 }, "footer": { "Checksum": 3 } });
    assert_eq!(view, expected);
    assert_eq!(
        encode(&definition, &from_json(&definition, &view).unwrap()).unwrap(),
        octets
    );
}

#[test]
fn an_empty_body_is_an_empty_object() {
    let definition = message(0x2B00, "QueryNothing", None);
    let value = decode(&definition, &[0, 0x2B]).unwrap();
    assert_eq!(to_json(&definition, &value).unwrap(), json!({}));
    assert_eq!(from_json(&definition, &json!({})).unwrap(), value);
    assert!(from_json(&definition, &json!({ "a": 1 })).is_err());
}

/// The sample with the value at a JSON pointer replaced.
fn changed(pointer: &str, value: Json) -> Json {
    let mut json = sample();
    *json.pointer_mut(pointer).unwrap() = value;
    json
}

#[test]
fn json_errors_say_where_and_what_is_expected() {
    let cases = [
        (
            "/Points/0",
            json!({ "X": 1, "Y": 2, "Z": 3 }),
            "Points[0]: unknown key \"Z\"; known keys: X, Y",
        ),
        (
            "/Points/0",
            json!({ "X": 1 }),
            "Points[0].Y: required, but absent",
        ),
        (
            "/Points/0/X",
            json!(256),
            "Points[0].X: expected an integer from 0 to 255, found 256",
        ),
        (
            "/Points/0/X",
            json!(1.5),
            "Points[0].X: expected an integer from 0 to 255, found 1.5",
        ),
        (
            "/Scaled/Speed",
            json!(100.5),
            "Scaled.Speed: 100.5 is outside the range from 0 to 100 meter",
        ),
        (
            "/Scaled/Speed",
            json!("fast"),
            "Scaled.Speed: expected a number from 0 to 100 meter, found \"fast\"",
        ),
        (
            "/Flags/State",
            json!("Asleep"),
            "Flags.State: expected an integer from 0 to 255 or one of \"Initialise\", \"Ready for use\", found \"Asleep\"",
        ),
        (
            "/Flags/Bits/Low",
            json!(16),
            "Flags.Bits.Low: expected an integer from 0 to 15 or one of \"Off\", \"On\", found 16",
        ),
        (
            "/Flags/Bits",
            json!({ "_reserved": 1 }),
            "Flags.Bits._reserved: expected an integer with no bits but 0xff0, found 1",
        ),
        (
            "/Choice",
            json!({}),
            "Choice: expected an object with one key out of One, Other, found an empty object",
        ),
        (
            "/Choice",
            json!({ "Two": 1 }),
            "Choice: unknown key \"Two\"; known keys: One, Other",
        ),
        (
            "/Measured/Joint/index",
            json!(2),
            "Measured.Joint.index: expected one of 1 (radian), 4 (one), found 2",
        ),
        (
            "/Matrix/Cells/1",
            json!([4, 5]),
            "Matrix.Cells[1]: expected an array of 3, found an array of 2",
        ),
        (
            "/Texts/Blob",
            json!("0"),
            "Texts.Blob: expected text of hexadecimal digits, two for each octet, found \"0\"",
        ),
        (
            "/Numbers/F32",
            json!(1e39),
            "Numbers.F32: expected a number in the range of a float, found 1e+39",
        ),
    ];
    for (pointer, value, expected) in cases {
        let error = from_json(&everything(), &changed(pointer, value))
            .unwrap_err()
            .to_string();
        assert_eq!(error, format!("Everything: {expected}"));
    }
}

#[test]
fn json_is_read_as_people_write_it() {
    let definition = everything();
    let written = [
        ("/Flags/State", json!("Ready for use"), json!(1)),
        ("/Flags/Bits/Low", json!("On"), json!(1)),
        (
            "/Flags/Bits",
            json!({ "Low": 1 }),
            json!({ "High": 0, "Low": 1 }),
        ),
        (
            "/Flags/Bits",
            json!({ "_reserved": 16 }),
            json!({ "High": 0, "Low": 0, "_reserved": 16 }),
        ),
        ("/Scaled/Speed", json!(100), json!(100.0)),
        ("/Numbers/F32", json!("NaN"), json!("NaN")),
        ("/Numbers/F64", json!("-Infinity"), json!("-Infinity")),
        (
            "/Texts/Name",
            json!({ "hex": "FF" }),
            json!({ "hex": "ff" }),
        ),
        ("/Texts/Fixed", json!("A\0\0"), json!("A")),
        ("/Texts/Image/format", json!("JPEG"), json!(3)),
        (
            "/Measured/Joint",
            json!({ "index": 4, "value": 1 }),
            json!({ "index": 4, "units": "one", "value": 1.0 }),
        ),
    ];
    for (pointer, given, shown) in written {
        let value = from_json(&definition, &changed(pointer, given)).unwrap();
        assert_eq!(
            to_json(&definition, &value).unwrap(),
            changed(pointer, shown)
        );
    }
    let mut json = sample();
    json["More"] = Json::Null;
    let value = from_json(&definition, &json).unwrap();
    assert_eq!(to_json(&definition, &value).unwrap().get("More"), None);
}

#[test]
fn values_that_do_not_fit_the_definition_are_errors() {
    let definition = limited();
    let number = |n| Value::Group(vec![Some(Value::Number(n))]);
    let cases = [
        (
            Value::Bits(0),
            "Limited: a bit field, but the definition has a list",
        ),
        (
            Value::List(vec![number(Raw::Unsigned(256)); 2]),
            "Limited: [0].B: 256 does not fit unsigned byte",
        ),
        (
            Value::List(vec![number(Raw::Signed(1)); 2]),
            "Limited: [0].B: 1 does not fit unsigned byte",
        ),
        (
            Value::List(vec![Value::Group(Vec::new()); 2]),
            "Limited: [0]: 0 slots, but the definition has 1",
        ),
        (
            Value::List(vec![Value::Group(vec![None]); 2]),
            "Limited: [0].B: the member is required",
        ),
    ];
    for (value, expected) in cases {
        assert_eq!(
            encode(&definition, &value).unwrap_err().to_string(),
            expected
        );
    }
}
