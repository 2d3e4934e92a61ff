//! One message of a stream, as a JSON object or a readable line.

use std::fmt::Write as _;

use serde_json::{Map, Value as Json};

use crate::line::Line;
use jaus::address::JausId;

/// A message or an error as one JSON object.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// The sender, if known.
    pub source: Option<JausId>,
    /// The destination, if known.
    pub destination: Option<JausId>,
    json: Map<String, Json>,
}

/// Maximum number of characters for the fields on a readable line.
const MOST_OF_BODY: usize = 160;

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

    /// Formats one readable line: time, source and destination, name, and the fields.
    #[must_use]
    pub fn in_words(&self, colours: bool) -> String {
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
            source.unwrap_or("?"),
            destination.unwrap_or("?")
        );
        let name = match (self.text("message"), self.text("code")) {
            (Some(message), _) => message.to_owned(),
            (None, Some(code)) => format!("{code}h"),
            (None, None) => String::new(),
        };
        let mut line = format!(
            "{} {} ",
            paint("2", format!("{time:<12}")),
            paint("36", ends)
        );
        if let Some(direction) = self.text("direction") {
            line += &paint("2", format!("{direction:<8} "));
        }
        line += &paint("1", name);
        if let Some(error) = self.text("error") {
            let _ = write!(line, "  {}", paint("31", error.to_owned()));
        } else if let Some(body) = self.json.get("body") {
            let _ = write!(line, "  {}", shortened(&fields(body)));
        } else if let Some(octets) = self.text("octets") {
            let _ = write!(line, "  {}", shortened(octets));
        }
        line.trim_end().to_owned()
    }
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
        Json::String(text) => {
            // Text from a peer must not reach the terminal as control sequences.
            text.chars()
                .map(|c| if c.is_control() { '·' } else { c })
                .collect()
        }
        other => other.to_string(),
    }
}

fn shortened(text: &str) -> String {
    match text.char_indices().nth(MOST_OF_BODY) {
        Some((at, _)) => format!("{}…", &text[..at]),
        None => text.to_owned(),
    }
}
