//! JAUS++ clients that drove a vehicle: two with events and wrench efforts, and an operator's
//! console with waypoints. Most of their datagrams have stale octets after the message.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use jaus::address::JausId;
use jaus::codec::Message;
use jaus::messages::core::{CancelEvent, ConfirmEventRequest, CreateEvent};
use jaus_test_kit::evidence;
use jaus_view::Dictionary;

use crate::tool::judge::replay::capture::{Said, said_by};
use crate::tool::judge::replay::client::{Client, Exchange, Pauses, is_answered};
use crate::tool::judge::replay::vehicle::{VEHICLE, Vehicle};

/// The clients paused for seconds at times.
const SHORT: Pauses = Pauses(Duration::from_millis(50));

/// The messages in a capture from a JAUS++ client of this id to a vehicle of this subsystem.
fn said(capture: &str, client: JausId, vehicle: u16) -> Vec<Said> {
    let capture = evidence::captures().join("jauspp").join(capture);
    let said = said_by(&capture, |id| id == client, vehicle, VEHICLE);
    assert!(!said.is_empty(), "{} has requests", capture.display());
    said
}

/// Requires an answer to every request.
#[track_caller]
fn all_answered(exchanges: &[Exchange]) {
    let dictionary = Dictionary::new();
    for (number, exchange) in exchanges.iter().enumerate() {
        let said = dictionary.line(&exchange.said.payload).to_json();
        assert!(
            is_answered(exchange),
            "number {number} has no answer: {said}"
        );
    }
}

/// Requires that the same subscription always gets the same stream. Returns the rates of the
/// streams.
#[track_caller]
fn one_stream_for_each_subscription(exchanges: &[Exchange]) -> BTreeMap<u8, f64> {
    let mut streams: BTreeMap<(u8, Vec<u8>), BTreeSet<u8>> = BTreeMap::new();
    let mut rates = BTreeMap::new();
    for exchange in exchanges {
        let Ok(creation) = CreateEvent::decode(&exchange.said.payload) else {
            continue;
        };
        let mut answers = exchange.answers.iter();
        let confirmation =
            answers.find_map(|answer| ConfirmEventRequest::decode(&answer.payload).ok());
        let confirmation = confirmation.expect("every subscription is confirmed");
        let subscription = (creation.event_type.0, creation.query_message.to_vec());
        let ids = streams.entry(subscription).or_default();
        ids.insert(confirmation.event_id);
        rates.insert(
            confirmation.event_id,
            confirmation.confirmed_periodic_rate.value(),
        );
    }
    for (subscription, ids) in &streams {
        assert_eq!(ids.len(), 1, "{subscription:?} has the streams {ids:?}");
    }
    assert_eq!(
        rates.len(),
        streams.len(),
        "two subscriptions share a stream"
    );
    rates
}

/// Replays a client up to its first cancellation, checks the streams, and then replays the rest.
fn events_do_not_multiply(capture: &str, vehicle: u16) {
    const LISTENING: f64 = 2.0;
    let said = said(capture, JausId::new(1000, 1, 7), vehicle);
    let cancellation = said.iter().position(|one| one.code() == CancelEvent::CODE);
    let (before, after) = said.split_at(cancellation.expect("it cancels"));
    let mut client = Client::new(Vehicle::start());
    client.acknowledges = true;
    let mut exchanges = client.replay(before, SHORT);
    let rates = one_stream_for_each_subscription(&exchanges);
    assert_eq!(rates.len(), 2, "two things are subscribed to");
    for (id, numbers) in client.listen(Duration::from_secs_f64(LISTENING)) {
        let rate = *rates.get(&id).expect("a stream that was confirmed");
        let is_one = numbers
            .windows(2)
            .all(|pair| pair[1] == pair[0].wrapping_add(1));
        assert!(is_one, "the events of stream {id} are numbered {numbers:?}");
        // A stream without a rate reports every change, at any rate.
        let most = (rate * LISTENING * 1.2).ceil() + 1.0;
        let came = numbers.len();
        assert!(
            rate == 0.0 || came as f64 <= most,
            "{came} events of a stream of {rate} Hz"
        );
    }
    exchanges.extend(client.replay(after, SHORT));
    all_answered(&exchanges);
    assert!(client.running().is_empty(), "all are cancelled");
    assert_eq!(client.listen(Duration::from_secs(1)), BTreeMap::new());
}

#[test]
fn a_client_of_a_jauspp_vehicle_gets_every_answer_and_no_stream_twice() {
    events_do_not_multiply("01-vehsim-client.pcap", 152);
}

#[test]
fn a_client_that_subscribes_again_and_again_gets_every_answer_and_no_stream_twice() {
    events_do_not_multiply("02-rawvehicle-client.pcap", 77);
}

#[test]
fn a_jauspp_console_with_waypoints_gets_every_answer() {
    let console = JausId::new(10002, 1, 1);
    let said = said("05-jcopc-challenge2010.pcap", console, 152);
    let mut client = Client::new(Vehicle::start());
    client.acknowledges = true;
    all_answered(&client.replay(&said, SHORT));
}
