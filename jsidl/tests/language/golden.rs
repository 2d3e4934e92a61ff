//! The dynamic codec against the encodings of an independent code generator.

use std::collections::BTreeMap;

use crate::support::golden;
use jaus_test_kit::evidence;
use jsidl::dynamic::{
    decode, encode, from_json, raw_from_real, real_from_raw, shortest_real, to_json,
};
use jsidl::model::{Item, Meaning, Message, Number, Rounding, Scalar, Scale, Shape, Unsigned};
use serde_json::{Map, Value as Json, json};

fn scale_of(row: &Json) -> (Scale, Unsigned) {
    let width = match row["type"].as_str().unwrap() {
        "unsigned byte" => Unsigned::U8,
        "unsigned short integer" => Unsigned::U16,
        "unsigned integer" => Unsigned::U32,
        other => panic!("{other} is no scaled type"),
    };
    let limit = |key: &str| row[key].as_f64().unwrap();
    let (lower, upper) = (limit("lower"), limit("upper"));
    (
        Scale {
            lower,
            upper,
            rounding: Rounding::Round,
        },
        width,
    )
}

#[test]
fn real_numbers_become_the_integers_of_exact_rounding() {
    let rows = golden::lines(&evidence::golden().join("scaling_encode.jsonl"));
    for row in &rows {
        let (scale, width) = scale_of(row);
        let raw = raw_from_real(&scale, width, row["real"].as_f64().unwrap());
        assert_eq!(raw, row["round_half_up"].as_u64(), "{row}");
    }
    println!("{} real numbers", rows.len());
    assert!(rows.len() > 1000);
}

#[test]
fn integers_become_the_real_numbers_they_stand_for() {
    let rows = golden::lines(&evidence::golden().join("scaling_decode.jsonl"));
    for row in &rows {
        let (scale, width) = scale_of(row);
        let raw = row["raw"].as_u64().unwrap();
        assert_eq!(
            Some(real_from_raw(&scale, width, raw)),
            row["jts_real"].as_f64(),
            "{row}"
        );
        let shortest = shortest_real(&scale, width, raw);
        assert_eq!(
            raw_from_real(&scale, width, shortest),
            Some(raw),
            "{row}: {shortest}"
        );
    }
    println!("{} integers", rows.len());
    assert!(rows.len() > 300);
}

/// The number of a scaled field to put into the JSON.
#[derive(Clone, Copy, PartialEq)]
enum Real {
    /// The input of the other generator: a quarter of a step above the exact value.
    Given,
    /// Our view of the integer that the other generator produced.
    Shown,
}

/// The JSON view of golden fields: the same content in our form.
fn view(item: &Item, golden: &Json, real: Real) -> Json {
    match &item.shape {
        Shape::Group(group) => {
            let golden = golden
                .as_object()
                .unwrap_or_else(|| panic!("{}: {golden}", item.name));
            let member = |name: &String| group.members.iter().find(|member| member.name == *name);
            let view = |(name, golden): (&String, &Json)| {
                let member = member(name).unwrap_or_else(|| panic!("{} has no {name}", item.name));
                (name.clone(), view(member, golden, real))
            };
            Json::Object(golden.iter().map(view).collect())
        }
        Shape::List(list) => {
            let golden = golden.as_array().unwrap().iter();
            golden
                .map(|golden| view(&list.element, &golden[&list.element.name], real))
                .collect()
        }
        Shape::Variant(variant) if variant.alternatives.is_empty() => {
            assert_eq!(*golden, json!({ "vtag": 0, "name": null, "value": null }));
            json!({})
        }
        Shape::Variant(variant) => {
            let tag = usize::try_from(golden["vtag"].as_u64().unwrap()).unwrap();
            let chosen = &variant.alternatives[tag];
            assert_eq!(golden["name"], chosen.name);
            let value = view(chosen, &golden["value"], real);
            Json::Object(Map::from_iter([(chosen.name.clone(), value)]))
        }
        Shape::Scalar(scalar) => number(scalar, golden, real),
        Shape::Bits(bits) => {
            let golden = golden.as_object().unwrap();
            assert_eq!(golden.len(), bits.fields.len());
            let field = |name: &String| (name.clone(), integer(&golden[name]));
            Json::Object(
                bits.fields
                    .iter()
                    .map(|sub_field| field(&sub_field.name))
                    .collect(),
            )
        }
        Shape::FixedString { .. } | Shape::VariableString { .. } => golden.clone(),
        Shape::Blob { .. } => golden["hex"].clone(),
        Shape::FormattedBlob { .. } => {
            json!({ "format": golden["format"], "data": golden["hex"] })
        }
        Shape::Measure { choices } => {
            let index = golden["index"].as_u64().unwrap();
            let choice = choices
                .iter()
                .find(|choice| u64::from(choice.index) == index)
                .unwrap();
            assert_eq!(golden["units"], choice.scalar.units);
            let value = number(&choice.scalar, &golden["value"], real);
            json!({ "index": index, "units": golden["units"], "value": value })
        }
        Shape::Array(array) => array_view(array.dimensions.len(), &array.element, golden, real),
        other => panic!("{other:?} is unknown here"),
    }
}

fn array_view(dimensions: usize, element: &Item, golden: &Json, real: Real) -> Json {
    if dimensions == 0 {
        return view(element, golden, real);
    }
    let inner = golden.as_array().unwrap().iter();
    inner
        .map(|golden| array_view(dimensions - 1, element, golden, real))
        .collect()
}

fn number(scalar: &Scalar, golden: &Json, real: Real) -> Json {
    match (&scalar.meaning, scalar.number) {
        (Meaning::Scaled(scale), Number::Unsigned(width)) => {
            let (given, raw) = (
                golden["real"].as_f64().unwrap(),
                golden["raw"].as_u64().unwrap(),
            );
            let shown = shortest_real(scale, width, raw);
            let step = (scale.upper - scale.lower) / width.max() as f64;
            assert!(
                (shown - given).abs() <= 0.76 * step,
                "{shown} shown for {given} ({raw})"
            );
            if real == Real::Given {
                given.into()
            } else {
                shown.into()
            }
        }
        (_, Number::F32) if real == Real::Shown => {
            let shortest = (golden.as_f64().unwrap() as f32).to_string();
            shortest.parse::<f64>().unwrap().into()
        }
        (_, Number::F32 | Number::F64) => golden.as_f64().unwrap().into(),
        _ => integer(golden),
    }
}

/// Integers from 2^53 are text in the golden data.
fn integer(golden: &Json) -> Json {
    match golden {
        Json::String(text) => text
            .parse::<u64>()
            .map_or_else(|_| text.parse::<i64>().unwrap().into(), Json::from),
        number => number.clone(),
    }
}

/// Checks one vector: octets to view, octets to octets, and both views to octets.
fn check(message: &Message, row: &Json) {
    let octets = golden::octets_of(&row["hex"]);
    let value = decode(message, &octets).unwrap_or_else(|error| panic!("{error}\n{row}"));
    assert_eq!(encode(message, &value).as_ref(), Ok(&octets), "{row}");
    let body = |real| match &message.body {
        Some(body) => view(body, &row["fields"]["body"][&body.name], real),
        None => {
            assert_eq!(row["fields"].get("body"), None, "{row}");
            json!({})
        }
    };
    let shown = to_json(message, &value).unwrap();
    assert_eq!(shown.to_string(), body(Real::Shown).to_string(), "{row}");
    for written in [shown, body(Real::Given)] {
        let read = from_json(message, &written).unwrap_or_else(|error| panic!("{error}\n{row}"));
        assert_eq!(
            encode(message, &read).as_ref(),
            Ok(&octets),
            "{written}\n{row}"
        );
    }
}

#[test]
fn every_golden_message_is_read_shown_and_written_as_it_is() {
    let Some(corpus) = evidence::outside("jsidl-corpus") else {
        return;
    };
    let mut total = 0;
    for (source, rows) in golden::sources() {
        let library = golden::load(&corpus, &source);
        for row in &rows {
            check(golden::message_of(&library, row), row);
        }
        println!("{source}: {} vectors", rows.len());
        total += rows.len();
    }
    println!("{total} vectors in all");
    assert!(total > 2000, "the golden data have 2116 vectors");
}

/// Messages whose layout differs between our definitions and those of the vectors; `services.rs`
/// gives the reasons.
const LAID_OUT_OTHERWISE: &[(&str, &str)] = &[
    // Ours has its own code, which its query names; theirs has the code of another message.
    ("fkie-iop", "CBDetailedMeasurement"),
    // A name in the singular.
    ("fkie-manipulator", "ReportJointPosition"),
    ("fkie-mobility", "ReportLocalVector"),
    ("fkie-mobility", "SetLocalVector"),
    ("jts-mobility", "ReportGlobalVector"),
    ("jts-mobility", "SetGlobalVector"),
    // Names that start with a lower-case letter.
    ("jts-ugv", "ReportPlatformSpecifications"),
];

#[test]
fn our_own_definitions_read_show_and_write_the_golden_messages_of_their_services() {
    let mut loader = jsidl::Loader::new();
    loader.catalogue();
    let ours = loader.load().library;
    let mut vectors = BTreeMap::<String, usize>::new();
    for row in golden::sources().into_iter().flat_map(|(_, rows)| rows) {
        let id = golden::id_of(&row);
        let other = |&(source, message): &(&str, &str)| {
            row["source"] == source && row["message"] == message
        };
        if ours.service(&id).is_some() && !LAID_OUT_OTHERWISE.iter().any(other) {
            check(golden::message_of(&ours, &row), &row);
            *vectors.entry(id.to_string()).or_default() += 1;
        }
    }
    println!("{vectors:#?}");
    assert!(vectors.values().sum::<usize>() > 500);
}
