use bytes::Bytes;

use super::super::*;
use crate::address::JausId;
use crate::codec::{Message, Text};
use crate::messages::core::{RegisterServices, register_services};
use crate::wire::{Acknowledgement, Broadcast, DataControl, Flags, Frame};

const US: JausId = JausId::new(101, 1, 1);
const PEER: JausId = JausId::new(42, 1, 1);
const QUERY: &[u8] = b"\x02\x22";

fn frame(sequence: u16, payload: &'static [u8]) -> Frame {
    Frame {
        sequence,
        ..Frame::new(PEER, US, Bytes::from_static(payload))
    }
}

fn to(destination: JausId, sequence: u16) -> Frame {
    Frame {
        destination,
        ..frame(sequence, QUERY)
    }
}

fn after<'a>(frames: impl IntoIterator<Item = &'a Frame>) -> Verdict {
    let mut recogniser = Recogniser::default();
    for frame in frames {
        recogniser.handle_frame(frame, 0);
    }
    recogniser.verdict()
}

/// The fragments of a message of `octets`, each with the code and this payload.
fn with_code_in_each(octets: usize, payload: usize) -> Vec<Frame> {
    let count = octets.div_ceil(payload - 2);
    let fragment = |index: usize| {
        let data = match index {
            0 => DataControl::First,
            _ if index + 1 == count => DataControl::Last,
            _ => DataControl::Middle,
        };
        let length = (octets - index * (payload - 2)).min(payload - 2);
        let mut body = vec![0x01, 0x4B];
        body.extend(std::iter::repeat_n(b'x', length));
        Frame {
            flags: Flags::default().with_data(data),
            payload: body.into(),
            ..frame(7 + index as u16, b"")
        }
    };
    (0..count).map(fragment).collect()
}

#[test]
fn nothing_is_known_of_who_keeps_to_the_standard() {
    let frames: Vec<_> = (500..520).map(|number| frame(number, QUERY)).collect();
    assert_eq!(after(&frames), Verdict::default());
    assert_eq!(Recogniser::default().certain(), Implementation::Standard);
}

#[test]
fn jauspp_is_certain_by_its_fragments_and_nobody_by_others() {
    let verdict = after(&with_code_in_each(5000, 1573));
    assert_eq!(
        (verdict.peer, verdict.certainty),
        (Implementation::JausPlusPlus, Certainty::Certain)
    );
    assert_eq!(verdict.reasons, [Sign::RepeatedCode]);
    let other_length = after(&with_code_in_each(5000, 1425));
    assert_eq!(other_length.certainty, Certainty::Unknown);
    let mut without = with_code_in_each(5000, 1573);
    let last = without.len() - 1;
    without[last].payload = Bytes::from_static(b"xxxx");
    assert_eq!(after(&without).certainty, Certainty::Unknown);
    let mut gap = with_code_in_each(5000, 1573);
    gap.remove(1);
    assert_eq!(after(&gap).certainty, Certainty::Unknown, "one is missing");
}

#[test]
fn stale_octets_make_jauspp_likely_and_a_registration_from_elsewhere_makes_it_certain() {
    let mut recogniser = Recogniser::default();
    recogniser.handle_frame(&frame(3, QUERY), 206);
    let verdict = recogniser.verdict();
    assert_eq!(
        (verdict.peer, verdict.certainty),
        (Implementation::JausPlusPlus, Certainty::Likely)
    );
    assert_eq!(
        recogniser.certain(),
        Implementation::Standard,
        "likely is not enough"
    );
    let registration = RegisterServices {
        service_list: vec![register_services::ServiceRec {
            uri: Text::from("urn:jaus:jss:core:Events"),
            major_version_number: 1,
            minor_version_number: 0,
        }],
    };
    let payload = registration.encode().unwrap();
    recogniser.handle_frame(
        &Frame {
            payload,
            ..frame(4, b"")
        },
        0,
    );
    assert_eq!(recogniser.certain(), Implementation::JausPlusPlus);
    let reasons = recogniser.verdict().reasons;
    assert_eq!(
        reasons,
        [
            Sign::StaleOctets,
            Sign::RegistersAcrossSubsystems,
            Sign::OnlyFirstVersions
        ]
    );
}

#[test]
fn services_tell_jauspp_and_the_profiles() {
    let after = |services: &[(&str, u8, u8)]| {
        let mut recogniser = Recogniser::default();
        recogniser.handle_services(services.iter().copied());
        recogniser
    };
    let of_jauspp = after(&[("urn:jaus:jss:jpp:extras:Video", 1, 0)]);
    assert_eq!(of_jauspp.certain(), Implementation::JausPlusPlus);
    // Any peer may offer these, for instance our own vehicle.
    let mut of_profile = after(&[("urn:jaus:jss:iop:CostMap2D", 1, 1)]);
    assert_eq!(of_profile.verdict().certainty, Certainty::Unknown);
    assert_eq!(
        of_profile.presumed(),
        Implementation::Iop,
        "a 0 of it means all"
    );
    of_profile.note(Sign::ZeroInDestination);
    assert_eq!(of_profile.certain(), Implementation::Iop);
    let of_core = after(&[("urn:jaus:jss:core:Events", 1, 0)]);
    assert_eq!(of_core.certain(), Implementation::Standard);
    assert_eq!(of_core.presumed(), Implementation::Standard);
}

#[test]
fn junior_of_the_tool_set_confuses_ids_with_zero_octets() {
    let confused = |one: &str, other: &str| {
        Implementation::Jts.confuses(one.parse().unwrap(), other.parse().unwrap())
    };
    assert!(confused("1.1.1", "513.1.1") && confused("513.1.1", "1.1.1"));
    assert!(!confused("1.1.1", "2.1.1") && !confused("257.1.1", "513.1.1"));
    assert!(!confused("1.1.1", "1.1.1"), "it is the same");
    assert!(!Implementation::Fkie.confuses(JausId::new(1, 1, 1), JausId::new(513, 1, 1)));
}

#[test]
fn junior_is_likely_by_its_first_call_and_certain_by_its_fault() {
    let call = Frame {
        flags: Flags::default()
            .with_broadcast(Broadcast::Global)
            .with_acknowledgement(Acknowledgement::Request),
        ..frame(1, QUERY)
    };
    let verdict = after([&call]);
    assert_eq!(
        (verdict.peer, verdict.certainty),
        (Implementation::Junior, Certainty::Likely)
    );
    let ours = Frame {
        sequence: 4711,
        ..call
    };
    assert_eq!(
        after([&ours]).certainty,
        Certainty::Unknown,
        "we call like that too"
    );
    let fault = Frame {
        flags: Flags(0xFF),
        ..frame(2, QUERY)
    };
    assert_eq!(after([&fault]).certainty, Certainty::Certain);
    let acknowledgement = Frame {
        flags: Flags(0xFF),
        ..frame(2, b"")
    };
    assert_eq!(after([&acknowledgement]).certainty, Certainty::Unknown);
}

#[test]
fn what_speaks_for_junior_speaks_for_a_fork_that_gives_itself_away() {
    let mut recogniser = Recogniser::default();
    recogniser.note(Sign::AnswersForZero);
    let guessed = recogniser.verdict();
    assert_eq!(
        (guessed.peer, guessed.certainty),
        (Implementation::Jts, Certainty::Likely)
    );
    recogniser.note(Sign::MisreadType);
    assert_eq!(recogniser.certain(), Implementation::Jts);
    let mut recogniser = Recogniser::default();
    recogniser.note(Sign::MisreadType);
    assert_eq!(recogniser.certain(), Implementation::Junior);
}

#[test]
fn the_judging_tool_is_told_by_how_it_counts_and_whom_it_asks() {
    let node = US.whole_node();
    let mut frames = Vec::new();
    for (destination, number) in [
        (node, 1),
        (JausId::EVERYONE, 1),
        (node, 2),
        (JausId::EVERYONE, 2),
        (node, 3),
    ] {
        frames.push(Frame {
            flags: Flags::default().with_broadcast(Broadcast::Global),
            ..to(destination, number)
        });
    }
    let verdict = after(&frames);
    assert_eq!(
        (verdict.peer, verdict.certainty),
        (Implementation::OpenJausSdk, Certainty::Certain)
    );
    let once: Vec<_> = [(node, 7), (US, 8), (node, 9), (US, 10), (node, 11)]
        .map(|(destination, number)| to(destination, number))
        .into();
    assert_eq!(
        after(&once).certainty,
        Certainty::Unknown,
        "one counter for all"
    );
}

#[test]
fn a_node_of_ours_is_not_taken_for_another_implementation() {
    let node = US.whole_node();
    let to_all = |destination, number| Frame {
        flags: Flags::default().with_broadcast(Broadcast::Global),
        ..to(destination, number)
    };
    let whole_nodes = [to_all(node, 31_361), to_all(node, 31_362)];
    let long = Frame {
        flags: Flags::default().with_data(DataControl::First),
        payload: vec![1; 4079].into(),
        ..frame(31_362, b"")
    };
    let call = Frame {
        flags: Flags::default()
            .with_broadcast(Broadcast::Global)
            .with_acknowledgement(Acknowledgement::Request),
        ..frame(31_363, QUERY)
    };
    for frames in [&whole_nodes[..], &[long, call]] {
        let verdict = after(frames);
        assert!(!verdict.reasons.is_empty(), "the test shows no sign");
        assert_eq!(
            (verdict.peer, verdict.certainty),
            (Implementation::Standard, Certainty::Unknown),
            "{:?}",
            verdict.reasons
        );
    }
}

#[test]
fn messages_out_of_order_are_no_count_per_destination() {
    let other = JausId::new(101, 1, 2);
    let retransmitted = [
        (US, 500),
        (other, 501),
        (US, 502),
        (other, 501),
        (US, 503),
        (other, 501),
        (US, 504),
    ];
    let early = [(US, 500), (other, 502), (US, 501), (other, 504), (US, 502)];
    let late = [(US, 501), (other, 500), (US, 502), (other, 498), (US, 503)];
    for order in [&retransmitted[..], &early, &late] {
        let frames: Vec<_> = order.iter().map(|&(id, number)| to(id, number)).collect();
        assert_eq!(after(&frames), Verdict::default(), "{order:?}");
    }
    let far = [(US, 500), (other, 9), (US, 501), (other, 10), (US, 502)];
    let frames: Vec<_> = far.iter().map(|&(id, number)| to(id, number)).collect();
    assert_eq!(after(&frames).reasons, [Sign::NumbersByDestination]);
}

#[test]
fn what_speaks_for_somebody_else_is_told_too() {
    let mut recogniser = Recogniser::default();
    recogniser.handle_frame(&frame(1, QUERY), 12);
    let verdict = recogniser.verdict();
    assert_eq!(verdict.peer, Implementation::JausPlusPlus);
    let reasons: Vec<_> = verdict
        .reasons
        .iter()
        .map(|sign| sign.explanation())
        .collect();
    assert!(reasons[0].ends_with("as JAUS++ does"), "{reasons:?}");
    assert!(reasons[1].ends_with("as Junior does"), "{reasons:?}");
}

#[test]
fn who_begins_with_1_and_calls_may_be_taken_for_junior_and_no_node_of_ours() {
    let call = |sequence| Frame {
        flags: Flags::default()
            .with_broadcast(Broadcast::Global)
            .with_acknowledgement(Acknowledgement::Request),
        ..frame(sequence, QUERY)
    };
    let long = |sequence| Frame {
        flags: Flags::default().with_data(DataControl::First),
        payload: vec![1; 4079].into(),
        ..frame(sequence, b"")
    };
    let presumed = |frames: &[Frame]| {
        let mut recogniser = Recogniser::default();
        for frame in frames {
            recogniser.handle_frame(frame, 0);
        }
        (recogniser.presumed(), recogniser.certain())
    };
    let likely = (Implementation::Junior, Implementation::Standard);
    assert_eq!(presumed(&[call(1), frame(2, QUERY)]), likely);
    assert_eq!(presumed(&[frame(1, QUERY), long(2)]), likely);
    assert_eq!(presumed(&[call(1), long(2)]).1, Implementation::Junior);
    // A node of ours that sends packets of the maximum length and searches for a peer.
    let ours = [call(31_361), long(31_362), frame(31_363, QUERY)];
    assert_eq!(
        presumed(&ours),
        (Implementation::Standard, Implementation::Standard)
    );
    // JAUS++ and others may begin with 1 too.
    assert_eq!(presumed(&[frame(1, QUERY)]).0, Implementation::Standard);
    let mut recogniser = Recogniser::default();
    recogniser.handle_frame(&call(1), 206);
    recogniser.note(Sign::RepeatedVersion);
    assert_eq!(recogniser.presumed(), Implementation::JausPlusPlus);
}
