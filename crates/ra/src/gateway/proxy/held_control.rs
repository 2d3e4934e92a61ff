//! What the gateway does with the control that it holds for an RA client: it repeats and stops the
//! client's setpoints, and ends the control of a dead client.
//!
//! As the gateway itself answers liveness probes of JAUS vehicles, it also stops vectors of a silent
//! client.

use std::time::{Duration, Instant};

use bytes::Bytes;

use super::codes::{RESET, SET_EMERGENCY, SHUTDOWN, STANDBY};
use super::hold::Hold;
use super::motion::moves;
use super::ra_client::{HeldControl, RaClient};
use super::stop;
use super::target::{RaRequest, Target};
use crate::gateway::counters::Counter;
use crate::ids::RaComponent;
use crate::message::Message;
use jaus::messages::core::Standby;
use jaus::service::{Stack, StopCause, Validity};

impl RaClient {
    /// Interval of rejections to a client without control.
    const REJECTION: Duration = Duration::from_secs(1);

    /// Whether the RA client has control of a JAUS component.
    fn controls(&self, peer: Target) -> bool {
        let mut held_controls = self.held_controls.values();
        held_controls.any(|it| it.held && it.peer == peer.id)
    }

    /// Refuses a command of a client without control and notifies it: it may have had control
    /// through an earlier gateway with our id, and must request control again.
    pub(super) fn refuse_uncontrolled(&mut self, request: &mut RaRequest<'_>) -> bool {
        if self.controls(request.peer) {
            return false;
        }
        request.refuse(Counter::NotInControl);
        let now = request.now;
        if self.rejected.is_none_or(|at| now >= at + Self::REJECTION) {
            self.rejected = Some(now);
            self.reject_control(request.message);
        }
        true
    }

    /// Stores the setpoint of a command sent to a JAUS component.
    pub(super) fn note_setpoint(
        &mut self,
        now: Instant,
        (request, payload): (&Message, &Bytes),
        peer: Target,
        stack: &Stack,
    ) {
        let code = request.code;
        let words = self.words(request.destination, peer.minor);
        let mut held_controls = self.held_controls.values_mut();
        let Some(held_control) = held_controls.find(|it| it.held && it.peer == peer.id) else {
            return;
        };
        if matches!(code, SHUTDOWN | STANDBY | RESET | SET_EMERGENCY) {
            return held_control.hold.clear(StopCause::Standby);
        }
        if !moves(code) {
            return;
        }
        let validity = Validity::of(code);
        let part = RaComponent(request.destination.component);
        let stop = stop::after(part, (code, &request.data));
        let stop = stop.and_then(|(code, data)| words.to_jaus(code, &data).ok());
        held_control.hold.guard.accept(now, stack.id(), validity);
        held_control.hold.stop = stop;
        held_control.hold.repeat =
            (validity == Validity::Brief).then(|| (payload.clone(), now + Hold::REPEAT));
    }

    /// Repeats held setpoints, stops those of a silent client, and ends the control of a dead
    /// client. Call it before queued messages are handled.
    pub(super) fn tend(&mut self, now: Instant, stack: &mut Stack) {
        if self.held_controls.is_empty() {
            return;
        }
        if self.life.dies_at().is_some_and(|death| death <= now) {
            return self.end_control(now, stack);
        }
        let life = &self.life;
        for held_control in self.held_controls.values_mut().filter(|it| it.held) {
            if let Some(payload) = held_control.hold.poll(now, life) {
                stack.send_octets(held_control.peer, payload);
            }
        }
    }

    /// Whether the client's status query is due, as a liveness probe.
    pub(super) fn take_probe(&mut self, now: Instant) -> bool {
        let due = self.probe_at().is_some_and(|due| due <= now);
        if due {
            self.life.probed = Some(now);
        }
        due
    }

    fn probe_at(&self) -> Option<Instant> {
        if self.held_controls.is_empty() {
            return None;
        }
        let moving = |it: &HeldControl| it.hold.guard.is_active();
        self.life.probe_at(self.held_controls.values().any(moving))
    }

    /// The next timeout of [`tend`](Self::tend).
    pub(super) fn tend_at(&self) -> Option<Instant> {
        let holds = self
            .held_controls
            .values()
            .filter_map(|it| it.hold.poll_timeout());
        let dies = self
            .life
            .dies_at()
            .filter(|_| !self.held_controls.is_empty());
        holds.chain(self.probe_at()).chain(dies).min()
    }

    /// Stops all JAUS components under the client's control, and releases them.
    pub(super) fn end_control(&mut self, now: Instant, stack: &mut Stack) {
        for (id, mut held_control) in std::mem::take(&mut self.held_controls) {
            let (client, of) = (
                held_control.request.source,
                held_control.request.destination,
            );
            tracing::info!(%client, %of, "control ended: the RA client is lost or the gateway is \
                stopping");
            if held_control.held {
                let stop = held_control.hold.stop.take();
                stop.into_iter()
                    .for_each(|stop| stack.send_octets(held_control.peer, stop));
                stack.send(held_control.peer, &Standby {});
            }
            stack.release_control(now, id);
            self.reject_control(&held_control.request);
        }
    }
}
