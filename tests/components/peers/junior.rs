//! Junior's side of captures, replayed in virtual time to our node in place of the other Junior
//! node: our octets equal the recorded ones.

use std::net::SocketAddr;

use super::recorded::Recorded;
use super::stand_in::StandIn;
use bytes::Bytes;
use jaus::address::JausId;
use jaus::endpoint::{Config, Counter, Event, Outgoing, To};
use jaus::peer::Implementation;
use jaus::wire::DataControl;
use jaus_test_kit::evidence;

const A: JausId = JausId::new(1, 1, 1);
const B: JausId = JausId::new(2, 1, 1);
/// Junior's longest payload.
const PAYLOAD: usize = 4079;

fn address(host: &str) -> SocketAddr {
    format!("10.77.0.{host}:3794").parse().unwrap()
}

/// The datagrams sent by each of the two nodes.
fn said(file: &str) -> (Vec<Recorded>, Vec<Recorded>) {
    let file = evidence::captures().join(format!("junior/{file}.pcap"));
    let all = super::recorded::datagrams(&file).into_iter();
    all.partition(|datagram| datagram.source == address("1"))
}

/// A node with one component, whose sequence numbers begin with 1 like Junior's.
fn node(id: JausId, host: &str) -> StandIn {
    let config = Config {
        payload_limit: PAYLOAD,
        ..Config::default()
    };
    let mut stand_in = StandIn::new(address(host), config);
    stand_in.endpoint.attach(id).unwrap();
    stand_in
}

fn octets(datagrams: &[Recorded]) -> Vec<Bytes> {
    datagrams.iter().map(|it| it.payload.clone()).collect()
}

#[test]
fn a_node_in_the_place_of_b_answers_with_b_s_very_octets() {
    // In 01 node B echoes every message, in the others it sends none.
    for (file, echoes) in [
        ("01-discovery-then-unicast", true),
        ("02-acked-small", false),
        ("03-acked-100KB", false),
        ("04-unacked-100KB-bigbuf", false),
        ("06-global-broadcast", false),
        ("07-subsystem-wildcard", false),
        ("09-as5669-v1-msgid", false),
        ("10-opc-JAUS01.0", false),
        ("12-priority15", false),
    ] {
        let (of_a, of_b) = said(file);
        let mut stand_in = node(B, "2");
        for datagram in &of_a {
            stand_in.run_until(datagram.at);
            stand_in.hear(datagram.source, datagram.payload.clone());
            for heard in std::mem::take(&mut stand_in.heard) {
                if echoes {
                    stand_in.say(Outgoing::new(B, heard.source, heard.payload));
                }
            }
        }
        assert!(
            stand_in.said.iter().all(|it| it.is_to(address("1"))),
            "{file}"
        );
        let ours: Vec<_> = stand_in.said.iter().map(|it| it.datagram.clone()).collect();
        assert_eq!(ours, octets(&of_b), "{file}");
    }
}

#[test]
fn what_junior_repeats_without_an_answer_is_acknowledged_each_time_and_taken_once() {
    let (of_a, _) = said("08-ack-timeout-no-peer");
    let mut stand_in = node(B, "2");
    for datagram in &of_a {
        stand_in.run_until(datagram.at);
        stand_in.hear(datagram.source, datagram.payload.clone());
    }
    assert_eq!(
        (of_a.len(), stand_in.heard.len(), stand_in.said.len()),
        (4, 1, 4)
    );
    assert!(
        stand_in
            .said
            .iter()
            .all(|it| it.frame.is_acknowledgement() && it.frame.sequence == 1)
    );
}

#[test]
fn the_priority_fault_is_counted_and_names_junior() {
    let (of_a, _) = said("11-priority0-bug");
    let mut stand_in = node(B, "2");
    for datagram in &of_a {
        stand_in.hear(datagram.source, datagram.payload.clone());
    }
    assert_eq!(stand_in.heard.len(), 1, "the one before it");
    assert_eq!(stand_in.endpoint.counters().get(Counter::PriorityFault), 1);
    assert_eq!(
        stand_in.endpoint.peers().next().unwrap().profile,
        Implementation::Junior
    );
}

/// The first messages go to the group, like Junior's, and Junior's acknowledgement gives us its
/// address.
#[test]
fn a_node_in_the_place_of_a_calls_as_a_does_and_understands_the_answer() {
    for (file, acknowledge) in [
        ("01-discovery-then-unicast", false),
        ("02-acked-small", true),
    ] {
        let (of_a, of_b) = said(file);
        let payload = of_a[0].frames().0[0].payload.clone();
        let mut stand_in = node(A, "1");
        stand_in.say(Outgoing {
            acknowledge,
            ..Outgoing::new(A, B, payload)
        });
        let [call] = &stand_in.said[..] else {
            panic!("one call: {:?}", stand_in.said)
        };
        assert_eq!(
            (call.to, &call.datagram),
            (To::Group, &of_a[0].payload),
            "{file}"
        );
        stand_in.run_until(of_b[0].at);
        stand_in.hear(of_b[0].source, of_b[0].payload.clone());
        let told = |event: &Event| matches!(event, Event::Acknowledged { by: B, .. });
        assert_eq!(stand_in.news.iter().any(told), acknowledge, "{file}");
        // From now on messages go by unicast, with the octets that A used.
        for next in &of_a[1..] {
            let before = stand_in.said.len();
            let payload = next.frames().0[0].payload.clone();
            stand_in.say(Outgoing::new(A, B, payload));
            assert!(stand_in.said[before].is_to(address("2")), "{file}");
            assert_eq!(stand_in.said[before].datagram, next.payload, "{file}");
        }
    }
}

/// 100 kB are fragmented as by Junior, and Junior's acknowledgements complete the delivery.
#[test]
fn a_large_acknowledged_message_goes_to_junior_as_juniors_own() {
    let (of_a, of_b) = said("03-acked-100KB");
    let mut stand_in = node(A, "1");
    let first = of_a[0].frames().0[0].payload.clone();
    let reliable = |payload| Outgoing {
        acknowledge: true,
        ..Outgoing::new(A, B, payload)
    };
    stand_in.say(reliable(first));
    stand_in.hear(of_b[0].source, of_b[0].payload.clone());
    stand_in.say(reliable(
        [&[0x01, 0x4B][..], &[b'x'; 99_998]].concat().into(),
    ));
    for acknowledgement in &of_b[1..] {
        let at = stand_in.at().max(acknowledgement.at);
        // Junior acknowledges only numbers that were sent.
        let number = acknowledgement.frames().0[0].sequence;
        assert!(
            stand_in.said.iter().any(|it| it.frame.sequence == number),
            "{number} was sent"
        );
        stand_in.hear(acknowledgement.source, acknowledgement.payload.clone());
        stand_in.run_until(at);
    }
    let acknowledged = |event: &&Event| matches!(event, Event::Acknowledged { .. });
    assert_eq!(stand_in.news.iter().filter(acknowledged).count(), 2);
    for (number, fragment) in (1_u16..).zip(&of_a) {
        let ours = stand_in.said.iter().find(|it| it.frame.sequence == number);
        assert_eq!(ours.unwrap().datagram, fragment.payload, "number {number}");
    }
    let last = stand_in
        .said
        .iter()
        .filter(|it| it.frame.flags.data() == DataControl::Last);
    assert!(last.count() >= 1);
}
