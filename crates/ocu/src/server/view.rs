//! The message view of one page: the traffic of the station's node, filtered, as JSON. A slow page
//! loses messages and receives their number; the traffic is never delayed.

use std::collections::VecDeque;

use axum::extract::ws::Utf8Bytes;
use serde_json::{Map, Value, json};

use crate::request::MessageFilter;
use jaus::node::{Node, Tap, Tapped};
use jaus_view::{Dictionary, Entry, Filter, FilterError, Links, MessageStream};

/// The message stream of one page.
pub(super) struct MessageView<'s> {
    tap: Tap,
    stream: MessageStream<'s>,
    links: Links,
    /// One passage can contain several messages.
    waiting: VecDeque<Utf8Bytes>,
}

impl<'s> MessageView<'s> {
    /// Limit of queued passages per page.
    const WAITING: usize = 512;

    pub(super) fn new(node: &Node, dictionary: &'s Dictionary, filter: Filter) -> Self {
        Self {
            tap: node.tap(Self::WAITING),
            stream: MessageStream::new(dictionary, filter),
            links: Links::of(node.clone()),
            waiting: VecDeque::new(),
        }
    }

    /// The next frame for the page; `None` when the node has stopped. The returned future is cancel
    /// safe.
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

/// Converts the page's filter fields to a filter.
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

/// The longest value sent to a page, in octets of JSON. Map cells, for example, are longer.
const LONGEST: usize = 16 << 10;

/// Formats a message in the page protocol.
fn in_a_frame(entry: &Entry) -> Utf8Bytes {
    let mut frame = Map::new();
    frame.insert("type".to_owned(), "message".into());
    for (key, name) in [
        ("time", "time"),
        ("source", "source"),
        ("destination", "destination"),
        ("code", "code"),
        ("service", "service"),
        ("error", "error"),
    ] {
        if let Some(text) = entry.text(key) {
            frame.insert(name.to_owned(), text.into());
        }
    }
    let name = entry.name();
    frame.insert("name".to_owned(), name.into());
    let octets = || entry.json().get("octets").cloned();
    let value = entry.body().or_else(octets);
    let value = value.as_ref().map_or(Value::Null, shortened);
    frame.insert("value".to_owned(), value);
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_names_the_report_of_an_event_and_gets_its_fields() {
        let Value::Object(line) = json!({
            "time": "2026-01-01T12:00:00.000000Z", "source": "101.2.42", "destination": "42.1.1",
            "code": "41F1", "message": "Event", "service": "urn:jaus:jss:core:Events",
            "body": {"EventID": 3, "SequenceNumber": 7, "ReportMessage": "044400"},
            "carries": {"code": "4404", "message": "ReportVelocityState", "body": {"Velocity_X": 1.5}},
        }) else {
            unreachable!("an object")
        };
        let frame: Value = serde_json::from_str(&in_a_frame(&Entry::of_object(line))).unwrap();
        assert_eq!(frame["name"], "Event: ReportVelocityState");
        assert_eq!(
            frame["value"],
            json!({"EventID": 3, "SequenceNumber": 7, "ReportMessage": {"Velocity_X": 1.5}})
        );
    }
}
