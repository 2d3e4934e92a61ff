//! Transfers places to an RA driver one by one: each is set, and then queried until it is reported.
//! This keeps the order and repeats lost places; a driver that does not answer the queries gets the
//! places at a fixed pace.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use bytes::Bytes;

/// Transfer of places to an RA driver.
#[derive(Debug, Default)]
pub(super) struct Handover {
    /// Places still to be sent, by number.
    waiting: VecDeque<(u16, Bytes)>,
    current: Option<Step>,
    /// Whether the driver answers queries. Unknown before the first one.
    answers: Option<bool>,
    /// Whether it keeps the first place of a number, and reports only that.
    keeps: bool,
    news: Option<Do>,
}

#[derive(Debug)]
struct Step {
    number: u16,
    data: Bytes,
    /// Number of queries.
    asked: u32,
    /// Number of times the place was set.
    sets: u32,
    /// Whether another place was reported under its number.
    differs: bool,
    next: Instant,
    until: Instant,
}

/// Actions of a transfer.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Do {
    /// Set this place.
    Set(Bytes),
    /// Query the place with this number.
    Ask(u16),
    /// The driver does not answer queries; the remaining places follow without.
    Mute,
    /// The driver keeps its earlier place under this number.
    Keeps(u16),
    /// The driver no longer answers: the remaining places are not sent.
    GiveUp(u16),
}

impl Handover {
    /// Interval of queries.
    const AGAIN: Duration = Duration::from_millis(250);
    /// How often a place is set while another one is reported under its number.
    const MOST_SETS: u32 = 3;
    /// Interval of places for a driver that does not answer queries.
    const PACE: Duration = Duration::from_millis(5);

    /// Whether the transfer is complete.
    pub(super) fn is_done(&self) -> bool {
        self.current.is_none() && self.waiting.is_empty()
    }

    /// Queues places.
    pub(super) fn add(&mut self, places: impl IntoIterator<Item = (u16, Bytes)>) {
        self.waiting.extend(places);
    }

    /// Cancels the transfer.
    pub(super) fn clear(&mut self) {
        self.waiting.clear();
        self.current = None;
    }

    /// Handles a place reported by the driver; `is_same_as` compares it to given data. Returns
    /// whether it was expected.
    pub(super) fn handle_report(
        &mut self,
        number: u16,
        is_same_as: impl Fn(&Bytes) -> bool,
    ) -> bool {
        let Some(step) = self.current.as_mut().filter(|step| step.number == number) else {
            return false;
        };
        self.answers = Some(true);
        if !self.keeps && !is_same_as(&step.data) {
            if step.sets < Self::MOST_SETS {
                // Either the set message was lost, or the right place follows: OpenJAUS reports all
                // places that it has under a number.
                step.differs = true;
                return true;
            }
            self.keeps = true;
            self.news = Some(Do::Keeps(number));
        }
        self.current = None;
        true
    }

    /// The actions that are due.
    pub(super) fn poll(&mut self, now: Instant, patience: Duration) -> Vec<Do> {
        let mut all = Vec::from_iter(self.news.take());
        loop {
            let is_mute = self.answers == Some(false);
            let Some(step) = &mut self.current else {
                let Some((number, data)) = self.waiting.pop_front() else {
                    return all;
                };
                all.push(Do::Set(data.clone()));
                let wait = match is_mute {
                    true => Self::PACE,
                    false => Self::AGAIN,
                };
                if !is_mute {
                    all.push(Do::Ask(number));
                }
                self.current = Some(Step {
                    number,
                    data,
                    asked: 1,
                    sets: 1,
                    differs: false,
                    next: now + wait,
                    until: now + patience,
                });
                return all;
            };
            if now < step.next {
                return all;
            }
            if is_mute {
                self.current = None;
                continue;
            }
            if now < step.until {
                step.asked += 1;
                step.next = (now + Self::AGAIN).min(step.until);
                // The query may have been lost; OpenJAUS would store a repeated place twice.
                if std::mem::take(&mut step.differs) || step.asked > 2 {
                    step.sets += 1;
                    all.push(Do::Set(step.data.clone()));
                }
                all.push(Do::Ask(step.number));
                return all;
            }
            let number = step.number;
            if self.answers == Some(true) {
                self.clear();
                all.push(Do::GiveUp(number));
                return all;
            }
            self.answers = Some(false);
            all.push(Do::Mute);
        }
    }

    /// Time of the next timer.
    pub(super) fn poll_timeout(&self) -> Option<Instant> {
        self.current.as_ref().map(|step| step.next)
    }
}
