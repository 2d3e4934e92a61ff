//! Holds the setpoints of an RA client at the JAUS components that it controls.
//!
//! RA clients send an effort once or at a low rate, as RA components keep the last one. A JAUS
//! vehicle stops half a second after the last effort. The gateway therefore repeats the effort as
//! long as the client is alive: proven by any message of the component, whose status is queried;
//! for a component that has never answered that, by any message of its subsystem, such as the
//! heartbeat. As the gateway itself answers liveness probes of JAUS vehicles, it also stops vectors
//! of a silent client, and ends the control of a dead one.

use std::time::{Duration, Instant};

use bytes::Bytes;

use super::codes::{RESET, SET_EMERGENCY, SHUTDOWN, STANDBY, STATUS};
use super::motion::moves;
use super::ra_client::RaClient;
use super::stop;
use super::target::{RaRequest, Target};
use crate::Message;
use crate::gateway::counters::Counter;
use crate::ids::RaComponent;
use jaus::messages::core::Standby;
use jaus::service::{MotionGuard, MotionPolicy, Stack, StopCause, Validity};

/// Signs of life of an RA client.
#[derive(Debug, Default)]
pub(super) struct ClientLife {
    /// Time of the component's last message.
    component: Option<Instant>,
    /// Time of its subsystem's last message.
    subsystem: Option<Instant>,
    /// Whether it has ever reported its status.
    answers: bool,
    probed: Option<Instant>,
}

impl ClientLife {
    /// Timeout of a dead client: RA systems drop a subsystem after the same time.
    const DEATH: Duration = Duration::from_secs(5);
    /// Interval of status queries while it moves something, and otherwise.
    const MOVING: Duration = Duration::from_millis(250);
    const SILENCE: Duration = Duration::from_secs(1);
    /// Heartbeats come once per second. A delay of half a second is no reason to stop.
    const LATE: Duration = Duration::from_millis(500);

    /// Notes a message of the component with this code.
    pub(super) fn hear(&mut self, now: Instant, code: u16) {
        self.component = Some(now);
        self.answers |= code == STATUS;
    }

    /// Notes the time of the subsystem's last message.
    pub(super) fn hear_subsystem(&mut self, at: Instant) {
        self.subsystem = self.subsystem.max(Some(at));
    }

    /// The last sign of life for the motion guard.
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

/// Setpoint of an RA client at one JAUS component.
#[derive(Debug)]
pub(super) struct Hold {
    guard: MotionGuard,
    /// An effort and the time of its next repetition.
    repeat: Option<(Bytes, Instant)>,
    /// Command that stops the motion.
    stop: Option<Bytes>,
}

impl Hold {
    /// Repetition interval of an effort: JAUS vehicles stop after half a second without one.
    const REPEAT: Duration = Duration::from_millis(150);

    /// No setpoint.
    pub(super) fn new() -> Self {
        Self {
            guard: MotionGuard::new(MotionPolicy::Hold),
            repeat: None,
            stop: None,
        }
    }

    /// Clears the setpoint.
    fn clear(&mut self, cause: StopCause) {
        self.guard.stop(cause);
        self.repeat = None;
        self.stop = None;
    }

    /// The due command: the stop, or the repeated effort.
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
        let moving = |it: &super::ra_client::HeldControl| it.hold.guard.is_active();
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
