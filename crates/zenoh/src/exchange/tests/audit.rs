//! What is recorded of messages from the zenoh side, and what is refused because it could not be.

use jaus::rights::Verdict;

use super::*;

const SET_EMERGENCY: &[u8] = b"\x06\x00\x01\x00";
const STANDBY: &[u8] = b"\x03\x00";

/// The bridge of the operator publishes a message for the driver.
fn receive(now: Instant, vehicle: &mut Exchange, payload: &'static [u8]) {
    let message = frame(OPERATOR, DRIVER, payload);
    let key = Key::Raw {
        source: OPERATOR,
        label: Label::of(&message).unwrap(),
        from: HERE,
        to: Recipient::All,
    };
    let octets = datagram(&[message]);
    vehicle.handle_sample(now, &Prefix::default().key(&key), &octets);
}

/// Who has done what, and with what result, since the last call.
fn decided(vehicle: &mut Exchange) -> Vec<(BridgeId, String, Verdict, u64)> {
    std::iter::from_fn(|| vehicle.poll_decision())
        .map(|it| (it.client, it.decision.what, it.decision.verdict, it.times))
        .collect()
}

fn passed(what: &str) -> (BridgeId, String, Verdict, u64) {
    (HERE, what.to_owned(), Verdict::Passed, 1)
}

fn vehicle(now: Instant, accept: &[&str]) -> Exchange {
    let mut vehicle = bridge(THERE, accept);
    vehicle.handle_local(now, DRIVER, now);
    announce_by(HERE, now, &mut vehicle, OPERATOR);
    vehicle
}

#[test]
fn control_emergencies_and_refusals_are_recorded_once_with_the_bridge_of_their_sender() {
    let now = Instant::now();
    let mut vehicle = vehicle(now, &["60 control=100"]);
    for payload in [REQUEST_CONTROL, SET_EMERGENCY, QUERY, RESUME] {
        receive(now, &mut vehicle, payload);
    }
    let expected = [passed("RequestControl"), passed("SetEmergency")];
    assert_eq!(decided(&mut vehicle), expected, "no query and no command");

    receive(now, &mut vehicle, b"\x0D\x00\x65");
    let refused = decided(&mut vehicle);
    let [(HERE, what, Verdict::Refused(_), 1)] = &*refused else {
        panic!("{refused:?}");
    };
    assert_eq!(what, "RequestControl");
}

#[test]
fn what_a_component_answers_about_control_is_recorded() {
    let now = Instant::now();
    let mut vehicle = vehicle(now, &["60 control=100"]);
    for told in [&b"\x0F\x00\x00"[..], b"\x0F\x00\x02", b"\x10\x00\x00"] {
        vehicle.transmit(now, &to_group(&[frame(DRIVER, OPERATOR, told)]));
    }
    let told: Vec<_> = decided(&mut vehicle).into_iter().map(|it| it.2).collect();
    assert_eq!(told, [Verdict::Granted, Verdict::Denied, Verdict::Ended]);
}

#[test]
fn who_uses_the_id_of_another_bridge_is_recorded() {
    let now = Instant::now();
    let mut vehicle = bridge(THERE, &["60 control=100"]);
    announce_by(BridgeId::new(9), now, &mut vehicle, OPERATOR);
    receive(now, &mut vehicle, REQUEST_CONTROL);
    receive(now, &mut vehicle, QUERY);
    let refused = decided(&mut vehicle);
    assert!(
        matches!(&*refused, [(HERE, _, Verdict::Refused(_), 1)]),
        "{refused:?}"
    );
}

#[test]
fn while_nothing_can_be_recorded_commands_are_refused_and_stops_pass() {
    let now = Instant::now();
    let mut vehicle = vehicle(now, &["60 control=100"]);
    vehicle.refuse_commands(true);
    for payload in [REQUEST_CONTROL, RESUME] {
        receive(now, &mut vehicle, payload);
    }
    assert!(arrivals(&mut vehicle).is_empty());
    for payload in [SET_EMERGENCY, STANDBY, QUERY] {
        receive(now, &mut vehicle, payload);
    }
    assert_eq!(arrivals(&mut vehicle).len(), 3);
    vehicle.refuse_commands(false);
    receive(now, &mut vehicle, RESUME);
    assert_eq!(arrivals(&mut vehicle).len(), 1);
}
