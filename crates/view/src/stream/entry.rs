//! One message of a stream, as a JSON object or a readable line.

use std::fmt::Write as _;

use bytes::Bytes;
use jaus::address::JausId;
use jaus_text::quoted;
use serde_json::{Map, Value as Json};

use crate::dictionary::Dictionary;
use crate::line::{CARRIED, Line};

/// A message or an error as one JSON object.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// The sender, if known.
    pub source: Option<JausId>,
    /// The destination, if known.
    pub destination: Option<JausId>,
    /// The message from its code on, if the entry is made from octets and not from JSON.
    pub octets: Option<Bytes>,
    json: Map<String, Json>,
}

/// The code of events.
const EVENT: &str = "41F1";
/// Maximum number of characters for the fields on a readable line.
const MOST_OF_BODY: usize = 160;

impl From<&Line<'_>> for Entry {
    fn from(line: &Line<'_>) -> Self {
        Self::of_line(line, Vec::new())
    }
}

impl Entry {
    /// Creates an entry from a line. `way` is inserted after the time.
    pub(super) fn of_line(line: &Line<'_>, way: Vec<(&'static str, String)>) -> Self {
        let Ok(Json::Object(object)) = serde_json::to_value(line) else {
            return Self::of_object(Map::new());
        };
        let mut json = Map::new();
        let mut way = Some(way);
        for (key, value) in object {
            let is_time = key == "time";
            if !is_time {
                put(&mut json, way.take());
            }
            json.insert(key, value);
            if is_time {
                put(&mut json, way.take());
            }
        }
        let header = line.envelope.as_ref().and_then(|e| e.header.as_ref());
        Self {
            source: header.map(|header| header.source),
            destination: header.map(|header| header.destination),
            octets: line.octets.clone(),
            json,
        }
    }

    /// Creates an entry from an object written by [`to_json`](Self::to_json) or `jaus decode`.
    #[must_use]
    pub fn of_object(json: Map<String, Json>) -> Self {
        let id = |key: &str| json.get(key)?.as_str()?.parse().ok();
        Self {
            source: id("source"),
            destination: id("destination"),
            octets: None,
            json,
        }
    }

    /// The object.
    #[must_use]
    pub const fn json(&self) -> &Map<String, Json> {
        &self.json
    }

    /// The object as text, without a line ending.
    #[must_use]
    pub fn to_json(&self) -> String {
        // Serialising to memory fails only for non-text map keys, which do not occur.
        serde_json::to_string(&self.json).unwrap_or_default()
    }

    /// A text value: `time`, `direction`, `code`, `message`, `service` …
    #[must_use]
    pub fn text(&self, key: &str) -> Option<&str> {
        self.json.get(key)?.as_str()
    }

    /// The name of the message, or its code. An event and a request for events name the message
    /// inside too: `Event: ReportVelocityState`.
    #[must_use]
    pub fn name(&self) -> String {
        let name = name_of(&self.json).unwrap_or_default();
        match self.carried().and_then(name_of) {
            Some(carried) => format!("{name}: {carried}"),
            None => name,
        }
    }

    /// The report inside, if the message is an event.
    #[must_use]
    pub fn event_report(&self) -> Option<String> {
        let is_event = self.text("code") == Some(EVENT);
        self.carried().filter(|_| is_event).and_then(name_of)
    }

    /// The fields, with those of the message inside an event in place of its octets.
    #[must_use]
    pub fn body(&self) -> Option<Json> {
        let mut body = self.json.get("body")?.clone();
        if let Some(carried) = self.carried()
            && let Some(object) = body.as_object_mut()
            && let Some(content) = carried.get("body").or_else(|| carried.get("error"))
            && let Some(field) = object
                .iter_mut()
                .find_map(|(key, value)| CARRIED.contains(&&**key).then_some(value))
        {
            *field = content.clone();
        }
        Some(body)
    }

    /// The message inside an event or a request for events: an object with `code`, `message`,
    /// `service` and `body`.
    #[must_use]
    pub fn carried(&self) -> Option<&Map<String, Json>> {
        self.json.get("carries")?.as_object()
    }

    /// The fields as [`body`](Self::body) has them, with the units of those whose definition the
    /// library of the dictionary has.
    fn body_with_units(&self, dictionary: &Dictionary) -> Option<Json> {
        let mut json = self.json.clone();
        let carried = json.get_mut("carries").and_then(Json::as_object_mut);
        if let Some(carried) = carried {
            dictionary.add_units(carried);
        }
        dictionary.add_units(&mut json);
        Self::of_object(json).body()
    }

    /// Formats one readable line: time, source and destination, name, and the fields with their units.
    #[must_use]
    pub fn in_words(&self, dictionary: &Dictionary, colours: bool) -> String {
        let paint = |code: &str, text: String| match colours {
            true => format!("\x1b[{code}m{text}\x1b[0m"),
            false => text,
        };
        let time = self.text("time").and_then(|time| time.split_once('T'));
        let time = time.map_or("", |(_, time)| time.trim_end_matches('Z'));
        let time = time.get(..12).unwrap_or(time);
        let (source, destination) = (self.text("source"), self.text("destination"));
        let ends = format!(
            "{:>10} → {:<10}",
            quoted(source.unwrap_or("?")),
            quoted(destination.unwrap_or("?"))
        );
        let mut line = format!(
            "{} {} ",
            paint("2", format!("{:<12}", quoted(time))),
            paint("36", ends)
        );
        if let Some(direction) = self.text("direction") {
            line += &paint("2", format!("{:<8} ", quoted(direction)));
        }
        line += &paint("1", quoted(&self.name()).into_owned());
        if let Some(error) = self.text("error") {
            let _ = write!(line, "  {}", paint("31", quoted(error).into_owned()));
        } else if let Some(body) = self.body_with_units(dictionary) {
            let _ = write!(line, "  {}", shortened(&fields(&body)));
        } else if let Some(octets) = self.text("octets") {
            let _ = write!(line, "  {}", shortened(&quoted(octets)));
        }
        line.trim_end().to_owned()
    }
}

/// The name of a message, or its code.
fn name_of(message: &Map<String, Json>) -> Option<String> {
    let text = |key: &str| message.get(key)?.as_str();
    text("message")
        .map(str::to_owned)
        .or_else(|| Some(format!("{}h", text("code")?)))
}

fn put(json: &mut Map<String, Json>, way: Option<Vec<(&'static str, String)>>) {
    for (key, value) in way.into_iter().flatten() {
        json.insert(key.to_owned(), value.into());
    }
}

/// The fields in sequence, without the quotes and braces of JSON.
fn fields(value: &Json) -> String {
    let join = |parts: Vec<String>| parts.join(" ");
    match value {
        Json::Object(object) => join(
            object
                .iter()
                .map(|(name, value)| (quoted(name), value))
                .map(|(name, value)| match value {
                    Json::Object(_) | Json::Array(_) => format!("{name}({})", fields(value)),
                    _ => format!("{name}={}", fields(value)),
                })
                .collect(),
        ),
        Json::Array(values) => join(
            values
                .iter()
                .map(|value| match value {
                    Json::Object(_) | Json::Array(_) => format!("[{}]", fields(value)),
                    _ => fields(value),
                })
                .collect(),
        ),
        Json::String(text) => quoted(text).into_owned(),
        other => other.to_string(),
    }
}

fn shortened(text: &str) -> String {
    match text.char_indices().nth(MOST_OF_BODY) {
        Some((at, _)) => format!("{}…", &text[..at]),
        None => text.to_owned(),
    }
}
