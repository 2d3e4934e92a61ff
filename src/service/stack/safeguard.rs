//! What a stack does so that nothing moves without a living controller: the one stop, the watch over
//! clients, and failures.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::{Duration, Instant};

use super::Stack;
use crate::service::control::Condition;
use crate::service::life::Rank;
use crate::service::safety;
use crate::service::{Context, Service, StopCause, UnsafeService};

/// What keeps the component in failure.
#[derive(Debug, Default)]
pub(super) struct Faults {
    /// Faults that services have reported and not recovered from.
    of_services: u32,
    /// Whether the application says that it has failed.
    of_application: bool,
}

impl Stack {
    /// A component that moves something and is not called for so long was held up, with all that steers
    /// what it moves.
    const HUNG: Duration = Duration::from_millis(500);
    const BEAT: Duration = Duration::from_millis(100);

    /// Checks that each service has beside it what makes it safe.
    ///
    /// # Errors
    /// [`UnsafeService`] says what to add.
    pub fn check(&self) -> Result<(), UnsafeService> {
        let mut services = self.services.iter();
        services.try_for_each(|service| self.check_service(service.as_ref()))
    }

    pub(super) fn check_service(&self, service: &dyn Service) -> Result<(), UnsafeService> {
        safety::check(service, self.control.has_management(), &self.standing)
    }

    /// The application tells how the component is, which Management shows.
    pub fn set_condition(&mut self, now: Instant, condition: Condition) {
        match condition {
            Condition::Initialized => {
                self.faults.of_application = false;
                if self.faults.of_services == 0 || self.control.is_initializing() {
                    self.control.handle_condition(condition, &mut self.out);
                }
                if self.faults.of_services > 0 {
                    self.control
                        .handle_condition(Condition::Failed, &mut self.out);
                }
            }
            Condition::Failed => {
                self.faults.of_application = true;
                self.control.handle_condition(condition, &mut self.out);
            }
            Condition::Safe => self.control.handle_condition(condition, &mut self.out),
        }
        self.collect(now);
    }

    /// Stops whatever the services move.
    pub fn stop(&mut self, cause: &StopCause) {
        for service in &mut self.services {
            let mut context =
                Context::new(&mut self.out, &self.standing, &self.life, &mut self.news);
            service.handle_stop(cause, &mut context);
        }
    }

    fn is_moving(&self) -> bool {
        self.services.iter().any(|service| service.is_moving())
    }

    /// While something moves the component is called this often, if only to know that it can be.
    pub(super) fn next_beat(&self) -> Option<Instant> {
        let last = self.called.filter(|_| self.is_moving())?;
        Some(last + Self::BEAT)
    }

    /// Ends control that has timed out, and what a component that was held up has moved: messages that
    /// have waited change nothing about that.
    pub(super) fn end_overdue(&mut self, now: Instant) {
        let last = self.called.replace(now).unwrap_or(now);
        let gap = now.saturating_duration_since(last);
        if gap > Self::HUNG && self.is_moving() {
            tracing::error!(id = %self.out.source(), ?gap, "stopped: the component was held up");
            self.stop(&StopCause::Hung(gap));
            self.control.drop_controller(&mut self.out);
        }
        self.control.handle_timeout(now, &mut self.out);
        self.follow_control(now);
    }

    /// Looks after the clients that matter: probes the silent, and forgets the dead.
    pub(super) fn probe(&mut self, now: Instant) {
        let services = self.services.iter();
        let moving: Vec<_> = services.filter_map(|it| it.depends_on()).collect();
        let (control, subscribers) = (&self.control, &self.subscribers);
        let rank = |client| {
            let ranks = [
                (moving.contains(&client), Rank::MovingController),
                (control.is_controller(client), Rank::Controller),
                (control.has_emergency_of(client), Rank::EmergencySetter),
                (subscribers.has(client), Rank::Subscriber),
            ];
            ranks.into_iter().find_map(|(is, rank)| is.then_some(rank))
        };
        self.life.handle_timeout(now, rank, &mut self.out);
        while let Some(client) = self.life.poll_dead() {
            tracing::info!(id = %self.out.source(), %client, "a client is dead: it answers no more");
            self.control.forget(client, &mut self.out);
            self.subscribers.forget(client);
        }
        self.warn_of_mute(now);
    }

    /// A client in control that never answers and need not renew could be dead.
    fn warn_of_mute(&mut self, now: Instant) {
        let controller = self.standing.controller.map(|it| it.id);
        let mute =
            controller.filter(|&id| !self.control.has_timeout() && self.life.is_mute(now, id));
        if let Some(client) = mute.filter(|_| self.mute != mute) {
            tracing::warn!(
                id = %self.out.source(), %client,
                "the client in control answers no Query Heartbeat Pulse, and control has no \
                 timeout: only standby, release or an emergency will stop what it has set in motion"
            );
        }
        self.mute = mute;
    }

    /// Watches the client in control, and those on whose life a motion depends.
    pub(super) fn watch_clients(&mut self, now: Instant) {
        if let Some(controller) = self.standing.controller {
            self.life.watch(now, controller.id, Rank::Controller);
        }
        for service in &self.services {
            if let Some(client) = service.depends_on() {
                self.life.watch(now, client, Rank::MovingController);
            }
        }
    }

    /// A service has found out that something is broken, or mended.
    pub(super) fn follow_faults(&mut self) {
        for fault in std::mem::take(&mut self.news.faults) {
            let id = self.out.source();
            let before = self.faults.of_services;
            match fault {
                Err(cause) => {
                    tracing::error!(%id, %cause, "failure");
                    self.faults.of_services = before.saturating_add(1);
                    // While it gets ready it counts afterwards.
                    if !self.control.is_initializing() {
                        self.control
                            .handle_condition(Condition::Failed, &mut self.out);
                    }
                }
                Ok(()) => {
                    self.faults.of_services = before.saturating_sub(1);
                    if before == 1 && !self.faults.of_application && self.control.has_failed() {
                        tracing::warn!(%id, "the failure is over");
                        self.control
                            .handle_condition(Condition::Initialized, &mut self.out);
                    }
                }
            }
        }
    }
}

impl Drop for Stack {
    /// Whatever ends a component, a panic of one of its functions included, ends what it moves.
    fn drop(&mut self) {
        for service in &mut self.services {
            let mut context =
                Context::new(&mut self.out, &self.standing, &self.life, &mut self.news);
            // Another stop action must not be skipped because one panics, nor may a panic during
            // a panic end the process before the last one.
            let stop = || service.handle_stop(&StopCause::Ended, &mut context);
            if catch_unwind(AssertUnwindSafe(stop)).is_err() {
                tracing::error!("a stop action has panicked");
            }
        }
    }
}
