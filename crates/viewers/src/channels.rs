//! Channels by source and message, and their samples.

use std::collections::BTreeMap;
use std::net::IpAddr;
use std::sync::Arc;
use std::time::Duration;

use jaus_limits::{Displacing, Room, quota_address};
use jaus_view::{Dictionary, Entry, Timestamp};
use serde_json::{Map, Value as Json};

use crate::schema::{MessageSchema, Schema};
use crate::topic::topic;
use crate::well_known;

/// Limit of channels. The messages of further ones are counted. One network address gets half of them
/// at most.
pub const MOST_CHANNELS: usize = 4096;
/// A live channel without samples for this time gives way to a new one.
const IDLE: Duration = Duration::from_secs(10);
/// The code of events.
const EVENT: &str = "41F1";

/// One stream of samples with a common schema.
#[derive(Debug)]
pub struct Channel {
    /// Its number, from 0, which no later channel gets.
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
/// let samples = channels.handle_entry(&entry, None, 0);
/// let channel = channels.get(samples[0].channel).expect("the sample's channel");
/// assert_eq!(channel.topic, "/jaus/101/1/1/ReportStatus");
/// assert_eq!(samples[0].value["Status"], 2);
/// # Ok::<(), String>(())
/// ```
#[derive(Debug)]
pub struct Channels<'d> {
    dictionary: &'d Dictionary,
    channels: BTreeMap<usize, Arc<Channel>>,
    /// The number of the next channel.
    next: usize,
    /// The channels by the network address of their source; `None` is this host.
    places: Displacing<Option<IpAddr>, usize>,
    by_topic: BTreeMap<String, usize>,
    definitions: BTreeMap<DefinitionKey, Arc<Definition>>,
    left_out: u64,
}

/// The origin and the time of a message.
#[derive(Debug, Clone, Copy)]
struct Arrival {
    from: Option<IpAddr>,
    /// Nanoseconds since 1970.
    time: u64,
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
    /// Starts without channels, and keeps each one. Schemas come from the library of `dictionary`.
    #[must_use]
    pub fn new(dictionary: &'d Dictionary) -> Self {
        Self::displacing(dictionary, Duration::MAX)
    }

    /// The same for live viewers: when all channels are taken, a new one replaces one that was without
    /// samples for 10 s.
    #[must_use]
    pub fn live(dictionary: &'d Dictionary) -> Self {
        Self::displacing(dictionary, IDLE)
    }

    fn displacing(dictionary: &'d Dictionary, idle: Duration) -> Self {
        Self {
            dictionary,
            channels: BTreeMap::new(),
            next: 0,
            places: Displacing::new(MOST_CHANNELS, idle),
            by_topic: BTreeMap::new(),
            definitions: BTreeMap::new(),
            left_out: 0,
        }
    }

    /// All channels, by their numbers.
    #[must_use]
    pub const fn all(&self) -> &BTreeMap<usize, Arc<Channel>> {
        &self.channels
    }

    /// A channel by its number.
    #[must_use]
    pub fn get(&self, index: usize) -> Option<&Arc<Channel>> {
        self.channels.get(&index)
    }

    /// Number of channels that were opened so far.
    #[must_use]
    pub(crate) const fn opened(&self) -> usize {
        self.next
    }

    /// Number of samples left out for want of a channel: of [`MOST_CHANNELS`], or of the share of their
    /// network address.
    #[must_use]
    pub const fn left_out(&self) -> u64 {
        self.left_out
    }

    /// The samples of a message from a network address, at a time in nanoseconds since 1970. The first is
    /// the message itself; others have schemas of Foxglove. `None` is this host, or an origin without an
    /// address.
    pub fn handle_entry(&mut self, entry: &Entry, from: Option<IpAddr>, time: u64) -> Vec<Sample> {
        let from = from.map(quota_address);
        let arrival = Arrival { from, time };
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
            self.add(topic, &definition.schema, value, arrival, &mut samples);
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
                arrival,
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
        arrival: Arrival,
        samples: &mut Vec<Sample>,
    ) {
        let now = Duration::from_nanos(arrival.time);
        let known = self.by_topic.get(&topic).copied();
        if let Some(channel) = known {
            self.places.touch(channel, now);
        }
        let Some(channel) = known.or_else(|| self.open(topic, schema, arrival)) else {
            self.left_out += 1;
            return;
        };
        samples.push(Sample {
            channel,
            time: arrival.time,
            value,
        });
    }

    /// Opens a channel, in place of an idle one if need be; `None` if there is no room.
    fn open(&mut self, topic: String, schema: &Arc<Schema>, arrival: Arrival) -> Option<usize> {
        let now = Duration::from_nanos(arrival.time);
        match self.places.room(arrival.from, now) {
            Room::Free => {}
            Room::InPlaceOf(idle) => self.close(idle),
            Room::None => return None,
        }
        let index = self.next;
        self.next += 1;
        self.places.insert(index, arrival.from, now);
        self.by_topic.insert(topic.clone(), index);
        let schema = schema.clone();
        let channel = Channel {
            index,
            topic,
            schema,
        };
        self.channels.insert(index, Arc::new(channel));
        Some(index)
    }

    fn close(&mut self, index: usize) {
        self.places.remove(index);
        if let Some(channel) = self.channels.remove(&index) {
            self.by_topic.remove(&channel.topic);
        }
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
        let taken = self.by_topic.get(&topic).and_then(|&it| self.get(it));
        if taken.is_some_and(|taken| taken.schema != definition.schema) {
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
            let samples =
                channels.handle_entry(&entry(&dictionary, &status(source, None)), None, 7);
            assert_eq!((samples.len(), samples[0].time), (1, 7));
        }
        let topics: Vec<_> = channels.all().values().map(|it| &*it.topic).collect();
        let expected = ["/jaus/101/1/1/ReportStatus", "/jaus/101/1/2/ReportStatus"];
        assert_eq!(topics, expected);
        assert_eq!(
            channels.all()[&0].schema.name,
            "core.Management.ReportStatus"
        );
    }

    #[test]
    fn another_layout_of_the_same_name_has_another_topic() {
        let dictionary = Dictionary::new().with_catalogue();
        let mut channels = Channels::new(&dictionary);
        for version in [None, Some("1.0"), None] {
            let status = status("101.1.1", version);
            channels.handle_entry(&entry(&dictionary, &status), None, 0);
        }
        let topics: Vec<_> = channels.all().values().map(|it| &*it.topic).collect();
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
        let samples = channels.handle_entry(&entry(&dictionary, &event), None, 0);
        assert_eq!(samples[0].value["Status"], 1);
        assert_eq!(channels.all()[&0].topic, "/jaus/101/1/1/ReportStatus");
    }

    /// Messages of this many components from a network address; returns how many had a channel.
    fn flood(
        channels: &mut Channels<'_>,
        dictionary: &Dictionary,
        (from, subsystem): (&str, u32),
        many: u32,
        time: Duration,
    ) -> usize {
        let from = Some(from.parse().unwrap());
        let time = u64::try_from(time.as_nanos()).unwrap();
        let sources = (0..many).map(|it| format!("{subsystem}.{}.{}", it / 200 + 1, it % 200 + 1));
        sources
            .map(|source| entry(dictionary, &status(&source, None)))
            .filter(|it| !channels.handle_entry(it, from, time).is_empty())
            .count()
    }

    #[test]
    fn an_address_that_invents_sources_leaves_channels_to_others() {
        let dictionary = Dictionary::new().with_catalogue();
        let mut channels = Channels::new(&dictionary);
        let second = Duration::from_secs;
        let flooded = flood(
            &mut channels,
            &dictionary,
            ("10.0.0.66", 66),
            4200,
            second(0),
        );
        assert_eq!(flooded, MOST_CHANNELS / 2);
        assert_eq!(channels.left_out(), 4200 - flooded as u64);
        let vehicle = ("10.0.0.1", 101);
        assert_eq!(
            flood(&mut channels, &dictionary, vehicle, 100, second(1)),
            100
        );
        assert_eq!(
            flood(&mut channels, &dictionary, vehicle, 100, second(60)),
            100,
            "known"
        );
        assert!(channels.all().len() <= MOST_CHANNELS);
    }

    #[test]
    fn live_channels_in_use_stay_and_idle_ones_give_way_however_many_addresses_are_forged() {
        let dictionary = Dictionary::new().with_catalogue();
        let mut channels = Channels::live(&dictionary);
        let vehicle = ("10.0.0.1", 101);
        let second = Duration::from_secs;
        assert_eq!(
            flood(&mut channels, &dictionary, vehicle, 50, second(0)),
            50
        );
        for address in 0..200 {
            let forged = (&*format!("10.1.{address}.1"), 1000 + address);
            flood(&mut channels, &dictionary, forged, 300, second(5));
        }
        assert_eq!(channels.all().len(), MOST_CHANNELS);
        assert_eq!(
            flood(&mut channels, &dictionary, vehicle, 50, second(14)),
            50
        );
        let newcomer = ("10.0.0.2", 102);
        assert_eq!(
            flood(&mut channels, &dictionary, newcomer, 50, second(14)),
            0
        );
        assert_eq!(
            flood(&mut channels, &dictionary, newcomer, 50, second(16)),
            50
        );
        assert_eq!(channels.all().len(), MOST_CHANNELS);
        let topics: Vec<_> = channels.all().values().map(|it| &*it.topic).collect();
        let of = |start: &str| topics.iter().filter(|it| it.starts_with(start)).count();
        assert_eq!((of("/jaus/101/"), of("/jaus/102/")), (50, 50));
    }
}
