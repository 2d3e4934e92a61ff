//! What components tell their clients about control.

use std::collections::BTreeSet;

use super::{Decision, Permission, Table, Verdict, begins};
use crate::address::JausId;
use crate::codec::Message as _;
use crate::messages::core::RejectControl;
use crate::wire::Frame;

/// Clients in control that are remembered. Of further ones each end counts.
const MOST_IN_CONTROL: usize = 1024;

/// What components have told their clients about control, for an audit log.
///
/// A component answers each Release Control with Reject Control, also one of a client that has nothing to
/// release. Only the end of control that was granted is evidence, so that nobody fills a log with the others.
#[derive(Debug, Default)]
pub struct Told {
    /// Components, each with its client.
    in_control: BTreeSet<(JausId, JausId)>,
}

impl Told {
    /// The decision that a component tells its client by this frame: `None` if it is about something else
    /// than control.
    pub fn decision(&mut self, frame: &Frame, table: &Table) -> Option<Decision> {
        let verdict = verdict(frame, table)?;
        let pair = (frame.source, frame.destination);
        let mut is_free = false;
        match verdict {
            Verdict::Granted if self.in_control.len() < MOST_IN_CONTROL => {
                self.in_control.insert(pair);
            }
            Verdict::Ended => {
                is_free =
                    self.in_control.len() < MOST_IN_CONTROL && !self.in_control.contains(&pair);
                self.in_control.remove(&pair);
            }
            _ => {}
        }
        let told = Decision::new(frame, table.name_of(&frame.payload), verdict);
        Some(Decision { is_free, ..told })
    }
}

fn verdict(frame: &Frame, table: &Table) -> Option<Verdict> {
    if !begins(frame) {
        return None;
    }
    let answer = table.needs(&frame.payload).find_map(|it| match it {
        Permission::Answer { is_granted } => Some(is_granted),
        _ => None,
    });
    match answer {
        Some(true) => Some(Verdict::Granted),
        Some(false) => Some(Verdict::Denied),
        None => (frame.code() == Some(RejectControl::CODE)).then_some(Verdict::Ended),
    }
}

#[cfg(test)]
mod tests {
    use bytes::Bytes;

    use super::*;
    use crate::rights::Weight;

    const VEHICLE: JausId = JausId::new(101, 1, 1);
    const OPERATOR: JausId = JausId::new(60, 1, 1);

    fn told(told: &mut Told, payload: &'static [u8]) -> Option<(String, Verdict, Weight)> {
        let frame = Frame::new(VEHICLE, OPERATOR, Bytes::from_static(payload));
        let it = told.decision(&frame, &Table::default())?;
        let weight = it.weight();
        Some((it.what, it.verdict, weight))
    }

    #[test]
    fn what_a_component_tells_about_control_is_told_apart() {
        let (done, nothing) = (Weight::Evidence, Weight::Refusal);
        for (payload, expected) in [
            (
                &b"\x0F\x00\x00"[..],
                Some(("ConfirmControl", Verdict::Granted, done)),
            ),
            (
                b"\x0F\x00\x02",
                Some(("ConfirmControl", Verdict::Denied, nothing)),
            ),
            (
                b"\x35\xFF\x01\x00",
                Some(("ConfirmHandoffRequest", Verdict::Granted, done)),
            ),
            (b"\x0E\x00", None),
            (b"\x39\xFF\x00", None),
        ] {
            let expected =
                expected.map(|(what, verdict, weight)| (what.to_owned(), verdict, weight));
            assert_eq!(told(&mut Told::default(), payload), expected);
        }
    }

    #[test]
    fn only_the_end_of_control_that_was_granted_is_evidence() {
        let mut all = Told::default();
        let mut end = || told(&mut all, b"\x10\x00\x00").unwrap().2;
        assert_eq!(end(), Weight::Free, "it had nothing");
        told(&mut all, b"\x0F\x00\x00").unwrap();
        let mut end = || told(&mut all, b"\x10\x00\x00").unwrap().2;
        assert_eq!((end(), end()), (Weight::Evidence, Weight::Free));
    }

    #[test]
    fn where_too_many_are_in_control_each_end_counts() {
        let mut all = Told::default();
        for subsystem in 1..=2 * MOST_IN_CONTROL as u16 {
            let client = JausId::new(subsystem, 1, 1);
            let frame = Frame::new(VEHICLE, client, Bytes::from_static(b"\x0F\x00\x00"));
            all.decision(&frame, &Table::default()).unwrap();
        }
        let client = JausId::new(2000, 1, 1);
        let frame = Frame::new(VEHICLE, client, Bytes::from_static(b"\x10\x00\x00"));
        let end = all.decision(&frame, &Table::default()).unwrap();
        assert_eq!(end.weight(), Weight::Evidence);
    }
}
