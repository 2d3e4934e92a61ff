//! Checks the generated JSON Schemas against the JSON view, with an independent validator.

use std::collections::BTreeMap;

use crate::support::catalogue;
use jaus_test_kit::evidence;
use jsidl::dynamic::{arbitrary, decode, from_json, to_json};
use jsidl::model::Message;
use jsidl::schema::{of_message, of_service};
use jsonschema::Validator;
use serde_json::{Value as Json, json};

fn validator(schema: &Json) -> Validator {
    jsonschema::draft202012::new(schema).unwrap_or_else(|error| panic!("{error}\n{schema:#}"))
}

#[track_caller]
fn holds(validator: &Validator, json: &Json) {
    if let Err(error) = validator.validate(json) {
        panic!("{error}\n{json:#}");
    }
}

#[test]
fn the_json_of_every_golden_message_is_valid() {
    let Some(corpus) = evidence::outside("jsidl-corpus") else {
        return;
    };
    let mut total = 0;
    for (source, rows) in crate::support::golden::sources() {
        let library = crate::support::golden::load(&corpus, &source);
        let mut validators = BTreeMap::new();
        for row in &rows {
            let message = crate::support::golden::message_of(&library, row);
            let octets = crate::support::golden::octets_of(&row["hex"]);
            let json = to_json(message, &decode(message, &octets).unwrap()).unwrap();
            let key = (
                row["service_id"].to_string(),
                row["version"].to_string(),
                message.code,
            );
            let schema = validators
                .entry(key)
                .or_insert_with(|| validator(&of_message(message)));
            holds(schema, &json);
            total += 1;
        }
    }
    println!("{total} vectors");
    assert!(total > 2000, "the golden data have 2116 vectors");
}

#[test]
fn lines_of_all_our_messages_are_valid_in_the_schema_of_their_service() {
    let library = catalogue();
    let mut total = 0;
    for service in library.services() {
        let schema = of_service(service);
        assert!(jsonschema::meta::is_valid(&schema), "{}", service.id);
        let schema = validator(&schema);
        for message in service.messages() {
            for entropy in [&[][..], &[255; 64], &[1, 2, 3, 5, 7, 11, 13, 17, 19, 23]] {
                let body = to_json(message, &arbitrary(message, entropy)).unwrap();
                let line = json!({ "code": format!("{:04X}", message.code), "message": message.name, "body": body });
                holds(&schema, &line);
                total += 1;
            }
        }
        assert!(!schema.is_valid(&json!({ "message": "Nothing", "body": {} })));
    }
    assert!(total > 500);
}

/// The minimal document of a message with the value at a JSON pointer replaced.
fn changed(message: &Message, place: &str, value: impl Into<Json>) -> Json {
    let mut json = to_json(message, &arbitrary(message, &[])).unwrap();
    let (parent, key) = place.rsplit_once('/').unwrap();
    json.pointer_mut(parent).unwrap()[key] = value.into();
    json
}

/// Checks that both the reader and the schema reject an invalid document.
#[track_caller]
fn refused(message: &Message, place: &str, value: impl Into<Json>) {
    let json = changed(message, place, value);
    assert!(from_json(message, &json).is_err(), "{json:#}");
    let schema = validator(&of_message(message));
    assert!(!schema.is_valid(&json), "{json:#}");
}

/// Checks that both accept a document in a form that the writer does not produce.
#[track_caller]
fn admitted(message: &Message, place: &str, value: impl Into<Json>) {
    let json = changed(message, place, value);
    assert!(from_json(message, &json).is_ok(), "{json:#}");
    holds(&validator(&of_message(message)), &json);
}

#[test]
fn wrong_documents_are_refused() {
    let everything = crate::support::everything();
    refused(&everything, "/Unknown", 1);
    refused(&everything, "/Flags", Json::Null);
    refused(&everything, "/Numbers/U8", 256);
    refused(&everything, "/Numbers/I8", -129);
    refused(&everything, "/Numbers/F32", "many");
    refused(&everything, "/Scaled/Speed", 100.5);
    refused(&everything, "/Flags/State", "Nowhere");
    refused(&everything, "/Flags/Bits/Low", 16);
    refused(&everything, "/Texts/Blob", "0g");
    refused(&everything, "/Texts/Image/format", 256);
    refused(&everything, "/Measured/Joint/index", 2);
    refused(&everything, "/Matrix/Cells", json!([[1, 2, 3]]));
    refused(&everything, "/Choice", json!({ "None": {} }));
    refused(&everything, "/Nothing/One", json!({}));
    refused(&crate::support::framed(), "/footer", json!({}));
}

#[test]
fn names_null_and_octets_are_admitted_where_they_are_read() {
    let everything = crate::support::everything();
    admitted(&everything, "/Flags/State", "Ready for use");
    admitted(&everything, "/Flags/Bits/Low", "On");
    admitted(&everything, "/Flags/Bits", json!({ "_reserved": 0xFF0 }));
    admitted(&everything, "/Scaled/Angle", Json::Null);
    admitted(&everything, "/Texts/Name", json!({ "hex": "FFfe" }));
    admitted(&everything, "/Numbers/F64", "NaN");
}
