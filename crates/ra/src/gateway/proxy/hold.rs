//! What an RA client has set at the JAUS components that it controls.
//!
//! RA clients send an effort once or slowly, for RA components keep the last one. A JAUS vehicle
//! stops when an effort is not repeated for half a second. The gateway therefore repeats it, as long
//! as the client itself shows life: any message of the component, which is asked for its status; for
//! a component that has never answered that, any message of its subsystem, such as its heartbeat. The
//! gateway answers for its own life when a JAUS vehicle asks the controller, so it also stops what the
//! client has left moving by a vector, and ends the client's control when it is dead.

use std::time::{Duration, Instant};

use bytes::Bytes;

use super::codes::{RESET, SET_EMERGENCY, SHUTDOWN, STANDBY, STATUS};
use super::motion::moves;
use super::ra_client::RaClient;
use super::stop;
use super::target::Target;
use crate::Message;
use crate::gateway::counters::{Counter, Tally};
use crate::ids::RaComponent;
use jaus::messages::core::Standby;
use jaus::service::{MotionGuard, MotionPolicy, Stack, StopCause, Validity};

/// The signs of life of an RA client.
#[derive(Debug, Default)]
pub(super) struct ClientLife {
    /// The last message of the component itself.
    component: Option<Instant>,
    /// The last message of its subsystem.
    subsystem: Option<Instant>,
    /// Whether it has ever reported its status.
    answers: bool,
    probed: Option<Instant>,
}

impl ClientLife {
    /// The client is dead when it has been silent for so long: RA systems drop a subsystem then.
    const DEATH: Duration = Duration::from_secs(5);
    /// Between two questions for its status while it moves something, and else.
    const MOVING: Duration = Duration::from_millis(250);
    const SILENCE: Duration = Duration::from_secs(1);
    /// Heartbeats come once a second. One that comes half a second late is no reason to stop.
    const LATE: Duration = Duration::from_millis(500);

    /// A message with this code has come from the component.
    pub(super) fn hear(&mut self, now: Instant, code: u16) {
        self.component = Some(now);
        self.answers |= code == STATUS;
    }

    /// Its subsystem was heard last at this time.
    pub(super) fn hear_subsystem(&mut self, at: Instant) {
        self.subsystem = self.subsystem.max(Some(at));
    }

    /// The last sign of life, as the motion guard judges it.
    fn sign(&self) -> Option<Instant> {
        let heartbeat = self.subsystem.filter(|_| !self.answers);
        self.component.max(heartbeat.map(|at| at + Self::LATE))
    }

    fn dies_at(&self) -> Option<Instant> {
        let heartbeat = self.subsystem.filter(|_| !self.answers);
        let last = self.component.max(heartbeat)?;
        Some(last + Self::DEATH)
    }

    fn probe_at(&self, moving: bool) -> Option<Instant> {
        let interval = if moving { Self::MOVING } else { Self::SILENCE };
        let last = self.component.max(self.probed)?;
        Some(last + interval)
    }
}

/// The setpoint of an RA client at one JAUS component.
#[derive(Debug)]
pub(super) struct Hold {
    guard: MotionGuard,
    /// An effort, and when it is sent again.
    repeat: Option<(Bytes, Instant)>,
    /// The command that ends the setpoint.
    stop: Option<Bytes>,
}

impl Hold {
    /// Between two repetitions of an effort: JAUS vehicles stop after half a second without one.
    const REPEAT: Duration = Duration::from_millis(150);

    /// Nothing is set.
    pub(super) fn new() -> Self {
        Self {
            guard: MotionGuard::new(MotionPolicy::Hold),
            repeat: None,
            stop: None,
        }
    }

    /// Forgets the setpoint.
    fn clear(&mut self, cause: StopCause) {
        self.guard.stop(cause);
        self.repeat = None;
        self.stop = None;
    }

    /// The command that is due now: the stop, or the effort again.
    fn poll(&mut self, now: Instant, life: &ClientLife) -> Option<Bytes> {
        self.guard.note_life(|_| life.sign());
        if let Some(cause) = self.guard.expire(now) {
            let stop = self.stop.take();
            self.clear(cause);
            return stop;
        }
        let (payload, next) = self.repeat.as_mut().filter(|(_, next)| *next <= now)?;
        *next = now + Self::REPEAT;
        Some(payload.clone())
    }

    fn poll_timeout(&self) -> Option<Instant> {
        let repeat = self.repeat.as_ref().map(|(_, next)| *next);
        self.guard.expires_at().into_iter().chain(repeat).min()
    }
}

impl RaClient {
    /// Between two rejections that tell a client that it has no control.
    const REJECTION: Duration = Duration::from_secs(1);

    /// Whether the RA client has control of a JAUS component.
    fn controls(&self, peer: Target) -> bool {
        let mut held_controls = self.held_controls.values();
        held_controls.any(|it| it.held && it.peer == peer.id)
    }

    /// Refuses a command of a client that has no control, and tells it so: it may have had control
    /// through an earlier gateway with our id, and must request it anew.
    pub(super) fn refuse_uncontrolled(
        &mut self,
        now: Instant,
        request: &Message,
        peer: Target,
        tally: &mut Tally,
    ) -> bool {
        if self.controls(peer) {
            return false;
        }
        tally.refuse(now, Counter::NotInControl, request.code, request.source);
        if self.rejected.is_none_or(|at| now >= at + Self::REJECTION) {
            self.rejected = Some(now);
            self.reject_control(request);
        }
        true
    }

    /// Notes a command that has been sent to a JAUS component.
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

    /// Repeats what the client holds, stops it when the client is silent, and ends the control of a
    /// dead client. To be called before messages that have waited are handled.
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

    /// Whether the client should be asked for its status now, to show life.
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
        let moving = |it: &super::ra_client::HeldControl| it.hold.guard.is_active();
        self.life.probe_at(self.held_controls.values().any(moving))
    }

    /// When [`tend`](Self::tend) has something to do.
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

    /// Stops all JAUS components that the client controls, and ends its control of them.
    pub(super) fn end_control(&mut self, now: Instant, stack: &mut Stack) {
        for (id, mut held_control) in std::mem::take(&mut self.held_controls) {
            let (client, of) = (
                held_control.request.source,
                held_control.request.destination,
            );
            tracing::info!(%client, %of, "control ended: the RA client is dead or the gateway stops");
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
