//! Emergency: every part of the vehicle is told at once and again and again until its status says
//! that it has stopped, and whoever starts again meanwhile is told, too.

use std::collections::BTreeSet;
use std::time::{Duration, Instant};

use super::Reply;
use super::client::Client;
use crate::picture::Picture;
use jaus::address::JausId;

/// The emergency that this operator has set, if any.
#[derive(Default)]
pub(super) struct Alarm {
    wanted: bool,
    /// Until when the parts may take to end it.
    clearing: Option<Instant>,
    /// Who is being told.
    busy: BTreeSet<JausId>,
    waiting: Vec<Waiting>,
}

/// Somebody who wants to know what became of it.
struct Waiting {
    on: bool,
    until: Instant,
    reply: Reply,
}

impl Alarm {
    /// How long the requester waits for the parts.
    const PATIENCE: Duration = Duration::from_secs(3);
    /// How many may wait; more are answered at once.
    const MOST_WAITING: usize = 64;

    pub(super) const fn is_wanted(&self) -> bool {
        self.wanted
    }

    /// An operator sets an emergency, as often as they like.
    pub(super) fn set(
        &mut self,
        now: Instant,
        picture: &Picture,
        client: &mut Client,
        reply: Reply,
    ) {
        if !self.wanted {
            tracing::info!("emergency: stopping {}", vehicle(picture));
        }
        self.wanted = true;
        self.clearing = None;
        for part in picture.not_in_emergency(now) {
            client.shout(part);
        }
        self.await_end(now, true, reply);
        self.handle_time(now, picture, client);
    }

    /// An operator takes it back.
    pub(super) fn clear(
        &mut self,
        now: Instant,
        picture: &Picture,
        client: &mut Client,
        reply: Reply,
    ) {
        if self.wanted {
            tracing::info!("emergency: over for {}", vehicle(picture));
        }
        self.wanted = false;
        self.clearing = Some(now + Self::PATIENCE);
        self.await_end(now, false, reply);
        self.handle_time(now, picture, client);
    }

    fn await_end(&mut self, now: Instant, on: bool, reply: Reply) {
        let until = now + Self::PATIENCE;
        if self.waiting.len() < Self::MOST_WAITING {
            self.waiting.push(Waiting { on, until, reply });
        } else {
            reply(Err(
                "too many wait for the emergency; it is being told".to_owned()
            ));
        }
    }

    /// A part has been told; what its status is the picture knows.
    pub(super) fn handle_told(&mut self, part: JausId) {
        self.busy.remove(&part);
    }

    /// Tells whoever has to be told, and answers whoever waits.
    pub(super) fn handle_time(&mut self, now: Instant, picture: &Picture, client: &mut Client) {
        let left: Vec<JausId> = if self.wanted {
            picture.not_in_emergency(now).collect()
        } else if self.clearing.is_some_and(|until| now < until) {
            picture.in_emergency().collect()
        } else {
            self.clearing = None;
            Vec::new()
        };
        for part in left {
            if self.busy.insert(part) {
                client.alarm(part, self.wanted);
            }
        }
        self.answer(now, picture);
    }

    fn answer(&mut self, now: Instant, picture: &Picture) {
        for waiting in std::mem::take(&mut self.waiting) {
            let left: Vec<JausId> = match (waiting.on, self.wanted) {
                (true, true) => picture.not_in_emergency(now).collect(),
                (false, false) => picture.in_emergency().collect(),
                _ => {
                    (waiting.reply)(Err("the emergency was wanted otherwise since".to_owned()));
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

fn vehicle(picture: &Picture) -> String {
    let number = picture.vehicle();
    number.map_or_else(|| "no vehicle".to_owned(), |it| format!("vehicle {it}"))
}

fn in_words(on: bool, left: &[JausId]) -> String {
    let left: Vec<_> = left.iter().map(ToString::to_string).collect();
    let left = left.join(", ");
    if on {
        format!("{left} has not confirmed the emergency yet and is told again and again")
    } else {
        format!(
            "{left} is still in emergency: another client has set one, too, and has to clear it, or \
             it does not answer"
        )
    }
}
