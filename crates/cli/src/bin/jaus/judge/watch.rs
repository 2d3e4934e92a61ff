//! Observes event streams: their rate, order and silence.

use std::time::Duration;

use bytes::Bytes;
use jaus::codec::Message;
use jaus::messages::core::Event;
use tokio::time::Instant;

use super::step::{Check, Stream, Watch, code_of};

/// Tolerance of a stream's mean interval, relative to its period.
const MEAN_SLACK: f64 = 0.1;
/// Tolerance of a single interval: one message may be delayed by many causes.
const INTERVAL_SLACK: f64 = 0.5;

/// Event streams under observation.
pub(super) struct Observation {
    streams: Vec<Observed>,
    purpose: Purpose,
}

enum Purpose {
    /// A number of events of each stream must arrive at this rate.
    Running { period: Duration, events: usize },
    /// No event may arrive for this time.
    Silent { lasting: Duration },
}

struct Observed {
    stream: Stream,
    arrivals: Vec<Arrival>,
}

struct Arrival {
    at: Instant,
    sequence: u8,
    /// The code of the report in its events.
    report: Option<u16>,
}

impl Observation {
    pub(super) fn watch(watch: &Watch, streams: Vec<Stream>) -> Self {
        let (period, events) = (watch.period, watch.events);
        Self::of(streams, Purpose::Running { period, events })
    }

    pub(super) fn silence(streams: Vec<Stream>, lasting: Duration) -> Self {
        Self::of(streams, Purpose::Silent { lasting })
    }

    fn of(streams: Vec<Stream>, purpose: Purpose) -> Self {
        let observed = |stream| Observed {
            stream,
            arrivals: Vec::new(),
        };
        Self {
            streams: streams.into_iter().map(observed).collect(),
            purpose,
        }
    }

    /// Maximum duration of the observation.
    pub(super) fn at_most(&self, limit: Duration) -> Duration {
        match self.purpose {
            Purpose::Running { period, events } => period * (events as u32) + limit,
            Purpose::Silent { lasting } => lasting,
        }
    }

    /// Records an event of one of the streams. Events are identified by their report too, because
    /// some peers give one id to several streams.
    pub(super) fn note(&mut self, at: Instant, octets: &Bytes) {
        let Ok(event) = Event::decode(octets) else {
            return;
        };
        let report = code_of(&event.report_message);
        let of_id = |one: &&mut Observed| one.stream.id == event.event_id;
        let ids = self
            .streams
            .iter()
            .filter(|one| one.stream.id == event.event_id);
        let is_ambiguous = ids.count() > 1;
        let right = |one: &&mut Observed| {
            of_id(one) && (!is_ambiguous || report == Some(one.stream.report))
        };
        if let Some(observed) = self.streams.iter_mut().find(right) {
            observed.arrivals.push(Arrival {
                at,
                sequence: event.sequence_number,
                report,
            });
        }
    }

    /// Whether the observation is complete.
    pub(super) fn is_complete(&self) -> bool {
        match self.purpose {
            // The first event may arrive at once, and is no evidence of the rate.
            Purpose::Running { events, .. } => {
                self.streams.iter().all(|one| one.arrivals.len() > events)
            }
            Purpose::Silent { .. } => false,
        }
    }

    /// The requirement, as text.
    pub(super) fn in_words(&self) -> String {
        match self.purpose {
            Purpose::Running { period, .. } => format!(
                "Event (41F1h) every {} s, numbered consecutively",
                period.as_secs_f64()
            ),
            Purpose::Silent { lasting } => {
                format!("no Event (41F1h) for {} s", lasting.as_secs_f64())
            }
        }
    }

    /// The measurement, in numbers.
    pub(super) fn measured(&self) -> String {
        let streams = self.streams.iter().map(|one| {
            let (id, events) = (one.stream.id, one.arrivals.len());
            let (Some(mean), Some(worst)) = (one.mean(), one.jitter()) else {
                return format!("event {id}: {events} reports");
            };
            let worst = worst.as_secs_f64() * 1e3;
            format!("event {id}: {events} reports, {mean:.3} s apart, at most {worst:.1} ms off")
        });
        streams.collect::<Vec<_>>().join("; ")
    }

    pub(super) fn check(&self) -> Check {
        self.streams.iter().try_for_each(|one| match self.purpose {
            Purpose::Running { period, events } => one.runs(period, events),
            Purpose::Silent { .. } => one.is_silent(),
        })
    }
}

impl Observed {
    fn runs(&self, period: Duration, events: usize) -> Check {
        let id = self.stream.id;
        if self.arrivals.len() < events {
            let came = self.arrivals.len();
            return Err(format!(
                "only {came} reports of event {id} arrived, not {events}"
            ));
        }
        let wrong = |one: &&Arrival| one.report != Some(self.stream.report);
        if let Some(wrong) = self.arrivals.iter().find(wrong) {
            let (report, code) = (self.stream.report, wrong.report.unwrap_or_default());
            return Err(format!("event {id} carries {code:04X}h, not {report:04X}h"));
        }
        for pair in self.arrivals.windows(2) {
            let (one, next) = (pair[0].sequence, pair[1].sequence);
            if next != one.wrapping_add(1) {
                return Err(format!(
                    "event {id} number {one} was followed by number {next}"
                ));
            }
        }
        let period = period.as_secs_f64();
        let near = |interval: f64, slack: f64| (interval - period).abs() <= slack * period;
        let mean = self.mean().unwrap_or(period);
        let worst = self
            .intervals()
            .find(|&interval| !near(interval, INTERVAL_SLACK));
        match worst {
            Some(interval) => Err(format!(
                "event {id} arrived {interval:.3} s after the previous one, not after {period} s"
            )),
            None if !near(mean, MEAN_SLACK) => Err(format!(
                "event {id} arrives every {mean:.3} s, not every {period} s"
            )),
            None => Ok(()),
        }
    }

    fn is_silent(&self) -> Check {
        let (id, came) = (self.stream.id, self.arrivals.len());
        if came == 0 {
            return Ok(());
        }
        Err(format!(
            "{came} reports of event {id} arrived after it was cancelled"
        ))
    }

    /// Intervals in seconds, without the first, which may be of any length.
    fn intervals(&self) -> impl Iterator<Item = f64> + '_ {
        let rest = self.arrivals.get(1..).unwrap_or_default();
        rest.windows(2)
            .map(|pair| (pair[1].at - pair[0].at).as_secs_f64())
    }

    fn mean(&self) -> Option<f64> {
        let count = self.intervals().count();
        (count > 0).then(|| self.intervals().sum::<f64>() / count as f64)
    }

    /// Deviation of the worst interval from the mean.
    fn jitter(&self) -> Option<Duration> {
        let mean = self.mean()?;
        let off = self.intervals().map(|interval| (interval - mean).abs());
        off.reduce(f64::max).map(Duration::from_secs_f64)
    }
}

#[cfg(test)]
#[expect(clippy::disallowed_methods, reason = "tests")]
mod tests {
    use super::*;

    const SECOND: Duration = Duration::from_secs(1);
    const STREAM: Stream = Stream {
        id: 9,
        report: 0x4202,
    };

    fn event(sequence_number: u8, report: u16) -> Bytes {
        let event = Event {
            event_id: 9,
            sequence_number,
            report_message: Bytes::copy_from_slice(&report.to_le_bytes()),
        };
        event.encode().unwrap()
    }

    fn watch(events: &[(f64, u8, u16)]) -> Observation {
        let purpose = Purpose::Running {
            period: SECOND,
            events: 3,
        };
        let mut observation = Observation::of(vec![STREAM], purpose);
        let start = Instant::now();
        for &(seconds, sequence, report) in events {
            let at = start + Duration::from_secs_f64(seconds);
            observation.note(at, &event(sequence, report));
        }
        observation
    }

    #[test]
    fn a_stream_at_its_rate_is_right_whenever_its_first_event_comes() {
        for first in [0.9, 0.2] {
            let events = [(first, 254), (1.0, 255), (2.01, 0), (2.99, 1)];
            let events = events.map(|(at, sequence)| (at, sequence, 0x4202));
            let observation = watch(&events);
            assert!(observation.is_complete());
            assert_eq!(observation.check(), Ok(()));
        }
    }

    #[test]
    fn what_is_wrong_with_a_stream_is_told() {
        let few = [(0.0, 1, 0x4202), (1.0, 2, 0x4202)];
        let other = [(0.0, 1, 0x4202), (1.0, 2, 0x4002), (2.0, 3, 0x4202)];
        let unnumbered = [(0.0, 1, 0x4202), (1.0, 1, 0x4202), (2.0, 1, 0x4202)];
        let slow = [(0.0, 1, 0x4202), (1.0, 2, 0x4202), (3.0, 3, 0x4202)];
        let fast = [
            (0.0, 1, 0x4202),
            (1.0, 2, 0x4202),
            (1.8, 3, 0x4202),
            (2.6, 4, 0x4202),
        ];
        for (events, reason) in [
            (&few[..], "only 2 reports of event 9 arrived, not 3"),
            (&other, "event 9 carries 4002h, not 4202h"),
            (&unnumbered, "event 9 number 1 was followed by number 1"),
            (
                &slow,
                "event 9 arrived 2.000 s after the previous one, not after 1 s",
            ),
            (&fast, "event 9 arrives every 0.800 s, not every 1 s"),
        ] {
            assert_eq!(watch(events).check(), Err(reason.to_owned()));
        }
    }

    #[test]
    fn an_event_after_the_end_is_told() {
        let mut observation = Observation::silence(vec![STREAM], SECOND);
        assert_eq!(observation.check(), Ok(()));
        observation.note(Instant::now(), &event(1, 0x4202));
        let reason = "1 reports of event 9 arrived after it was cancelled";
        assert_eq!(observation.check(), Err(reason.to_owned()));
    }
}
