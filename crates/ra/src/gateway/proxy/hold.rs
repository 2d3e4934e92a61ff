//! The setpoint that the gateway holds for an RA client at a JAUS component, and the client's signs of
//! life.
//!
//! RA clients send an effort once or at a low rate, as RA components keep the last one. A JAUS
//! vehicle stops half a second after the last effort. The gateway therefore repeats the effort as
//! long as the client is alive: proven by any message of the component, whose status is queried;
//! for a component that has never answered that, by any message of its subsystem, such as the
//! heartbeat.

use std::time::{Duration, Instant};

use bytes::Bytes;

use super::codes::STATUS;
use jaus::service::{MotionGuard, MotionPolicy, StopCause};

/// Signs of life of an RA client.
#[derive(Debug, Default)]
pub(super) struct ClientLife {
    /// Time of the component's last message.
    component: Option<Instant>,
    /// Time of its subsystem's last message.
    subsystem: Option<Instant>,
    /// Whether it has ever reported its status.
    answers: bool,
    /// When the component was last asked for its status.
    pub(super) probed: Option<Instant>,
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
    pub(super) fn sign(&self) -> Option<Instant> {
        let heartbeat = self.subsystem.filter(|_| !self.answers);
        self.component.max(heartbeat.map(|at| at + Self::LATE))
    }

    pub(super) fn dies_at(&self) -> Option<Instant> {
        let heartbeat = self.subsystem.filter(|_| !self.answers);
        let last = self.component.max(heartbeat)?;
        Some(last + Self::DEATH)
    }

    pub(super) fn probe_at(&self, moving: bool) -> Option<Instant> {
        let interval = if moving { Self::MOVING } else { Self::SILENCE };
        let last = self.component.max(self.probed)?;
        Some(last + interval)
    }
}

/// Setpoint of an RA client at one JAUS component.
#[derive(Debug)]
pub(super) struct Hold {
    pub(super) guard: MotionGuard,
    /// An effort and the time of its next repetition.
    pub(super) repeat: Option<(Bytes, Instant)>,
    /// Command that stops the motion.
    pub(super) stop: Option<Bytes>,
}

impl Hold {
    /// Repetition interval of an effort: JAUS vehicles stop after half a second without one.
    pub(super) const REPEAT: Duration = Duration::from_millis(150);

    /// No setpoint.
    pub(super) fn new() -> Self {
        Self {
            guard: MotionGuard::new(MotionPolicy::Hold),
            repeat: None,
            stop: None,
        }
    }

    /// Clears the setpoint.
    pub(super) fn clear(&mut self, cause: StopCause) {
        self.guard.stop(cause);
        self.repeat = None;
        self.stop = None;
    }

    /// The due command: the stop, or the repeated effort.
    pub(super) fn poll(&mut self, now: Instant, life: &ClientLife) -> Option<Bytes> {
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

    pub(super) fn poll_timeout(&self) -> Option<Instant> {
        let repeat = self.repeat.as_ref().map(|(_, next)| *next);
        self.guard.expires_at().into_iter().chain(repeat).min()
    }
}
