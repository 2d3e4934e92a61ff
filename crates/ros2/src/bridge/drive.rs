//! Driving by `cmd_vel`: which publisher drives, how long a command is valid, and when control of the
//! vehicle is wanted. It does no I/O and reads no clock.

use std::time::{Duration, Instant};

use super::ports::Command;
use super::publishers::{Outdated, Publishers};
use super::velocity::{InvalidVelocity, Limits, Velocity};
use crate::graph::Gid;

/// The times and limits of driving.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DriveSettings {
    /// How long a command is valid: without another one for this time, the vehicle stops.
    pub timeout: Duration,
    /// How long control is kept after the last command that moves.
    pub hold: Duration,
    /// The limits of commands.
    pub limits: Limits,
}

impl Default for DriveSettings {
    /// 500 ms, 5 s, and the limits of a small rover: 2 m/s and 1.5 rad/s.
    fn default() -> Self {
        Self {
            timeout: Duration::from_millis(500),
            hold: Duration::from_secs(5),
            limits: Limits {
                speed: 2.0,
                yaw_rate: 1.5,
            },
        }
    }
}

/// The bridge's access to a component of the vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Access {
    /// It was requested, or the driver is being made ready.
    Pending,
    /// The driver obeys.
    Ready,
    /// Control was refused or lost, or the driver is in an emergency, a failure or in standby.
    Lost,
}

/// Why a command has no effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Refusal {
    /// The velocity cannot be commanded.
    #[error("{0}")]
    Invalid(#[from] InvalidVelocity),
    /// Another publisher drives.
    #[error("another publisher drives; it keeps the vehicle until it is silent")]
    OtherPublisher,
    /// The command is too old.
    #[error("{0}")]
    Outdated(#[from] Outdated),
    /// Control was lost or driving was ended, and the publisher has not stopped or paused since.
    #[error("driving was ended: publish zero or pause before driving again")]
    Locked,
}

/// Driving by the commands of one publisher at a time.
#[derive(Debug)]
pub struct Drive {
    settings: DriveSettings,
    phase: Phase,
    access: Access,
    /// The last command that moves; control is kept for some time after it.
    moved: Option<Instant>,
    publishers: Publishers,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Phase {
    /// No publisher drives, and the vehicle has confirmed it.
    Rest,
    Driven {
        publisher: Gid,
        velocity: Velocity,
        heard: Instant,
    },
    /// No publisher drives any more, and the vehicle is being stopped.
    Stopping { since: Instant },
}

impl Drive {
    /// Maximum time to repeat the stop command without an acknowledgement. By then the vehicle's own
    /// timeout has stopped it.
    pub const STOPPING: Duration = Duration::from_secs(3);

    /// At rest, without control.
    #[must_use]
    pub const fn new(settings: DriveSettings) -> Self {
        Self {
            settings,
            phase: Phase::Rest,
            access: Access::Pending,
            moved: None,
            publishers: Publishers::new(settings.timeout),
        }
    }

    /// Handles a command.
    ///
    /// # Errors
    /// The reason why it has no effect. If the publisher drives and the velocity is invalid, or zero and
    /// outdated, the vehicle stops nevertheless.
    pub fn handle_command(&mut self, now: Instant, command: &Command) -> Result<(), Refusal> {
        self.handle_time(now);
        let publisher = command.publisher;
        let velocity = self.settings.limits.velocity(&command.twist);
        let moves = velocity != Ok(Velocity::ZERO);
        let driver = self.publisher();
        if let Err(outdated) = self.publishers.check(now, command, moves) {
            // A sample with a copied gid may have taken its number, and a stop counts whatever its number is.
            if !moves && driver == Some(publisher) {
                self.stop(now);
            }
            return Err(outdated.into());
        }
        if driver.is_some_and(|driver| driver != publisher) {
            return Err(Refusal::OtherPublisher);
        }
        let velocity = velocity.inspect_err(|_| self.stop(now))?;
        if self.publishers.is_blocked(publisher) {
            return Err(Refusal::Locked);
        }
        if moves {
            self.moved = Some(now);
        } else if driver.is_none() {
            // The vehicle is not driven, so there is nothing to stop.
            return Ok(());
        }
        self.phase = Phase::Driven {
            publisher,
            velocity,
            heard: command.arrival,
        };
        Ok(())
    }

    /// Handles the end of a publisher. If it drives, the vehicle stops at once. Returns whether it
    /// drove.
    pub fn handle_publisher_gone(&mut self, now: Instant, publisher: Gid) -> bool {
        self.handle_time(now);
        self.publishers.handle_gone(now, publisher);
        let drove = self.publisher() == Some(publisher);
        if drove {
            self.stop(now);
        }
        drove
    }

    /// Handles a change of access to the driver. After a loss, each publisher that sends commands has
    /// to stop or pause before it can drive again: a command of before must not move the vehicle
    /// later.
    pub fn handle_access(&mut self, now: Instant, access: Access) {
        let is_new = self.access != access;
        self.access = access;
        if access == Access::Lost && is_new && self.moved.is_some() {
            self.phase = Phase::Rest;
            self.moved = None;
            self.publishers.block(now);
        }
    }

    /// Ends driving and the need for control, for a reason for which each publisher has to stop or
    /// pause before it drives again: a goal, a release, an emergency, or the loss of the ROS network.
    pub fn halt(&mut self, now: Instant) {
        self.publishers.block(now);
        self.stop(now);
        self.moved = None;
    }

    /// Handles the vehicle's acknowledgement of a stop.
    pub fn handle_stopped(&mut self) {
        if matches!(self.phase, Phase::Stopping { .. }) {
            self.phase = Phase::Rest;
        }
    }

    /// Applies the timeouts.
    pub fn handle_time(&mut self, now: Instant) {
        let timeout = self.settings.timeout;
        match self.phase {
            Phase::Driven { heard, .. } if now >= heard + timeout => self.stop(now),
            Phase::Stopping { since } if now >= since + Self::STOPPING => self.phase = Phase::Rest,
            _ => {}
        }
        let is_at_rest = self.publisher().is_none() || self.velocity() == Velocity::ZERO;
        if is_at_rest
            && self
                .moved
                .is_some_and(|moved| now >= moved + self.settings.hold)
        {
            self.moved = None;
            // With a short hold time, the zero of the publisher may not have reached the vehicle.
            self.stop(now);
        }
    }

    fn stop(&mut self, now: Instant) {
        if matches!(self.phase, Phase::Driven { .. }) {
            self.phase = Phase::Stopping { since: now };
        }
    }

    /// Whether control of the driver is wanted.
    #[must_use]
    pub const fn wants_control(&self) -> bool {
        self.moved.is_some() || matches!(self.phase, Phase::Stopping { .. })
    }

    /// Whether a publisher moves the vehicle.
    #[must_use]
    pub fn is_moving(&self) -> bool {
        self.velocity() != Velocity::ZERO
    }

    /// The velocity to command now; `None` without a driver that obeys, and at rest.
    #[must_use]
    pub fn poll_velocity(&mut self, now: Instant) -> Option<Velocity> {
        self.handle_time(now);
        if self.access != Access::Ready {
            // Without control, earlier commands do not affect the vehicle any more.
            self.handle_stopped();
            return None;
        }
        match self.phase {
            Phase::Rest => None,
            Phase::Driven { velocity, .. } => Some(velocity),
            Phase::Stopping { .. } => Some(Velocity::ZERO),
        }
    }

    /// The publisher that drives.
    #[must_use]
    pub const fn publisher(&self) -> Option<Gid> {
        match self.phase {
            Phase::Driven { publisher, .. } => Some(publisher),
            Phase::Rest | Phase::Stopping { .. } => None,
        }
    }

    const fn velocity(&self) -> Velocity {
        match self.phase {
            Phase::Driven { velocity, .. } => velocity,
            Phase::Rest | Phase::Stopping { .. } => Velocity::ZERO,
        }
    }
}

#[cfg(test)]
#[expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]
mod tests {
    use std::cell::Cell;
    use std::sync::OnceLock;

    use super::super::velocity::Twist;
    use super::*;

    const ONE: Gid = Gid([1; 16]);
    const OTHER: Gid = Gid([2; 16]);

    fn ms(ms: u64) -> Duration {
        Duration::from_millis(ms)
    }

    /// A command forward that arrives now, later than all before.
    fn command(now: Instant, publisher: Gid, forward: f64) -> Command {
        static FIRST: OnceLock<Instant> = OnceLock::new();
        // Other tests run in other threads, and must not cause gaps.
        thread_local! {
            static SEQUENCE: Cell<i64> = const { Cell::new(1) };
        }
        let passed = now.saturating_duration_since(*FIRST.get_or_init(|| now));
        Command {
            publisher,
            session: publisher,
            sequence: SEQUENCE.with(|it| it.replace(it.get() + 1)),
            stamp: i64::try_from(passed.as_nanos()).unwrap(),
            arrival: now,
            twist: Twist {
                linear: [forward, 0.0, 0.0],
                ..Twist::default()
            },
        }
    }

    fn ahead() -> Velocity {
        Velocity {
            forward: 1.0,
            ..Velocity::ZERO
        }
    }

    /// Under control and driven at 1 m/s since now.
    fn driven(now: Instant) -> Drive {
        let mut drive = Drive::new(DriveSettings::default());
        drive.handle_command(now, &command(now, ONE, 1.0)).unwrap();
        drive.handle_access(now, Access::Ready);
        assert_eq!(drive.poll_velocity(now), Some(ahead()));
        drive
    }

    #[test]
    fn the_first_command_wants_control_and_is_sent_once_the_driver_obeys() {
        let start = Instant::now();
        let mut drive = Drive::new(DriveSettings::default());
        assert!(!drive.wants_control());
        drive
            .handle_command(start, &command(start, ONE, 1.0))
            .unwrap();
        assert!(drive.wants_control());
        assert_eq!(drive.poll_velocity(start + ms(100)), None);
        drive.handle_access(start + ms(200), Access::Ready);
        assert_eq!(drive.poll_velocity(start + ms(200)), Some(ahead()));
    }

    #[test]
    fn a_copied_gid_does_not_suppress_the_stop_of_the_publisher_that_drives() {
        let start = Instant::now();
        for number in [0, 1, 90, 1_i64 << 62] {
            let mut drive = driven(start);
            let now = start + ms(100);
            let copied = command(now, ONE, 1.0);
            let mut stop = command(now + ms(1), ONE, 0.0);
            stop.sequence = copied.sequence;
            let ahead_of_it = Command {
                sequence: copied.sequence + number,
                ..copied
            };
            let _taken = drive.handle_command(now, &ahead_of_it);
            let refused = drive.handle_command(now + ms(1), &stop);
            assert_eq!(refused.is_err(), number < 1 << 62, "{number}");
            assert!(!drive.is_moving(), "{number}");
            assert_eq!(drive.poll_velocity(now + ms(1)), Some(Velocity::ZERO));
        }
    }

    #[test]
    fn a_command_that_got_old_before_control_was_granted_is_never_sent() {
        let start = Instant::now();
        let mut drive = Drive::new(DriveSettings::default());
        drive
            .handle_command(start, &command(start, ONE, 1.0))
            .unwrap();
        assert_eq!(drive.poll_velocity(start + ms(500)), None);
        drive.handle_access(start + ms(600), Access::Ready);
        assert_eq!(drive.poll_velocity(start + ms(600)), None);
    }

    #[test]
    fn to_stand_still_needs_no_control() {
        let start = Instant::now();
        let mut drive = Drive::new(DriveSettings::default());
        drive
            .handle_command(start, &command(start, ONE, 0.0))
            .unwrap();
        assert!(!drive.wants_control());
    }

    #[test]
    fn after_half_a_second_without_a_command_the_vehicle_is_stopped_until_it_confirms() {
        let start = Instant::now();
        let mut drive = driven(start);
        assert_eq!(drive.poll_velocity(start + ms(499)), Some(ahead()));
        assert_eq!(drive.poll_velocity(start + ms(500)), Some(Velocity::ZERO));
        assert_eq!(drive.poll_velocity(start + ms(900)), Some(Velocity::ZERO));
        drive.handle_stopped();
        assert_eq!(drive.poll_velocity(start + ms(950)), None);
    }

    #[test]
    fn control_is_kept_for_the_hold_time_and_then_released() {
        let start = Instant::now();
        let mut drive = driven(start);
        drive.handle_time(start + ms(500));
        drive.handle_stopped();
        drive.handle_time(start + ms(4999));
        assert!(drive.wants_control());
        drive.handle_time(start + ms(5000));
        assert!(!drive.wants_control());
    }

    #[test]
    fn a_publisher_that_repeats_zero_for_ever_keeps_control_no_longer_than_the_hold_time() {
        let start = Instant::now();
        let mut drive = driven(start);
        for step in 1..=50 {
            let now = start + ms(100 * step);
            drive.handle_command(now, &command(now, ONE, 0.0)).unwrap();
            drive.handle_time(now);
            // The vehicle acknowledges each zero.
            drive.handle_stopped();
            assert_eq!(drive.wants_control(), step < 50, "{step}");
        }
    }

    #[test]
    fn a_publisher_that_moves_keeps_control_for_as_long_as_it_moves() {
        let start = Instant::now();
        let mut drive = driven(start);
        for step in 1..=100 {
            let now = start + ms(100 * step);
            drive.handle_command(now, &command(now, ONE, 1.0)).unwrap();
            assert_eq!(drive.poll_velocity(now), Some(ahead()));
            assert!(drive.wants_control());
        }
    }

    #[test]
    fn the_end_of_the_publisher_stops_the_vehicle_at_once_and_that_of_another_does_not() {
        let start = Instant::now();
        let mut drive = driven(start);
        drive.handle_publisher_gone(start, OTHER);
        assert_eq!(drive.poll_velocity(start), Some(ahead()));
        drive.handle_publisher_gone(start, ONE);
        assert_eq!(drive.poll_velocity(start), Some(Velocity::ZERO));
    }

    #[test]
    fn a_command_that_is_refused_stops_the_vehicle_that_its_publisher_drives() {
        let start = Instant::now();
        let mut drive = driven(start);
        let refused = drive.handle_command(start, &command(start, OTHER, f64::NAN));
        assert_eq!(refused, Err(Refusal::OtherPublisher));
        assert_eq!(drive.poll_velocity(start), Some(ahead()));
        let refused = drive.handle_command(start, &command(start, ONE, 9.0));
        assert_eq!(refused, Err(InvalidVelocity::Speed.into()));
        assert_eq!(drive.poll_velocity(start), Some(Velocity::ZERO));
    }

    #[test]
    fn the_second_publisher_drives_once_the_first_is_silent() {
        let start = Instant::now();
        let mut drive = driven(start);
        let early = drive.handle_command(start + ms(499), &command(start + ms(499), OTHER, -1.0));
        assert_eq!(early, Err(Refusal::OtherPublisher));
        let later = start + ms(500);
        drive
            .handle_command(later, &command(later, OTHER, -1.0))
            .unwrap();
        assert_eq!(drive.publisher(), Some(OTHER));
    }

    #[test]
    fn after_a_loss_of_control_a_publisher_that_goes_on_moves_nothing_until_it_stops_or_pauses() {
        let start = Instant::now();
        let stops = |drive: &mut Drive, now| {
            drive.handle_command(now, &command(now, ONE, 0.0)).unwrap();
            now
        };
        let pauses = |_: &mut Drive, now| now + ms(500);
        for (name, ends) in [
            ("stop", &stops as &dyn Fn(&mut Drive, Instant) -> Instant),
            ("pause", &pauses),
        ] {
            let mut drive = driven(start);
            drive.handle_access(start + ms(50), Access::Lost);
            assert!(!drive.wants_control(), "{name}");
            for step in 1..=50 {
                let now = start + ms(100 * step);
                let refused = drive.handle_command(now, &command(now, ONE, 1.0));
                assert_eq!(refused, Err(Refusal::Locked), "{name}");
                assert!(!drive.wants_control(), "{name}");
            }
            let now = ends(&mut drive, start + ms(5000));
            drive.handle_command(now, &command(now, ONE, 1.0)).unwrap();
            assert!(drive.wants_control(), "{name}");
            assert_eq!(
                drive.poll_velocity(now),
                None,
                "{name}: not granted again yet"
            );
            drive.handle_access(now, Access::Pending);
            drive.handle_access(now, Access::Ready);
            assert_eq!(drive.poll_velocity(now), Some(ahead()), "{name}");
        }
    }

    #[test]
    fn a_halt_stops_and_gives_up_control_once_the_vehicle_has_stopped() {
        let start = Instant::now();
        let mut drive = driven(start);
        drive.halt(start);
        assert_eq!(drive.poll_velocity(start), Some(Velocity::ZERO));
        assert!(drive.wants_control());
        let refused = drive.handle_command(start, &command(start, ONE, 1.0));
        assert_eq!(refused, Err(Refusal::Locked));
        drive.handle_stopped();
        assert!(!drive.wants_control());
    }

    #[test]
    fn a_stop_that_is_never_confirmed_ends_after_three_seconds() {
        let start = Instant::now();
        let mut drive = driven(start);
        drive.halt(start);
        let end = start + Drive::STOPPING;
        assert_eq!(drive.poll_velocity(end - ms(1)), Some(Velocity::ZERO));
        assert_eq!(drive.poll_velocity(end), None);
        assert!(!drive.wants_control());
    }

    #[test]
    fn after_a_halt_no_publisher_that_goes_on_moves_the_vehicle_whatever_another_one_sends() {
        let start = Instant::now();
        let mut drive = driven(start);
        let refused = drive.handle_command(start, &command(start, OTHER, -1.0));
        assert_eq!(refused, Err(Refusal::OtherPublisher));
        drive.halt(start);
        for step in 1..=20 {
            let now = start + ms(100 * step);
            let idle = Gid([3; 16]);
            let stands = drive.handle_command(now, &command(now, idle, 0.0));
            assert_eq!(stands, Ok(()));
            for publisher in [ONE, OTHER] {
                let refused = drive.handle_command(now, &command(now, publisher, 1.0));
                assert_eq!(refused, Err(Refusal::Locked), "{publisher}");
            }
            assert!(!drive.is_moving());
        }
        // A stop of one of them allows nothing to the other one.
        let now = start + ms(2100);
        drive
            .handle_command(now, &command(now, OTHER, 0.0))
            .unwrap();
        let refused = drive.handle_command(now, &command(now, ONE, 1.0));
        assert_eq!(refused, Err(Refusal::Locked));
        drive
            .handle_command(now, &command(now, OTHER, 1.0))
            .unwrap();
        assert_eq!(drive.publisher(), Some(OTHER));
    }

    #[test]
    fn after_a_halt_a_publisher_that_begins_drives_at_once() {
        let start = Instant::now();
        let mut drive = driven(start);
        drive.halt(start);
        drive
            .handle_command(start, &command(start, OTHER, 1.0))
            .unwrap();
        assert_eq!(drive.poll_velocity(start), Some(ahead()));
    }

    #[test]
    fn a_hold_time_below_the_timeout_does_not_swallow_the_stop() {
        let settings = DriveSettings {
            hold: ms(50),
            ..DriveSettings::default()
        };
        for last in [1.0, 0.0] {
            let start = Instant::now();
            let mut drive = Drive::new(settings);
            drive
                .handle_command(start, &command(start, ONE, 1.0))
                .unwrap();
            drive.handle_access(start, Access::Ready);
            assert_eq!(drive.poll_velocity(start), Some(ahead()));
            let now = start + ms(100);
            drive.handle_command(now, &command(now, ONE, last)).unwrap();
            let now = now + ms(500);
            assert_eq!(drive.poll_velocity(now), Some(Velocity::ZERO), "{last}");
            assert!(drive.wants_control(), "{last}");
            drive.handle_stopped();
            assert!(!drive.wants_control(), "{last}");
        }
    }

    #[test]
    fn a_command_is_valid_from_its_arrival_and_not_from_its_handling() {
        let start = Instant::now();
        let mut drive = driven(start);
        let waited = Command {
            arrival: start + ms(100),
            ..command(start + ms(100), ONE, 1.0)
        };
        drive.handle_command(start + ms(400), &waited).unwrap();
        assert_eq!(drive.poll_velocity(start + ms(600)), Some(Velocity::ZERO));
    }

    #[test]
    fn the_last_command_of_a_publisher_that_is_gone_does_not_move_the_vehicle() {
        let start = Instant::now();
        let mut drive = driven(start);
        assert!(drive.handle_publisher_gone(start, ONE));
        let refused = drive.handle_command(start, &command(start, ONE, 1.0));
        assert_eq!(refused, Err(Outdated::PublisherGone.into()));
        assert_eq!(drive.poll_velocity(start), Some(Velocity::ZERO));
    }
}
