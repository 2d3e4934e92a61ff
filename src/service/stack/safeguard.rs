//! The safeguards of a stack, so that nothing moves without a living controller: the one stop, the
//! watch over clients, and faults.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::{Duration, Instant};

use super::Stack;
use crate::endpoint::Received;
use crate::messages::registry;
use crate::service::control::Condition;
use crate::service::life::Rank;
use crate::service::safety;
use crate::service::{Incarnation, Service, StopCause, UnsafeService};

/// What keeps the component in failure.
#[derive(Debug, Default)]
pub(super) struct Faults {
    /// Faults that services have reported and not recovered from.
    of_services: u32,
    /// Whether the application has reported a failure.
    of_application: bool,
}

/// Whether a message with this code is a query, and so has no effect but its answer.
pub(super) fn is_query(services: &[Box<dyn Service>], code: u16) -> bool {
    registry().report_of(code).is_some() || services.iter().any(|it| it.answers(code))
}

impl Stack {
    /// If something moves and the component is not called for `HUNG`, the component was held up,
    /// together with the code that steers. While something moves it is called every `BEAT`.
    const HUNG: Duration = Duration::from_millis(500);
    const BEAT: Duration = Duration::from_millis(100);

    /// Checks that each service has what it needs to be safe.
    ///
    /// # Errors
    /// [`UnsafeService`] names what is missing.
    pub fn check(&self) -> Result<(), UnsafeService> {
        let mut services = self.services.iter();
        services.try_for_each(|service| self.check_service(service.as_ref()))
    }

    pub(super) fn check_service(&self, service: &dyn Service) -> Result<(), UnsafeService> {
        safety::check(service, self.control.has_management(), &self.standing)
    }

    /// Takes the application's report of the component's condition, which Management reports to
    /// clients.
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
            Condition::Stopped | Condition::StopReleased | Condition::Safe => {
                self.control.handle_condition(condition, &mut self.out);
            }
        }
        self.collect(now);
    }

    /// Stops everything that the services move.
    pub fn stop(&mut self, cause: &StopCause) {
        let (services, mut context) = self.services_in_context();
        for service in services {
            service.handle_stop(cause, &mut context);
        }
    }

    pub(super) fn is_moving(&self) -> bool {
        self.services.iter().any(|service| service.is_moving())
    }

    /// While something moves the component is called this often, if only to show that it still can
    /// be.
    pub(super) fn next_beat(&self) -> Option<Instant> {
        let last = self.called.filter(|_| self.is_moving())?;
        Some(last + Self::BEAT)
    }

    /// Ends control that has timed out, and stops motion if the component was held up. Called
    /// before any waiting message is handled, so that none can prevent this.
    pub(super) fn end_overdue(&mut self, now: Instant) {
        let last = self.called.replace(now).unwrap_or(now);
        let gap = now.saturating_duration_since(last);
        if gap > Self::HUNG && self.is_moving() {
            tracing::error!(id = %self.out.source(), ?gap, "stopped: the component was delayed");
            self.stop(&StopCause::Hung(gap));
            self.control.drop_controller(&mut self.out);
        }
        self.control.handle_timeout(now, &mut self.out);
        self.follow_control(now);
    }

    /// Watches the clients that matter: probes silent ones, and forgets dead ones.
    pub(super) fn probe(&mut self, now: Instant) {
        let services = self.services.iter();
        let moving: Vec<_> = services.filter_map(|it| it.depends_on()).collect();
        let (control, subscribers) = (&self.control, &self.subscribers);
        let rank = |client| {
            let ranks = [
                (moving.contains(&client), Rank::MovingController),
                (control.is_acting_for(client), Rank::ReadyController),
                (control.is_controller(client), Rank::Controller),
                (control.has_emergency_of(client), Rank::EmergencySetter),
                (subscribers.has(client), Rank::Subscriber),
            ];
            ranks.into_iter().find_map(|(is, rank)| is.then_some(rank))
        };
        self.life.handle_timeout(now, rank, &mut self.out);
        while let Some(client) = self.life.poll_dead() {
            tracing::info!(id = %self.out.source(), %client, "client lost: it no longer answers");
            self.control.forget(client, &mut self.out);
            self.subscribers.forget(client);
        }
        self.warn_of_mute(now);
    }

    /// Ends the motion and the control of clients that have restarted: the new incarnation is a new
    /// client.
    pub(super) fn end_control_of_restarted(&mut self, now: Instant, message: &Received) {
        while let Some(client) = self.life.poll_restarted() {
            self.order.forget(client);
            let is_moving = self
                .services
                .iter()
                .any(|it| it.depends_on() == Some(client));
            if !is_moving && !self.control.is_controller(client) {
                continue;
            }
            tracing::warn!(id = %self.out.source(), %client, "the client in control has restarted");
            self.stop(&StopCause::Restarted(client));
            self.control.handle_restarted(message, &mut self.out);
            self.follow_control(now);
        }
    }

    /// Warns if the client in control could be dead: it never answers, and control has no timeout.
    fn warn_of_mute(&mut self, now: Instant) {
        let controller = self.standing.controller.map(|it| it.id);
        let mute =
            controller.filter(|&id| !self.control.has_timeout() && self.life.is_mute(now, id));
        if let Some(client) = mute.filter(|_| self.mute != mute) {
            tracing::warn!(
                id = %self.out.source(), %client,
                "the client in control does not answer Query Heartbeat Pulse, and control has no \
                 timeout: only standby, release or an emergency will stop its motion"
            );
        }
        self.mute = mute;
    }

    /// Watches the client in control, and those that a motion depends on.
    pub(super) fn watch_clients(&mut self, now: Instant) {
        if let Some(controller) = self.standing.controller {
            let (id, life) = (controller.id, &mut self.life);
            let rank = match self.control.is_acting_for(id) {
                true => Rank::ReadyController,
                false => Rank::Controller,
            };
            life.watch(now, id, rank);
            if Incarnation::is_offered_by(&self.discovery.directory(), id) == Some(true) {
                life.introduce(now, id, &mut self.out);
            }
        }
        for service in &self.services {
            if let Some(client) = service.depends_on() {
                self.life.watch(now, client, Rank::MovingController);
            }
        }
    }

    /// Handles the faults and recoveries that services have reported.
    pub(super) fn follow_faults(&mut self) {
        for fault in std::mem::take(&mut self.news.faults) {
            let id = self.out.source();
            let before = self.faults.of_services;
            match fault {
                Err(cause) => {
                    tracing::error!(%id, %cause, "failure");
                    self.faults.of_services = before.saturating_add(1);
                    // During initialization the fault takes effect afterwards.
                    if !self.control.is_initializing() {
                        self.control
                            .handle_condition(Condition::Failed, &mut self.out);
                    }
                }
                Ok(()) => {
                    self.faults.of_services = before.saturating_sub(1);
                    if before == 1 && !self.faults.of_application && self.control.has_failed() {
                        tracing::warn!(%id, "failure cleared");
                        self.control
                            .handle_condition(Condition::Initialized, &mut self.out);
                    }
                }
            }
        }
    }
}

impl Drop for Stack {
    /// However a component ends, including by a panic in one of its functions, its motion stops.
    fn drop(&mut self) {
        let (services, mut context) = self.services_in_context();
        for service in services {
            // A panic in one stop action must not skip the next ones, nor may a panic during a
            // panic end the process before the last one.
            let stop = || service.handle_stop(&StopCause::Ended, &mut context);
            if catch_unwind(AssertUnwindSafe(stop)).is_err() {
                tracing::error!("a stop action panicked");
            }
        }
    }
}
