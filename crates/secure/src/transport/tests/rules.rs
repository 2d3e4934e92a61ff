//! What a key may do, and what one peer learns of another.

use jaus::codec::Message as _;
use jaus::messages::core::{
    ConfirmControl, Event, QueryIdentification, RejectControl, RequestControl, SetEmergency,
};
use jaus::messages::mobility::{
    QueryVelocityState, ReportGlobalPose, ReportVelocityState, SetWrenchEffort,
};
use jaus::rights::{Decision, Refusal, Unaccepted, Verdict};
use jaus::wire::{DataControl, Flags};

use super::*;

/// A vehicle whose rules for the operator are these.
fn vehicle_with_rules(rules: &str) -> (Network, [TrustFile; 2], [Key; 2]) {
    let (mut network, trust, keys) = vehicle_and_operator();
    replace_rules(&trust[0], &keys[1], rules);
    network.run(SECOND);
    (network, trust, keys)
}

fn replace_rules(trust: &TrustFile, operator: &Key, rules: &str) {
    let operator = Peer {
        rules: rules.parse().unwrap(),
        ..peer("operator", operator, "60.255.255")
    };
    trust.replace(Trust::new(vec![operator]));
}

fn message(source: &str, destination: &str, message: &impl jaus::codec::Message) -> Bytes {
    raw(source, destination, &message.encode().unwrap())
}

impl Network {
    /// Lets a host send a message to whom it has a session with.
    fn say(&mut self, host: usize, from: &str, to: &str, sent: &impl jaus::codec::Message) {
        self.send(host, Priority::Standard, &message(from, to, sent));
    }
}

fn records(network: &mut Network, host: usize) -> Vec<Act> {
    let transport = &mut network.hosts[host].transport;
    let each = std::iter::from_fn(|| transport.poll_record());
    each.flat_map(|(record, times)| (0..times).map(move |_| record.act.clone()))
        .collect()
}

fn decisions(network: &mut Network, host: usize) -> Vec<Decision> {
    let decided = |act| match act {
        Act::Decided(decision) => Some(decision),
        _ => None,
    };
    let records = records(network, host);
    records.into_iter().filter_map(decided).collect()
}

#[test]
fn an_id_of_several_keys_belongs_to_those_with_the_narrowest_ids() {
    let (mut network, trust, keys) = vehicle_and_operator();
    let viewer = key();
    let narrow = ["60.1.255", "60.255.255"];
    let [operator, wide] = narrow.map(|it| it.parse::<JausId>().unwrap());
    let both = |operators: JausId| {
        let mut peers = vec![peer("operator", &keys[1], "60.1.255")];
        peers[0].ids = vec![operators];
        peers.push(peer("viewer", &viewer, "60.255.255"));
        Trust::new(peers)
    };
    trust[0].replace(both(operator));
    let rover = trusting([peer("rover", &keys[0], "101.255.255")]);
    let viewing = network.add(&viewer, &rover, &[address(1)]);
    network.run(2 * SECOND);
    // The viewer comes first with the operator's id.
    for id in ["60.1.1", "60.2.1"] {
        network.send(viewing, Priority::Standard, &judp(id, 20));
    }
    network.run(SECOND);
    assert_eq!(network.hosts[0].received, [judp("60.2.1", 20)]);
    network.send(1, Priority::Standard, &judp("60.1.1", 30));
    network.run(SECOND);
    assert_eq!(network.hosts[0].received[1..], [judp("60.1.1", 30)]);
    // With ids that are as wide, as those of a relay on a second way, both may use them.
    trust[0].replace(both(wide));
    network.run(SECOND);
    network.send(viewing, Priority::Standard, &judp("60.1.1", 40));
    network.run(SECOND);
    assert_eq!(network.hosts[0].received[2..], [judp("60.1.1", 40)]);
}

#[test]
fn a_key_that_may_observe_commands_nothing_and_is_told_so() {
    let (mut network, ..) = vehicle_with_rules("");
    let wrench = message("60.1.1", "101.1.1", &SetWrenchEffort::default());
    let stop = message("60.1.1", "101.1.1", &SetEmergency::default());
    for datagram in [&wrench, &stop, &wrench] {
        network.send(1, Priority::Standard, datagram);
    }
    network.run(SECOND);
    assert_eq!(network.hosts[0].received, [stop]);
    assert_eq!(network.count(0, Counter::RuleForbids), 2);
    let notices = network.count(1, Counter::NoticesReceived);
    assert_eq!(notices, 1, "one a second");
    let recorded = decisions(&mut network, 0);
    let refused = |it: &&Decision| it.is_refusal() && it.what == "SetWrenchEffort";
    assert_eq!(recorded.iter().filter(refused).count(), 2);
}

#[test]
fn what_cannot_be_recorded_is_refused_but_stops_are_not() {
    let (mut network, ..) = vehicle_with_rules("control=127");
    let request = message("60.1.1", "101.1.1", &RequestControl { authority_code: 1 });
    let stop = message("60.1.1", "101.1.1", &SetEmergency::default());
    network.hosts[0].transport.refuse_commands(true);
    for datagram in [&request, &stop] {
        network.send(1, Priority::Standard, datagram);
    }
    network.run(SECOND);
    assert_eq!(network.hosts[0].received, std::slice::from_ref(&stop));
    network.hosts[0].transport.refuse_commands(false);
    network.send(1, Priority::Standard, &request);
    network.run(SECOND);
    assert_eq!(network.hosts[0].received, [stop, request]);
}

#[test]
fn a_request_beyond_the_authority_of_a_key_is_denied_in_the_words_of_jaus() {
    let (mut network, ..) = vehicle_with_rules("control=127");
    let request = |authority_code| message("60.1.1", "101.1.1", &RequestControl { authority_code });
    network.send(1, Priority::Standard, &request(128));
    network.send(1, Priority::Standard, &request(127));
    network.run(SECOND);
    assert_eq!(network.hosts[0].received, [request(127)]);
    let answer = network.hosts[1].received.pop().unwrap();
    let frame = judp::frames(answer).unwrap().next().unwrap().unwrap();
    assert_eq!(
        (frame.source, frame.destination),
        (JausId::new(101, 1, 1), JausId::new(60, 1, 1))
    );
    let confirm = ConfirmControl::decode(&frame.payload).unwrap();
    assert_eq!(confirm.response_code.0, 2, "insufficient authority");
}

#[test]
fn rules_that_change_apply_to_running_sessions() {
    let (mut network, trust, keys) = vehicle_with_rules("");
    let wrench = message("60.1.1", "101.1.1", &SetWrenchEffort::default());
    replace_rules(&trust[0], &keys[1], "command");
    network.run(SECOND);
    network.send(1, Priority::Standard, &wrench);
    network.run(SECOND);
    assert_eq!(network.hosts[0].received, std::slice::from_ref(&wrench));
    replace_rules(&trust[0], &keys[1], "observe");
    network.run(SECOND);
    network.send(1, Priority::Standard, &wrench);
    network.run(SECOND);
    assert_eq!(network.hosts[0].received, [wrench]);
    assert!(network.hosts[0].closed.is_empty(), "the session remains");
}

#[test]
fn what_except_adds_ends_the_reports_of_a_subscription_that_stands() {
    let (mut network, trust, keys) = vehicle_with_rules("");
    let pose = ReportGlobalPose::default().encode().unwrap();
    let event = Event {
        event_id: 1,
        sequence_number: 1,
        report_message: pose.clone(),
    };
    let reports = [
        raw("101.1.1", "60.1.1", &pose),
        message("101.1.1", "60.1.1", &event),
        message("101.1.1", "60.1.1", &ReportVelocityState::default()),
    ];
    for datagram in &reports {
        network.send(0, Priority::Standard, datagram);
    }
    network.run(SECOND);
    assert_eq!(network.hosts[1].received, reports);
    replace_rules(&trust[0], &keys[1], "except=GlobalPoseSensor");
    network.run(SECOND);
    for datagram in &reports {
        network.send(0, Priority::Standard, datagram);
    }
    network.run(SECOND);
    assert_eq!(network.hosts[1].received[3..], reports[2..]);
    assert_eq!(network.count(0, Counter::Separated), 2);
}

#[test]
fn of_a_packed_datagram_the_allowed_messages_pass() {
    let (mut network, ..) = vehicle_with_rules("");
    let stop = message("60.1.1", "101.1.1", &SetEmergency::default());
    let wrench = message("60.1.1", "101.1.1", &SetWrenchEffort::default());
    let mut packed = stop.to_vec();
    packed.extend_from_slice(&wrench[1..]);
    packed.extend_from_slice(&stop[1..]);
    network.send(1, Priority::Standard, &packed.into());
    network.run(SECOND);
    let twice = [&stop[..], &stop[1..]].concat();
    assert_eq!(network.hosts[0].received, [Bytes::from(twice)]);
}

#[test]
fn control_emergencies_and_sessions_are_recorded() {
    let (mut network, ..) = vehicle_with_rules("control=127");
    let request = message("60.1.1", "101.1.1", &RequestControl { authority_code: 1 });
    network.send(1, Priority::Standard, &request);
    network.say(1, "60.1.1", "101.1.1", &SetEmergency::default());
    network.run(SECOND);
    network.say(0, "101.1.1", "60.1.1", &ConfirmControl::default());
    network.run(SECOND);
    let acts = records(&mut network, 0);
    assert_eq!(acts[0], Act::Connected);
    let decided = acts.iter().filter_map(|act| match act {
        Act::Decided(it) => Some((&*it.what, it.verdict)),
        _ => None,
    });
    let expected = [
        ("RequestControl", Verdict::Passed),
        ("SetEmergency", Verdict::Passed),
        ("ConfirmControl", Verdict::Granted),
    ];
    assert_eq!(decided.collect::<Vec<_>>(), expected);
}

/// A relay with two vehicles, 101 and 102, and two operators, 61 and 62; each operator has one
/// vehicle. The hosts in this order.
fn relay() -> Network {
    let keys: [Key; 5] = std::array::from_fn(|_| key());
    let names = ["rover", "truck", "anna", "bert"];
    let ids = ["101.255.255", "102.255.255", "61.255.255", "62.255.255"];
    let rules = [
        "with=61.255.255",
        "",
        "control=127 with=101.255.255",
        "control=127 with=102.255.255",
    ];
    let peers = (0..4).map(|it| Peer {
        rules: rules[it].parse().unwrap(),
        ..peer(names[it], &keys[it + 1], ids[it])
    });
    let mut network = Network::new();
    network.add(&keys[0], &TrustFile::of(Trust::new(peers.collect())), &[]);
    for key in &keys[1..] {
        let relay = peer("relay", &keys[0], "65535.255.255");
        network.add(key, &trusting([relay]), &[address(1)]);
    }
    network.run(SECOND);
    network
}

/// Passes on what the relay has received, to all others, as a router does without routes.
fn pass_on(network: &mut Network) {
    network.run(SECOND);
    for datagram in std::mem::take(&mut network.hosts[0].received) {
        network.send_to_all(0, &datagram);
    }
    network.run(SECOND);
}

#[test]
fn a_relay_separates_vehicles_and_operators_by_its_rules() {
    let mut network = relay();
    let heartbeat = message("101.1.1", "65535.255.255", &QueryIdentification::default());
    let hello = message("61.1.1", "65535.255.255", &QueryIdentification::default());
    network.send(1, Priority::Standard, &heartbeat);
    network.send(3, Priority::Standard, &hello);
    network.say(3, "61.1.1", "102.1.1", &SetEmergency::default());
    pass_on(&mut network);
    let received = |host: usize| network.hosts[host].received.clone();
    // Each gets its own broadcast back too; a router does not send there.
    assert_eq!(received(1), std::slice::from_ref(&hello));
    assert!(
        received(2).is_empty(),
        "the truck may reach all, but Anna may not reach the truck"
    );
    assert_eq!(received(3), [heartbeat]);
    assert!(received(4).is_empty(), "Bert may reach the truck alone");
    // Anna's message to the truck.
    assert_eq!(network.count(0, Counter::RuleForbids), 1);
}

#[test]
fn a_stop_for_all_reaches_those_that_its_sender_may_reach_and_no_others() {
    let mut network = relay();
    let stop = SetEmergency::default();
    network.say(3, "61.1.1", "65535.255.255", &stop);
    pass_on(&mut network);
    let own = message("61.1.1", "101.255.255", &stop);
    assert_eq!(network.hosts[1].received, [own]);
    for host in 2..=4 {
        assert!(network.hosts[host].received.is_empty(), "{host}");
    }
    assert_eq!(network.count(0, Counter::RuleForbids), 0);
}

/// A fragment of a Set Wrench Effort from 60.1.1 to 101.1.1.
fn fragment(data: DataControl, sequence: u16) -> Bytes {
    let (source, destination) = (JausId::new(60, 1, 1), JausId::new(101, 1, 1));
    let frame = Frame {
        flags: Flags::default().with_data(data),
        sequence,
        ..Frame::new(source, destination, Bytes::from_static(b"\x05\x04\0\0"))
    };
    judp::encode(&frame).unwrap()
}

#[test]
fn fragments_of_one_key_complete_no_message_of_another() {
    use DataControl::{First, Last, Middle};
    let keys: [Key; 3] = std::array::from_fn(|_| key());
    let rules = |rules: &str, name, key| Peer {
        rules: rules.parse().unwrap(),
        ..peer(name, key, "60.255.255")
    };
    let peers = [
        rules("command", "operator", &keys[1]),
        rules("", "viewer", &keys[2]),
    ];
    let mut network = Network::new();
    network.add(&keys[0], &trusting(peers), &[]);
    for key in &keys[1..] {
        let vehicle = peer("vehicle", &keys[0], "101.255.255");
        network.add(key, &trusting([vehicle]), &[address(1)]);
    }
    network.run(SECOND);
    let mut send = |host, data, number| {
        network.send(host, Priority::Standard, &fragment(data, number));
        network.run(SECOND);
        network.hosts[0].received.len()
    };
    assert_eq!(send(1, First, 1), 1);
    assert_eq!(send(2, Middle, 2), 1, "the viewer continues the command");
    assert_eq!(send(2, Last, 2), 1, "the viewer ends the command");
    assert_eq!(send(1, Middle, 2), 2);
    assert_eq!(send(1, Last, 3), 3);
    assert_eq!(network.count(0, Counter::StrayFragments), 2);
}

#[test]
fn a_message_goes_only_to_the_session_of_its_destination() {
    let mut network = relay();
    let query = message("200.1.1", "62.1.1", &QueryVelocityState::default());
    network.send_to_all(0, &query);
    network.run(SECOND);
    for host in 1..=3 {
        assert!(network.hosts[host].received.is_empty(), "{host}");
    }
    // Bert exchanges messages with the truck alone.
    assert!(network.hosts[4].received.is_empty());
    let query = message("102.1.1", "62.1.1", &QueryVelocityState::default());
    network.send_to_all(0, &query);
    network.run(SECOND);
    assert_eq!(network.hosts[4].received, [query]);
}

/// However many requests are open: none of them keeps the answer to another out of the log.
#[test]
fn each_answer_about_control_and_its_loss_are_recorded() {
    let (mut network, ..) = vehicle_with_rules("control=127");
    for component in 1..=200 {
        let to = format!("101.1.{component}");
        let request = RequestControl { authority_code: 1 };
        network.say(1, "60.1.1", &to, &request);
    }
    network.run(SECOND);
    let told: [Bytes; 3] = [
        message("101.1.1", "60.1.1", &ConfirmControl::default()),
        message("101.1.1", "60.1.1", &RejectControl::default()),
        message("101.1.200", "60.1.1", &ConfirmControl::default()),
    ];
    for told in &told {
        network.send(0, Priority::Standard, told);
    }
    network.run(SECOND);
    let told = decisions(&mut network, 0).into_iter();
    let told = told.filter(|it| it.source.subsystem() == 101);
    let told: Vec<_> = told.map(|it| (it.source.component(), it.verdict)).collect();
    let (granted, ended) = (Verdict::Granted, Verdict::Ended);
    assert_eq!(told, [(1, granted), (1, ended), (200, granted)]);
}

#[test]
fn refused_messages_do_not_displace_the_record_of_what_was_done() {
    let (mut network, ..) = vehicle_with_rules("");
    let stop = message("60.1.1", "101.1.1", &SetEmergency::default());
    network.send(1, Priority::Standard, &stop);
    for number in 0..1000 {
        let to = format!("101.{}.{}", 1 + number / 250, 1 + number % 250);
        let wrench = message("60.1.1", &to, &SetWrenchEffort::default());
        network.send(1, Priority::Standard, &wrench);
    }
    network.run(5 * SECOND);
    assert!(network.count(0, Counter::RecordsLost) > 0);
    let is_stop = |it: &Decision| !it.is_refusal() && it.what == "SetEmergency";
    assert!(decisions(&mut network, 0).iter().any(is_stop));
}

/// Handover of Enhanced Access Control: the request may be put off before it is granted.
#[test]
fn a_handover_is_recorded_with_each_of_its_answers() {
    let (mut network, ..) = vehicle_with_rules("control=127");
    // Authority 100, and 200; no explanation.
    for request in [b"\x31\xFF\x64\0", b"\x31\xFF\xC8\0"] {
        network.send(1, Priority::Standard, &raw("60.1.1", "101.1.1", request));
    }
    network.run(SECOND);
    // Request 1 is queued, then granted.
    for answer in [b"\x35\xFF\x01\x04", b"\x35\xFF\x01\0", b"\x35\xFF\x01\0"] {
        network.send(0, Priority::Standard, &raw("101.1.1", "60.1.1", answer));
    }
    network.run(SECOND);
    let seen = decisions(&mut network, 0).into_iter();
    let seen: Vec<_> = seen.map(|it| (it.what, it.verdict)).collect();
    let refused = Verdict::Refused(Unaccepted::Rule(Refusal::Authority {
        asked: 200,
        most: 127,
    }));
    let expected = [
        ("RequestHandoff", Verdict::Passed),
        ("RequestHandoff", refused),
        ("ConfirmHandoffRequest", Verdict::Denied),
        ("ConfirmHandoffRequest", Verdict::Granted),
        ("ConfirmHandoffRequest", Verdict::Granted),
    ];
    assert_eq!(
        seen,
        expected.map(|(what, verdict)| (what.to_owned(), verdict))
    );
    let answer = network.hosts[1].received.first().unwrap();
    let frame = judp::frames(answer.clone()).unwrap().next().unwrap();
    assert_eq!(
        *frame.unwrap().payload,
        *b"\x35\xFF\0\x06",
        "insufficient authority"
    );
}
