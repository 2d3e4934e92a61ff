//! RA reports that describe a component's state: the proxy caches them for several clients, and
//! cuts a full report down to the fields that a client requested.

use bytes::{BufMut, Bytes, BytesMut};

/// A report code is higher than its query code by this much, on both sides.
const STEP: u16 = 0x2000;

/// The code of the report for a query code; `None` if the code is no query.
pub(super) const fn report_of(query: u16) -> Option<u16> {
    match query {
        0x2000..=0x3FFF => Some(query + STEP),
        _ => None,
    }
}

/// The code of the query for a report code; `None` if the code is no report.
pub(super) const fn query_of(report: u16) -> Option<u16> {
    match report {
        0x4000..=0x5FFF => Some(report - STEP),
        _ => None,
    }
}

/// A report of a state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct State {
    /// The code of the report.
    pub(super) report: u16,
    /// Octets of the presence vector, in query and report; 0 where there is none.
    presence: usize,
    /// The fields to query: those that peers send by default.
    all: u32,
    /// Octets of the optional fields, bit 0 first.
    fields: &'static [usize],
}

/// Pose: three coordinates and their deviation, three angles and theirs, time.
const POSE: &[usize] = &[4, 4, 4, 4, 2, 2, 2, 2, 4];
/// Global vector: speed, altitude, heading, roll, pitch.
const VECTOR: &[usize] = &[2, 4, 2, 2, 2];
/// Efforts: six propulsive ones, six resistive ones.
const EFFORT: &[usize] = &[2, 2, 2, 2, 2, 2, 1, 1, 1, 1, 1, 1];

#[rustfmt::skip]
const STATES: &[State] = &[
    State { report: 0x4001, presence: 0, all: 0, fields: &[] },
    State { report: 0x4002, presence: 0, all: 0, fields: &[] },
    State { report: 0x4402, presence: 2, all: 0xFF, fields: POSE },
    State { report: 0x4403, presence: 2, all: 0xFF, fields: POSE },
    State { report: 0x4404, presence: 2, all: 0xFF, fields: POSE },
    State { report: 0x4405, presence: 2, all: 0xFFF, fields: EFFORT },
    State { report: 0x4407, presence: 1, all: 0xFF, fields: VECTOR },
    State { report: 0x4408, presence: 0, all: 0, fields: &[] },
    State { report: 0x440A, presence: 0, all: 0, fields: &[] },
];

/// The state behind a report code, if there is one.
pub(super) fn state(report: u16) -> Option<State> {
    STATES.iter().find(|it| it.report == report).copied()
}

impl State {
    /// The code of its query.
    pub(super) const fn query(self) -> u16 {
        self.report - STEP
    }

    /// The body of a query for all fields.
    pub(super) fn query_for_all(self) -> Bytes {
        self.query_for(self.all)
    }

    /// The body of a query for these fields.
    pub(super) fn query_for(self, presence: u32) -> Bytes {
        Bytes::copy_from_slice(&presence.to_le_bytes()[..self.presence])
    }

    /// The presence vector of all fields.
    pub(super) const fn all(self) -> u32 {
        self.all
    }

    /// The fields that a query body requests; `None` if it is too short.
    pub(super) fn wanted(self, query: &[u8]) -> Option<u32> {
        let octets = query.get(..self.presence)?;
        let mut presence = [0; 4];
        presence[..self.presence].copy_from_slice(octets);
        Some(u32::from_le_bytes(presence))
    }

    /// Cuts a report down to the `wanted` fields. A report whose size contradicts its presence
    /// vector is returned unchanged; decoding refuses it later.
    pub(super) fn narrow(self, report: &Bytes, wanted: u32) -> Bytes {
        let Some(present) = self.wanted(report).filter(|_| !self.fields.is_empty()) else {
            return report.clone();
        };
        let mut narrowed = BytesMut::with_capacity(report.len());
        narrowed.put_slice(&(present & wanted).to_le_bytes()[..self.presence]);
        let mut at = self.presence;
        for (bit, &size) in self.fields.iter().enumerate() {
            if present & 1 << bit == 0 {
                continue;
            }
            let Some(field) = report.get(at..at + size) else {
                return report.clone();
            };
            if wanted & 1 << bit != 0 {
                narrowed.put_slice(field);
            }
            at += size;
        }
        narrowed.freeze()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::convert::{Context, to_jaus_with, to_ra_with};
    use crate::ids::RaComponent;

    fn bytes(hex: &str) -> Bytes {
        let octet = |at: usize| u8::from_str_radix(&hex[at..at + 2], 16).unwrap();
        (0..hex.len()).step_by(2).map(octet).collect()
    }

    #[test]
    fn a_report_is_cut_down_to_the_fields_that_are_wanted() {
        // A global pose of a running OpenJAUS 3.3.1.
        let whole = bytes("ff00eb0eed3425c8ccc63a8ee3b8295c8f020000000000401304");
        let pose = state(0x4402).unwrap();
        assert_eq!(pose.narrow(&whole, 0xFF), whole);
        assert_eq!(pose.narrow(&whole, 3), bytes("0300eb0eed3425c8ccc6"));
        assert_eq!(pose.narrow(&whole, 1 << 6), bytes("40000040"));
        assert_eq!(pose.narrow(&whole, 0x100), bytes("0000"));
    }

    #[test]
    fn a_report_that_is_too_short_is_left_for_who_reads_it() {
        let pose = state(0x4402).unwrap();
        for short in ["", "ff", "ff00eb0e"] {
            assert_eq!(pose.narrow(&bytes(short), 1), bytes(short));
        }
    }

    #[test]
    fn a_query_has_as_many_octets_as_its_presence_vector() {
        assert_eq!(state(0x4402).unwrap().query_for_all(), bytes("ff00"));
        assert_eq!(state(0x4002).unwrap().query_for_all(), bytes(""));
        assert_eq!(state(0x4407).unwrap().wanted(&[7]), Some(7));
        assert_eq!(state(0x4405).unwrap().wanted(&[7]), None);
    }

    #[test]
    fn every_query_and_every_cut_has_the_octets_that_its_definition_has() {
        for state in STATES {
            let context = Context {
                part: Some(RaComponent::LOCAL_PATH_SEGMENT_DRIVER),
                ..Context::default()
            };
            let query = state.query_for_all();
            let ours = to_jaus_with(context, state.query(), &query).unwrap();
            let (_, again) = to_ra_with(context, &ours).unwrap();
            assert_eq!(again.len(), query.len(), "{:04X}h", state.query());

            if state.fields.is_empty() {
                continue;
            }
            let fields: u32 = (1 << state.fields.len()) - 1;
            let mut whole = state.query_for(fields).to_vec();
            whole.resize(state.presence + state.fields.iter().sum::<usize>(), 0);
            let ours = to_jaus_with(context, state.report, &whole);
            assert!(ours.is_ok(), "{:04X}h: {ours:?}", state.report);
            let whole = Bytes::from(whole);
            assert_eq!(state.narrow(&whole, fields), whole);
        }
    }

    #[test]
    fn reports_answer_queries() {
        assert_eq!(report_of(0x2402), Some(0x4402));
        assert_eq!(query_of(0x4402), Some(0x2402));
        assert_eq!((report_of(0x0405), query_of(0x2402)), (None, None));
    }
}
