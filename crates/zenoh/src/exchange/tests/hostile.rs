//! What a bridge does not accept: commands without the right, foreign ids, malformed samples.

use proptest::prelude::*;

use super::*;
use crate::arrivals::MOST_OF_SESSION;

const SET_EMERGENCY: &[u8] = b"\x06\x00\x01\x00";
/// Asks the client in control to hand it over, with authority 255.
const REQUEST_HANDOFF: &[u8] = b"\x31\xFF\xFF\x01x";

/// A sample as another bridge publishes it.
fn sample(frame: &Frame, from: BridgeId) -> (String, Bytes) {
    let key = Key::Raw {
        source: frame.source,
        label: Label::of(frame).unwrap(),
        from,
        to: Recipient::All,
    };
    let octets = datagram(std::slice::from_ref(frame));
    (Prefix::default().key(&key), octets)
}

#[test]
fn by_default_the_other_side_observes_and_its_commands_are_refused() {
    let now = Instant::now();
    let mut vehicle = bridge(THERE, &[]);
    announce_by(HERE, now, &mut vehicle, OPERATOR);
    for (payload, passes) in [
        (QUERY, true),
        (RESUME, false),
        (REQUEST_CONTROL, false),
        (REQUEST_HANDOFF, false),
        (SET_EMERGENCY, false),
    ] {
        let (key, octets) = sample(&frame(OPERATOR, DRIVER, payload), HERE);
        vehicle.handle_sample(now, &key, &octets);
        assert_eq!(arrivals(&mut vehicle).len(), usize::from(passes));
    }
    assert_eq!(vehicle.counters().get(Counter::RuleForbids), 4);
}

#[test]
fn a_refused_request_for_control_is_answered_as_by_the_component() {
    let now = Instant::now();
    let mut vehicle = bridge(THERE, &[]);
    vehicle.handle_local(now, DRIVER, now);
    announce_by(HERE, now, &mut vehicle, OPERATOR);
    samples(now, &mut vehicle);
    let (key, octets) = sample(&frame(OPERATOR, DRIVER, REQUEST_CONTROL), HERE);
    vehicle.handle_sample(now, &key, &octets);
    assert!(arrivals(&mut vehicle).is_empty());
    let answers = samples(now, &mut vehicle);
    assert_eq!(
        answers[0].key,
        "jaus/raw/101/1/33/000F/0000000000000002/00/00000000000001"
    );
    let answer = only_frame(&answers[0].payload).unwrap();
    let confirm = ConfirmControl::decode(&answer.payload).unwrap();
    let expected = ResponseCode::INSUFFICIENT_AUTHORITY;
    assert_eq!(confirm.response_code, expected);
    assert_eq!((answer.source, answer.destination), (DRIVER, OPERATOR));
}

#[test]
fn with_the_right_commands_and_control_pass_up_to_its_authority() {
    let now = Instant::now();
    let mut vehicle = bridge(THERE, &["60 control=100"]);
    announce_by(HERE, now, &mut vehicle, OPERATOR);
    let too_much: &[u8] = b"\x0D\x00\x65";
    for (payload, passes) in [(RESUME, true), (REQUEST_CONTROL, true), (too_much, false)] {
        let (key, octets) = sample(&frame(OPERATOR, DRIVER, payload), HERE);
        vehicle.handle_sample(now, &key, &octets);
        assert_eq!(arrivals(&mut vehicle).len(), usize::from(passes));
    }
}

#[test]
fn a_stop_to_a_group_reaches_those_that_its_sender_may_reach_and_no_others() {
    let now = Instant::now();
    let mut vehicle = bridge(THERE, &["60 control=100 with=101.255.255"]);
    announce_by(HERE, now, &mut vehicle, OPERATOR);
    let (key, octets) = sample(&frame(OPERATOR, JausId::EVERYONE, SET_EMERGENCY), HERE);
    vehicle.handle_sample(now, &key, &octets);
    let arrived = arrivals(&mut vehicle);
    let [Arrival::Datagram { octets, .. }] = &*arrived else {
        panic!("{arrived:?}");
    };
    let stop = only_frame(octets).unwrap();
    assert_eq!(stop.destination, JausId::new(101, 255, 255));
    assert_eq!(stop.payload, SET_EMERGENCY);
}

#[test]
fn an_id_that_is_not_accepted_neither_sends_nor_appears() {
    let now = Instant::now();
    let mut vehicle = bridge(THERE, &["60"]);
    let stranger = JausId::new(61, 1, 1);
    let (key, octets) = sample(&frame(stranger, DRIVER, QUERY), HERE);
    vehicle.handle_sample(now, &key, &octets);
    let token = bridge(HERE, &[]).token_key(stranger);
    vehicle.handle_token(now, &token, true);
    assert!(arrivals(&mut vehicle).is_empty());
    assert_eq!(vehicle.counters().get(Counter::NotAccepted), 2);
    assert_eq!(
        vehicle.subscriptions(),
        [
            "jaus/raw/60/*/*/*/*/all",
            "jaus/raw/60/*/*/*/*/00/00000000000002"
        ]
    );
    assert_eq!(vehicle.presences(), ["jaus/live/60/*/*/*"]);
}

#[test]
fn nobody_speaks_for_a_component_of_this_side_or_of_another_bridge() {
    let now = Instant::now();
    let mut vehicle = bridge(THERE, &[]);
    vehicle.handle_local(now, DRIVER, now);
    let (key, octets) = sample(&frame(DRIVER, DRIVER, QUERY), HERE);
    vehicle.handle_sample(now, &key, &octets);
    vehicle.handle_token(now, &bridge(HERE, &[]).token_key(DRIVER), true);
    assert_eq!(vehicle.counters().get(Counter::OwnId), 2);

    vehicle.handle_token(now, &bridge(HERE, &[]).token_key(OPERATOR), true);
    let (key, octets) = sample(&frame(OPERATOR, DRIVER, QUERY), BridgeId::new(3));
    vehicle.handle_sample(now, &key, &octets);
    assert_eq!(vehicle.counters().get(Counter::OtherBridge), 1);
    assert!(arrivals(&mut vehicle).is_empty());
}

/// The tokens about which the network is asked; other commands are dropped.
fn identified(now: Instant, by: &mut Exchange) -> Vec<String> {
    std::iter::from_fn(|| by.poll_command(now))
        .filter_map(|command| match command {
            Command::Identify(token) => Some(token),
            _ => None,
        })
        .collect()
}

const SQUATTER: BridgeId = BridgeId::new(9);

#[test]
fn who_squats_an_id_is_named_once_and_frees_it_when_it_goes() {
    let now = Instant::now();
    let mut vehicle = bridge(THERE, &["60 control=127"]);
    let token = |from| bridge(from, &[]).token_key(OPERATOR);
    announce_by(SQUATTER, now, &mut vehicle, OPERATOR);
    let named = identified(now, &mut vehicle);
    assert_eq!(named, [token(SQUATTER)], "the id has rights");

    announce_by(HERE, now, &mut vehicle, OPERATOR);
    let both = [token(SQUATTER), token(HERE)];
    assert_eq!(identified(now, &mut vehicle), both);
    let (key, octets) = sample(&frame(OPERATOR, DRIVER, REQUEST_CONTROL), HERE);
    for _ in 0..5 {
        vehicle.handle_sample(now, &key, &octets);
    }
    assert_eq!(vehicle.counters().get(Counter::OtherBridge), 6);
    assert!(arrivals(&mut vehicle).is_empty());
    assert_eq!(identified(now, &mut vehicle), [""; 0], "once per change");

    vehicle.handle_token(now, &token(SQUATTER), false);
    vehicle.handle_sample(now, &key, &octets);
    let passed = arrivals(&mut vehicle);
    assert!(
        matches!(passed[..], [Arrival::Closed(_), Arrival::Datagram { .. }]),
        "{passed:?}"
    );
    assert_eq!(identified(now, &mut vehicle), [token(HERE)], "the next");
    announce_by(SQUATTER, now, &mut vehicle, OPERATOR);
    let both = [token(HERE), token(SQUATTER)];
    assert_eq!(identified(now, &mut vehicle), both, "a change");
}

#[test]
fn who_squats_an_id_is_named_on_the_side_of_the_id_too() {
    let now = Instant::now();
    let mut here = bridge(HERE, &["60 control=127"]);
    announce_by(SQUATTER, now, &mut here, OPERATOR);
    let token = bridge(SQUATTER, &[]).token_key(OPERATOR);
    here.handle_local(now, OPERATOR, now);
    assert_eq!(identified(now, &mut here), [&*token]);
    here.handle_local(now, OPERATOR, now);
    assert!(here.is_idle(), "once per change");
    here.handle_token(now, &token, false);
    here.handle_local(now, OPERATOR, now);
    assert_eq!(here.poll_command(now), Some(Command::Announce(OPERATOR)));
}

#[test]
fn a_client_that_may_only_look_loses_an_id_at_once_when_this_side_uses_it() {
    let now = Instant::now();
    let mut here = bridge(HERE, &[]);
    announce_by(SQUATTER, now, &mut here, OPERATOR);
    // A second id, so that its session goes on.
    announce_by(SQUATTER, now, &mut here, JausId::new(60, 1, 2));
    let (key, octets) = sample(&frame(OPERATOR, DRIVER, QUERY), SQUATTER);
    here.handle_sample(now, &key, &octets);
    let session = session_of(&mut here);
    let answer = to_session(session, &[frame(DRIVER, OPERATOR, QUERY)]);
    here.transmit(now, &answer);
    assert_eq!(samples(now, &mut here).len(), 1, "nobody else uses the id");

    let token = bridge(SQUATTER, &[]).token_key(OPERATOR);
    here.handle_local(now, OPERATOR, now);
    let commands: Vec<_> = std::iter::from_fn(|| here.poll_command(now)).collect();
    assert!(commands.contains(&Command::Announce(OPERATOR)));
    assert!(
        commands.contains(&Command::Identify(token.clone())),
        "named"
    );
    here.handle_sample(now, &key, &octets);
    assert!(arrivals(&mut here).is_empty());
    // What is for the id stays on this side, also while its component is silent for a while.
    let silent = now + LOCAL_FOR;
    here.expire(silent);
    for when in [now, silent] {
        here.transmit(when, &answer);
        assert!(samples(when, &mut here).is_empty());
        here.handle_token(when, &token, true);
        here.handle_sample(when, &key, &octets);
        assert!(arrivals(&mut here).is_empty());
    }
    let free = silent + ID_HELD;
    here.expire(free);
    here.handle_sample(free, &key, &octets);
    assert_eq!(arrivals(&mut here).len(), 1, "the id is free");
}

#[test]
fn a_bridge_without_the_token_of_an_id_is_refused_and_named_once() {
    let now = Instant::now();
    let mut vehicle = bridge(THERE, &["60 control=127"]);
    let (key, octets) = sample(&frame(OPERATOR, DRIVER, REQUEST_CONTROL), HERE);
    for _ in 0..3 {
        vehicle.handle_sample(now, &key, &octets);
    }
    assert!(arrivals(&mut vehicle).is_empty());
    assert_eq!(vehicle.counters().get(Counter::NotAnnounced), 3);
    let token = bridge(HERE, &[]).token_key(OPERATOR);
    assert_eq!(identified(now, &mut vehicle), [token]);
}

#[test]
fn a_key_must_agree_with_its_message() {
    let now = Instant::now();
    let mut vehicle = bridge(THERE, &[]);
    let query = frame(OPERATOR, DRIVER, QUERY);
    let (_, octets) = sample(&query, HERE);
    for key in [
        "jaus/raw/61/1/1/2404/0000000000000001/all",
        "jaus/raw/60/1/1/2402/0000000000000001/all",
        "jaus/raw/60/1/1/ack/0000000000000001/all",
    ] {
        vehicle.handle_sample(now, key, &octets);
    }
    assert_eq!(vehicle.counters().get(Counter::KeyMismatch), 3);
    for key in [
        "jaus/raw/60/1/1/2404/0000000000000001/00/00000000000003",
        "jaus/raw/60/1/1/2404/0000000000000002/all",
        "jaus/json/60/1/1/2404",
        "",
    ] {
        vehicle.handle_sample(now, key, &octets);
    }
    assert_eq!(vehicle.counters().get(Counter::UnknownKey), 4);
    assert!(arrivals(&mut vehicle).is_empty());
}

#[test]
fn a_payload_is_exactly_one_message_with_the_as5669a_header() {
    let now = Instant::now();
    let mut vehicle = bridge(THERE, &[]);
    let query = frame(OPERATOR, DRIVER, QUERY);
    let (key, octets) = sample(&query, HERE);
    let two = datagram(&[query.clone(), query.clone()]);
    let older = judp::encode(&Frame {
        version: Version::As5669,
        ..query
    })
    .unwrap();
    let mut longer = octets.to_vec();
    longer.push(0);
    let cut = octets.slice(..octets.len() - 1);
    let huge = Bytes::from(vec![2; LARGEST + 1]);
    let all = [two, older, longer.into(), cut, huge, Bytes::new()];
    for payload in &all {
        vehicle.handle_sample(now, &key, payload);
    }
    let refused = vehicle.counters().get(Counter::InvalidPayload);
    assert_eq!(refused, all.len() as u64);
    assert!(arrivals(&mut vehicle).is_empty());
}

#[test]
fn messages_that_the_node_does_not_take_have_a_bound() {
    let now = Instant::now();
    let mut vehicle = bridge(THERE, &[]);
    announce_by(HERE, now, &mut vehicle, OPERATOR);
    let (key, octets) = sample(&frame(OPERATOR, DRIVER, QUERY), HERE);
    for _ in 0..MOST_OF_SESSION.messages + 3 {
        vehicle.handle_sample(now, &key, &octets);
    }
    assert_eq!(vehicle.counters().get(Counter::InboxFull), 3);
    assert_eq!(arrivals(&mut vehicle).len(), MOST_OF_SESSION.messages);
    vehicle.handle_sample(now, &key, &octets);
    assert_eq!(arrivals(&mut vehicle).len(), 1);
}

#[test]
fn the_table_of_this_sides_components_has_a_bound() {
    let now = Instant::now();
    let mut here = bridge(HERE, &[]);
    for number in 0..=MOST_OF_BRIDGE {
        let source = JausId::new(1 + number as u16, 1, 1);
        here.transmit(now, &to_group(&[frame(source, JausId::EVERYONE, QUERY)]));
        samples(now, &mut here);
    }
    assert_eq!(here.counters().get(Counter::LocalTableFull), 1);
}

proptest! {
    #[test]
    fn any_sample_is_passed_or_counted(
        key in "jaus/raw/60/1/1/(2404|ack|part)/0000000000000001/all|.{0,60}",
        payload in proptest::collection::vec(any::<u8>(), 0..64),
        is_alive: bool,
    ) {
        let now = Instant::now();
        let mut vehicle = bridge(THERE, &[]);
        vehicle.handle_sample(now, &key, &payload.into());
        let counted: u64 = vehicle.counters().iter().map(|(_, number)| number).sum();
        prop_assert_eq!(counted, 1);
        vehicle.handle_token(now, &key, is_alive);
    }
}
