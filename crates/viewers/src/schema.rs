//! JSON schemas that viewers understand, made from the JSON Schema of a definition.
//!
//! Foxglove and PlotJuggler accept a part of JSON Schema: each field has one `type`, and arrays hold
//! no arrays. The schema of a definition says more: a number or a name, text or octets, one of
//! several alternatives. [`MessageSchema`] narrows it, and converts each message to fit:
//!
//! | JSON view of a message | for viewers |
//! |---|---|
//! | a name or a number of an enumeration | the number, with the names in the schema (`oneOf`) |
//! | a name, or a number in a range | the number, with the names in the schema (`anyOf`) |
//! | `"NaN"`, `"Infinity"`, a number that an enumeration does not have | left out |
//! | an array with such an element | left out, because an element without a value would move the others |
//! | octets in hexadecimal | base64 (`contentEncoding`) |
//! | text, or `{"hex": …}` | text |
//! | one of several alternatives | an object with the members of all, of which one is there |
//! | arrays in arrays | one array, the last dimension fastest |
//! | a body that is no object | an object with the body as its only member |

use std::collections::BTreeMap;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use jaus_view::from_hex;
use jsidl::model::Message;
use serde_json::{Map, Value as Json, json};

/// Schema of the samples of a channel.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Schema {
    /// Its name, for example `core.Management.ReportStatus` or `foxglove.LocationFix`.
    pub name: String,
    /// JSON Schema.
    pub text: String,
}

/// The schema of a message for viewers, and the conversion to it.
#[derive(Debug)]
pub(crate) struct MessageSchema {
    pub(crate) json: Json,
    form: Form,
    /// The member that holds a body that is no object.
    wrapper: Option<String>,
}

/// What a value is converted to.
#[derive(Debug)]
enum Form {
    Integer,
    Number,
    /// An integer that may have a name. With `closed`, it has one.
    Named {
        names: BTreeMap<String, i64>,
        closed: bool,
    },
    Text,
    Octets,
    Object(BTreeMap<String, Self>),
    List(Box<Self>),
    /// Arrays in arrays, with the form of the innermost elements.
    Nested(Box<Self>),
}

impl MessageSchema {
    pub(crate) fn of(message: &Message) -> Self {
        let (mut json, form) = narrow(&jsidl::schema::of_message(message));
        if matches!(form, Form::Object(_)) {
            return Self {
                json,
                form,
                wrapper: None,
            };
        }
        let body = message.body.as_ref().map(|body| body.name.clone());
        let name = body.unwrap_or_else(|| "Body".to_owned());
        let title = json.as_object_mut().and_then(|it| it.remove("title"));
        json = object(&Map::from_iter([(name.clone(), json)]));
        json["title"] = title.unwrap_or_default();
        Self {
            json,
            form,
            wrapper: Some(name),
        }
    }

    /// The body of a message as the schema describes it.
    pub(crate) fn convert(&self, body: &Json) -> Json {
        let value = self.form.convert(body);
        match &self.wrapper {
            None => value.unwrap_or_else(|| json!({})),
            Some(name) => {
                let member = value.map(|value| (name.clone(), value));
                Json::Object(member.into_iter().collect())
            }
        }
    }
}

impl Form {
    /// The value in this form; `None` if it cannot be represented.
    fn convert(&self, value: &Json) -> Option<Json> {
        match self {
            Self::Integer => is_integer(value).then(|| value.clone()),
            Self::Number => value.is_number().then(|| value.clone()),
            Self::Named { names, closed } => match value.as_str() {
                Some(name) => names.get(name).map(|&number| number.into()),
                None => {
                    let has_name = || names.values().any(|&it| value.as_i64() == Some(it));
                    let fits = is_integer(value) && (!closed || has_name());
                    fits.then(|| value.clone())
                }
            },
            Self::Text => {
                let text = value.as_str().or_else(|| value.get("hex")?.as_str())?;
                Some(text.into())
            }
            Self::Octets => {
                let octets = from_hex(value.as_str()?).ok()?;
                Some(STANDARD.encode(octets).into())
            }
            Self::Object(members) => {
                let object = value.as_object()?;
                let members = object.iter().filter_map(|(name, value)| {
                    let value = members.get(name)?.convert(value)?;
                    Some((name.clone(), value))
                });
                Some(Json::Object(members.collect()))
            }
            Self::List(element) => {
                let elements = value.as_array()?.iter();
                elements.map(|it| element.convert(it)).collect()
            }
            Self::Nested(element) => {
                let mut elements = Vec::new();
                element.flatten(value, &mut elements)?;
                Some(elements.into())
            }
        }
    }

    fn flatten(&self, value: &Json, into: &mut Vec<Json>) -> Option<()> {
        match value.as_array() {
            Some(values) => values
                .iter()
                .try_for_each(|value| self.flatten(value, into)),
            None => {
                into.push(self.convert(value)?);
                Some(())
            }
        }
    }
}

/// Narrows a schema, and keeps its annotations.
fn narrow(schema: &Json) -> (Json, Form) {
    let (mut narrowed, form) = match schema["anyOf"].as_array() {
        Some(alternatives) => narrow_alternatives(schema, alternatives),
        None => narrow_type(schema),
    };
    for key in ["title", "description", "x-units", "x-format"] {
        if let (Some(text), None) = (schema.get(key), narrowed.get(key)) {
            narrowed[key] = text.clone();
        }
    }
    (narrowed, form)
}

fn narrow_type(schema: &Json) -> (Json, Form) {
    let kind = schema["type"].as_str().unwrap_or_default();
    match kind {
        "object" => narrow_members(schema["properties"].as_object().into_iter().flatten()),
        "array" => {
            let (items, form) = narrow(&schema["items"]);
            match form {
                Form::List(element) | Form::Nested(element) => (items, Form::Nested(element)),
                form => (array(&items), Form::List(Box::new(form))),
            }
        }
        "string" if schema.get("pattern").is_some() => (
            json!({ "type": "string", "contentEncoding": "base64" }),
            Form::Octets,
        ),
        "string" => (json!({ "type": "string" }), Form::Text),
        "integer" => (json!({ "type": "integer" }), Form::Integer),
        // Numbers, and constants, which the generator gives no type.
        _ => match schema["const"].is_string() {
            true => (json!({ "type": "string" }), Form::Text),
            false => (json!({ "type": "number" }), Form::Number),
        },
    }
}

fn narrow_alternatives(schema: &Json, alternatives: &[Json]) -> (Json, Form) {
    let of_type = |kind: &str| alternatives.iter().find(|it| it["type"] == kind);
    if of_type("null").is_some()
        && let Some(present) = alternatives.iter().find(|it| it["type"] != "null")
    {
        return narrow(present);
    }
    if let Some(listed) = schema["x-values"].as_array() {
        return named(listed, schema.get("x-ranges").is_some());
    }
    if of_type("string").is_some() {
        return (json!({ "type": "string" }), Form::Text);
    }
    if of_type("number").is_some() {
        return (json!({ "type": "number" }), Form::Number);
    }
    // The alternatives of a variant or a measure: all their members.
    let members = alternatives
        .iter()
        .filter_map(|it| it["properties"].as_object());
    narrow_members(members.flatten())
}

fn narrow_members<'a>(members: impl Iterator<Item = (&'a String, &'a Json)>) -> (Json, Form) {
    let mut properties = Map::new();
    let mut forms = BTreeMap::new();
    for (name, schema) in members {
        if properties.contains_key(name) {
            continue;
        }
        let (schema, form) = narrow(schema);
        properties.insert(name.clone(), schema);
        forms.insert(name.clone(), form);
    }
    (object(&properties), Form::Object(forms))
}

fn is_integer(value: &Json) -> bool {
    value.is_i64() || value.is_u64()
}

/// A number with names, which are listed as `"5 EMERGENCY"`. Of two equal names the first counts.
/// `has_others` says whether the definition has ranges, too.
///
/// Viewers show the names of `oneOf`, in which they accept no more than constants.
fn named(listed: &[Json], has_others: bool) -> (Json, Form) {
    let mut names = BTreeMap::new();
    let mut constants = Vec::new();
    let split = |it: &Json| {
        let (number, name) = it.as_str()?.split_once(' ')?;
        Some((number.parse::<i64>().ok()?, name.to_owned()))
    };
    for (number, name) in listed.iter().filter_map(split) {
        constants.push(json!({ "title": name, "const": number }));
        names.entry(name).or_insert(number);
    }
    let mut schema = json!({ "type": "integer" });
    // A single name is that of a special value among others, such as a timeout of 0.
    let closed = constants.len() > 1 && !has_others;
    if closed {
        schema["oneOf"] = constants.into();
    } else if constants.len() > 1 {
        constants.push(json!({ "type": "integer" }));
        schema["anyOf"] = constants.into();
    }
    (schema, Form::Named { names, closed })
}

fn object(properties: &Map<String, Json>) -> Json {
    json!({ "type": "object", "properties": properties })
}

fn array(items: &Json) -> Json {
    json!({ "type": "array", "items": items })
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use jsidl::Loader;

    use super::*;

    fn every_message() -> Vec<Arc<Message>> {
        let mut loader = Loader::new();
        loader.catalogue();
        let library = loader.load().library;
        library
            .services()
            .flat_map(|it| it.messages().cloned().collect::<Vec<_>>())
            .collect()
    }

    fn schema_of(name: &str) -> MessageSchema {
        let messages = every_message();
        let message = messages.iter().find(|it| it.name == name);
        MessageSchema::of(message.unwrap())
    }

    /// What Foxglove's reader of schemas demands of an object and its members.
    #[track_caller]
    fn assert_is_understood(schema: &Json, place: &str) {
        assert_eq!(schema["type"], "object", "{place}: {schema}");
        for (name, member) in schema["properties"].as_object().unwrap() {
            let place = format!("{place}.{name}");
            let leaf = match member["type"].as_str() {
                Some("array") => &member["items"],
                _ => member,
            };
            match leaf["type"].as_str() {
                Some("object") => assert_is_understood(leaf, &place),
                Some("number" | "integer" | "string") => {}
                other => panic!("{place}: {other:?} in {member}"),
            }
            if let Some(constants) = leaf["oneOf"].as_array() {
                assert!(constants.iter().all(|it| it["const"].is_i64()), "{place}");
            }
        }
    }

    #[test]
    fn viewers_understand_the_schema_of_every_message() {
        let messages = every_message();
        assert!(messages.len() > 500);
        for message in messages {
            assert_is_understood(&MessageSchema::of(&message).json, &message.name);
        }
    }

    #[test]
    fn enumerated_values_are_numbers_whose_names_are_in_the_schema() {
        let schema = schema_of("ReportStatus");
        let status = &schema.json["properties"]["Status"];
        assert!(
            status["oneOf"]
                .as_array()
                .unwrap()
                .contains(&json!({ "title": "EMERGENCY", "const": 5 }))
        );
        let convert = |status: Json| schema.convert(&json!({ "Status": status, "Reserved": 0 }));
        let expected = json!({ "Status": 5, "Reserved": 0 });
        assert_eq!(convert("EMERGENCY".into()), expected);
        assert_eq!(convert(5.into()), expected);
        for undefined in [Json::from("no such name"), 6.into(), 255.into()] {
            assert_eq!(convert(undefined), json!({ "Reserved": 0 }));
        }
    }

    #[test]
    fn a_number_with_names_and_ranges_may_be_any() {
        let mut schema = json!({
            "anyOf": [{ "type": "integer" }, { "enum": ["ANY", "NONE"] }],
            "x-values": ["0 NONE", "255 ANY"],
        });
        let (closed, form) = narrow(&schema);
        assert_eq!(closed["oneOf"][1]["const"], 255);
        assert_eq!(form.convert(&json!(1)), None);
        schema["x-ranges"] = json!(["1 to 254"]);
        let (open, form) = narrow(&schema);
        assert_eq!(open.get("oneOf"), None);
        assert_eq!(open["anyOf"][2], json!({ "type": "integer" }));
        assert_eq!(form.convert(&json!(1)), Some(json!(1)));
        assert_eq!(form.convert(&json!("ANY")), Some(json!(255)));
    }

    #[test]
    fn a_number_with_one_special_value_is_no_enumeration() {
        let schema = schema_of("ReportTimeout");
        assert!(schema.json["properties"]["Timeout"].get("oneOf").is_none());
        let body = json!({ "Timeout": "TIMEOUT_FEATURE_DISABLED" });
        assert_eq!(schema.convert(&body), json!({ "Timeout": 0 }));
        assert_eq!(
            schema.convert(&json!({ "Timeout": 4 })),
            json!({ "Timeout": 4 })
        );
    }

    #[test]
    fn units_stay_with_their_fields_and_absent_fields_stay_absent() {
        let schema = schema_of("ReportLocalPose");
        assert_eq!(schema.json["properties"]["X"]["x-units"], "meter");
        assert_eq!(schema.json["properties"]["X"]["type"], "number");
        let body = json!({ "X": 1.5, "Y": null });
        assert_eq!(schema.convert(&body), json!({ "X": 1.5 }));
    }

    #[test]
    fn a_body_that_is_a_list_becomes_a_member_of_an_object() {
        let schema = schema_of("ReportStillImageDataExt");
        let image = json!([{ "SensorID": 1, "ImageFrame": { "format": 0, "data": "FFD8" } }]);
        let expected = json!({
            "StillImageDataList": [{ "SensorID": 1, "ImageFrame": { "format": 0, "data": "/9g=" } }]
        });
        assert_eq!(schema.convert(&image), expected);
    }

    #[test]
    fn arrays_in_arrays_become_one_array() {
        let nested = json!({ "type": "array", "items": { "type": "array", "items": {
            "type": "integer", "minimum": 0, "maximum": 255 } } });
        let (json, form) = narrow(&nested);
        assert_eq!(json, array(&json!({ "type": "integer" })));
        assert_eq!(
            form.convert(&json!([[1, 2], [3, 4]])),
            Some(json!([1, 2, 3, 4]))
        );
        assert_eq!(form.convert(&json!([[1, "NaN"], [3, 4]])), None);
    }

    #[test]
    fn what_is_no_finite_number_is_left_out() {
        let float = json!({ "anyOf": [{ "type": "number" }, { "enum": ["NaN"] }] });
        let (json, form) = narrow(&float);
        assert_eq!(json, json!({ "type": "number" }));
        assert_eq!(form.convert(&json!(0.5)), Some(json!(0.5)));
        assert_eq!(form.convert(&json!("NaN")), None);
    }
}
