//! The navigator: from the octets of a receiver, turn rates and wheel counts to the pose that a
//! vehicle may rely on, or the reason why there is none.

use std::fmt;
use std::time::{Duration, Instant};

use super::{Estimate, Estimator, Navigation, Receiver};
use crate::motion::{DeadReckoning, WheelCount};
use jaus::service::SampleAge;

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
/// finds out how old they are. A turn rate has no stamp, but the time of its measurement.
#[derive(Debug, Default)]
pub struct Navigator {
    config: NavigatorConfig,
    receiver: Receiver,
    /// Age of the positions, by the receiver's clock.
    fixes: SampleAge,
    /// Time of a fresh position whose course has not been used.
    course_due: Option<Instant>,
    wheels: Wheels,
    estimator: Estimator,
}

/// Wheel counts, and when the last one was read.
#[derive(Debug, Default)]
struct Wheels {
    reckoning: DeadReckoning,
    age: SampleAge,
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
                    if let Some(at) = self.fixes.handle(now, Some(fix.time.into())) {
                        self.estimator.handle_fix(at, &fix);
                        self.course_due = Some(at);
                    }
                    if self.estimator.estimate().is_some()
                        && let Some(heading) = self.config.heading.take()
                    {
                        self.estimator.set_heading(heading);
                    }
                }
                // A course has no age of its own, and RMC and VTG tell the same one: it counts once
                // for each fresh position.
                Navigation::Course(course) => {
                    if let Some(at) = self.course_due.take() {
                        self.estimator.handle_course(at, &course);
                    }
                }
                Navigation::NoFix => tracing::debug!("the receiver has no fix"),
            }
        }
    }

    /// Takes a turn rate in radians per second, right positive, measured at `at`.
    pub fn handle_rate(&mut self, at: Instant, rate: f64) {
        self.estimator.handle_rate(at, rate);
    }

    /// Takes a wheel count.
    pub fn handle_count(&mut self, now: Instant, count: WheelCount) {
        let wheels = &mut self.wheels;
        let read_at = Duration::from_millis(count.time_ms.into());
        let at = wheels.age.handle(now, Some(read_at.into()));
        let gone = wheels.reckoning.handle_count(count);
        // Travel counts, even if it is not known when the count was read.
        wheels.read_at = at.or(wheels.read_at);
        if let Some(at) = wheels.read_at {
            self.estimator.handle_travel(at, gone);
        }
    }

    /// The wheels' source was lost. The next count may have another clock.
    pub fn forget_wheels(&mut self) {
        self.wheels.age.forget();
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
    use crate::motion::{Frame, Pose, wrap};
    use crate::navigation::{Course, Quality, SimulatedReceiver};

    const ORIGIN: Frame = Frame {
        latitude: 52.5,
        longitude: 13.4,
        altitude: 0.0,
        heading: 0.0,
    };

    /// A vehicle that drives at 1 m/s, with five positions and courses and fifty wheel counts a
    /// second.
    struct Drive {
        navigator: Navigator,
        simulated: SimulatedReceiver,
        start: Instant,
        now: Instant,
        truth: Pose,
        /// Turn rate in radians per second.
        rate: f64,
        /// Travel of the left and right wheels in metres.
        wheels: [f64; 2],
        has_wheels: bool,
        /// The last sentences of the sound receiver.
        last: String,
    }

    /// What a faulty receiver writes in place of its sentences.
    type Fault = fn(&mut Drive, String) -> String;

    const SOUND: Fault = |_, sentences| sentences;
    const TRACK: f64 = 0.5;

    impl Drive {
        /// Drives north for 10 s.
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
                truth: Pose::default(),
                rate: 0.0,
                wheels: [0.0; 2],
                has_wheels: true,
                last: String::new(),
            };
            assert_eq!(drive.navigator.pose(start), Err(NavigationLoss::NoPosition));
            drive.run(10.0, SOUND);
            drive
        }

        fn run(&mut self, seconds: f64, fault: Fault) {
            for step in 0..(seconds * 50.0) as u32 {
                self.now += Duration::from_millis(20);
                let turn = self.rate * 0.02;
                self.truth.yaw = wrap(self.truth.yaw + turn);
                self.truth.x += 0.02 * self.truth.yaw.cos();
                self.truth.y += 0.02 * self.truth.yaw.sin();
                self.wheels[0] += 0.02 + turn * TRACK / 2.0;
                self.wheels[1] += 0.02 - turn * TRACK / 2.0;
                if self.has_wheels {
                    let time = self.now.saturating_duration_since(self.start);
                    let count = WheelCount {
                        start: 7,
                        time_ms: time.as_millis() as u32,
                        left: self.wheels[0],
                        right: self.wheels[1],
                        track: TRACK,
                    };
                    self.navigator.handle_count(self.now, count);
                }
                if step % 10 == 0 {
                    let sentences = self.sentences(self.truth.yaw);
                    let written = fault(self, sentences.clone());
                    if written == sentences {
                        self.last = sentences;
                    }
                    self.navigator.handle_octets(self.now, written.as_bytes());
                }
            }
        }

        /// The sentences of the true position, and of a course.
        fn sentences(&mut self, direction: f64) -> String {
            let place = ORIGIN.to_global(&self.truth);
            let speed = 1.0;
            let course = Some(Course { speed, direction });
            self.simulated.fix(self.now, &place, course)
        }

        fn loss(&self) -> String {
            let pose = self.navigator.pose(self.now);
            pose.map_or_else(|why| why.to_string(), |pose| format!("{pose:?}"))
        }

        /// Metres between the pose and the truth, if there is a pose.
        fn error(&self) -> Option<f64> {
            let pose = self.navigator.pose(self.now).ok()?.pose;
            let pose = ORIGIN.to_local(&pose);
            Some(pose.distance(self.truth.x, self.truth.y))
        }

        /// Radians between the heading and the truth.
        fn turned(&self) -> f64 {
            let estimate = self.navigator.estimator.estimate().unwrap();
            wrap(estimate.pose.yaw - self.truth.yaw).abs()
        }
    }

    /// Every way in which a receiver does not tell a position.
    const FAULTS: [(&str, Fault); 6] = [
        ("silent", |_, _| String::new()),
        ("no fix", |drive, _| drive.simulated.no_fix(drive.now)),
        ("cut", |_, text| text[..text.len() / 2].to_owned()),
        ("a wrong checksum", |_, text| {
            text.replace("5230", "5231").replace("GNVTG,", "GNVTG,1")
        }),
        ("noise", |_, text| text.replace(['$', '*'], "\u{fffd}")),
        ("frozen", |drive, _| drive.last.clone()),
    ];

    #[test]
    fn a_receiver_that_tells_no_position_is_bridged_by_the_wheels_for_ten_seconds_only() {
        for (name, fault) in FAULTS {
            let mut drive = Drive::new();
            drive.rate = 0.2;
            drive.run(9.0, fault);
            assert!(drive.error().is_some_and(|it| it < 1.0), "{name}");
            assert!(drive.turned() < 0.1, "{name}: {}", drive.turned());
            drive.run(1.5, fault);
            let loss = drive.loss();
            assert!(loss.starts_with("no acceptable position"), "{name}: {loss}");
            assert!(drive.turned() < 0.1, "{name}: {}", drive.turned());
            drive.run(1.0, SOUND);
            assert!(drive.error().is_some_and(|it| it < 0.2), "{name}: again");
        }
    }

    #[test]
    fn a_course_counts_once_for_each_position() {
        // The second sentence of an epoch tells another course, so that it shows if it counts.
        let twice: Fault = |drive, sentences| {
            let other = drive.sentences(drive.truth.yaw + 0.3);
            let (_position, course) = other.split_once("\r\n").unwrap();
            sentences + course
        };
        let mut drive = Drive::new();
        drive.run(10.0, twice);
        assert!(drive.turned() < 0.01, "{}", drive.turned());
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
        let jumps: Fault = |drive, _| {
            let truth = drive.truth;
            drive.truth.x += 1855.0;
            let sentences = drive.sentences(truth.yaw);
            drive.truth = truth;
            sentences
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
