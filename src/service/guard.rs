//! The motion guard: decides how long a command may keep something moving.
//!
//! A command is a setpoint with an owner and a [`Validity`]. The vehicle may move while the
//! setpoint is in force. When it ends, the vehicle stops, and only a new command moves it again.
//!
//! | command | in force until |
//! |---|---|
//! | effort, velocity ([`Validity::Brief`]) | 500 ms have passed; like a vector under [`MotionPolicy::Hold`] |
//! | vector ([`Validity::WhileAlive`]) | its owner has shown no life for 1 s |
//! | goal ([`Validity::UntilDone`]) | it is reached |
//!
//! A setpoint also ends when another one replaces it, and on every [`StopCause`].
//! [`Handlers`](super::Handlers) and the vehicle services of the crate `jaus-vehicle` have a guard
//! each. The [`Stack`](super::Stack) reports changes of the component's state and control to it.

use std::fmt;
use std::time::{Duration, Instant};

use super::{Standing, State};
use crate::address::JausId;

/// How long a command stays in force.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Validity {
    /// Briefly, as set by [`MotionPolicy`]: effort and velocity.
    Brief,
    /// As long as its owner shows life within [`MotionGuard::LIFE`]: a speed and a heading.
    WhileAlive,
    /// Until it is done, as long as control lasts: waypoints, lists, path segments.
    UntilDone,
}

impl Validity {
    /// The validity of a command of the mobility services (AS6009) by message code. Any other
    /// command is brief, which is the safe choice.
    #[must_use]
    pub const fn of(code: u16) -> Self {
        match code {
            // Set Global Vector, Set Local Vector, and their Ext forms.
            0x0407 | 0x0408 | 0x04A7 | 0x04A8 => Self::WhileAlive,
            // Set Travel Speed, Set Global Waypoint, Set Local Waypoint, Set Global and Local Path
            // Segment, Execute List, and their Ext forms.
            0x040A | 0x040C | 0x040D | 0x040F | 0x0410 | 0x041E | 0x04AA | 0x04AC | 0x04AD
            | 0x04AF | 0x04B0 | 0x04AE => Self::UntilDone,
            _ => Self::Brief,
        }
    }
}

/// How long efforts and velocities last if the client does not repeat them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MotionPolicy {
    /// They end after this time.
    Expire(Duration),
    /// They last while their client shows life within [`MotionGuard::LIFE`]. For clients that send
    /// once or slowly, such as those of the public competitions and those behind the gateway.
    Hold,
}

impl MotionPolicy {
    /// The default validity of an effort or a velocity.
    pub const BRIEF: Duration = Duration::from_millis(500);
}

impl Default for MotionPolicy {
    fn default() -> Self {
        Self::Expire(Self::BRIEF)
    }
}

/// Why something was stopped.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum StopCause {
    /// The client did not repeat its command in time.
    Expired(JausId),
    /// The client has shown no life.
    ControllerSilent(JausId),
    /// Control was released, lost, or taken over.
    ControlChanged,
    /// The component is in standby, or restarts.
    Standby,
    /// The application has stopped it.
    Requested,
    /// A client or a stop input has set an emergency.
    Emergency,
    /// Something is broken.
    Failure,
    /// The component shuts down.
    Shutdown,
    /// An actuator or a sensor reports a fault.
    Fault(String),
    /// The pose is too old to steer by.
    PoseStale(Duration),
    /// The pose is unknown.
    PoseUnknown,
    /// The component's task did not run for this time.
    Hung(Duration),
    /// The component or its node has ended, or has panicked.
    Ended,
}

impl StopCause {
    /// The cause of the stop that a change of the component's state or control requires, if any.
    pub(super) fn of(before: &Standing, after: &Standing) -> Option<Self> {
        after.stops(before).then_some(match after.state {
            State::Emergency => Self::Emergency,
            State::Failure => Self::Failure,
            State::Shutdown => Self::Shutdown,
            State::Initialize => Self::Standby,
            State::Standby | State::Ready if before.controller != after.controller => {
                Self::ControlChanged
            }
            State::Standby | State::Ready => Self::Standby,
        })
    }
}

impl fmt::Display for StopCause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Expired(client) => write!(f, "{client} did not repeat its command in time"),
            Self::ControllerSilent(client) => write!(f, "{client} is silent"),
            Self::ControlChanged => f.write_str("control was released, lost or taken over"),
            Self::Standby => f.write_str("the component is in standby"),
            Self::Requested => f.write_str("the application stopped it"),
            Self::Emergency => f.write_str("emergency"),
            Self::Failure => f.write_str("the component failed"),
            Self::Shutdown => f.write_str("the component is shutting down"),
            Self::Fault(what) => f.write_str(what),
            Self::PoseStale(age) => write!(f, "the pose is {:.1} s old", age.as_secs_f64()),
            Self::Hung(gap) => {
                write!(
                    f,
                    "the component was delayed for {:.1} s",
                    gap.as_secs_f64()
                )
            }
            Self::PoseUnknown => f.write_str("the pose is unknown"),
            Self::Ended => f.write_str("the component ended"),
        }
    }
}

/// Keeps the setpoint in force and its end.
#[derive(Debug, Default)]
pub struct MotionGuard {
    policy: MotionPolicy,
    setpoint: Option<Setpoint>,
    /// Owner and time of the last brief command, to measure how often a client repeats.
    last: Option<(JausId, Instant)>,
    /// The client whose first expiry has been logged.
    logged: Option<JausId>,
    last_stop: Option<StopCause>,
}

#[derive(Debug, Clone, Copy)]
struct Setpoint {
    owner: JausId,
    validity: Validity,
    since: Instant,
    /// The last known sign of life of the owner.
    alive: Instant,
    /// Time between the owner's last two brief commands.
    interval: Option<Duration>,
}

impl MotionGuard {
    /// A vector, or an effort under [`MotionPolicy::Hold`], ends when its owner has been silent for
    /// this time.
    pub const LIFE: Duration = Duration::from_secs(1);

    /// A guard with nothing in force.
    #[must_use]
    pub fn new(policy: MotionPolicy) -> Self {
        Self {
            policy,
            ..Self::default()
        }
    }

    /// Sets how long efforts and velocities last if they are not repeated.
    pub const fn set_policy(&mut self, policy: MotionPolicy) {
        self.policy = policy;
    }

    /// Puts a command of `owner` in force, in place of any earlier one.
    pub fn accept(&mut self, now: Instant, owner: JausId, validity: Validity) {
        let before = self.last.filter(|(id, _)| *id == owner);
        self.last = (validity == Validity::Brief).then_some((owner, now));
        self.last_stop = None;
        self.setpoint = Some(Setpoint {
            owner,
            validity,
            since: now,
            alive: now,
            interval: before.map(|(_, at)| now.saturating_duration_since(at)),
        });
    }

    /// Notes the owner's last sign of life, if known.
    pub fn note_life(&mut self, last_sign: impl FnOnce(JausId) -> Option<Instant>) {
        if let Some(setpoint) = &mut self.setpoint
            && let Some(sign) = last_sign(setpoint.owner)
        {
            setpoint.alive = setpoint.alive.max(sign);
        }
    }

    /// When the setpoint in force ends, as far as known now.
    #[must_use]
    pub fn expires_at(&self) -> Option<Instant> {
        let setpoint = self.setpoint?;
        match (setpoint.validity, self.policy) {
            (Validity::UntilDone, _) => None,
            // A sum that overflows never expires: such a duration means "forever".
            (Validity::Brief, MotionPolicy::Expire(brief)) => setpoint.since.checked_add(brief),
            (Validity::Brief, MotionPolicy::Hold) | (Validity::WhileAlive, _) => {
                Some(setpoint.alive + Self::LIFE)
            }
        }
    }

    /// Ends the setpoint if it has expired, and returns the cause of the stop.
    #[must_use]
    pub fn expire(&mut self, now: Instant) -> Option<StopCause> {
        if self.expires_at().is_none_or(|end| end > now) {
            return None;
        }
        let setpoint = self.setpoint?;
        let cause = if self.life_matters() {
            tracing::warn!(client = %setpoint.owner, "stopped: the client is silent");
            StopCause::ControllerSilent(setpoint.owner)
        } else {
            self.log_expiry(&setpoint);
            StopCause::Expired(setpoint.owner)
        };
        self.stop(cause.clone());
        Some(cause)
    }

    /// Warns about the first expiry of a client that repeats its commands too slowly. Other
    /// expiries are the normal end of driving.
    fn log_expiry(&mut self, setpoint: &Setpoint) {
        let client = setpoint.owner;
        let MotionPolicy::Expire(brief) = self.policy else {
            return;
        };
        if setpoint.interval.is_some_and(|interval| interval < brief)
            || self.logged.replace(client) == Some(client)
        {
            tracing::debug!(%client, "stopped: the command expired");
            return;
        }
        let interval = setpoint.interval.map_or_else(
            || "sent it once".to_owned(),
            |interval| format!("sends every {:.2} s", interval.as_secs_f64()),
        );
        tracing::warn!(
            %client,
            "stopped: a command is valid for {:.2} s, but the client {interval}; let it send more \
             often, or choose the motion policy \"hold\"",
            brief.as_secs_f64()
        );
    }

    /// Ends the setpoint, if there is one.
    pub fn stop(&mut self, cause: StopCause) {
        if self.setpoint.take().is_some() {
            self.last_stop = Some(cause);
        }
    }

    /// Ends the setpoint because its goal is reached.
    pub const fn finish(&mut self) {
        self.setpoint = None;
    }

    /// Whether a setpoint is in force.
    #[must_use]
    pub const fn is_active(&self) -> bool {
        self.setpoint.is_some()
    }

    /// The client whose liveness the motion depends on now.
    #[must_use]
    pub fn depends_on(&self) -> Option<JausId> {
        let setpoint = self.setpoint.filter(|_| self.life_matters());
        setpoint.map(|setpoint| setpoint.owner)
    }

    /// What ended the last setpoint, unless it reached its goal or another command replaced it.
    #[must_use]
    pub const fn last_stop(&self) -> Option<&StopCause> {
        self.last_stop.as_ref()
    }

    fn life_matters(&self) -> bool {
        let validity = self.setpoint.map(|setpoint| setpoint.validity);
        match (validity, self.policy) {
            (Some(Validity::WhileAlive), _) | (Some(Validity::Brief), MotionPolicy::Hold) => true,
            (Some(Validity::UntilDone | Validity::Brief) | None, _) => false,
        }
    }
}
