//! The navigator: from the octets of a receiver, turn rates and wheel counts to the pose that a
//! vehicle may rely on, or the reason why there is none.

use std::fmt;
use std::time::{Duration, Instant};

use super::{Estimate, Estimator, Navigation, Receiver};
use crate::motion::{DeadReckoning, Freshness, WheelCount};

/// Limits of what a [`Navigator`] reports.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NavigatorConfig {
    /// The heading at the start in radians from north, if it is known.
    pub heading: Option<f64>,
    /// The pose becomes unknown without position or wheel travel for this time.
    pub silence: Duration,
    /// The pose becomes unknown without an accepted position for this time, whatever the wheels say:
    /// they also turn where the vehicle is stuck.
    pub outage: Duration,
    /// The pose becomes unknown at this standard error of the position, in metres.
    pub max_rms: f64,
}

impl Default for NavigatorConfig {
    /// 1.5 s, 10 s and 10 m.
    fn default() -> Self {
        Self {
            heading: None,
            silence: Duration::from_millis(1500),
            outage: Duration::from_secs(10),
            max_rms: 10.0,
        }
    }
}

/// Why there is no pose to rely on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum NavigationLoss {
    /// The receiver has not reported a position yet.
    NoPosition,
    /// Neither position nor wheel travel for this time.
    Silent(Duration),
    /// No acceptable position for this time.
    Outage(Duration),
    /// The position has this standard error in metres.
    Uncertain(f64),
}

impl fmt::Display for NavigationLoss {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoPosition => f.write_str("the receiver has not reported a position yet"),
            Self::Silent(age) => {
                let seconds = age.as_secs_f64();
                write!(f, "neither position nor wheel travel for {seconds:.1} s")
            }
            Self::Outage(age) => {
                let seconds = age.as_secs_f64();
                write!(f, "no acceptable position for {seconds:.1} s")
            }
            Self::Uncertain(rms) => {
                write!(f, "the standard error of the position is {rms:.1} m")
            }
        }
    }
}

/// Reads the inputs and fuses them. Times are those of receipt; from the stamps of the inputs it
/// finds out how old they are.
#[derive(Debug, Default)]
pub struct Navigator {
    config: NavigatorConfig,
    receiver: Receiver,
    /// Age of the positions, by the receiver's clock.
    fixes: Freshness,
    wheels: Wheels,
    estimator: Estimator,
}

/// Wheel counts, and when the last one was read.
#[derive(Debug, Default)]
struct Wheels {
    reckoning: DeadReckoning,
    freshness: Freshness,
    read_at: Option<Instant>,
}

impl Navigator {
    /// A navigator without a position.
    #[must_use]
    pub fn new(config: NavigatorConfig) -> Self {
        Self {
            config,
            ..Self::default()
        }
    }

    /// Takes octets of the receiver, in any portions.
    pub fn handle_octets(&mut self, now: Instant, octets: &[u8]) {
        for news in self.receiver.handle_octets(octets) {
            match news {
                Navigation::Fix(fix) => {
                    // A report that waited in a buffer is as old as its fix.
                    if let Some(at) = self.fixes.handle(now, Some(fix.time)) {
                        self.estimator.handle_fix(at, &fix);
                    }
                    if self.estimator.estimate().is_some()
                        && let Some(heading) = self.config.heading.take()
                    {
                        self.estimator.set_heading(heading);
                    }
                }
                Navigation::Course(course) => self.estimator.handle_course(now, &course),
                Navigation::NoFix => tracing::debug!("the receiver has no fix"),
            }
        }
    }

    /// Takes a turn rate in radians per second, right positive.
    pub fn handle_rate(&mut self, now: Instant, rate: f64) {
        self.estimator.handle_rate(now, rate);
    }

    /// Takes a wheel count.
    pub fn handle_count(&mut self, now: Instant, count: WheelCount) {
        let wheels = &mut self.wheels;
        let read_at = Duration::from_millis(count.time_ms.into());
        let at = wheels.freshness.handle(now, Some(read_at));
        let gone = wheels.reckoning.handle_count(count);
        // Travel counts, even if it is not known when the count was read.
        wheels.read_at = at.or(wheels.read_at);
        if let Some(at) = wheels.read_at {
            self.estimator.handle_travel(at, gone);
        }
    }

    /// The wheels' source was lost. The next count may have another clock.
    pub fn forget_wheels(&mut self) {
        self.wheels.freshness.forget();
    }

    /// Sets the heading in radians from north, as a person knows it.
    pub fn set_heading(&mut self, heading: f64) {
        self.estimator.set_heading(heading);
    }

    /// The pose to rely on at `now`.
    ///
    /// # Errors
    /// Why there is none.
    pub fn pose(&self, now: Instant) -> Result<Estimate, NavigationLoss> {
        let estimate = self.estimator.estimate();
        let estimate = estimate.ok_or(NavigationLoss::NoPosition)?;
        let age = |at| now.saturating_duration_since(at);
        let NavigatorConfig {
            silence,
            outage,
            max_rms,
            ..
        } = self.config;
        if age(estimate.sampled_at) > silence {
            return Err(NavigationLoss::Silent(age(estimate.sampled_at)));
        }
        if age(estimate.fixed_at) > outage {
            return Err(NavigationLoss::Outage(age(estimate.fixed_at)));
        }
        if estimate.position_rms > max_rms {
            return Err(NavigationLoss::Uncertain(estimate.position_rms));
        }
        Ok(estimate)
    }
}

#[cfg(test)]
#[expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]
mod tests {
    use super::*;
    use crate::motion::{Frame, Pose};
    use crate::navigation::{Quality, SimulatedReceiver};

    /// A vehicle that drives north at 1 m/s, with five positions and fifty wheel counts a second.
    struct Drive {
        navigator: Navigator,
        simulated: SimulatedReceiver,
        start: Instant,
        now: Instant,
        metres: f64,
        has_wheels: bool,
    }

    /// What a faulty receiver writes in place of its sentences.
    type Fault = fn(&mut SimulatedReceiver, Instant, String) -> String;

    const SOUND: Fault = |_, _, sentences| sentences;

    impl Drive {
        fn new() -> Self {
            let start = Instant::now();
            let navigator = Navigator::new(NavigatorConfig {
                heading: Some(0.0),
                ..NavigatorConfig::default()
            });
            let mut drive = Self {
                navigator,
                simulated: SimulatedReceiver::default(),
                start,
                now: start,
                metres: 0.0,
                has_wheels: true,
            };
            assert_eq!(drive.navigator.pose(start), Err(NavigationLoss::NoPosition));
            drive.run(10.0, SOUND);
            drive
        }

        fn run(&mut self, seconds: f64, fault: Fault) {
            for step in 0..(seconds * 50.0) as u32 {
                self.now += Duration::from_millis(20);
                self.metres += 0.02;
                if self.has_wheels {
                    let time = self.now.saturating_duration_since(self.start);
                    let count = WheelCount {
                        start: 7,
                        time_ms: time.as_millis() as u32,
                        left: self.metres,
                        right: self.metres,
                        track: 0.5,
                    };
                    self.navigator.handle_count(self.now, count);
                }
                if step % 10 == 0 {
                    let place = Frame::at(52.5, 13.4).to_global(&Pose::at(self.metres, 0.0));
                    let sentences = self.simulated.fix(self.now, &place, None);
                    let sentences = fault(&mut self.simulated, self.now, sentences);
                    self.navigator.handle_octets(self.now, sentences.as_bytes());
                }
            }
        }

        fn loss(&self) -> String {
            let pose = self.navigator.pose(self.now);
            pose.map_or_else(|why| why.to_string(), |pose| format!("{pose:?}"))
        }

        /// Metres between the pose and the truth, if there is a pose.
        fn error(&self) -> Option<f64> {
            let pose = self.navigator.pose(self.now).ok()?.pose;
            let pose = Frame::at(52.5, 13.4).to_local(&pose);
            Some(pose.distance(self.metres, 0.0))
        }
    }

    /// Every way in which a receiver does not tell a position.
    const FAULTS: [(&str, Fault); 6] = [
        ("silent", |_, _, _| String::new()),
        ("no fix", |simulated, now, _| simulated.no_fix(now)),
        ("cut", |_, _, text| text[..text.len() / 2].to_owned()),
        ("a wrong checksum", |_, _, text| {
            text.replace("5230", "5231")
        }),
        ("noise", |_, _, text| text.replace(['$', '*'], "\u{fffd}")),
        ("frozen", |_, _, _| {
            let mut stopped = SimulatedReceiver::default();
            let place = Frame::at(52.5, 13.4).to_global(&Pose::default());
            #[expect(clippy::disallowed_methods, reason = "always midnight")]
            stopped.fix(Instant::now(), &place, None)
        }),
    ];

    #[test]
    fn a_receiver_that_tells_no_position_is_bridged_by_the_wheels_for_ten_seconds_only() {
        for (name, fault) in FAULTS {
            let mut drive = Drive::new();
            drive.run(9.0, fault);
            assert!(drive.error().is_some_and(|it| it < 1.0), "{name}");
            drive.run(1.5, fault);
            let loss = drive.loss();
            assert!(loss.starts_with("no acceptable position"), "{name}: {loss}");
            drive.run(1.0, SOUND);
            assert!(drive.error().is_some_and(|it| it < 0.2), "{name}: again");
        }
    }

    #[test]
    fn without_wheels_the_position_does_not_outlive_the_receivers_silence() {
        for (name, fault) in FAULTS {
            let mut drive = Drive::new();
            drive.has_wheels = false;
            drive.run(1.4, fault);
            assert!(drive.error().is_some(), "{name}");
            drive.run(0.4, fault);
            let loss = drive.loss();
            assert!(
                loss.starts_with("neither position nor wheel"),
                "{name}: {loss}"
            );
        }
    }

    #[test]
    fn a_position_that_jumps_or_is_vague_is_no_position() {
        let jumps: Fault = |_, _, text| {
            let body = text[1..text.len() - 5].replace("5230.", "5231.");
            let sum = body.bytes().fold(0, |sum, octet| sum ^ octet);
            format!("${body}*{sum:02X}\r\n")
        };
        let mut drive = Drive::new();
        drive.run(0.2, jumps);
        let loss = drive.loss();
        assert!(
            loss.starts_with("the standard error of the position is 18"),
            "{loss}"
        );
        let mut drive = Drive::new();
        drive.simulated.quality = Quality::Autonomous;
        drive.simulated.hdop = 4.5;
        drive.run(60.0, SOUND);
        let loss = drive.loss();
        assert!(
            loss.starts_with("the standard error of the position is 11"),
            "{loss}"
        );
    }
}
