//! The message view of one page: what passes the station's node, filtered, as JSON. A page that is
//! too slow loses messages and is told how many; the traffic never waits.

use std::collections::VecDeque;

use axum::extract::ws::Utf8Bytes;
use serde_json::{Map, Value, json};

use crate::request::MessageFilter;
use jaus::node::{Node, Tap, Tapped};
use jaus_view::{Dictionary, Entry, Filter, FilterError, Links, MessageStream};

/// What a page sees of the messages.
pub(super) struct MessageView<'s> {
    tap: Tap,
    stream: MessageStream<'s>,
    links: Links,
    /// Several messages may pass at once.
    waiting: VecDeque<Utf8Bytes>,
}

impl<'s> MessageView<'s> {
    /// Passages that may wait for a page.
    const WAITING: usize = 512;

    pub(super) fn new(node: &Node, dictionary: &'s Dictionary, filter: Filter) -> Self {
        Self {
            tap: node.tap(Self::WAITING),
            stream: MessageStream::new(dictionary, filter),
            links: Links::of(node.clone()),
            waiting: VecDeque::new(),
        }
    }

    /// The next frame for the page; `None` when the node has stopped. Nothing is lost if the
    /// returned future is dropped.
    pub(super) async fn next(&mut self) -> Option<Utf8Bytes> {
        loop {
            if let Some(frame) = self.waiting.pop_front() {
                return Some(frame);
            }
            match self.tap.next().await? {
                Tapped::Passage(passage) => {
                    let entries = self.stream.read_passage(&passage, &mut self.links);
                    self.waiting.extend(entries.iter().map(in_a_frame));
                }
                Tapped::Lost(count) => {
                    let lost = json!({"type": "lost", "count": count});
                    self.waiting.push_back(lost.to_string().into());
                }
            }
        }
    }
}

/// A filter as a page has it in its fields.
pub(super) fn filter(wanted: &MessageFilter) -> Result<Filter, FilterError> {
    let mut filter = Filter::default();
    for (key, value) in [
        ("component", &wanted.component),
        ("service", &wanted.service),
        ("message", &wanted.message),
        ("text", &wanted.text),
    ] {
        filter.add(key, value)?;
    }
    Ok(filter)
}

/// The longest value that a page is shown, in octets of JSON: a map's cells are not for reading.
const LONGEST: usize = 16 << 10;

/// A message in the page's words.
fn in_a_frame(entry: &Entry) -> Utf8Bytes {
    let mut frame = Map::new();
    frame.insert("type".to_owned(), "message".into());
    for (key, name) in [
        ("time", "time"),
        ("source", "source"),
        ("destination", "destination"),
        ("code", "code"),
        ("message", "name"),
        ("service", "service"),
        ("error", "error"),
    ] {
        if let Some(text) = entry.text(key) {
            frame.insert(name.to_owned(), text.into());
        }
    }
    let body = entry
        .json()
        .get("body")
        .or_else(|| entry.json().get("octets"));
    frame.insert("value".to_owned(), body.map_or(Value::Null, shortened));
    Value::Object(frame).to_string().into()
}

fn shortened(value: &Value) -> Value {
    let length = value.to_string().len();
    if length <= LONGEST {
        value.clone()
    } else {
        format!("{length} octets of JSON, too long to show").into()
    }
}
