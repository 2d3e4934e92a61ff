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
//! A setpoint also ends when another one replaces it, and on every [`StopCause`]. A setpoint that is
//! older than that, by its sender's order, [is not admitted](super::Context::admits_setpoint).
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
    /// What the client sends may be too old: the network holds it up.
    Late(JausId),
    /// The client has restarted: whoever commanded the motion is gone.
    Restarted(JausId),
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
            Self::Late(client) => write!(f, "what {client} sends arrives too late"),
            Self::Restarted(client) => write!(f, "{client} has restarted"),
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
        if !self.warns_of_expiry(setpoint, brief) {
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

    fn warns_of_expiry(&mut self, setpoint: &Setpoint, brief: Duration) -> bool {
        let is_slow = setpoint.interval.is_none_or(|interval| interval >= brief);
        is_slow && self.logged.replace(setpoint.owner) != Some(setpoint.owner)
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

#[cfg(test)]
#[expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]
mod tests {
    use super::*;
    use crate::service::Controller;

    const OWNER: JausId = JausId::new(42, 1, 1);
    const OTHER: JausId = JausId::new(42, 2, 1);
    const BRIEF: Duration = Duration::from_millis(200);
    const MOMENT: Duration = Duration::from_nanos(1);
    const EXPIRE: MotionPolicy = MotionPolicy::Expire(BRIEF);

    #[test]
    fn the_validity_of_a_command_follows_from_its_code() {
        for (codes, expected) in [
            (&[0x0405, 0x0406, 0x0409, 0x2407][..], Validity::Brief),
            (&[0x0407, 0x0408, 0x04A7, 0x04A8], Validity::WhileAlive),
            (
                &[
                    0x040A, 0x040C, 0x040D, 0x040F, 0x0410, 0x041E, 0x04AA, 0x04AC, 0x04AD, 0x04AE,
                    0x04AF, 0x04B0,
                ],
                Validity::UntilDone,
            ),
        ] {
            for &code in codes {
                assert_eq!(Validity::of(code), expected, "{code:04X}");
            }
        }
    }

    #[test]
    fn a_command_is_in_force_exactly_as_long_as_its_validity() {
        let silent = Some((MotionGuard::LIFE, StopCause::ControllerSilent(OWNER)));
        for (policy, validity, end) in [
            (
                EXPIRE,
                Validity::Brief,
                Some((BRIEF, StopCause::Expired(OWNER))),
            ),
            (MotionPolicy::Hold, Validity::Brief, silent.clone()),
            (EXPIRE, Validity::WhileAlive, silent.clone()),
            (MotionPolicy::Hold, Validity::WhileAlive, silent),
            (EXPIRE, Validity::UntilDone, None),
            (MotionPolicy::Hold, Validity::UntilDone, None),
        ] {
            let start = Instant::now();
            let mut guard = MotionGuard::new(policy);
            guard.accept(start, OWNER, validity);
            let at = end.as_ref().map(|(after, _)| start + *after);
            assert!(guard.is_active());
            assert_eq!(guard.expires_at(), at, "{policy:?} {validity:?}");
            let Some((end, (_, cause))) = at.zip(end) else {
                let later = start + Duration::from_secs(3600);
                assert_eq!((guard.expire(later), guard.depends_on()), (None, None));
                continue;
            };
            let silence_ends_it = cause == StopCause::ControllerSilent(OWNER);
            assert_eq!(guard.depends_on(), silence_ends_it.then_some(OWNER));
            assert_eq!(guard.expire(end - MOMENT), None);
            assert_eq!(guard.expire(end), Some(cause.clone()));
            assert_eq!(guard.last_stop(), Some(&cause));
            assert_eq!((guard.is_active(), guard.depends_on()), (false, None));
            assert_eq!(guard.expire(end), None, "a command ends once");
        }
    }

    #[test]
    fn the_policy_can_change_and_is_500_ms_by_default() {
        let start = Instant::now();
        let mut guard = MotionGuard::default();
        guard.accept(start, OWNER, Validity::Brief);
        assert_eq!(guard.expires_at(), Some(start + Duration::from_millis(500)));
        guard.set_policy(EXPIRE);
        assert_eq!(guard.expires_at(), Some(start + BRIEF));
        guard.set_policy(MotionPolicy::Expire(Duration::MAX));
        assert_eq!(guard.expires_at(), None, "forever");
    }

    #[test]
    fn only_the_latest_sign_of_life_of_the_owner_extends_a_command() {
        let start = Instant::now();
        let mut guard = MotionGuard::new(EXPIRE);
        guard.accept(start, OWNER, Validity::WhileAlive);
        let sign = start + Duration::from_millis(700);
        for (known, latest) in [(None, start), (Some(sign), sign), (Some(start), sign)] {
            guard.note_life(|id| known.filter(|_| id == OWNER));
            assert_eq!(guard.expires_at(), Some(latest + MotionGuard::LIFE));
        }
    }

    #[test]
    fn the_last_stop_is_that_of_a_command_that_was_in_force() {
        let start = Instant::now();
        let mut guard = MotionGuard::new(EXPIRE);
        guard.stop(StopCause::Requested);
        assert_eq!(guard.last_stop(), None, "nothing was in force");
        guard.accept(start, OWNER, Validity::UntilDone);
        guard.stop(StopCause::Emergency);
        guard.stop(StopCause::Requested);
        assert_eq!(guard.last_stop(), Some(&StopCause::Emergency));
        assert!(!guard.is_active());
        guard.accept(start, OWNER, Validity::UntilDone);
        assert_eq!(guard.last_stop(), None);
        guard.finish();
        assert_eq!((guard.is_active(), guard.last_stop()), (false, None));
    }

    #[test]
    fn only_the_first_expiry_of_a_client_that_repeats_too_slowly_is_a_warning() {
        let start = Instant::now();
        let warns = |guard: &mut MotionGuard| {
            let setpoint = guard.setpoint.unwrap();
            guard.warns_of_expiry(&setpoint, BRIEF)
        };
        for (interval, is_slow) in [(BRIEF - MOMENT, false), (BRIEF, true)] {
            let mut guard = MotionGuard::new(EXPIRE);
            guard.accept(start, OWNER, Validity::Brief);
            guard.accept(start + interval, OWNER, Validity::Brief);
            assert_eq!([warns(&mut guard), warns(&mut guard)], [is_slow, false]);
            guard.accept(start + interval, OTHER, Validity::Brief);
            assert!(warns(&mut guard), "another client, for the first time");
        }
        let mut guard = MotionGuard::new(EXPIRE);
        guard.accept(start, OWNER, Validity::WhileAlive);
        guard.accept(start, OWNER, Validity::Brief);
        assert!(warns(&mut guard), "a vector before it is no repetition");
    }

    #[test]
    fn the_cause_of_a_stop_follows_from_the_state_and_the_client_in_control() {
        let controlled = |state, id| Standing {
            state,
            exclusive: true,
            controller: Some(Controller { id, authority: 1 }),
            ..Standing::default()
        };
        let released = |state| Standing {
            controller: None,
            ..controlled(state, OWNER)
        };
        let before = controlled(State::Ready, OWNER);
        for (after, cause) in [
            (before, None),
            (
                controlled(State::Emergency, OWNER),
                Some(StopCause::Emergency),
            ),
            (released(State::Failure), Some(StopCause::Failure)),
            (released(State::Shutdown), Some(StopCause::Shutdown)),
            (released(State::Initialize), Some(StopCause::Standby)),
            (controlled(State::Standby, OWNER), Some(StopCause::Standby)),
            (released(State::Standby), Some(StopCause::ControlChanged)),
            (
                controlled(State::Ready, OTHER),
                Some(StopCause::ControlChanged),
            ),
        ] {
            assert_eq!(StopCause::of(&before, &after), cause, "{after:?}");
        }
    }

    #[test]
    fn a_cause_names_the_client_and_the_time() {
        let late = Duration::from_millis(2500);
        for (cause, expected) in [
            (
                StopCause::Expired(OWNER),
                "42.1.1 did not repeat its command in time",
            ),
            (StopCause::ControllerSilent(OWNER), "42.1.1 is silent"),
            (StopCause::Restarted(OWNER), "42.1.1 has restarted"),
            (StopCause::Late(OWNER), "what 42.1.1 sends arrives too late"),
            (StopCause::Fault("no current".to_owned()), "no current"),
            (StopCause::PoseStale(late), "the pose is 2.5 s old"),
            (StopCause::Hung(late), "the component was delayed for 2.5 s"),
        ] {
            assert_eq!(cause.to_string(), expected);
        }
    }
}
