//! Channels by source and message, and their samples.

use std::collections::BTreeMap;
use std::sync::Arc;

use jaus_view::{Dictionary, Entry, Timestamp};
use serde_json::{Map, Value as Json};

use crate::schema::{MessageSchema, Schema};
use crate::topic::topic;
use crate::well_known;

/// Limit of channels. The messages of further ones are counted.
pub const MOST_CHANNELS: usize = 4096;
/// The code of events.
const EVENT: &str = "41F1";

/// One stream of samples with a common schema.
#[derive(Debug)]
pub struct Channel {
    /// Its number, from 0.
    pub index: usize,
    /// Its topic, for example `/jaus/101/1/40/ReportLocalPose`.
    pub topic: String,
    /// The schema of its samples.
    pub schema: Arc<Schema>,
}

/// One message on a channel.
#[derive(Debug, Clone, PartialEq)]
pub struct Sample {
    /// [`Channel::index`].
    pub channel: usize,
    /// Time in nanoseconds since 1970.
    pub time: u64,
    /// The message, as the schema of the channel describes it.
    pub value: Json,
}

/// Turns messages into samples, and opens a channel for each new source and message.
///
/// A report inside an event is a sample of the report's channel: a value has one channel, whether it
/// was queried or subscribed to. Messages without a definition have no channel.
///
/// ```
/// use jaus_view::{Dictionary, Filter, MessageStream};
/// use jaus_viewers::Channels;
///
/// let dictionary = Dictionary::new().with_catalogue();
/// let stream = MessageStream::new(&dictionary, Filter::default());
/// let line = r#"{"source":"101.1.1","code":"4002","message":"ReportStatus",
///     "service":"urn:jaus:jss:core:Management","body":{"Status":"STANDBY","Reserved":0}}"#;
/// let entry = stream.read_json(line)?.expect("every message matches");
/// let mut channels = Channels::new(&dictionary);
/// let samples = channels.handle_entry(&entry, 0);
/// assert_eq!(channels.all()[samples[0].channel].topic, "/jaus/101/1/1/ReportStatus");
/// assert_eq!(samples[0].value["Status"], 2);
/// # Ok::<(), String>(())
/// ```
#[derive(Debug)]
pub struct Channels<'d> {
    dictionary: &'d Dictionary,
    channels: Vec<Arc<Channel>>,
    by_topic: BTreeMap<String, usize>,
    definitions: BTreeMap<DefinitionKey, Arc<Definition>>,
    left_out: u64,
}

/// Service, version if it is not the usual one, and code.
type DefinitionKey = (String, Option<String>, String);

/// The schema of a message, and the conversion of its bodies.
#[derive(Debug)]
struct Definition {
    schema: Arc<Schema>,
    conversion: MessageSchema,
}

impl<'d> Channels<'d> {
    /// Starts without channels. Schemas come from the library of `dictionary`.
    #[must_use]
    pub fn new(dictionary: &'d Dictionary) -> Self {
        Self {
            dictionary,
            channels: Vec::new(),
            by_topic: BTreeMap::new(),
            definitions: BTreeMap::new(),
            left_out: 0,
        }
    }

    /// All channels so far.
    #[must_use]
    pub fn all(&self) -> &[Arc<Channel>] {
        &self.channels
    }

    /// Number of samples left out, because there are [`MOST_CHANNELS`] already.
    #[must_use]
    pub const fn left_out(&self) -> u64 {
        self.left_out
    }

    /// The samples of a message of this time, in nanoseconds since 1970. The first is the message
    /// itself; others have schemas of Foxglove.
    pub fn handle_entry(&mut self, entry: &Entry, time: u64) -> Vec<Sample> {
        let is_event = entry.text("code") == Some(EVENT);
        let object = match entry.carried() {
            Some(carried) if is_event => carried,
            _ => entry.json(),
        };
        let (Some(source), Some(body)) = (entry.text("source"), object.get("body")) else {
            return Vec::new();
        };
        let mut samples = Vec::new();
        if let Some((topic, definition)) = self.definition(source, object) {
            let value = definition.conversion.convert(body);
            self.add(topic, &definition.schema, value, time, &mut samples);
        }
        let text = |key: &str| object.get(key).and_then(Json::as_str).unwrap_or_default();
        let message = well_known::Message {
            service: text("service"),
            name: text("message"),
            source,
            body,
            time,
        };
        for sample in well_known::samples(&message) {
            self.add(
                sample.topic,
                &sample.schema,
                sample.value,
                time,
                &mut samples,
            );
        }
        samples
    }

    fn add(
        &mut self,
        topic: String,
        schema: &Arc<Schema>,
        value: Json,
        time: u64,
        samples: &mut Vec<Sample>,
    ) {
        let known = self.by_topic.get(&topic).copied();
        let channel = match known {
            Some(channel) => channel,
            None if self.channels.len() < MOST_CHANNELS => self.open(topic, schema),
            None => {
                self.left_out += 1;
                return;
            }
        };
        samples.push(Sample {
            channel,
            time,
            value,
        });
    }

    fn open(&mut self, topic: String, schema: &Arc<Schema>) -> usize {
        let index = self.channels.len();
        self.by_topic.insert(topic.clone(), index);
        self.channels.push(Arc::new(Channel {
            index,
            topic,
            schema: schema.clone(),
        }));
        index
    }

    /// The topic and the definition of a message; `None` if it has no definition.
    fn definition(
        &mut self,
        source: &str,
        object: &Map<String, Json>,
    ) -> Option<(String, Arc<Definition>)> {
        let text = |key: &str| object.get(key)?.as_str();
        let (service, code, message) = (text("service")?, text("code")?, text("message")?);
        let version = text("version");
        let key = (
            service.to_owned(),
            version.map(str::to_owned),
            code.to_owned(),
        );
        let definition = match self.definitions.get(&key) {
            Some(known) => known.clone(),
            None => {
                let model = self.dictionary.model_of(object)?;
                let conversion = MessageSchema::of(model);
                let schema = Arc::new(Schema {
                    name: schema_name(service, version, message),
                    text: conversion.json.to_string(),
                });
                let definition = Arc::new(Definition { schema, conversion });
                self.definitions.insert(key, definition.clone());
                definition
            }
        };
        let mut topic = topic(source, message);
        // Another layout with the same name: another version, or another service.
        let taken = self.by_topic.get(&topic);
        if taken.is_some_and(|&taken| self.channels[taken].schema != definition.schema) {
            topic = format!("{topic}/{}", definition.schema.name);
        }
        Some((topic, definition))
    }
}

/// `core.Management.ReportStatus`, or `core.Management.1.0.ReportStatus`.
fn schema_name(service: &str, version: Option<&str>, message: &str) -> String {
    let mut parts: Vec<_> = service.rsplit(':').take(2).collect();
    parts.reverse();
    parts.extend(version);
    parts.push(message);
    parts.join(".")
}

/// Nanoseconds since 1970; 0 for times before, and the greatest number for those that do not fit.
#[must_use]
pub fn nanoseconds(time: Timestamp) -> u64 {
    let seconds = u64::try_from(time.seconds()).unwrap_or(0);
    let nanoseconds = seconds.checked_mul(1_000_000_000);
    let nanoseconds = nanoseconds.and_then(|it| it.checked_add(time.subsec_nanos().into()));
    nanoseconds.unwrap_or(u64::MAX)
}

#[cfg(test)]
mod tests {
    use jaus_view::{Filter, MessageStream};

    use super::*;

    fn entry(dictionary: &Dictionary, json: &Json) -> Entry {
        let stream = MessageStream::new(dictionary, Filter::default());
        stream.read_json(&json.to_string()).unwrap().unwrap()
    }

    fn status(source: &str, version: Option<&str>) -> Json {
        let mut json = serde_json::json!({
            "source": source, "code": "4002", "message": "ReportStatus",
            "service": "urn:jaus:jss:core:Management",
            "body": { "Status": "READY", "Reserved": 0 },
        });
        if let Some(version) = version {
            json["version"] = version.into();
        }
        json
    }

    #[test]
    fn each_source_and_message_has_a_channel_of_its_own() {
        let dictionary = Dictionary::new().with_catalogue();
        let mut channels = Channels::new(&dictionary);
        for source in ["101.1.1", "101.1.2", "101.1.1"] {
            let samples = channels.handle_entry(&entry(&dictionary, &status(source, None)), 7);
            assert_eq!((samples.len(), samples[0].time), (1, 7));
        }
        let topics: Vec<_> = channels.all().iter().map(|it| &*it.topic).collect();
        let expected = ["/jaus/101/1/1/ReportStatus", "/jaus/101/1/2/ReportStatus"];
        assert_eq!(topics, expected);
        assert_eq!(
            channels.all()[0].schema.name,
            "core.Management.ReportStatus"
        );
    }

    #[test]
    fn another_layout_of_the_same_name_has_another_topic() {
        let dictionary = Dictionary::new().with_catalogue();
        let mut channels = Channels::new(&dictionary);
        for version in [None, Some("1.0"), None] {
            let status = status("101.1.1", version);
            channels.handle_entry(&entry(&dictionary, &status), 0);
        }
        let topics: Vec<_> = channels.all().iter().map(|it| &*it.topic).collect();
        let expected = [
            "/jaus/101/1/1/ReportStatus",
            "/jaus/101/1/1/ReportStatus/core.Management.1.0.ReportStatus",
        ];
        assert_eq!(topics, expected);
    }

    #[test]
    fn a_report_inside_an_event_is_a_sample_of_the_report() {
        let dictionary = Dictionary::new().with_catalogue();
        let mut channels = Channels::new(&dictionary);
        let mut event = serde_json::json!({
            "source": "101.1.1", "code": "41F1", "message": "Event",
            "service": "urn:jaus:jss:core:Events",
            "body": { "EventID": 1, "SequenceNumber": 0, "ReportMessage": "0240" },
        });
        event["carries"] = status("", None);
        let samples = channels.handle_entry(&entry(&dictionary, &event), 0);
        assert_eq!(samples[0].value["Status"], 1);
        assert_eq!(channels.all()[0].topic, "/jaus/101/1/1/ReportStatus");
    }

    #[test]
    fn channels_are_bounded_and_what_is_left_out_is_counted() {
        let dictionary = Dictionary::new().with_catalogue();
        let mut channels = Channels::new(&dictionary);
        for source in 0..MOST_CHANNELS + 10 {
            let source = format!("{}.{}.1", source / 200 + 1, source % 200 + 1);
            channels.handle_entry(&entry(&dictionary, &status(&source, None)), 0);
        }
        assert_eq!(channels.all().len(), MOST_CHANNELS);
        assert_eq!(channels.left_out(), 10);
        let known = entry(&dictionary, &status("1.1.1", None));
        assert_eq!(channels.handle_entry(&known, 0).len(), 1);
    }
}
