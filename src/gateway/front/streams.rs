//! The service connections by which an RA component keeps us told of what somebody subscribes to.
//!
//! One connection for each report, at the greatest rate that anybody wants. A component that does
//! not confirm one, or refuses it, is asked with queries instead.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use bytes::{BufMut, Bytes, BytesMut};

use super::super::pairs;

/// Create Service Connection.
const CREATE: u16 = 0x0008;
/// Terminate Service Connection.
const TERMINATE: u16 = 0x000C;
/// What a rate's 16 bits are scaled to, in hertz.
pub(in crate::gateway) const MOST_HZ: f64 = 1092.0;

/// The connections with one RA component, by the code of their reports.
#[derive(Debug, Default)]
pub(super) struct Streams {
    all: BTreeMap<u16, Stream>,
    said: Vec<(u16, Bytes)>,
}

#[derive(Debug)]
struct Stream {
    state: pairs::State,
    hz: f64,
    course: Course,
    /// When to do something next.
    next: Instant,
    heard: Instant,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Course {
    Asking {
        tries: u32,
    },
    Up {
        instance: u8,
    },
    /// There is no connection: queries do.
    Polling {
        left: u32,
    },
}

impl Streams {
    const RETRY: Duration = Duration::from_millis(500);
    const TRIES: u32 = 3;
    /// The most queries in a second that stand in for a connection.
    const MOST_QUERIES: f64 = 10.0;
    /// After so many queries a connection is tried again.
    const POLLS: u32 = 100;
    /// A connection is down when so many periods have brought nothing, and not sooner than
    const SILENT_PERIODS: f64 = 4.0;
    /// this after its last report.
    const LEAST_SILENCE: Duration = Duration::from_secs(2);

    /// What is wanted now: the rates, by the code of the report.
    pub(super) fn want(&mut self, now: Instant, wanted: &BTreeMap<u16, f64>) {
        let gone = |code: &u16| !wanted.contains_key(code);
        let ended: Vec<u16> = self.all.keys().copied().filter(gone).collect();
        for report in ended {
            self.end(report);
        }
        for (&report, &hz) in wanted {
            match self.all.get_mut(&report) {
                Some(stream) if (stream.hz - hz).abs() <= 0.01 * stream.hz => {}
                Some(stream) => {
                    stream.hz = hz;
                    stream.course = Course::Asking { tries: 0 };
                    self.ask(now, report);
                }
                None => self.begin(now, report, hz),
            }
        }
    }

    fn begin(&mut self, now: Instant, report: u16, hz: f64) {
        let Some(state) = pairs::state(report) else {
            return;
        };
        let stream = Stream {
            state,
            hz,
            course: Course::Asking { tries: 0 },
            next: now,
            heard: now,
        };
        self.all.insert(report, stream);
        self.ask(now, report);
    }

    fn end(&mut self, report: u16) {
        let Some(stream) = self.all.remove(&report) else {
            return;
        };
        let instance = match stream.course {
            Course::Up { instance } => instance,
            Course::Asking { .. } => 0,
            Course::Polling { .. } => return,
        };
        let mut body = BytesMut::new();
        body.put_u16_le(report);
        body.put_u8(instance);
        self.said.push((TERMINATE, body.freeze()));
    }

    fn ask(&mut self, now: Instant, report: u16) {
        let Some(stream) = self.all.get_mut(&report) else {
            return;
        };
        let Course::Asking { tries } = &mut stream.course else {
            return;
        };
        *tries += 1;
        stream.next = now + Self::RETRY;
        let mut body = BytesMut::new();
        body.put_u16_le(report);
        body.put_u16_le(rate(stream.hz));
        body.put_u32_le(stream.state.all());
        self.said.push((CREATE, body.freeze()));
    }

    /// The RA component has confirmed a connection, or refused it.
    pub(super) fn handle_confirm(&mut self, now: Instant, body: &[u8]) {
        let [low, high, instance, _, _, response, ..] = *body else {
            return;
        };
        let Some(stream) = self.all.get_mut(&u16::from_le_bytes([low, high])) else {
            return;
        };
        stream.heard = now;
        if response == 0 {
            stream.course = Course::Up { instance };
            stream.next = now + stream.silence();
        } else {
            stream.course = Course::Polling { left: Self::POLLS };
            stream.next = now;
        }
    }

    /// A report has come.
    pub(super) fn handle_report(&mut self, now: Instant, report: u16) {
        if let Some(stream) = self.all.get_mut(&report) {
            stream.heard = now;
        }
    }

    /// How old a report may be while its connection stands; `None` without one.
    pub(super) fn freshness(&self, report: u16) -> Option<Duration> {
        let stream = self.all.get(&report)?;
        let stands = matches!(stream.course, Course::Up { .. });
        stands.then(|| Duration::from_secs_f64(2.0 / stream.hz))
    }

    pub(super) fn handle_timeout(&mut self, now: Instant) {
        let due = |it: &(&u16, &Stream)| it.1.next <= now;
        let due: Vec<u16> = self.all.iter().filter(due).map(|(&it, _)| it).collect();
        for report in due {
            self.go_on(now, report);
        }
    }

    fn go_on(&mut self, now: Instant, report: u16) {
        let Some(stream) = self.all.get_mut(&report) else {
            return;
        };
        let silent = stream.heard + stream.silence();
        match &mut stream.course {
            Course::Asking { tries } if *tries >= Self::TRIES => {
                stream.course = Course::Polling { left: Self::POLLS };
            }
            Course::Asking { .. } => self.ask(now, report),
            Course::Up { .. } if now < silent => stream.next = silent,
            Course::Up { .. } | Course::Polling { left: 0 } => {
                stream.course = Course::Asking { tries: 0 };
                self.ask(now, report);
            }
            Course::Polling { left } => {
                *left -= 1;
                let hz = stream.hz.min(Self::MOST_QUERIES);
                stream.next = now + Duration::from_secs_f64(1.0 / hz);
                let query = (stream.state.query(), stream.state.query_for_all());
                self.said.push(query);
            }
        }
    }

    pub(super) fn poll_timeout(&self) -> Option<Instant> {
        self.all.values().map(|stream| stream.next).min()
    }

    /// What is to be told to the RA component since this was asked last.
    pub(super) fn take_said(&mut self) -> Vec<(u16, Bytes)> {
        std::mem::take(&mut self.said)
    }
}

impl Stream {
    fn silence(&self) -> Duration {
        let periods = Duration::from_secs_f64(Streams::SILENT_PERIODS / self.hz);
        periods.max(Streams::LEAST_SILENCE)
    }
}

/// A rate as service connections say it.
pub(in crate::gateway) fn rate(hz: f64) -> u16 {
    let scaled = hz / MOST_HZ * f64::from(u16::MAX);
    // At least the smallest step; the cast saturates.
    scaled.round().max(1.0) as u16
}
