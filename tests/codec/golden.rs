//! The generated codec against octets of JTS' C++ encoder: every vector of a generated message
//! decodes to the vector's values and encodes to the same octets.

use std::fs;

use bytes::Bytes;
use jaus::codec::{MessageInfo, Rounding, Scale, ServiceId};
use jaus::messages;
use jaus_test_kit::evidence;
use serde_json::{Map, Value};

fn rows(name: &str) -> Vec<Value> {
    let text = fs::read_to_string(evidence::golden().join(name)).unwrap();
    text.lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect()
}

fn octets(hex: &str) -> Bytes {
    let pairs = hex.as_bytes().chunks(2);
    let octet = |pair| u8::from_str_radix(std::str::from_utf8(pair).unwrap(), 16).unwrap();
    pairs.map(octet).collect()
}

/// Converts a vector's notation of values to ours: drops the body's own name and the wrappers of
/// list elements and variants; reals stay as they are.
fn our_view(fields: &Value) -> Value {
    match fields.get("body").and_then(Value::as_object) {
        Some(body) => view(body.values().next().unwrap()),
        None => Value::Object(Map::new()),
    }
}

fn view(value: &Value) -> Value {
    match value {
        Value::Array(elements) => elements.iter().map(element).collect(),
        Value::Object(members) => match members {
            m if m.contains_key("raw") && m.contains_key("real") => m["real"].clone(),
            m if m.contains_key("vtag") => alternative(m),
            m if m.contains_key("units") && m.contains_key("index") => {
                let keys = ["index", "units", "value"];
                keys.into_iter()
                    .map(|key| (key.to_owned(), view(&m[key])))
                    .collect()
            }
            m if m.len() == 1 && m.contains_key("hex") => m["hex"].clone(),
            m if m.contains_key("hex") => {
                serde_json::json!({ "format": m["format"], "data": m["hex"] })
            }
            m => m
                .iter()
                .map(|(name, value)| (name.clone(), view(value)))
                .collect(),
        },
        Value::String(text) => big(text).unwrap_or_else(|| value.clone()),
        plain => plain.clone(),
    }
}

/// The vectors write integers with a magnitude of 2^53 or more as text.
fn big(text: &str) -> Option<Value> {
    let number: i128 = text.parse().ok()?;
    let is_big = number.unsigned_abs() >= 1 << 53;
    let unsigned = || u64::try_from(number).map(Value::from);
    let signed = || i64::try_from(number).map(Value::from);
    is_big.then(|| unsigned().or_else(|_| signed()).ok())?
}

/// Messages whose layout or spelling in one source differs from the definitions of our types, under
/// the same service and version: the dynamic codec reads them with that source's own definitions.
const OTHERWISE: &[(&str, &str)] = &[
    // One position per stabilizer; the two other sources have two.
    ("fkie-ugv.jsonl", "ReportStabilizerPosition"),
    // A different order of lights.
    ("jts-ugv.jsonl", "ReportIlluminationState"),
    // Names with a lower-case first letter.
    ("jts-ugv.jsonl", "ReportPlatformSpecifications"),
];

/// A list element is wrapped in an object with its name; an array's element is not.
fn element(value: &Value) -> Value {
    match value.as_object() {
        Some(members) if members.len() == 1 && !members.contains_key("hex") => {
            view(members.values().next().unwrap())
        }
        _ => view(value),
    }
}

fn alternative(members: &Map<String, Value>) -> Value {
    match members["name"].as_str() {
        Some(name) => Value::Object(Map::from_iter([(name.to_owned(), view(&members["value"]))])),
        None => Value::Object(Map::new()),
    }
}

/// Whether the values agree. They must be equal, except that a real in the vector may be any value
/// that the field rounds to the same integer, and need only be close to ours. A separate check
/// covers the octets.
fn agree(ours: &Value, theirs: &Value) -> bool {
    match (ours, theirs) {
        (Value::Object(a), Value::Object(b)) => {
            a.keys().eq(b.keys()) && a.iter().all(|(key, value)| agree(value, &b[key]))
        }
        (Value::Array(a), Value::Array(b)) => {
            a.len() == b.len() && a.iter().zip(b).all(|(a, b)| agree(a, b))
        }
        (Value::Number(a), Value::Number(b)) if a != b && (a.is_f64() || b.is_f64()) => {
            let (a, b) = (a.as_f64().unwrap(), b.as_f64().unwrap());
            // The vector's reals are a quarter step above the code.
            (a - b).abs() <= 0.005 * b.abs().max(100.0)
        }
        _ => ours == theirs,
    }
}

/// The candidate types of the vector, beginning with the one that its service declares. (Published
/// definitions of one service and version differ in two messages; both layouts are generated.)
fn generated(row: &Value) -> Vec<&'static MessageInfo> {
    let text = |key: &str| row[key].as_str().unwrap();
    let code = u16::from_str_radix(text("message_id"), 16).unwrap();
    let version = |id: &ServiceId| format!("{}.{}", id.major, id.minor);
    let declares = |id: &ServiceId| id.urn == text("service_id") && version(id) == text("version");
    let types = messages::registry().by_code(code);
    let mut types: Vec<_> = types.filter(|info| info.name == text("message")).collect();
    types.sort_by_key(|info| !info.services.iter().any(declares));
    types
}

#[test]
fn every_vector_decodes_shows_its_values_and_encodes_to_the_same_octets() {
    let mut checked = 0;
    let mut wrong = Vec::new();
    for entry in fs::read_dir(evidence::golden()).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap().to_owned();
        // The examples have their own services, whose messages only resemble these.
        if !name.ends_with(".jsonl") || name.starts_with("scaling") || name == "jts-examples.jsonl"
        {
            continue;
        }
        for row in rows(&name) {
            let types = generated(&row);
            let otherwise =
                |&(file, message): &(&str, &str)| file == name && row["message"] == message;
            if types.is_empty() || OTHERWISE.iter().any(otherwise) {
                continue;
            }
            checked += 1;
            let failures: Vec<_> = types
                .iter()
                .map_while(|info| check(info, &row).err())
                .collect();
            if failures.len() == types.len() {
                let reason = &failures[0];
                wrong.push(format!(
                    "{name} {} {}: {reason}",
                    row["message"], row["case"]
                ));
            }
        }
    }
    println!("{checked} vectors are of generated messages");
    assert!(
        wrong.is_empty(),
        "{} of {checked}:\n{}",
        wrong.len(),
        wrong.join("\n")
    );
    assert!(
        checked > 300,
        "only {checked} vectors are of generated messages"
    );
}

fn check(info: &MessageInfo, row: &Value) -> Result<(), String> {
    let octets = octets(row["hex"].as_str().unwrap());
    let message = (info.decode)(&octets).map_err(|error| error.to_string())?;
    if message.encode().map_err(|error| error.to_string())? != octets {
        return Err("it encodes to other octets".to_owned());
    }
    let text = serde_json::to_string(&*message).unwrap();
    let ours: Value = serde_json::from_str(&text).unwrap();
    let theirs = our_view(&row["fields"]);
    if !agree(&ours, &theirs) {
        return Err(format!("it shows\n  {ours}\ninstead of\n  {theirs}"));
    }
    let read = serde_json::from_str(&text).unwrap();
    let again = (info.from_view)(&read).map_err(|error| error.to_string())?;
    if again.encode().map_err(|error| error.to_string())? != octets {
        return Err(format!("{text} encodes to other octets"));
    }
    let direct = (info.from_view)(&serde_json::from_value(theirs).unwrap());
    match direct.map_err(|error| error.to_string())?.encode() {
        Ok(encoded) if encoded == octets => Ok(()),
        _ => Err("the vector's own values encode to other octets".to_owned()),
    }
}

fn scale(row: &Value) -> Scale {
    let max = match row["type"].as_str().unwrap() {
        "unsigned byte" => u8::MAX.into(),
        "unsigned short integer" => u16::MAX.into(),
        _ => u32::MAX.into(),
    };
    let limit = |key: &str| row[key].as_f64().unwrap();
    Scale::new(limit("lower"), limit("upper"), max, Rounding::Round)
}

#[test]
fn reals_are_rounded_exactly() {
    for row in rows("scaling_encode.jsonl") {
        let raw = scale(&row).raw(row["real"].as_f64().unwrap());
        assert_eq!(raw, row["round_half_up"].as_u64(), "{row}");
    }
}

#[test]
fn integers_stand_for_the_reals_that_other_decoders_give_and_come_back() {
    for row in rows("scaling_decode.jsonl") {
        let (scale, raw) = (scale(&row), row["raw"].as_u64().unwrap());
        let theirs = row["jts_real"].as_f64().unwrap();
        let tolerance = 4.0 * f64::EPSILON * (scale.upper() - scale.lower());
        assert!((scale.value(raw) - theirs).abs() <= tolerance, "{row}");
        assert_eq!(scale.raw(scale.value(raw)), Some(raw), "{row}");
        assert_eq!(scale.raw(scale.shortest(raw)), Some(raw), "{row}");
    }
}
