//! Captured JAUS++ messages, replayed in virtual time to our own vehicle and operator: every
//! request gets a usable answer, within JAUS++'s timeout of 250 ms, at its source address.

use std::collections::{BTreeMap, VecDeque};
use std::net::SocketAddr;
use std::time::Duration;

use super::asked::answers_to;
use super::recorded::Recorded;
use super::stand_in::{Said, StandIn};
use bytes::{Bytes, BytesMut};
use jaus::address::JausId;
use jaus::codec::Message;
use jaus::endpoint::{Config, Counter, Outgoing};
use jaus::messages::core::*;
use jaus::peer::Implementation;
use jaus::service::Stack;
use jaus::wire::Frame;
use jaus_test_kit::evidence;
use jaus_view::Dictionary;

/// JAUS++'s timeout for an answer.
const PATIENCE: Duration = Duration::from_millis(250);
/// Offset of the message in a datagram: version and header.
const MESSAGE: usize = 13;

/// A stream of events, with its id in the recording and ours.
#[derive(Debug, Clone, Copy)]
struct Stream {
    captured: u8,
    ours: u8,
    is_running: bool,
}

/// A replay: the queried node and the recording.
struct Replay {
    stand_in: StandIn,
    dictionary: Dictionary,
    streams: Vec<Stream>,
    /// The recorded confirmations, by the request that they answer.
    confirmations: VecDeque<ConfirmEventRequest>,
    /// The expected state in the next Report Status.
    state: Option<u8>,
    asked: BTreeMap<u16, usize>,
    unanswered: BTreeMap<u16, usize>,
}

impl Replay {
    /// Puts components in place of those at `address`, and replays the messages to them.
    fn of(file: &str, address: &str, stacks: impl IntoIterator<Item = Stack>) -> Self {
        let all = super::recorded::datagrams(&evidence::captures().join("jauspp").join(file));
        let address: SocketAddr = address.parse().unwrap();
        let confirmations = all.iter().filter(|it| it.source == address);
        let confirmations = confirmations.filter_map(|it| {
            let frame = it.frames().0.into_iter().next()?;
            ConfirmEventRequest::decode(&frame.payload).ok()
        });
        let mut replay = Self {
            stand_in: StandIn::new(address, Config::default()),
            dictionary: Dictionary::new(),
            streams: Vec::new(),
            confirmations: confirmations.collect(),
            state: None,
            asked: BTreeMap::new(),
            unanswered: BTreeMap::new(),
        };
        for stack in stacks {
            replay.stand_in.stand_in(stack);
        }
        let is_for_us = |it: &&Recorded| {
            let to = it.destination;
            it.source != address && (to == address || to.ip().is_multicast())
        };
        for datagram in all.iter().filter(is_for_us) {
            replay.say(datagram);
        }
        replay
    }

    /// Replays one message, and looks for its answer.
    fn say(&mut self, datagram: &Recorded) {
        let (frames, _) = datagram.frames();
        let [frame] = &frames[..] else {
            panic!("JAUS++ writes one message in a datagram: {frames:?}")
        };
        self.stand_in.run_until(datagram.at);
        let before = self.stand_in.said.len();
        let octets = self.with_our_stream(datagram, frame);
        self.stand_in.hear(datagram.source, octets);
        let wanted = answers_to(frame.code().unwrap());
        if wanted.is_empty() {
            self.note_command(frame);
            return;
        }
        *self.asked.entry(frame.code().unwrap()).or_default() += 1;
        let is_answer =
            |said: &&Said| said.frame.destination == frame.source && wanted.contains(&said.code());
        let deadline = self.stand_in.at() + PATIENCE;
        if !self.stand_in.said[before..]
            .iter()
            .any(|said| is_answer(&said))
        {
            self.stand_in.run_until(deadline);
        }
        let Some(answer) = self.stand_in.said[before..].iter().find(is_answer).cloned() else {
            *self.unanswered.entry(frame.code().unwrap()).or_default() += 1;
            return;
        };
        assert!(answer.at <= deadline, "it waits no longer");
        self.check(datagram, frame, &answer);
    }

    /// Checks that JAUS++ can use an answer.
    fn check(&mut self, asked: &Recorded, question: &Frame, answer: &Said) {
        let octets = &answer.frame.payload;
        let shown = self.dictionary.line(octets).to_json();
        assert!(
            shown.contains("\"message\"") && !shown.contains("\"error\""),
            "{shown}"
        );
        assert!(answer.is_to(asked.source), "{:?}: {shown}", answer.to);
        assert!(question.destination.matches(answer.frame.source), "{shown}");
        // One packet, unfragmented and uncompressed, that JAUS++ decodes.
        assert!(octets.len() <= 1425, "{shown}");
        assert_eq!(
            (answer.frame.kind.0, answer.frame.flags.0),
            (0, 1),
            "{shown}"
        );
        assert_eq!(
            answer.datagram.len(),
            MESSAGE + octets.len() + 2,
            "one message"
        );
        match question.code().unwrap() {
            CreateEvent::CODE => self.note_stream(question, octets),
            CancelEvent::CODE => {
                let confirm = ConfirmEventRequest::decode(octets).unwrap();
                let ended = self.streams.iter_mut();
                ended
                    .filter(|stream| stream.ours == confirm.event_id)
                    .for_each(|stream| stream.is_running = false);
            }
            RequestControl::CODE => assert_eq!(octets[2], 0, "control is granted: {shown}"),
            ReleaseControl::CODE => assert_eq!(octets[2], 0, "it is given back: {shown}"),
            QueryStatus::CODE => {
                if let Some(expected) = self.state.take() {
                    assert_eq!(octets[2], expected, "{shown}");
                }
            }
            QueryIdentification::CODE => {
                let report = ReportIdentification::decode(octets).unwrap();
                assert_eq!(report.query_type.0, question.payload[2]);
                assert!(!report.identification.is_empty());
            }
            QueryServices::CODE => check_services(question, octets),
            QueryEvents::CODE => {
                let report = ReportEvents::decode(octets).unwrap();
                let running = self.streams.iter().filter(|it| it.is_running);
                let mut ids: Vec<_> = running.map(|it| it.ours).collect();
                ids.sort_unstable();
                ids.dedup();
                assert_eq!(report.event_list.len(), ids.len(), "all of them: {shown}");
            }
            // Queries for poses and velocities name the fields: the answer has no others.
            0x2402..=0x2404 => {
                let vector = |octets: &[u8]| u16::from_le_bytes([octets[2], octets[3]]);
                let (asked, told) = (vector(&question.payload), vector(octets));
                assert_eq!(told & !asked, 0, "{shown}");
                assert_ne!(told, 0, "{shown}");
            }
            _ => {}
        }
    }

    fn note_command(&mut self, frame: &Frame) {
        match frame.code().unwrap() {
            Resume::CODE => self.state = Some(1),
            Standby::CODE => self.state = Some(2),
            Shutdown::CODE => self.state = Some(3),
            _ => {}
        }
    }

    fn note_stream(&mut self, question: &Frame, octets: &Bytes) {
        let create = CreateEvent::decode(&question.payload).unwrap();
        let confirm = ConfirmEventRequest::decode(octets).expect("it is confirmed");
        assert_eq!(confirm.request_id, create.request_id);
        let periodic = create.event_type.0 == 0;
        assert_eq!(confirm.confirmed_periodic_rate_hz() > 0.0, periodic);
        let recorded = self.confirmations.iter();
        let same = |it: &ConfirmEventRequest| it.request_id == create.request_id;
        let at = recorded.into_iter().position(same);
        let captured = at.and_then(|at| self.confirmations.remove(at));
        self.streams.push(Stream {
            captured: captured.map_or(confirm.event_id, |it| it.event_id),
            ours: confirm.event_id,
            is_running: true,
        });
    }

    /// The datagram, with our stream id in place of the recorded one.
    fn with_our_stream(&self, datagram: &Recorded, frame: &Frame) -> Bytes {
        let at = match frame.code() {
            Some(CancelEvent::CODE) => 3,
            Some(QueryEvents::CODE) if frame.payload[2] == 2 => 3,
            _ => return datagram.payload.clone(),
        };
        let captured = frame.payload[at];
        let mut named = self.streams.iter().filter(|it| it.captured == captured);
        let running = named.clone().find(|stream| stream.is_running);
        let mut octets = BytesMut::from(&datagram.payload[..]);
        if let Some(stream) = running.or(named.next_back()) {
            octets[MESSAGE + at] = stream.ours;
        }
        octets.freeze()
    }

    /// Sequence numbers of the sent events, by stream.
    fn events(&self) -> BTreeMap<u8, Vec<u8>> {
        let mut events: BTreeMap<u8, Vec<u8>> = BTreeMap::new();
        for said in &self.stand_in.said {
            if let Ok(event) = Event::decode(&said.frame.payload) {
                events
                    .entry(event.event_id)
                    .or_default()
                    .push(event.sequence_number);
            }
        }
        events
    }

    /// Sends a large message to a peer, in the fragmentation that it understands.
    fn large_to(&mut self, us: JausId, peer: &str, address: &str) {
        let before = self.stand_in.said.len();
        let (peer, address) = (peer.parse().unwrap(), address.parse().unwrap());
        let message: Bytes = [&[0x01, 0x4B][..], &[7; 5000]].concat().into();
        self.stand_in.say(Outgoing::new(us, peer, message.clone()));
        let pieces = &self.stand_in.said[before..];
        assert_eq!(pieces.len(), 4);
        let mut joined = vec![0x01, 0x4B];
        for (index, piece) in pieces.iter().enumerate() {
            let octets = &piece.frame.payload;
            assert!(octets.starts_with(&[0x01, 0x4B]) && octets.len() <= 1425);
            assert!(piece.is_to(address));
            let first = pieces[0].frame.sequence;
            assert_eq!(piece.frame.sequence, first + index as u16);
            joined.extend_from_slice(&octets[2..]);
        }
        assert_eq!(joined, message);
    }
}

/// JAUS++ looks for exact names in version 1.0.
fn check_services(question: &Frame, octets: &Bytes) {
    let query = QueryServices::decode(&question.payload).unwrap();
    let report = ReportServices::decode(octets).unwrap();
    let asked = question.destination;
    let mentions = |node: u8, component: u8| {
        let nodes = report
            .node_list
            .iter()
            .filter(|it| it.node_rec.node_id == node);
        let mut components = nodes.flat_map(|it| &it.component_list);
        components.any(|it| it.component_rec.component_id == component)
    };
    let lists_asked = query.node_list.iter().any(|node| {
        let components = node.component_list.iter();
        node.node_rec.node_id.0 == asked.node()
            && components
                .clone()
                .any(|it| it.component_id.0 == asked.component())
    });
    assert_eq!(mentions(asked.node(), asked.component()), lists_asked);
    let services = report.node_list.iter().flat_map(|it| &it.component_list);
    let services = services.flat_map(|it| &it.service_list);
    let first = services.filter(|it| (it.major_version_number, it.minor_version_number) == (1, 0));
    let names: Vec<_> = first
        .map(|it| it.uri.to_string_lossy().into_owned())
        .collect();
    for name in ["Events", "Discovery", "Liveness", "Transport"] {
        let urn = format!("urn:jaus:jss:core:{name}");
        assert!(names.contains(&urn), "{urn} 1.0 is not in {names:?}");
    }
}

fn id(text: &str) -> JausId {
    text.parse().unwrap()
}

const NOTHING: BTreeMap<u16, usize> = BTreeMap::new();

#[test]
fn the_client_of_the_vehicle_simulation_gets_every_answer_from_a_vehicle_of_ours() {
    let (one, other) = (id("152.1.1"), id("152.1.2"));
    let stacks = [one, other].map(super::drivable::vehicle);
    let mut replay = Replay::of("01-vehsim-client.pcap", "10.99.0.1:3794", stacks);
    assert_eq!(replay.unanswered, NOTHING);
    let asked: usize = replay.asked.values().sum();
    assert_eq!(asked, 108, "{:?}", replay.asked);
    // Two streams, without gaps or duplicates; both are cancelled at the end.
    let events = replay.events();
    assert_eq!(events.len(), 2, "{events:?}");
    for numbers in events.values() {
        assert!(
            numbers
                .windows(2)
                .all(|pair| pair[1] == pair[0].wrapping_add(1))
        );
    }
    assert!(replay.streams.iter().all(|stream| !stream.is_running));
    assert_eq!(replay.stand_in.stack(one).event_count(), 0);
    let counters = replay.stand_in.endpoint.counters();
    assert!(counters.get(Counter::StaleOctets) > 10_000);
    assert_eq!(counters.get(Counter::Malformed), 0);
    replay.large_to(one, "1000.1.7", "10.99.0.2:3794");
}

#[test]
fn a_client_that_looks_after_its_events_keeps_them_and_creates_nothing_twice() {
    let us = id("77.1.1");
    let stacks = [super::drivable::vehicle(us)];
    let replay = Replay::of("02-rawvehicle-client.pcap", "10.99.0.2:3794", stacks);
    assert_eq!(replay.unanswered, NOTHING);
    assert!(
        replay.asked[&CreateEvent::CODE] > 2,
        "it creates again and again"
    );
    let events = replay.events();
    assert_eq!(events.len(), 2, "{events:?}");
    for numbers in events.values() {
        assert!(
            numbers
                .windows(2)
                .all(|pair| pair[1] == pair[0].wrapping_add(1))
        );
    }
}

#[test]
fn the_console_with_waypoints_gets_every_answer() {
    let us = id("152.1.1");
    let stacks = [super::drivable::vehicle(us)];
    let mut replay = Replay::of("05-jcopc-challenge2010.pcap", "10.99.0.1:3794", stacks);
    assert_eq!(replay.unanswered, NOTHING);
    assert_eq!(replay.asked[&RequestControl::CODE], 36);
    assert_eq!(replay.asked[&SetElement::CODE], 1, "four waypoints");
    replay.large_to(us, "10002.1.1", "10.99.0.2:3794");
}

/// The scripted operator of the 2010 rules: not JAUS++, but with the requests that JAUS++ received.
#[test]
fn the_tasks_of_2010_get_every_answer() {
    let stacks = [super::drivable::vehicle(id("152.1.1"))];
    let replay = Replay::of("07-cop-challenge2010.pcap", "10.99.0.1:3794", stacks);
    assert_eq!(replay.unanswered, NOTHING);
}

/// JAUS++'s vehicles query our operator's identification. It offers neither control nor management,
/// and JAUS++ needs neither to list it.
#[test]
fn an_operator_of_ours_is_what_vehicles_of_jauspp_ask_for() {
    let not_offered = [QueryAuthority::CODE, QueryStatus::CODE];
    for (file, us, address, vehicles) in [
        (
            "01-vehsim-client.pcap",
            "1000.1.7",
            "10.99.0.2:3794",
            &["152.1.1", "152.1.2"][..],
        ),
        (
            "05-jcopc-challenge2010.pcap",
            "10002.1.1",
            "10.99.0.2:3794",
            &["152.1.1"],
        ),
        (
            "07-cop-challenge2010.pcap",
            "42.1.1",
            "10.99.0.2:3794",
            &["152.1.1"],
        ),
    ] {
        let mut replay = Replay::of(file, address, [super::drivable::operator(id(us))]);
        let unanswered = replay.unanswered.keys();
        let missing: Vec<_> = unanswered
            .filter(|code| !not_offered.contains(code))
            .collect();
        assert!(missing.is_empty(), "{file}: {missing:04X?}");
        for vehicle in vehicles {
            let directory = replay.stand_in.stack(id(us)).directory();
            let known = directory.component(id(vehicle)).expect(vehicle);
            assert!(
                known.offers("urn:jaus:jss:core:AccessControl"),
                "{file}: {known:?}"
            );
            let peer = replay
                .stand_in
                .endpoint
                .peers()
                .find(|it| it.id == id(vehicle));
            assert_eq!(
                peer.unwrap().profile,
                Implementation::JausPlusPlus,
                "{file}: {vehicle}"
            );
        }
        replay.large_to(id(us), "152.1.1", "10.99.0.1:3794");
    }
}
