//! Examinations of scripted peers, in virtual time: the complete output for each kind of failure.
//! The expected texts are in files beside this one.

mod air;
mod scripted;

use std::time::Duration;

use jaus::address::JausId;
use jaus::peer::{Certainty, Implementation};
use jaus_cli::failure::Outcome;
use jaus_test_kit::snapshot;

use super::case::Settings;
use super::exchange::Exchange;
use super::report;
use air::{Air, examine};
use scripted::{Ra, Silent, Vehicle};

const OWN: JausId = JausId::new(60_001, 1, 1);

fn settings(target: &str) -> Settings {
    Settings {
        target: target.parse().unwrap(),
        own: OWN,
        last_number: 0,
        wanted: None,
        is_secure: false,
        port: 3794,
        no_group: None,
        listen: Duration::from_secs(6),
        control: false,
        payload_limit: 1425,
    }
}

/// Output and exit status of an examination.
fn printed(settings: Settings, peer: &mut dyn air::Scripted) -> (String, Outcome) {
    let examiner = examine(settings, peer);
    let case = examiner.case();
    let before = std::iter::once(None).chain(case.trials.iter().map(Some));
    let lines = case.trials.iter().zip(before);
    let lines = lines.filter_map(|(trial, before)| report::line(trial, before, false));
    let lines: Vec<String> = lines.collect();
    let text = format!(
        "{}\n{}\n\n{}\n",
        lines.join("\n"),
        report::profile(case),
        report::conclusion(case, true)
    );
    let width = text.lines().map(|line| line.chars().count()).max();
    assert!(width <= Some(80), "a line is too long:\n{text}");
    (text, report::outcome(case, true))
}

/// The same in one line, to search for a sentence.
fn words(settings: Settings, peer: &mut dyn air::Scripted) -> (String, Outcome) {
    let (text, outcome) = printed(settings, peer);
    (
        text.split_whitespace().collect::<Vec<_>>().join(" "),
        outcome,
    )
}

/// Compares the output with the text of this name.
#[track_caller]
fn check(name: &str, settings: Settings, peer: &mut dyn air::Scripted) -> Outcome {
    let (text, outcome) = printed(settings, peer);
    check_text(name, &text);
    outcome
}

#[track_caller]
fn check_text(name: &str, text: &str) {
    let directory = concat!(env!("CARGO_MANIFEST_DIR"), "/src/bin/jaus/examine/tests");
    snapshot::check(format!("{directory}/{name}.txt"), text);
}

/// The first failed exchange.
fn first_failure(settings: Settings, peer: &mut dyn air::Scripted) -> Option<Exchange> {
    let examiner = examine(settings, peer);
    let mut trials = examiner.case().trials.iter();
    trials
        .find(|trial| trial.failed())
        .map(|trial| trial.exchange)
}

#[test]
fn a_sound_peer_is_found_sound() {
    let outcome = check("sound", settings("10.0.0.2"), &mut Vehicle::sound());
    assert_eq!(outcome, Outcome::Done);
}

#[test]
fn a_peer_is_found_by_its_id_alone() {
    let mut control = settings("77.1.1");
    control.control = true;
    let outcome = check("by-id", control, &mut Vehicle::sound());
    assert_eq!(outcome, Outcome::Done);
}

#[test]
fn somebody_else_with_another_id_is_named() {
    let outcome = check("another-id", settings("78.1.1"), &mut Vehicle::sound());
    assert_eq!(outcome, Outcome::Incomplete);
}

#[test]
fn a_silent_host_and_a_closed_port_are_told_apart() {
    let outcome = check("silent", settings("10.0.0.2"), &mut Silent::default());
    assert_eq!(outcome, Outcome::Incomplete);
    let mut gone = Silent {
        gone: true,
        ..Silent::default()
    };
    let (text, _) = words(settings("10.0.0.2"), &mut gone);
    let told = "there is no route to 10.0.0.2, or no host has that address";
    assert!(text.contains(told), "{text}");
    let mut closed = Silent {
        refuses: true,
        ..Silent::default()
    };
    assert_eq!(
        check("closed", settings("10.0.0.2"), &mut closed),
        Outcome::Incomplete
    );
}

#[test]
fn a_program_that_holds_its_port_and_reads_nothing_is_said_to_hang() {
    let mut hung = Silent {
        hangs: true,
        ..Silent::default()
    };
    let outcome = check("hung", settings("10.0.0.2"), &mut hung);
    assert_eq!(outcome, Outcome::Incomplete);
}

#[test]
fn a_peer_that_moved_is_named_with_its_new_address_whether_or_not_its_id_is_given() {
    for (target, told) in [
        (
            "10.0.0.9",
            "use its address: jaus examine 77.1.1@10.0.0.2:3794",
        ),
        (
            "77.1.1@10.0.0.9",
            "use that: jaus examine 77.1.1@10.0.0.2:3794",
        ),
    ] {
        let mut peer = Vehicle::sound();
        // It sends nothing by itself.
        peer.calls = false;
        let (text, outcome) = words(settings(target), &mut peer);
        assert_eq!(outcome, Outcome::Incomplete);
        assert!(text.contains(told), "{text}");
        assert!(text.contains("the peer has another address"), "{text}");
    }
}

#[test]
fn a_peer_of_the_reference_architecture_is_named_and_sent_to_the_gateway() {
    let outcome = check("ra", settings("10.0.0.2"), &mut Ra::default());
    assert_eq!(outcome, Outcome::Incomplete);
    let mut elsewhere = settings("10.0.0.2");
    elsewhere.port = 40_000;
    let (text, _) = words(elsewhere, &mut Ra::astray());
    assert!(
        text.contains("it answers to our port 3794, which is taken"),
        "{text}"
    );
}

#[test]
fn a_peer_that_answers_from_another_port_is_told_from_one_behind_a_translation() {
    let mut other = Vehicle::sound();
    other.speaks_from = 40_111;
    assert_eq!(
        check("other-port", settings("10.0.0.2"), &mut other),
        Outcome::Incomplete
    );
    let mut translated = Vehicle::sound();
    translated.speaks_from = 40_111;
    translated.hears_at_source = true;
    let (text, _) = words(settings("10.0.0.2"), &mut translated);
    assert!(
        text.contains("something on the path translates ports"),
        "{text}"
    );
}

#[test]
fn a_wrong_port_is_told_with_the_right_one() {
    let mut peer = Vehicle::sound();
    peer.address.set_port(3795);
    peer.speaks_from = 3795;
    let (text, outcome) = words(settings("10.0.0.2"), &mut peer);
    assert_eq!(outcome, Outcome::Incomplete);
    assert!(
        text.contains("use that: jaus examine 10.0.0.2:3795"),
        "{text}"
    );
}

#[test]
fn a_wrong_id_is_told_with_the_right_one() {
    let (text, outcome) = words(settings("78.1.1@10.0.0.2"), &mut Vehicle::sound());
    assert_eq!(outcome, Outcome::Incomplete);
    assert!(
        text.contains("use that: jaus examine 77.1.1@10.0.0.2:3794"),
        "{text}"
    );
}

#[test]
fn a_firewall_before_a_peer_that_speaks_is_suspected() {
    let mut peer = Vehicle::sound();
    peer.hears_unicast = false;
    let (text, outcome) = words(settings("10.0.0.2"), &mut peer);
    assert_eq!(outcome, Outcome::Incomplete);
    assert!(text.contains("its firewall blocks incoming UDP"), "{text}");
}

#[test]
fn a_peer_that_does_not_join_multicast_is_reached_by_unicast() {
    let mut peer = Vehicle::sound();
    peer.joined = false;
    let outcome = check("not-joined", settings("10.0.0.2"), &mut peer);
    assert_eq!(outcome, Outcome::Incomplete);
}

#[test]
fn jauspp_is_recognised_and_its_ways_are_named() {
    let outcome = check("jauspp", settings("10.0.0.2"), &mut Vehicle::jauspp());
    assert_eq!(outcome, Outcome::Incomplete);
}

#[test]
fn junior_without_services_acknowledges_and_no_more() {
    let outcome = check(
        "junior",
        settings("77.1.1@10.0.0.2"),
        &mut Vehicle::junior(),
    );
    assert_eq!(outcome, Outcome::Incomplete);
    // Its acknowledgement reveals its id.
    let first = first_failure(settings("10.0.0.2"), &mut Vehicle::junior());
    assert_eq!(first, Some(Exchange::Identification));
}

/// As observed on the three forks, JAUS++ and our own, and for a peer that ignores the type.
#[test]
fn junior_is_told_by_the_message_types_that_it_takes_and_its_fork_by_zeros() {
    type Knob = fn(&mut Vehicle);
    let juniors: fn(u8) -> bool = |kind| kind & 0b11 == 0;
    let cases: [(Knob, Implementation, Certainty); 5] = [
        (|_| {}, Implementation::Standard, Certainty::Unknown),
        (
            |v| v.takes_type = |_| true,
            Implementation::Standard,
            Certainty::Unknown,
        ),
        (
            |v| v.zero_is_all = true,
            Implementation::Standard,
            Certainty::Unknown,
        ),
        (|_| {}, Implementation::Junior, Certainty::Certain),
        (
            |v| v.zero_is_all = true,
            Implementation::Jts,
            Certainty::Certain,
        ),
    ];
    for (number, (knob, peer, certainty)) in cases.into_iter().enumerate() {
        let mut scripted = Vehicle::sound();
        scripted.events_of_services = false;
        if number > 2 {
            scripted.takes_type = juniors;
        }
        knob(&mut scripted);
        let examiner = examine(settings("10.0.0.2"), &mut scripted);
        let verdict = examiner.case().recognise();
        assert_eq!(
            (verdict.peer, verdict.certainty),
            (peer, certainty),
            "{number}"
        );
    }
}

#[test]
fn each_exchange_that_fails_is_the_first_to_be_named() {
    type Knob = fn(&mut Vehicle);
    let cases: [(Knob, Exchange); 17] = [
        (|v| v.identifies = false, Exchange::Identification),
        (|v| v.lists_itself = false, Exchange::Configuration),
        (|v| v.beats = false, Exchange::Heartbeat),
        (|v| v.acknowledges = false, Exchange::Acknowledgement),
        (|v| v.configures = false, Exchange::Configuration),
        (|v| v.wildcard = false, Exchange::ServicesWildcard),
        (|v| v.named = false, Exchange::ServicesNamed),
        (|v| v.all = false, Exchange::ServicesAll),
        (|v| v.reports_authority = false, Exchange::Authority),
        (|v| v.reports_status = false, Exchange::Status),
        (|v| v.reports_control = false, Exchange::Control),
        (|v| v.confirms = false, Exchange::EventPeriodic),
        (|v| v.fires = false, Exchange::EventArrives),
        (|v| v.cancels = false, Exchange::EventCancel),
        (|v| v.on_change = false, Exchange::EventOnChange),
        (|v| v.most_fragments = 8, Exchange::Large(100 << 10)),
        (|v| v.most_at_once = 20, Exchange::Rate),
    ];
    let mut told = String::new();
    for (knob, exchange) in cases {
        let mut peer = Vehicle::sound();
        knob(&mut peer);
        let examiner = examine(settings("10.0.0.2"), &mut peer);
        let mut failed = examiner.case().trials.iter().filter(|t| t.failed());
        let first = failed.next().unwrap();
        assert_eq!(first.exchange, exchange);
        told.push_str(&report::line(first, None, false).unwrap());
        told.push('\n');
    }
    check_text("failures", &told);
}

#[test]
fn a_name_cannot_forge_a_line_of_the_report() {
    let mut peer = Vehicle::sound();
    peer.name = "Mule\u{1b}[2J\nfailed\u{202e}";
    let (text, _) = printed(settings("10.0.0.2"), &mut peer);
    let told = r#"identification     "Mule\u{1b}[2J\nfailed\u{202e}", a vehicle"#;
    assert!(text.contains(told), "{text}");
}

#[test]
fn numbers_that_do_not_count_and_messages_that_come_twice_are_noticed() {
    for (knob, told) in [
        (
            (|v| v.counts = false) as fn(&mut Vehicle),
            "messages have the sequence number 7",
        ),
        (|v| v.doubles = true, "messages arrived twice"),
    ] {
        let mut peer = Vehicle::sound();
        knob(&mut peer);
        let (text, _) = words(settings("10.0.0.2"), &mut peer);
        assert!(text.contains(told), "{text}");
    }
}

#[test]
fn an_id_that_is_there_twice_or_that_our_node_is_to_have_is_noticed() {
    let mut peer = Vehicle::sound();
    peer.twin = Some("10.0.0.9:3794".parse().unwrap());
    let (text, _) = words(settings("77.1.1@10.0.0.2"), &mut peer);
    assert!(
        text.contains("77.1.1 sends from 10.0.0.2 and from 10.0.0.9"),
        "{text}"
    );
    let mut same = settings("10.0.0.2");
    same.wanted = Some(JausId::new(77, 1, 1));
    let (text, _) = words(same, &mut Vehicle::sound());
    assert!(
        text.contains("77.1.1 is the id chosen for our node"),
        "{text}"
    );
}

#[test]
fn nothing_is_commanded_and_no_control_taken_without_leave() {
    let mut peer = Vehicle::sound();
    examine(settings("10.0.0.2"), &mut peer);
    // Events are created and cancelled; nothing else resembles a command.
    assert!(
        peer.heard_codes
            .iter()
            .all(|code| *code > 0x0FFF || [0x01F0, 0x01F2].contains(code))
    );
    assert!(peer.events.is_empty(), "{:?}", peer.events);
    let mut control = settings("10.0.0.2");
    control.control = true;
    let mut peer = Vehicle::sound();
    examine(control, &mut peer);
    assert!(peer.heard_codes.contains(&0x000D) && peer.heard_codes.contains(&0x000E));
}

#[test]
fn who_stops_an_examination_leaves_no_event_and_no_control_behind() {
    let mut peer = Vehicle::sound();
    let mut examiner = super::examiner::Examiner::new(settings("10.0.0.2"));
    let mut air = Air::new();
    air.run(&mut examiner, &mut peer, |examiner| {
        examiner.case().open_events.is_empty()
    });
    assert_eq!(peer.events.len(), 1);
    examiner.leave();
    air.deliver_sends(&mut examiner, &mut peer);
    assert!(peer.events.is_empty());
}

#[test]
fn anything_at_all_is_survived() {
    let mut state = 7_u32;
    let mut random = move || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 24) as u8
    };
    let mut peer = air::Noise(Box::new(move || {
        let length = usize::from(random()) % 60;
        let mut octets: Vec<u8> = (0..length).map(|_| random()).collect();
        if let (Some(first), 0..=200) = (octets.first_mut(), random()) {
            *first = 2;
        }
        octets
    }));
    examine(settings("10.0.0.2"), &mut peer);
}
