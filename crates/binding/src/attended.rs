//! The services of a program with its own loop: a program that does not fetch its commands hangs, and
//! must not keep its component alive.

use std::sync::Arc;
use std::time::{Duration, Instant};

use jaus::address::JausId;
use jaus::codec::ServiceId;
use jaus::component::{Handlers, Service, Standing, UndecodedFunctions};
use jaus::endpoint::Received;
use jaus::service::{Context, Handled, Hazards, Publication, StopCause};

use crate::HUNG;
use crate::events::{EventQueue, Notice, ServiceKey};

/// A service whose messages wait for the program in a queue.
///
/// When what it moves must stop, the commands that still wait are withdrawn, and the program gets the news.
/// A program that does not come for its messages for [`HUNG`], or does not come at all while a command is in
/// force, hangs: the service stops, and its component fails until the program comes again.
#[derive(Debug)]
pub struct Attended<E> {
    inner: Handlers<UndecodedFunctions>,
    key: ServiceKey,
    queue: Arc<EventQueue<E>>,
    /// Since when a command has been in force.
    moving: Option<Instant>,
    /// When the program was last looked after.
    looked: Option<Instant>,
    /// When it was found to hang; `None` while it does not.
    hung: Option<Instant>,
}

impl<E: Notice> Attended<E> {
    /// How often the program is called while a command is in force, and looked after while it hangs.
    const BEAT: Duration = Duration::from_millis(200);

    /// A service whose functions push its messages into the queue, its commands under this key.
    #[must_use]
    pub const fn new(
        inner: Handlers<UndecodedFunctions>,
        key: ServiceKey,
        queue: Arc<EventQueue<E>>,
    ) -> Self {
        Self {
            inner,
            key,
            queue,
            moving: None,
            looked: None,
            hung: None,
        }
    }

    /// Notes whether a command is in force, after a call of the service.
    fn note_motion(&mut self, now: Instant) {
        self.moving = match self.inner.is_moving() {
            true => self.moving.or(Some(now)),
            false => None,
        };
    }

    /// Tells the program of a stop, after which it must not act on the commands that wait.
    fn note_stop(&self, cause: Option<&StopCause>, id: JausId) {
        self.queue.withdraw_commands(self.key);
        self.queue.push_in_time(E::stopped(self.key, id, cause));
    }

    /// Since when the program has owed a call.
    fn owed_since(&self) -> Option<Instant> {
        let attention = self.queue.attention();
        let first = [self.moving, attention.due].into_iter().flatten().min()?;
        Some(first.max(attention.fetched))
    }

    fn attend(&mut self, now: Instant, context: &mut Context<'_>) {
        if self.looked.is_none_or(|looked| now - looked >= Self::BEAT) {
            self.looked = Some(now);
            if self.moving.is_some() {
                self.queue.beat();
            }
        }
        match self.hung {
            None => self.find_hung(now, context),
            Some(hung) if self.queue.attention().fetched > hung => {
                self.hung = None;
                context.recover();
            }
            Some(_) => {}
        }
    }

    fn find_hung(&mut self, now: Instant, context: &mut Context<'_>) {
        let gap = self
            .owed_since()
            .map(|since| now.saturating_duration_since(since));
        if let Some(gap) = gap.filter(|gap| *gap >= HUNG) {
            self.hung = Some(now);
            tracing::error!(id = %context.id(), ?gap, "stopped: the program does not fetch its events");
            let cause = StopCause::Hung(gap);
            self.handle_stop(&cause, context);
            context.fail(cause);
        }
    }
}

impl<E: Notice> Service for Attended<E> {
    fn offers(&self) -> Vec<ServiceId> {
        self.inner.offers()
    }

    fn handle_message(
        &mut self,
        now: Instant,
        message: &Received,
        context: &mut Context<'_>,
    ) -> Handled {
        let handled = self.inner.handle_message(now, message, context);
        self.note_motion(now);
        handled
    }

    fn handle_publication(
        &mut self,
        publication: &Publication,
        context: &mut Context<'_>,
    ) -> Handled {
        self.inner.handle_publication(publication, context)
    }

    fn handle_timeout(&mut self, now: Instant, context: &mut Context<'_>) {
        let was_moving = self.inner.is_moving();
        self.inner.handle_timeout(now, context);
        self.note_motion(now);
        if was_moving && !self.inner.is_moving() {
            self.note_stop(None, context.id());
        }
        self.attend(now, context);
    }

    fn handle_stop(&mut self, cause: &StopCause, context: &mut Context<'_>) {
        let was_moving = self.inner.is_moving();
        self.inner.handle_stop(cause, context);
        self.moving = None;
        self.queue.withdraw_commands(self.key);
        if was_moving {
            self.note_stop(Some(cause), context.id());
        }
    }

    fn handle_standing(&mut self, now: Instant, before: &Standing, context: &mut Context<'_>) {
        self.inner.handle_standing(now, before, context);
    }

    fn depends_on(&self) -> Option<JausId> {
        self.inner.depends_on()
    }

    fn is_moving(&self) -> bool {
        self.inner.is_moving()
    }

    fn hazards(&self) -> Hazards {
        self.inner.hazards()
    }

    fn unhandled_version(&self) -> Option<(ServiceId, &'static str)> {
        self.inner.unhandled_version()
    }

    fn unanswered_query(&self) -> Option<(ServiceId, &'static str)> {
        self.inner.unanswered_query()
    }

    fn answers(&self, query: u16) -> bool {
        self.inner.answers(query)
    }

    fn poll_timeout(&self) -> Option<Instant> {
        let next_look = self.looked.map(|looked| looked + Self::BEAT);
        let look = match self.hung {
            Some(hung) => next_look.or(Some(hung)),
            None => {
                let hangs = self.owed_since().map(|since| since + HUNG);
                let beat = self.moving.map(|moving| next_look.unwrap_or(moving));
                [hangs, beat].into_iter().flatten().min()
            }
        };
        let wakes = [self.inner.poll_timeout(), look];
        wakes.into_iter().flatten().min()
    }
}
