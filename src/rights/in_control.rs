//! Who is in control of which component, as the messages show it, for audit logs.

use std::collections::BTreeMap;

use super::{Decision, Permission, Table, Unaccepted, Verdict, begins};
use crate::address::JausId;
use crate::codec::Message as _;
use crate::messages::core::RejectControl;
use crate::wire::Frame;

/// Clients in control that are remembered. Of further ones each message counts.
const MOST: usize = 1024;

/// The clients that components have told that they are in control. So an audit log tells what changes
/// control from what does not: a client renews its control every second, and a component answers each
/// Release Control with Reject Control, also one of a client that has nothing to release. Neither fills a log
/// with evidence.
#[derive(Debug, Default)]
pub struct InControl {
    /// Components, each with its client; and the authority for which the client has asked last.
    clients: BTreeMap<(JausId, JausId), Option<u8>>,
}

impl InControl {
    /// The decision on a frame from a client, as [`Decision::of`]. One that renews the control of its sender
    /// with the same authority counts as free.
    pub fn decision(
        &mut self,
        frame: &Frame,
        checked: Result<(), Unaccepted>,
        table: &Table,
    ) -> Option<Decision> {
        let decision = Decision::of(frame, checked, table)?;
        let is_renewal = checked.is_ok() && self.is_renewal(frame, table);
        let is_free = decision.is_free || is_renewal;
        Some(Decision {
            is_free,
            ..decision
        })
    }

    /// The decision that a component tells its client by this frame: `None` if it is about something else
    /// than control. It counts as free if nothing changes by it.
    pub fn told(&mut self, frame: &Frame, table: &Table) -> Option<Decision> {
        let verdict = verdict(frame, table)?;
        let pair = (frame.source, frame.destination);
        let is_full = self.clients.len() >= MOST;
        let is_free = match verdict {
            Verdict::Granted if self.clients.contains_key(&pair) => true,
            Verdict::Granted => {
                if !is_full {
                    self.clients.insert(pair, None);
                }
                false
            }
            Verdict::Ended => self.clients.remove(&pair).is_none() && !is_full,
            _ => false,
        };
        let told = Decision::new(frame, table.name_of(&frame.payload), verdict);
        Some(Decision { is_free, ..told })
    }

    fn is_renewal(&mut self, frame: &Frame, table: &Table) -> bool {
        let mut needs = table.needs(&frame.payload);
        let (Some(Permission::Control { authority }), None) = (needs.next(), needs.next()) else {
            return false;
        };
        let pair = (frame.destination, frame.source);
        let asked = self.clients.get_mut(&pair);
        asked.is_some_and(|asked| asked.replace(authority) == Some(authority))
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

    fn told(all: &mut InControl, payload: &'static [u8]) -> Option<(String, Verdict, Weight)> {
        let frame = Frame::new(VEHICLE, OPERATOR, Bytes::from_static(payload));
        let it = all.told(&frame, &Table::default())?;
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
            assert_eq!(told(&mut InControl::default(), payload), expected);
        }
    }

    #[test]
    fn only_the_end_of_control_that_was_granted_is_evidence() {
        let mut all = InControl::default();
        let mut end = || told(&mut all, b"\x10\x00\x00").unwrap().2;
        assert_eq!(end(), Weight::Free, "it had nothing");
        told(&mut all, b"\x0F\x00\x00").unwrap();
        let mut end = || told(&mut all, b"\x10\x00\x00").unwrap().2;
        assert_eq!((end(), end()), (Weight::Evidence, Weight::Free));
    }

    #[test]
    fn renewals_are_no_evidence_and_another_authority_is() {
        let mut all = InControl::default();
        let request = |all: &mut InControl, payload: &'static [u8]| {
            let frame = Frame::new(OPERATOR, VEHICLE, Bytes::from_static(payload));
            let decision = all.decision(&frame, Ok(()), &Table::default());
            decision.unwrap().weight()
        };
        const LOW: &[u8] = b"\x0D\x00\x64";
        const HIGH: &[u8] = b"\x0D\x00\xC8";
        const GRANTED: &[u8] = b"\x0F\x00\x00";
        assert_eq!(request(&mut all, LOW), Weight::Evidence);
        assert_eq!(request(&mut all, LOW), Weight::Evidence, "not granted yet");
        assert_eq!(told(&mut all, GRANTED).unwrap().2, Weight::Evidence);
        request(&mut all, LOW);
        for _ in 0..9 {
            assert_eq!(request(&mut all, LOW), Weight::Free);
            assert_eq!(told(&mut all, GRANTED).unwrap().2, Weight::Free);
        }
        assert_eq!(request(&mut all, HIGH), Weight::Evidence);
        assert_eq!(request(&mut all, HIGH), Weight::Free);
        told(&mut all, b"\x10\x00\x00").unwrap();
        assert_eq!(request(&mut all, HIGH), Weight::Evidence);
    }

    #[test]
    fn where_too_many_are_in_control_each_end_counts() {
        let mut all = InControl::default();
        for subsystem in 1..=2 * MOST as u16 {
            let client = JausId::new(subsystem, 1, 1);
            let frame = Frame::new(VEHICLE, client, Bytes::from_static(b"\x0F\x00\x00"));
            all.told(&frame, &Table::default()).unwrap();
        }
        let client = JausId::new(2000, 1, 1);
        let frame = Frame::new(VEHICLE, client, Bytes::from_static(b"\x10\x00\x00"));
        let end = all.told(&frame, &Table::default()).unwrap();
        assert_eq!(end.weight(), Weight::Evidence);
    }
}
