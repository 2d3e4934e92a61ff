//! Guards motion of an RA component on behalf of its JAUS client. RA components keep their last
//! command, so the gateway sends the stop command when the client's setpoint ends: an effort is not
//! repeated, the client of a vector is silent, or a client loses control.

use std::time::Instant;

use bytes::Bytes;

use super::codes::{SET_EFFORT, SET_GLOBAL_VECTOR, SET_LOCAL_VECTOR, SET_SPEED, STATUS};
use super::{Proxy, stop};
use crate::gateway::counters::Tally;
use crate::ids::RaComponent;
use jaus::address::JausId;
use jaus::endpoint::{Outgoing, Received};
use jaus::service::{Incarnation, Life, MotionGuard, Outbox, Rank, StopCause, Validity};

/// Active motion command of an RA component, and the liveness of its client.
#[derive(Debug)]
pub(super) struct Motion {
    guard: MotionGuard,
    /// The last motion command: code and data.
    last: Option<(u16, Bytes)>,
    life: Life,
    out: Outbox,
}

impl Motion {
    /// No motion. `id` is the RA component's JAUS id, `incarnation` that of its proxy.
    pub(super) fn new(id: JausId, incarnation: Incarnation) -> Self {
        Self {
            guard: MotionGuard::default(),
            last: None,
            life: Life::new(incarnation),
            out: Outbox::new(id),
        }
    }

    /// Notes a message of a JAUS component.
    pub(super) fn hear(&mut self, now: Instant, message: &Received) {
        self.life.hear(now, message);
    }

    /// Takes the next liveness probe.
    pub(super) fn poll_transmit(&mut self) -> Option<Outgoing> {
        self.out.pop()
    }

    pub(super) fn poll_timeout(&self) -> Option<Instant> {
        let guard = self.guard.expires_at();
        guard.into_iter().chain(self.life.poll_timeout()).min()
    }
}

/// Whether a command with this code moves the RA component.
pub(super) const fn moves(code: u16) -> bool {
    matches!(
        code,
        SET_EFFORT | SET_GLOBAL_VECTOR | SET_LOCAL_VECTOR | SET_SPEED
    )
}

impl Proxy {
    /// Sends a command of the client in control to the RA component.
    pub(super) fn give(&mut self, now: Instant, (code, mut data): (u16, Bytes)) {
        if code == SET_EFFORT {
            data = stop::with_every_field(&data).unwrap_or(data);
        }
        if moves(code)
            && let Some(client) = self.lease.controller()
        {
            self.motion.guard.accept(now, client.id, Validity::of(code));
            self.motion.last = Some((code, data.clone()));
            self.watch(now, client.id);
        }
        self.to_ra.push((code, data));
    }

    /// Sends the stop command to the RA component, and clears the setpoint.
    pub(super) fn stop(&mut self) {
        let part = RaComponent(self.ra.component);
        let last = self.motion.last.take();
        let command = match &last {
            Some((code, data)) => stop::after(part, (*code, data)),
            None => stop::command(part),
        };
        self.to_ra.extend(command);
        self.motion.guard.finish();
        if let Some(listing) = &self.listing {
            listing.lock().stop();
        }
    }

    /// Ends expired control and setpoints. Runs before queued messages are handled, as they may
    /// have waited while the gateway did not run.
    pub(super) fn end_overdue(&mut self, now: Instant) {
        self.lease.handle_timeout(now);
        self.ra_client.tend(now, &mut self.stack);
        let Motion { guard, life, .. } = &mut self.motion;
        guard.note_life(|client| life.last_sign(client));
        if let Some(cause) = guard.expire(now) {
            tracing::debug!(component = %self.ra, %cause, "stopped");
            self.stop();
        }
    }

    /// Probes the client in control, and ends its control if it is dead.
    pub(super) fn tend_client(&mut self, now: Instant, tally: &mut Tally) {
        let controller = self.lease.controller().map(|it| it.id);
        let moving = self.motion.guard.depends_on();
        let rank = |id| match (controller == Some(id), moving == Some(id)) {
            (false, _) => None,
            (true, false) => Some(Rank::ReadyController),
            (true, true) => Some(Rank::MovingController),
        };
        let Motion { life, out, .. } = &mut self.motion;
        life.handle_timeout(now, rank, out);
        while let Some(dead) = self.motion.life.poll_dead() {
            tracing::warn!(client = %dead, component = %self.ra, "the client in control is lost");
            self.forget(now, dead, tally);
        }
    }

    /// Ends the motion and the control of a client that has restarted.
    pub(super) fn end_control_of_restarted(&mut self, now: Instant, tally: &mut Tally) {
        while let Some(client) = self.motion.life.poll_restarted() {
            if self.lease.controller().is_some_and(|it| it.id == client) {
                tracing::warn!(%client, component = %self.ra, "the client in control has restarted");
                self.forget(now, client, tally);
            }
        }
    }

    /// Follows a change of the client in control.
    pub(super) fn follow_controller(&mut self, now: Instant) {
        let controller = self.lease.controller();
        let is_driver = RaComponent(self.ra.component).is_driver();
        self.in_standby = is_driver && controller.is_some();
        if is_driver {
            self.mirror.outdate(STATUS);
            self.ask(STATUS);
        }
        // A release stops the component itself.
        if controller.is_some() || self.lease.is_engaged() {
            self.stop();
        } else {
            self.motion.guard.stop(StopCause::ControlChanged);
            self.motion.last = None;
        }
        if let Some(client) = controller {
            self.watch(now, client.id);
        }
    }

    fn watch(&mut self, now: Instant, client: JausId) {
        let rank = match self.motion.guard.depends_on() {
            Some(_) => Rank::MovingController,
            None => Rank::ReadyController,
        };
        let Motion { life, out, .. } = &mut self.motion;
        life.watch(now, client, rank);
        if Incarnation::is_offered_by(&self.stack.directory(), client) == Some(true) {
            life.introduce(now, client, out);
        }
    }
}
