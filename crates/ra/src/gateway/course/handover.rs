//! Giving an RA driver its places one by one: each is set, and then asked for until it is told. So they
//! come in order, and what got lost is given again; a driver that answers no such questions gets them
//! one after the other all the same.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use bytes::Bytes;

/// Places on their way to an RA driver.
#[derive(Debug, Default)]
pub(super) struct Handover {
    /// What is still to be given, by number.
    waiting: VecDeque<(u16, Bytes)>,
    current: Option<Step>,
    /// Whether it answers. Not known before it was asked once.
    answers: Option<bool>,
    /// Whether it keeps what it had under a number, and tells that alone.
    keeps: bool,
    news: Option<Do>,
}

#[derive(Debug)]
struct Step {
    number: u16,
    data: Bytes,
    /// How often it was asked for.
    asked: u32,
    /// How often it was set.
    sets: u32,
    /// Whether another place was told under its number.
    differs: bool,
    next: Instant,
    until: Instant,
}

/// What is to be done for a handover.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Do {
    /// Set the place with this data.
    Set(Bytes),
    /// Ask for the place with this number.
    Ask(u16),
    /// The driver answers no such questions, and gets the rest without.
    Mute,
    /// It keeps what it had under a number.
    Keeps(u16),
    /// It answered before and does not now: what is left is not given.
    GiveUp(u16),
}

impl Handover {
    /// Between two questions.
    const AGAIN: Duration = Duration::from_millis(250);
    /// How often a place is set under whose number another one is told.
    const MOST_SETS: u32 = 3;
    /// Between two places for a driver that answers no questions.
    const PACE: Duration = Duration::from_millis(5);

    /// Whether all has been given.
    pub(super) fn is_done(&self) -> bool {
        self.current.is_none() && self.waiting.is_empty()
    }

    /// Puts places behind those that wait.
    pub(super) fn add(&mut self, places: impl IntoIterator<Item = (u16, Bytes)>) {
        self.waiting.extend(places);
    }

    /// Gives nothing more.
    pub(super) fn clear(&mut self) {
        self.waiting.clear();
        self.current = None;
    }

    /// The driver has told a place, and whether it is the same `as` one with some data. Says whether
    /// that was waited for.
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
                // What was set may be what was lost; or the right one comes behind it, for OpenJAUS
                // tells all that it has under a number.
                step.differs = true;
                return true;
            }
            self.keeps = true;
            self.news = Some(Do::Keeps(number));
        }
        self.current = None;
        true
    }

    /// The next thing to do now.
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
                // The question may be what was lost; a place twice is one too many for OpenJAUS.
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

    /// When there is something to do.
    pub(super) fn poll_timeout(&self) -> Option<Instant> {
        self.current.as_ref().map(|step| step.next)
    }
}
