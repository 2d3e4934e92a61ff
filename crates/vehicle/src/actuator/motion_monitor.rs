//! Motion without a command: a drive that turns although it must stand still, turns the wrong way, or
//! turns faster than commanded.

use std::fmt;
use std::time::{Duration, Instant};

use super::{Actuator, Command};

/// Compares what a drive is commanded with what it does.
///
/// What slows down is never a fault: a vehicle needs time to brake, to coast to a stop and to
/// reverse. Neither is a drive that is slower than commanded, such as uphill.
#[derive(Debug, Clone)]
pub(super) struct MotionMonitor {
    /// Speed at full propulsion, in the unit of the measurements.
    top: f64,
    odd: Option<Odd>,
    /// What was found last, and when.
    fault: Option<(Oddity, Instant)>,
}

/// Motion that is a fault if it lasts.
#[derive(Debug, Clone, Copy)]
struct Odd {
    what: Oddity,
    since: Instant,
    /// The least speed since then.
    least: f64,
}

/// How a drive deviates from its command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Oddity {
    WithoutCommand,
    WrongWay,
    TooFast,
}

impl fmt::Display for Oddity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::WithoutCommand => "turns without a command",
            Self::WrongWay => "turns the wrong way",
            Self::TooFast => "turns faster than commanded",
        })
    }
}

impl MotionMonitor {
    /// Speed of a braked drive that is no motion yet, and of any drive that is no motion in the wrong
    /// direction, as shares of the top speed.
    const STILL: f64 = 0.1;
    /// A drive that is not braked may be so many times faster than commanded, plus the second share
    /// of the top speed: downhill, or when its strength varies.
    const FASTER: (f64, f64) = (1.5, 0.25);
    /// Commands below this share are none.
    const NOTHING: f64 = 0.02;
    /// A drive slows down if it loses this share of the top speed within the limit.
    const SLOWS: f64 = 0.02;
    /// How long a braked drive may move without slowing down.
    const BRAKED: Duration = Duration::from_millis(500);
    /// How long a drive that is not braked may deviate.
    const UNBRAKED: Duration = Duration::from_secs(1);
    /// A fault ends when the drive has been still for this time.
    const HOLD: Duration = Duration::from_secs(1);

    /// A monitor of a drive that reaches `top` at full propulsion.
    pub(super) const fn new(top: f64) -> Self {
        Self {
            top,
            odd: None,
            fault: None,
        }
    }

    /// Handles a measured speed under the command in force.
    pub(super) fn handle_speed(&mut self, now: Instant, command: Command, speed: f64) {
        let magnitude = speed.abs();
        if magnitude > Self::STILL * self.top
            && let Some((_, at)) = &mut self.fault
        {
            *at = now;
        }
        let since = |at| now.saturating_duration_since(at);
        self.fault = self.fault.filter(|(_, at)| since(*at) < Self::HOLD);
        let Some(what) = self.oddity(command, speed) else {
            self.odd = None;
            return;
        };
        let odd = self
            .odd
            .filter(|odd| odd.what == what && magnitude > odd.least - Self::SLOWS * self.top);
        let odd = odd.unwrap_or(Odd {
            what,
            since: now,
            least: magnitude,
        });
        self.odd = Some(odd);
        let limit = match command.brake >= 0.5 {
            true => Self::BRAKED,
            false => Self::UNBRAKED,
        };
        if since(odd.since) >= limit {
            self.fault = Some((what, now));
        }
    }

    /// What is wrong with the drive: for as long as it is, and until it has stood still for a second.
    pub(super) fn fault(&self) -> Option<Oddity> {
        self.fault.map(|(what, _)| what)
    }

    fn oddity(&self, command: Command, speed: f64) -> Option<Oddity> {
        let wanted = command.drive.clamp(-1.0, 1.0) * self.top;
        let magnitude = speed.abs();
        let still = Self::STILL * self.top;
        let is_commanded = wanted.abs() > Self::NOTHING * self.top;
        if is_commanded && wanted * speed < 0.0 && magnitude > still {
            return Some(Oddity::WrongWay);
        }
        let (times, slack) = Self::FASTER;
        let allowed = match command.brake >= 0.5 {
            true => still.max(times * wanted.abs()),
            false => times * wanted.abs() + slack * self.top,
        };
        (magnitude > allowed).then_some(match is_commanded {
            true => Oddity::TooFast,
            false => Oddity::WithoutCommand,
        })
    }
}

/// A drive with a monitor of its motion.
#[derive(Debug)]
pub(super) struct MonitoredDrive<A> {
    drive: A,
    name: &'static str,
    monitor: MotionMonitor,
    command: Command,
    /// Time and travel at the beginning of the measurement under way.
    measured: Option<(Instant, f64)>,
}

impl<A: Actuator> MonitoredDrive<A> {
    /// Time over which a speed is measured: counters may step less often than they are read.
    const SPAN: Duration = Duration::from_millis(100);
    /// After a longer gap, nobody has measured.
    const LONGEST: Duration = Duration::from_millis(500);

    /// Monitors a drive that reaches `top` metres per second at full propulsion.
    pub(super) const fn new(drive: A, name: &'static str, top: f64) -> Self {
        Self {
            drive,
            name,
            monitor: MotionMonitor::new(top),
            command: Command::STOP,
            measured: None,
        }
    }
}

impl<A: Actuator> Actuator for MonitoredDrive<A> {
    fn handle_time(&mut self, now: Instant) {
        self.drive.handle_time(now);
        let travel = self.drive.travel();
        let (since, before) = *self.measured.get_or_insert((now, travel));
        let span = now.saturating_duration_since(since);
        if span < Self::SPAN {
            return;
        }
        self.measured = Some((now, travel));
        if span <= Self::LONGEST {
            let speed = (travel - before) / span.as_secs_f64();
            self.monitor.handle_speed(now, self.command, speed);
        }
    }

    fn command(&mut self, command: Command) {
        self.command = command.or_stop();
        self.drive.command(command);
    }

    fn travel(&self) -> f64 {
        self.drive.travel()
    }

    fn fault(&self) -> Option<String> {
        self.drive.fault().or_else(|| {
            let fault = self.monitor.fault()?;
            Some(format!("the {} {fault}: cut its power", self.name))
        })
    }
}

#[cfg(test)]
#[expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]
mod tests {
    use super::*;

    const PERIOD: Duration = Duration::from_millis(100);
    const TOP: f64 = 2.0;

    /// The first fault while a drive does this, and when it was found. `speed` is that after so many
    /// seconds.
    fn found(
        command: impl Fn(f64) -> Command,
        speed: impl Fn(f64) -> f64,
    ) -> Option<(Oddity, f64)> {
        let (mut monitor, start) = (MotionMonitor::new(TOP), Instant::now());
        (0..200_u32).find_map(|step| {
            let time = PERIOD * step;
            let seconds = time.as_secs_f64();
            monitor.handle_speed(start + time, command(seconds), speed(seconds));
            monitor.fault().map(|fault| (fault, seconds))
        })
    }

    const fn drive(drive: f64) -> Command {
        Command { drive, brake: 0.0 }
    }

    #[test]
    fn motion_against_the_command_is_found_within_the_limit() {
        for (command, speed, what, limit) in [
            (Command::STOP, 0.3, Oddity::WithoutCommand, 0.5),
            (Command::STOP, -2.0, Oddity::WithoutCommand, 0.5),
            (drive(0.0), 0.8, Oddity::WithoutCommand, 1.0),
            (drive(0.5), -0.3, Oddity::WrongWay, 1.0),
            (drive(-0.5), 1.0, Oddity::WrongWay, 1.0),
            (drive(0.2), 1.5, Oddity::TooFast, 1.0),
            (drive(-0.2), -2.0, Oddity::TooFast, 1.0),
        ] {
            let (fault, at) = found(|_| command, |_| speed).unwrap();
            assert_eq!(fault, what, "{command:?} {speed}");
            assert!((at - limit).abs() < 0.01, "{command:?} {speed}: {at}");
        }
    }

    #[test]
    fn hills_coasting_reversal_and_uneven_motors_are_no_fault() {
        // Uphill, and downhill at up to half more than commanded.
        assert_eq!(found(|_| drive(0.5), |_| 0.1), None);
        assert_eq!(found(|_| drive(0.5), |_| 1.5), None);
        // Slow creep on a slope, against the brakes.
        assert_eq!(found(|_| Command::STOP, |_| 0.15), None);
        // Braking from full speed in 10 s, and coasting from it in 16 s.
        let slows = |rate: f64| move |seconds: f64| (2.0 - rate * seconds).max(0.0);
        assert_eq!(found(|_| Command::STOP, slows(0.2)), None);
        assert_eq!(found(|_| drive(0.0), slows(0.125)), None);
        // From full speed ahead to full speed back within 6 s.
        let reverses = |seconds: f64| (2.0 - 0.6 * seconds).max(-2.0);
        assert_eq!(found(|_| drive(-1.0), reverses), None);
        // A command that goes up and down, and a motor that lags behind it by half a second.
        let swings = |seconds: f64| (seconds * 2.0).sin();
        let lags = |seconds: f64| 2.2 * ((seconds - 0.5) * 2.0).sin();
        assert_eq!(found(|seconds| drive(swings(seconds)), lags), None);
    }

    #[test]
    fn a_fault_ends_after_a_second_of_standstill() {
        let (mut monitor, mut now) = (MotionMonitor::new(TOP), Instant::now());
        let mut run = |speed: f64, steps: u32| {
            for _ in 0..steps {
                now += PERIOD;
                monitor.handle_speed(now, Command::STOP, speed);
            }
            monitor.fault()
        };
        assert_eq!(run(1.0, 8), Some(Oddity::WithoutCommand));
        assert_eq!(run(0.0, 9), Some(Oddity::WithoutCommand));
        assert_eq!(run(0.0, 2), None);
    }
}
