//! Two or more bridges in one test, without a network: what one publishes, the others receive.
#![expect(
    clippy::disallowed_methods,
    reason = "the tests start at an arbitrary instant"
)]

mod audit;
mod hostile;

use jaus::endpoint::{LinkId, SessionId};
use jaus::messages::core::ConfirmControl;
use jaus::messages::core::confirm_control::ResponseCode;
use jaus::wire::{Flags, Priority};

use super::*;

const OPERATOR: JausId = JausId::new(60, 1, 1);
const DRIVER: JausId = JausId::new(101, 1, 33);
const QUERY: &[u8] = b"\x04\x24\xFF\xFF";
const RESUME: &[u8] = b"\x04\x00";
const REQUEST_CONTROL: &[u8] = b"\x0D\x00\x64";

const HERE: BridgeId = BridgeId::new(1);
const THERE: BridgeId = BridgeId::new(2);

fn bridge(id: BridgeId, accept: &[&str]) -> Exchange {
    let accept = match accept {
        [] => Acceptance::default(),
        _ => Acceptance::new(accept.iter().map(|text| text.parse().unwrap())),
    };
    let settings = Settings {
        accept,
        ..Settings::default()
    };
    let mut bridge = Exchange::new(id, settings);
    bridge.handle_open();
    bridge
}

fn frame(source: JausId, destination: JausId, payload: &'static [u8]) -> Frame {
    Frame::new(source, destination, Bytes::from_static(payload))
}

fn datagram(frames: &[Frame]) -> Bytes {
    let mut octets = judp::encode(&frames[0]).unwrap().to_vec();
    for frame in &frames[1..] {
        octets.extend_from_slice(&judp::encode(frame).unwrap()[1..]);
    }
    octets.into()
}

fn to_group(frames: &[Frame]) -> Transmit {
    Transmit {
        link: LinkId(0),
        to: To::Group,
        priority: Priority::Standard,
        payload: datagram(frames),
        segment: None,
    }
}

fn to_session(session: SessionId, frames: &[Frame]) -> Transmit {
    Transmit {
        to: To::Peer(Remote::Session(session)),
        ..to_group(frames)
    }
}

/// Its samples that wait; declarations are dropped.
fn samples(now: Instant, from: &mut Exchange) -> Vec<Publication> {
    std::iter::from_fn(|| from.poll_command(now))
        .filter_map(|command| match command {
            Command::Publish(publication) => Some(publication),
            _ => None,
        })
        .collect()
}

/// Passes all samples and tokens of one bridge to another.
fn pass(now: Instant, from: &mut Exchange, to: &mut Exchange) {
    while let Some(command) = from.poll_command(now) {
        match command {
            Command::Announce(id) => to.handle_token(now, &from.token_key(id), true),
            Command::Withdraw(id) => to.handle_token(now, &from.token_key(id), false),
            Command::Publish(sample) => to.handle_sample(now, &sample.key, &sample.payload),
            Command::Serve(_) | Command::Identify(_) => {}
        }
    }
}

fn arrivals(bridge: &mut Exchange) -> Vec<Arrival> {
    std::iter::from_fn(|| bridge.poll_arrival()).collect()
}

/// The session of the only datagram that has arrived.
#[track_caller]
fn session_of(bridge: &mut Exchange) -> SessionId {
    match &arrivals(bridge)[..] {
        [Arrival::Datagram { session, .. }] => *session,
        others => panic!("{others:?}"),
    }
}

/// The bridge `THERE` announces a component.
fn announce(now: Instant, to: &mut Exchange, component: JausId) {
    announce_by(THERE, now, to, component);
}

/// A bridge announces a component.
fn announce_by(from: BridgeId, now: Instant, to: &mut Exchange, component: JausId) {
    to.handle_token(now, &bridge(from, &[]).token_key(component), true);
}

#[test]
fn a_broadcast_reaches_the_other_side_unchanged_and_the_answer_its_sender() {
    let now = Instant::now();
    let (mut here, mut there) = (bridge(HERE, &[]), bridge(THERE, &[]));
    let hello = frame(OPERATOR, JausId::EVERYONE, b"\x00\x2B\x02");
    here.transmit(now, &to_group(std::slice::from_ref(&hello)));
    pass(now, &mut here, &mut there);
    let [Arrival::Datagram { session, octets }] = &arrivals(&mut there)[..] else {
        panic!("one datagram");
    };
    assert_eq!(*octets, datagram(&[hello]));
    let answer = frame(DRIVER, OPERATOR, b"\x00\x4B\x02");
    there.transmit(now, &to_session(*session, std::slice::from_ref(&answer)));
    let sent = samples(now, &mut there);
    assert_eq!(
        sent[0].key,
        "jaus/raw/101/1/33/4B00/0000000000000002/00/00000000000001"
    );
    assert_eq!(sent[0].payload, datagram(&[answer]));
}

#[test]
fn messages_that_share_a_datagram_are_published_one_by_one() {
    let now = Instant::now();
    let mut here = bridge(HERE, &[]);
    announce(now, &mut here, DRIVER);
    let frames = [
        frame(OPERATOR, DRIVER, QUERY),
        frame(JausId::new(60, 1, 2), DRIVER, RESUME),
    ];
    here.transmit(now, &to_group(&frames));
    let sent = samples(now, &mut here);
    let keys: Vec<_> = sent.iter().map(|it| it.key.as_str()).collect();
    assert_eq!(
        keys,
        [
            "jaus/raw/60/1/1/2404/0000000000000001/00/00000000000002",
            "jaus/raw/60/1/2/0004/0000000000000001/00/00000000000002",
        ]
    );
    for (sample, frame) in sent.iter().zip(frames) {
        assert_eq!(sample.payload, datagram(&[frame]));
    }
}

#[test]
fn what_must_arrive_waits_for_a_congested_link_and_urgent_messages_overtake() {
    let now = Instant::now();
    let mut here = bridge(HERE, &[]);
    announce(now, &mut here, DRIVER);
    let plain = frame(OPERATOR, DRIVER, QUERY);
    let acknowledged = Frame {
        flags: Flags::default().with_acknowledgement(Acknowledgement::Request),
        ..plain.clone()
    };
    let urgent = Frame {
        flags: Flags::new(Priority::SafetyCritical),
        ..plain.clone()
    };
    here.transmit(now, &to_group(&[plain, acknowledged, urgent]));
    let sent = samples(now, &mut here);
    let sent: Vec<_> = sent.iter().map(|it| (it.priority, it.waits)).collect();
    let (standard, critical) = (Some(Priority::Standard), Some(Priority::SafetyCritical));
    assert_eq!(
        sent,
        [(critical, false), (standard, false), (standard, true)]
    );
}

#[test]
fn a_component_is_announced_before_its_first_message_and_withdrawn_when_it_is_silent() {
    let start = Instant::now();
    let mut here = bridge(HERE, &[]);
    announce(start, &mut here, DRIVER);
    here.transmit(start, &to_group(&[frame(OPERATOR, DRIVER, QUERY)]));
    assert_eq!(here.poll_command(start), Some(Command::Announce(OPERATOR)));
    assert_eq!(here.poll_command(start), Some(Command::Serve(60)));
    assert!(matches!(
        here.poll_command(start),
        Some(Command::Publish(_))
    ));
    here.expire(start + LOCAL_FOR / 2);
    assert!(here.serves(OPERATOR));
    here.expire(start + LOCAL_FOR);
    assert_eq!(here.poll_command(start), Some(Command::Withdraw(OPERATOR)));
    assert!(!here.serves(OPERATOR));
    here.handle_local(start, OPERATOR, start);
    assert_eq!(here.poll_command(start), Some(Command::Announce(OPERATOR)));
    assert_eq!(here.poll_command(start), None, "its subsystem is served");
}

#[test]
fn a_session_ends_when_the_tokens_of_its_bridge_are_gone() {
    let now = Instant::now();
    let (mut here, mut there) = (bridge(HERE, &[]), bridge(THERE, &[]));
    there.handle_local(now, DRIVER, now);
    here.handle_local(now, OPERATOR, now);
    here.handle_token(now, &there.token_key(DRIVER), true);
    there.handle_token(now, &here.token_key(OPERATOR), true);
    there.transmit(now, &to_group(&[frame(DRIVER, OPERATOR, QUERY)]));
    pass(now, &mut there, &mut here);
    let session = session_of(&mut here);
    here.handle_token(now, &there.token_key(DRIVER), false);
    assert_eq!(arrivals(&mut here), [Arrival::Closed(session)]);
    here.transmit(now, &to_session(session, &[frame(OPERATOR, DRIVER, QUERY)]));
    assert_eq!(here.counters().get(Counter::NoSession), 1);
    assert!(samples(now, &mut here).is_empty());
}

#[test]
fn three_bridges_on_two_networks_make_no_loop() {
    let now = Instant::now();
    let third = BridgeId::new(3);
    // The first is at the operator, the two others are both on the vehicle's network.
    let mut bridges = [bridge(HERE, &[]), bridge(THERE, &[]), bridge(third, &[])];
    let call = frame(OPERATOR, JausId::EVERYONE, b"\x00\x2B\x02");
    bridges[0].transmit(now, &to_group(std::slice::from_ref(&call)));
    for other in &mut bridges[1..] {
        announce_by(HERE, now, other, OPERATOR);
    }
    for sample in samples(now, &mut bridges[0]) {
        for other in &mut bridges[1..] {
            other.handle_sample(now, &sample.key, &sample.payload);
        }
    }
    // Each passes it to the vehicle's network, where the other one hears it.
    for bridge in &mut bridges[1..] {
        assert_eq!(arrivals(bridge).len(), 1);
        bridge.transmit(now, &to_group(std::slice::from_ref(&call)));
        assert!(samples(now, bridge).is_empty());
        assert_eq!(bridge.counters().get(Counter::FromOutside), 1);
    }
}

#[test]
fn a_message_that_returns_to_its_own_side_is_refused() {
    let now = Instant::now();
    let (mut here, mut there) = (bridge(HERE, &[]), bridge(THERE, &[]));
    let call = frame(OPERATOR, JausId::EVERYONE, b"\x00\x2B\x02");
    here.transmit(now, &to_group(std::slice::from_ref(&call)));
    here.poll_command(now);
    // A bridge that has heard the operator on its own network first.
    there.transmit(now, &to_group(std::slice::from_ref(&call)));
    pass(now, &mut there, &mut here);
    assert!(arrivals(&mut here).is_empty());
    let refused = here.counters().get(Counter::OwnId);
    assert_eq!(refused, 2, "the token and the message");
}

#[test]
fn a_message_goes_to_the_bridge_with_the_token_of_its_destination_alone() {
    let now = Instant::now();
    let mut here = bridge(HERE, &[]);
    announce(now, &mut here, DRIVER);
    let stranger = JausId::new(102, 1, 33);
    // Before the node knows a route, it searches everywhere.
    let search = [DRIVER, stranger].map(|to| frame(OPERATOR, to, QUERY));
    here.transmit(now, &to_group(&search));
    let sent = samples(now, &mut here);
    let keys: Vec<_> = sent.iter().map(|it| it.key.as_str()).collect();
    assert_eq!(
        keys,
        ["jaus/raw/60/1/1/2404/0000000000000001/00/00000000000002"]
    );
    assert_eq!(here.counters().get(Counter::NotPresent), 1);
}

#[test]
fn a_bridge_that_is_found_hears_the_calls_that_it_has_missed() {
    let now = Instant::now();
    let mut here = Exchange::new(HERE, Settings::default());
    let call = frame(OPERATOR, JausId::EVERYONE, b"\x00\x2B\x02");
    // Before the session is open, and so to nobody.
    here.transmit(now, &to_group(std::slice::from_ref(&call)));
    here.handle_open();
    assert!(samples(now, &mut here).is_empty());
    announce(now, &mut here, DRIVER);
    let sent = samples(now, &mut here);
    assert_eq!(
        sent[0].key,
        "jaus/raw/60/1/1/2B00/0000000000000001/00/00000000000002"
    );
    assert_eq!(sent[0].payload, datagram(&[call]));
    announce(now, &mut here, JausId::new(101, 1, 34));
    assert!(here.is_idle(), "it is found already");
}

#[test]
fn a_component_that_changes_sides_belongs_to_its_bridge_once_it_is_silent_here() {
    let start = Instant::now();
    // An id that a rule lets come from the zenoh side, and others.
    for (accept, is_free_after) in [(&["101 observe"][..], LOCAL_FOR), (&[], ID_HELD)] {
        let mut here = bridge(HERE, accept);
        here.handle_local(start, DRIVER, start);
        announce(start, &mut here, DRIVER);
        assert_eq!(here.counters().get(Counter::OwnId), 1);
        let silent = start + LOCAL_FOR;
        here.expire(silent);
        // A further claim meanwhile is refused as the first one was.
        announce_by(BridgeId::new(9), silent, &mut here, DRIVER);
        let free = silent + is_free_after;
        let before = free - Duration::from_millis(1);
        here.expire(before);
        here.handle_local(before, DRIVER, before);
        assert_eq!(here.serves(DRIVER), is_free_after == ID_HELD);
        here.expire(before + LOCAL_FOR);
        here.expire(before + LOCAL_FOR + ID_HELD);
        // It belongs to the bridge now: with rights it stays there, and without them it comes back at once.
        let later = before + LOCAL_FOR + ID_HELD;
        assert!(here.remotes.contains(DRIVER));
        here.handle_local(later, DRIVER, later);
        assert_eq!(here.serves(DRIVER), is_free_after == ID_HELD);
    }
}

#[test]
fn only_offered_components_leave() {
    let now = Instant::now();
    let settings = Settings {
        offer: vec!["101.255.255".parse().unwrap()],
        ..Settings::default()
    };
    let mut here = Exchange::new(HERE, settings);
    here.handle_open();
    here.handle_local(now, OPERATOR, now);
    assert!(here.is_idle());
    let to_all = |from| to_group(&[frame(from, JausId::EVERYONE, QUERY)]);
    here.transmit(now, &to_all(OPERATOR));
    here.transmit(now, &to_all(DRIVER));
    assert_eq!(here.counters().get(Counter::NotOffered), 1);
    assert_eq!(samples(now, &mut here).len(), 1);
}

#[test]
fn without_a_session_messages_are_dropped_instead_of_sent_late() {
    let now = Instant::now();
    let mut here = Exchange::new(HERE, Settings::default());
    announce(now, &mut here, DRIVER);
    here.transmit(now, &to_group(&[frame(OPERATOR, DRIVER, RESUME)]));
    here.handle_open();
    assert!(samples(now, &mut here).is_empty());
    assert_eq!(here.counters().get(Counter::NotConnected), 1);
}

#[test]
fn a_bridge_that_stops_withdraws_its_components_and_sends_no_more() {
    let now = Instant::now();
    let mut here = bridge(HERE, &[]);
    announce(now, &mut here, DRIVER);
    here.handle_local(now, OPERATOR, now);
    assert!(samples(now, &mut here).is_empty());
    here.close();
    assert_eq!(here.poll_command(now), Some(Command::Withdraw(OPERATOR)));
    here.transmit(now, &to_group(&[frame(OPERATOR, DRIVER, QUERY)]));
    assert!(here.is_idle());
}

#[test]
fn the_newest_of_the_held_messages_leaves_when_its_period_is_over() {
    let now = Instant::now();
    let period = Duration::from_secs(1);
    let settings = Settings {
        min_periods: vec!["QueryVelocityState=1s".parse().unwrap()],
        ..Settings::default()
    };
    let mut here = Exchange::new(HERE, settings);
    here.handle_open();
    announce(now, &mut here, DRIVER);
    for _ in 0..3 {
        here.transmit(now, &to_group(&[frame(OPERATOR, DRIVER, QUERY)]));
    }
    assert_eq!(samples(now, &mut here).len(), 1);
    assert_eq!(here.counters().get(Counter::Replaced), 1);
    assert_eq!(here.poll_timeout(), Some(now + period));
    here.handle_timeout(now + period);
    assert_eq!(samples(now + period, &mut here).len(), 1);
}
