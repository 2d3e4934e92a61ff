//! JSON Schema (draft 2020-12) of the JSON view of messages, the view that
//! [`dynamic::to_json`](crate::dynamic::to_json) writes and
//! [`dynamic::from_json`](crate::dynamic::from_json) reads.
//!
//! [`of_service`] returns one schema for a service. Its `$defs` hold the body of every message
//! under the message's name; the schema itself describes a message with its name, as
//! `{"message": "QueryIdentification", "body": {…}}`, other keys admitted: a line of `jaus decode`
//! and `jaus encode`. Units are in the annotation `x-units`.
//!
//! ```
//! let mut loader = jsidl::Loader::new();
//! loader.catalogue();
//! let library = loader.load().library;
//! let service = library.versions("urn:jaus:jss:core:Discovery").last().expect("it is there");
//! let schema = jsidl::schema::of_service(service);
//! let body = &schema["$defs"]["QueryIdentification"];
//! assert_eq!(body["properties"]["QueryType"]["anyOf"][0]["maximum"], 255);
//! ```

mod number;
mod shape;

use serde_json::{Map, Value as Json, json};

use crate::docs::names::Names;
use crate::library::Library;
use crate::model::{Message, Service};

/// JSON Schema dialect.
pub const DIALECT: &str = "https://json-schema.org/draft/2020-12/schema";

/// Schemas of all services that `wanted` selects, each with its file name, for example
/// `core.Discovery.1.1.schema.json`.
pub fn files(library: &Library, wanted: impl Fn(&Service) -> bool) -> Vec<(String, Json)> {
    let wanted = || library.services().map(AsRef::as_ref).filter(|s| wanted(s));
    let names = Names::new(wanted());
    let file = |service: &Service| {
        let name = names.page(&service.id).unwrap_or_default();
        (format!("{name}.schema.json"), of_service(service))
    };
    wanted().map(file).collect()
}

/// Schema of the messages that a service declares itself.
pub fn of_service(service: &Service) -> Json {
    let mut definitions = Map::new();
    let mut lines = Vec::new();
    let mut known: Vec<&Message> = Vec::new();
    for message in service.messages() {
        if known
            .iter()
            .any(|other| other.code == message.code && other.name == message.name)
        {
            continue;
        }
        known.push(message);
        let key = key(&definitions, message);
        let mut line = json!({
            "title": message.name,
            "type": "object",
            "properties": {
                "code": { "const": format!("{:04X}", message.code) },
                "message": { "const": message.name },
                "body": { "$ref": format!("#/$defs/{}", pointer(&key)) },
            },
            "required": ["message", "body"],
        });
        describe(&mut line, &message.description);
        lines.push(line);
        definitions.insert(key, of_message(message));
    }
    let mut schema = json!({
        "$schema": DIALECT,
        "title": format!("{} {}", service.name, service.id.version),
        "x-service": service.id.to_string(),
    });
    describe(&mut schema, &service.description);
    if lines.is_empty() {
        // A service without its own messages: the schema matches nothing.
        schema["not"] = json!({});
    } else {
        schema["anyOf"] = lines.into();
    }
    schema["$defs"] = definitions.into();
    schema
}

/// Schema of a message's JSON view, without the key `$schema`.
pub fn of_message(message: &Message) -> Json {
    let mut schema = if message.header.is_none() && message.footer.is_none() {
        match &message.body {
            Some(body) => shape::of(&body.shape),
            None => object(Map::new(), &[]),
        }
    } else {
        let sections = [
            ("header", &message.header),
            ("body", &message.body),
            ("footer", &message.footer),
        ];
        let sections = sections.map(|(key, item)| Some((key, item.as_ref()?)));
        let mut properties = Map::new();
        let mut required = Vec::new();
        for (key, item) in sections.into_iter().flatten() {
            properties.insert(key.to_owned(), shape::of(&item.shape));
            required.push(key);
        }
        object(properties, &required)
    };
    schema["title"] = message.name.clone().into();
    describe(&mut schema, &message.description);
    schema
}

/// The message's name, with its code if another message already has the name.
fn key(definitions: &Map<String, Json>, message: &Message) -> String {
    if definitions.contains_key(&message.name) {
        format!("{}-{:04X}", message.name, message.code)
    } else {
        message.name.clone()
    }
}

/// Escapes a key for a JSON pointer in a URI.
fn pointer(key: &str) -> String {
    let mut escaped = String::with_capacity(key.len());
    for octet in key.bytes() {
        match octet {
            b'~' => escaped.push_str("~0"),
            b'/' => escaped.push_str("~1"),
            b if b.is_ascii_alphanumeric() || b"-._".contains(&b) => escaped.push(b.into()),
            b => escaped.push_str(&format!("%{b:02X}")),
        }
    }
    escaped
}

/// Adds the author's text, if there is one.
fn describe(schema: &mut Json, words: &str) {
    if !words.is_empty() {
        schema["description"] = words.into();
    }
}

/// An object that admits only these keys.
fn object(properties: Map<String, Json>, required: &[&str]) -> Json {
    let mut schema = json!({ "type": "object" });
    if !properties.is_empty() {
        schema["properties"] = properties.into();
    }
    if !required.is_empty() {
        schema["required"] = required.into();
    }
    schema["additionalProperties"] = false.into();
    schema
}
