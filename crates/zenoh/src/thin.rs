//! Minimum periods: how often a message of one kind goes to a thin link.
//!
//! A message that comes too early is held back, and replaced if a newer one of the same stream
//! comes; the newest is published when the period is over. So the last value always arrives.
//! Messages with an acknowledgement request, acknowledgements and fragments of large messages are
//! never held back.

use std::collections::{BTreeMap, BTreeSet};
use std::str::FromStr;
use std::time::{Duration, Instant};

use jaus::address::JausId;
use jaus::codec::Message as _;
use jaus::messages::core::Event;
use jaus::messages::registry;
use jaus::node::units;
use jaus::wire::{Acknowledgement, DataControl, Frame};

use crate::queue::Publication;

/// The minimum period of a message.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MinPeriod {
    /// The message code.
    pub code: u16,
    /// The period.
    pub period: Duration,
}

/// Why a text is no minimum period.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum MinPeriodError {
    /// It has no equals sign.
    #[error("write a message and a period, such as ReportVelocityState=200ms")]
    Form,
    /// The message is unknown.
    #[error(
        "`{0}` is not a message: write a name as `jaus list messages` shows it, or four \
         hexadecimal digits and an h, such as 4404h"
    )]
    Message(String),
    /// The period is malformed or out of range.
    #[error("write a period above 0 and up to 1h, such as 200ms")]
    Period,
}

impl FromStr for MinPeriod {
    type Err = MinPeriodError;

    fn from_str(text: &str) -> Result<Self, MinPeriodError> {
        let (name, period) = text.split_once('=').ok_or(MinPeriodError::Form)?;
        let code = code_of(name)
            .ok_or_else(|| MinPeriodError::Message(name.chars().take(60).collect()))?;
        let period = units::duration(period).map_err(|_| MinPeriodError::Period)?;
        let is_valid = period > Duration::ZERO && period <= LONGEST;
        is_valid
            .then_some(Self { code, period })
            .ok_or(MinPeriodError::Period)
    }
}

/// The longest period.
const LONGEST: Duration = Duration::from_secs(3600);

fn code_of(name: &str) -> Option<u16> {
    let digits = name.strip_suffix(['h', 'H']).filter(|it| it.len() == 4);
    let code = digits.and_then(|it| u16::from_str_radix(it, 16).ok());
    code.or_else(|| registry().by_name(name).next().map(|it| it.code))
}

/// Messages of one kind from one component to one destination; those of an event by its number.
type StreamId = (JausId, JausId, u16, Option<u8>);

/// The most streams whose periods run at a time.
const MOST_STREAMS: usize = 4096;

/// What to do with a message.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Verdict {
    /// Publish it.
    Publish(Publication),
    /// Publish it, although its period may not be over: the table is full.
    TableFull(Publication),
    /// It is held back.
    Held,
    /// It is held back, and an older one is dropped.
    Replaced,
}

/// Holds back messages that come too early.
#[derive(Debug, Default)]
pub(crate) struct Thinner {
    periods: BTreeMap<u16, Duration>,
    /// The streams whose periods run, with the message that each holds back.
    streams: BTreeMap<StreamId, Option<Publication>>,
    due: BTreeSet<(Instant, StreamId)>,
}

impl Thinner {
    pub(crate) fn new(periods: &[MinPeriod]) -> Self {
        let periods = periods.iter().map(|it| (it.code, it.period)).collect();
        Self {
            periods,
            ..Self::default()
        }
    }

    /// Handles a message to publish.
    pub(crate) fn admit(&mut self, now: Instant, frame: &Frame, sample: Publication) -> Verdict {
        let Some((id, period)) = self.stream_of(frame) else {
            return Verdict::Publish(sample);
        };
        if let Some(held) = self.streams.get_mut(&id) {
            return match held.replace(sample) {
                Some(_) => Verdict::Replaced,
                None => Verdict::Held,
            };
        }
        if self.streams.len() >= MOST_STREAMS {
            return Verdict::TableFull(sample);
        }
        self.begin(id, now + period);
        Verdict::Publish(sample)
    }

    fn begin(&mut self, id: StreamId, due: Instant) {
        self.streams.insert(id, None);
        self.due.insert((due, id));
    }

    /// A message whose period is over.
    pub(crate) fn poll(&mut self, now: Instant) -> Option<Publication> {
        while let Some(&(due, id)) = self.due.first().filter(|(due, _)| *due <= now) {
            self.due.pop_first();
            if let Some(sample) = self.streams.remove(&id).flatten() {
                let period = self.period(id.2).unwrap_or_default();
                // From now on if the last turn is long ago.
                self.begin(id, (due + period).max(now));
                return Some(sample);
            }
        }
        None
    }

    /// When the next period is over.
    pub(crate) fn poll_timeout(&self) -> Option<Instant> {
        self.due.first().map(|&(due, _)| due)
    }

    fn period(&self, code: u16) -> Option<Duration> {
        self.periods.get(&code).copied()
    }

    /// The stream of a message and its period; `None` if it is never held back.
    fn stream_of(&self, frame: &Frame) -> Option<(StreamId, Duration)> {
        let is_plain = frame.flags.data() == DataControl::Single
            && frame.flags.acknowledgement() == Acknowledgement::None;
        if self.periods.is_empty() || !is_plain {
            return None;
        }
        let code = frame.code()?;
        let (code, event) = match code {
            Event::CODE => reported(frame)?,
            _ => (code, None),
        };
        let id = (frame.source, frame.destination, code, event);
        Some((id, self.period(code)?))
    }
}

/// The code of the report in an event, and the event's number.
fn reported(frame: &Frame) -> Option<(u16, Option<u8>)> {
    let event = Event::decode(&frame.payload).ok()?;
    let code = event.report_message.first_chunk()?;
    Some((u16::from_le_bytes(*code), Some(event.event_id)))
}

#[cfg(test)]
#[expect(
    clippy::disallowed_methods,
    reason = "the tests start at an arbitrary instant"
)]
mod tests {
    use bytes::Bytes;
    use jaus::wire::Flags;

    use super::*;

    const PERIOD: Duration = Duration::from_millis(200);
    const REPORT: &[u8] = b"\x04\x44\x00\x00";

    fn thinner() -> Thinner {
        Thinner::new(&["ReportVelocityState=200ms".parse().unwrap()])
    }

    fn frame(payload: impl Into<Bytes>) -> Frame {
        Frame::new(
            JausId::new(101, 1, 43),
            JausId::new(60, 1, 1),
            payload.into(),
        )
    }

    fn sample(number: u8) -> Publication {
        Publication {
            key: String::new(),
            payload: vec![number].into(),
            priority: None,
            waits: false,
        }
    }

    fn event(number: u8) -> Bytes {
        let event = Event {
            event_id: number,
            report_message: Bytes::from_static(REPORT),
            ..Event::default()
        };
        event.encode().unwrap()
    }

    #[test]
    fn within_a_period_the_newest_message_waits_and_is_published_at_its_end() {
        let (start, mut thinner) = (Instant::now(), thinner());
        let report = frame(REPORT);
        let mut admit = |at, number| thinner.admit(start + at, &report, sample(number));
        assert_eq!(admit(Duration::ZERO, 1), Verdict::Publish(sample(1)));
        assert_eq!(admit(PERIOD / 4, 2), Verdict::Held);
        assert_eq!(admit(PERIOD / 2, 3), Verdict::Replaced);
        assert_eq!(thinner.poll_timeout(), Some(start + PERIOD));
        assert_eq!(thinner.poll(start + PERIOD / 2), None);
        assert_eq!(thinner.poll(start + PERIOD), Some(sample(3)));
        assert_eq!(thinner.poll(start + PERIOD), None);
        // The period begins again, and without messages it ends for good.
        assert_eq!(thinner.poll_timeout(), Some(start + 2 * PERIOD));
        assert_eq!(thinner.poll(start + 2 * PERIOD), None);
        assert_eq!(thinner.poll_timeout(), None);
    }

    #[test]
    fn other_messages_and_other_streams_are_not_held_back() {
        let (now, mut thinner) = (Instant::now(), thinner());
        let mut passes = |frame: &Frame| {
            let verdict = thinner.admit(now, frame, sample(1));
            verdict == Verdict::Publish(sample(1))
        };
        assert!(passes(&frame(REPORT)) && !passes(&frame(REPORT)));
        let to_another = Frame {
            destination: JausId::new(61, 1, 1),
            ..frame(REPORT)
        };
        assert!(passes(&to_another));
        let pose = frame(&b"\x02\x44\x00\x00"[..]);
        assert!(passes(&pose) && passes(&pose));
        assert!(passes(&frame(event(1))) && passes(&frame(event(2))));
        assert!(!passes(&frame(event(1))));
    }

    #[test]
    fn what_must_arrive_is_never_held_back() {
        let (now, mut thinner) = (Instant::now(), thinner());
        let plain = Flags::default();
        for flags in [
            plain.with_acknowledgement(Acknowledgement::Request),
            plain.with_data(DataControl::First),
            plain.with_data(DataControl::Last),
        ] {
            let frame = Frame {
                flags,
                ..frame(REPORT)
            };
            for _ in 0..2 {
                let verdict = thinner.admit(now, &frame, sample(1));
                assert_eq!(verdict, Verdict::Publish(sample(1)));
            }
        }
    }

    #[test]
    fn a_full_table_lets_messages_pass() {
        let (now, mut thinner) = (Instant::now(), thinner());
        for number in 0..MOST_STREAMS {
            let destination = JausId::new(1 + number as u16, 1, 1);
            let frame = Frame {
                destination,
                ..frame(REPORT)
            };
            thinner.admit(now, &frame, sample(1));
        }
        let to_another = Frame {
            destination: JausId::new(60_000, 1, 1),
            ..frame(REPORT)
        };
        let verdict = thinner.admit(now, &to_another, sample(1));
        assert_eq!(verdict, Verdict::TableFull(sample(1)));
    }

    #[test]
    fn a_malformed_period_is_refused_with_an_example() {
        for (text, hint) in [
            ("4404h", "200ms"),
            ("Speed=1s", "4404h"),
            ("4404h=0s", "200ms"),
            ("4404h=2h", "1h"),
            ("4404h=x", "200ms"),
        ] {
            let error = text.parse::<MinPeriod>().unwrap_err().to_string();
            assert!(error.contains(hint), "{text}: {error}");
        }
        let period: MinPeriod = "4404h=1s".parse().unwrap();
        assert_eq!((period.code, period.period.as_secs()), (0x4404, 1));
    }
}
