//! What the peer does with a message type that the standard reserves. That gives Junior away where
//! it says nothing by itself.
//!
//! Who keeps to the standard drops what is not of type 0. Junior takes the two lowest bits of that
//! octet for those of header compression and passes the others over: it acknowledges type 4, and
//! loses type 1. Of its forks, that of the JAUS Tool Set takes a 0 in an id for "all". Seen of all
//! three forks; JAUS++ and our own nodes drop both. Nobody acts on what is sent here.

use std::time::Duration;

use jaus::address::JausId;
use jaus::wire::{Flags, Frame, Kind, Priority};

use super::case::{Case, Question, Send};
use super::exchange::{Exchange, Verdict};
use super::judgement::{Begin, Judgement};

/// A type of which Junior passes all bits over.
const PASSED_OVER: Kind = Kind(4);
/// A type that Junior takes for header compression.
const TAKEN_FOR_COMPRESSION: Kind = Kind(1);
/// The priority of what goes to an id with a 0: acknowledgements have that of their request.
const TO_ZERO: Priority = Priority::SafetyCritical;
/// How long to wait for acknowledgements.
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
        _ => Begin::Over(Verdict::skipped("no id is known there")),
    }
}

fn question(sends: Vec<Send>) -> Question {
    Question {
        sends,
        again: Some(PATIENCE / 3),
        patience: PATIENCE,
    }
}

/// Type 4 is acknowledged: is type 1, and what is for an id with a 0?
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

/// The number and the priority of each acknowledgement behind a mark.
fn answers(case: &Case, mark: usize) -> impl Iterator<Item = (u16, Priority)> {
    let told = case.told(mark).map(|heard| &heard.frame);
    let answers = told.filter(|frame| frame.flags.acknowledgement().is_answer());
    answers.map(|frame| (frame.sequence, frame.flags.priority()))
}

/// No more acknowledgements come.
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
    Verdict::ok("a message of the reserved type 4 is acknowledged, and one of type 1 is lost")
}
