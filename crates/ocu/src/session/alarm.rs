//! Emergency: sent to every part of the vehicle immediately and repeatedly until its status
//! confirms the stop. Parts that restart meanwhile receive it as well.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use tokio::task::AbortHandle;

use super::client::{AlarmChange, Cleared, Client};
use crate::orders::Reply;
use crate::picture::Picture;
use jaus::address::JausId;

/// The emergency set by this operator, if any.
#[derive(Default)]
pub(super) struct Alarm {
    wanted: bool,
    /// When it was set.
    since: Option<Instant>,
    /// When it was last sent to all parts that have not confirmed it.
    shouted: Option<Instant>,
    /// Until when clearing is repeated, and whose emergency.
    clearing: Option<(Instant, Cleared)>,
    /// Parts with a delivery in progress.
    busy: BTreeMap<JausId, AbortHandle>,
    waiting: Vec<Waiting>,
}

/// A requester waiting for the result.
struct Waiting {
    on: bool,
    until: Instant,
    reply: Reply,
}

impl Alarm {
    /// How long a requester waits for the parts.
    const PATIENCE: Duration = Duration::from_secs(3);
    /// How long a new emergency is repeated fast.
    const FRESH: Duration = Duration::from_secs(1);
    const FAST_REPEAT: Duration = Duration::from_millis(90);
    const REPEAT: Duration = Duration::from_millis(500);
    /// Limit of waiting requesters. Further ones are answered immediately.
    const MOST_WAITING: usize = 64;

    pub(super) const fn is_wanted(&self) -> bool {
        self.wanted
    }

    /// Sets the emergency, and sends it at once. Returns whether it is new. May be repeated at any
    /// rate.
    pub(super) fn set(&mut self, now: Instant, picture: &mut Picture, client: &mut Client) -> bool {
        let is_new = !self.wanted;
        if is_new {
            tracing::info!("emergency: stopping vehicle {}", picture.vehicle());
            self.since = Some(now);
            self.shouted = None;
            picture.handle_stop(now);
            // What is still being told to end an emergency must not hear that after the stop.
            self.busy.values().for_each(AbortHandle::abort);
            self.busy.clear();
        }
        self.wanted = true;
        self.clearing = None;
        self.handle_time(now, picture, client);
        is_new
    }

    /// Whether the end of an emergency is being sent.
    pub(super) const fn is_clearing(&self) -> bool {
        self.clearing.is_some()
    }

    /// Clears the emergency.
    pub(super) fn clear(
        &mut self,
        now: Instant,
        whose: Cleared,
        picture: &Picture,
        client: &mut Client,
    ) {
        if self.wanted {
            tracing::info!("emergency: cleared for vehicle {}", picture.vehicle());
        }
        self.wanted = false;
        self.clearing = Some((now + Self::PATIENCE, whose));
        self.handle_time(now, picture, client);
    }

    /// Replies when all parts have confirmed the start or the end of the emergency.
    pub(super) fn await_end(&mut self, now: Instant, on: bool, picture: &Picture, reply: Reply) {
        let until = now + Self::PATIENCE;
        if self.waiting.len() < Self::MOST_WAITING {
            self.waiting.push(Waiting { on, until, reply });
        } else {
            reply(Err(
                "too many pending requests; the emergency is being sent".to_owned(),
            ));
        }
        self.answer(now, picture);
    }

    /// Sends the emergency to the parts that have not confirmed it, without waiting for
    /// acknowledgements: a lost packet must not cost more than a repetition.
    fn shout(&mut self, now: Instant, picture: &Picture, client: &Client) {
        let is_fresh = self.since.is_some_and(|since| now < since + Self::FRESH);
        let pause = if is_fresh {
            Self::FAST_REPEAT
        } else {
            Self::REPEAT
        };
        if self.shouted.is_some_and(|at| now < at + pause) {
            return;
        }
        self.shouted = Some(now);
        for part in picture.not_in_emergency(now) {
            client.shout(part);
        }
    }

    /// Handles the end of a delivery. The result shows in the reported status.
    pub(super) fn handle_told(&mut self, part: JausId) {
        self.busy.remove(&part);
    }

    /// Starts the pending deliveries and answers waiting requesters.
    pub(super) fn handle_time(&mut self, now: Instant, picture: &Picture, client: &mut Client) {
        if self.wanted {
            self.shout(now, picture, client);
        }
        self.clearing = self.clearing.filter(|(until, _)| now < *until);
        let (left, change): (Vec<JausId>, _) = match self.clearing {
            _ if self.wanted => (picture.not_in_emergency(now).collect(), AlarmChange::Set),
            Some((_, whose)) => (picture.in_emergency().collect(), AlarmChange::Clear(whose)),
            None => return self.answer(now, picture),
        };
        for part in left {
            let told = self.busy.entry(part);
            told.or_insert_with(|| client.alarm(part, change));
        }
        self.answer(now, picture);
    }

    fn answer(&mut self, now: Instant, picture: &Picture) {
        for waiting in std::mem::take(&mut self.waiting) {
            let left: Vec<JausId> = match (waiting.on, self.wanted) {
                (true, true) => picture.not_in_emergency(now).collect(),
                (false, false) => picture.in_emergency().collect(),
                _ => {
                    (waiting.reply)(Err("a later request changed the emergency".to_owned()));
                    continue;
                }
            };
            if left.is_empty() {
                (waiting.reply)(Ok(()));
            } else if now >= waiting.until {
                (waiting.reply)(Err(in_words(waiting.on, &left)));
            } else {
                self.waiting.push(waiting);
            }
        }
    }
}

fn in_words(on: bool, left: &[JausId]) -> String {
    let left: Vec<_> = left.iter().map(ToString::to_string).collect();
    let left = left.join(", ");
    if on {
        format!("{left} has not confirmed the emergency yet; it is sent repeatedly")
    } else {
        format!(
            "{left} is still in emergency: it does not answer, or another client set an emergency \
             and must clear it, or its stop input is pressed; a station clears the emergencies of \
             others only over a secure link, with a key that has the right clear-emergency=any"
        )
    }
}
