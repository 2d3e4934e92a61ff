//! Tests the peer's reaction to a reserved message type. This reveals Junior even if it sends
//! nothing by itself.
//!
//! A compliant peer drops every type except 0. Junior takes the two lowest bits of that octet for
//! the header compression flags and ignores the others: it acknowledges type 4, and loses type 1.
//! Of its forks, that of the JAUS Tool Set takes a 0 in an id for "all". Observed on all three
//! forks; JAUS++ and our own nodes drop both. The messages sent here have no effect.

use std::time::Duration;

use jaus::address::JausId;
use jaus::wire::{Flags, Frame, Kind, Priority};

use super::case::{Case, Question, Send};
use super::exchange::{Exchange, Verdict};
use super::judgement::{Begin, Judgement};

/// A type whose bits Junior ignores.
const PASSED_OVER: Kind = Kind(4);
/// A type that Junior takes for header compression.
const TAKEN_FOR_COMPRESSION: Kind = Kind(1);
/// Priority of messages to an id with a 0: acknowledgements repeat the priority of their request.
const TO_ZERO: Priority = Priority::SafetyCritical;
/// Timeout of acknowledgements.
const PATIENCE: Duration = Duration::from_millis(700);

pub(super) fn begin(case: &mut Case) -> Begin {
    if let Some(skip) = case.nobody() {
        return Begin::Over(skip);
    }
    if !case.went_well(Exchange::Acknowledgement) {
        return Begin::Over(Verdict::skipped("it acknowledges nothing"));
    }
    match (case.id, case.address) {
        (Some(id), Some(address)) => {
            let frame = case.wanting_acknowledgement(id);
            let typed = Frame {
                kind: PASSED_OVER,
                ..frame
            };
            Begin::Ask(question(vec![Send::To(address, typed)]))
        }
        _ => Begin::Over(Verdict::skipped("no component id is known at that address")),
    }
}

fn question(sends: Vec<Send>) -> Question {
    Question {
        sends,
        again: Some(PATIENCE / 3),
        patience: PATIENCE,
    }
}

/// After an acknowledgement of type 4: tests type 1, and an id with a 0.
pub(super) fn acknowledged(case: &mut Case, mark: usize, stage: u8) -> Judgement {
    let (Some(id), Some(address)) = (case.id, case.address) else {
        return Judgement::Wait;
    };
    if stage > 0 || answers(case, mark).next().is_none() {
        return Judgement::Wait;
    }
    let typed = Frame {
        kind: TAKEN_FOR_COMPRESSION,
        ..case.wanting_acknowledgement(id)
    };
    case.reserved.second = typed.sequence;
    let zero = JausId::new(id.subsystem(), 0, id.component());
    let to_zero = case.wanting_acknowledgement(zero);
    let flags = Flags::new(TO_ZERO).with_acknowledgement(to_zero.flags.acknowledgement());
    let to_zero = Frame { flags, ..to_zero };
    Judgement::Ask(question(vec![
        Send::To(address, typed),
        Send::To(address, to_zero),
    ]))
}

/// Number and priority of each acknowledgement since a mark.
fn answers(case: &Case, mark: usize) -> impl Iterator<Item = (u16, Priority)> {
    let received = case.received(mark).map(|heard| &heard.frame);
    let answers = received.filter(|frame| frame.flags.acknowledgement().is_answer());
    answers.map(|frame| (frame.sequence, frame.flags.priority()))
}

/// The verdict after the timeout.
pub(super) fn over(case: &mut Case, mark: usize, stage: u8) -> Verdict {
    if stage == 0 {
        return Verdict::ok("a message of a reserved type is dropped");
    }
    let second = case.reserved.second;
    let (to_zero, typed): (Vec<_>, Vec<_>) = answers(case, mark)
        .filter(|(number, _)| number.wrapping_sub(second) < u16::MAX / 2)
        .partition(|(_, priority)| *priority == TO_ZERO);
    if !typed.is_empty() {
        return Verdict::ok("messages of reserved types are acknowledged");
    }
    case.reserved.misreads_type = true;
    case.reserved.answers_for_zero = !to_zero.is_empty();
    Verdict::ok("a message of the reserved type 4 is acknowledged, but one of type 1 is lost")
}
