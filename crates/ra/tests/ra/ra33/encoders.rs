//! Octets of known values from OpenJAUS's own encoders.

use std::collections::BTreeSet;

use jaus_ra::messages;
use serde_json::Value;

use super::{Definitions, octets, payload, through_both};

const VECTORS: &str = include_str!("openjaus-3.3.1.tsv");

/// Messages whose encoder is broken: this one copies its output over the text field.
const BROKEN: [u16; 1] = [0x0A21];

/// A row of the table.
struct Vector {
    name: &'static str,
    code: u16,
    data: Vec<u8>,
    values: Value,
}

fn vectors() -> impl Iterator<Item = Vector> {
    let rows = VECTORS.lines().filter(|line| !line.starts_with('#'));
    rows.map(|row| {
        let mut columns = row.split('\t');
        let mut column = || columns.next().unwrap();
        Vector {
            name: column(),
            code: u16::from_str_radix(column(), 16).unwrap(),
            data: octets(column()),
            values: serde_json::from_str(column()).unwrap(),
        }
    })
}

#[test]
fn what_openjaus_encodes_is_read_and_written_again_by_both_codecs() {
    let definitions = Definitions::new();
    for vector in vectors() {
        let definition = definitions.of(vector.code).unwrap();
        assert_eq!(definition.generated.name, vector.name);
        let payload = payload(vector.code, &vector.data);
        let (octets, view) = through_both(&definition, &payload);
        assert_eq!(octets, payload, "{}", vector.name);
        let shown: Value = serde_json::from_str(&view).unwrap();
        assert_same(vector.name, &shown, &vector.values);
    }
}

#[test]
fn the_values_that_openjaus_was_given_make_the_same_octets() {
    let definitions = Definitions::new();
    for vector in vectors() {
        let definition = definitions.of(vector.code).unwrap();
        let payload = payload(vector.code, &vector.data);
        let view = serde_json::from_value(vector.values.clone()).unwrap();
        let message = (definition.generated.from_view)(&view).unwrap();
        assert_eq!(message.encode().unwrap(), payload, "{}", vector.name);
        let value = jsidl::dynamic::from_json(&definition.dynamic, &vector.values).unwrap();
        let octets = jsidl::dynamic::encode(&definition.dynamic, &value).unwrap();
        assert_eq!(octets, payload, "{}", vector.name);
    }
}

#[test]
fn every_message_was_compared_but_what_openjaus_cannot_write() {
    let compared: BTreeSet<u16> = vectors().map(|vector| vector.code).collect();
    let missing = messages::registry().iter().map(|info| info.code);
    let missing: Vec<_> = missing.filter(|code| !compared.contains(code)).collect();
    assert_eq!(missing, BROKEN);
}

/// Compares values; numbers may differ by about half a step of the coarsest scale.
fn assert_same(name: &str, shown: &Value, given: &Value) {
    match (shown, given) {
        (Value::Number(shown), Value::Number(given)) => {
            let (shown, given) = (shown.as_f64().unwrap(), given.as_f64().unwrap());
            // The coarsest scale: 0 to 10000 m/s in two octets.
            let near = (shown - given).abs() <= 0.08;
            assert!(near, "{name}: {shown} instead of {given}");
        }
        (Value::Object(shown), Value::Object(given)) => {
            let keys =
                |map: &serde_json::Map<String, Value>| map.keys().cloned().collect::<Vec<_>>();
            assert_eq!(keys(shown), keys(given), "{name}");
            for (key, shown) in shown {
                assert_same(&format!("{name} {key}"), shown, &given[key]);
            }
        }
        (Value::Array(shown), Value::Array(given)) => {
            assert_eq!(shown.len(), given.len(), "{name}");
            for (shown, given) in shown.iter().zip(given) {
                assert_same(name, shown, given);
            }
        }
        (shown, given) => assert_eq!(shown, given, "{name}"),
    }
}
