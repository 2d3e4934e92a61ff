//! The pose on the globe of a simulated vehicle: a GNSS receiver that can fail, and the library's
//! navigator.

use std::time::{Duration, Instant};

use jaus_vehicle::motion::{Frame, Motion, Pose, Velocity, WheelCount};
use jaus_vehicle::navigation::{Course, Navigator, NavigatorConfig, Quality, SimulatedReceiver};

use crate::cell::Fault;

/// The local frame of the vehicle.
pub(crate) const FRAME: Frame = Frame {
    latitude: 52.5,
    longitude: 13.4,
    altitude: 0.0,
    heading: 0.0,
};

/// Receiver, wheel counter and navigator.
pub(crate) struct Positioning {
    navigator: Navigator,
    receiver: SimulatedReceiver,
    start: Instant,
    written_at: Instant,
    /// The last sentences of the sound receiver.
    sentences: String,
    /// Distance of the wheels: forward in metres, and turned in radians.
    travel: (f64, f64),
    /// The last velocity.
    velocity: Velocity,
    /// The fault of the receiver.
    pub(crate) fault: Option<Fault>,
}

impl Positioning {
    /// A position is known after this time.
    pub(crate) const START: Duration = Duration::from_secs(1);
    const PERIOD: Duration = Duration::from_millis(200);
    /// Distance between left and right wheels in metres.
    const TRACK: f64 = 0.5;
    /// Shorter than the default, so that it ends within a trial.
    pub(crate) const OUTAGE: Duration = Duration::from_secs(2);

    pub(crate) fn new(now: Instant) -> Self {
        Self {
            navigator: Navigator::new(NavigatorConfig {
                heading: Some(0.0),
                outage: Self::OUTAGE,
                ..NavigatorConfig::default()
            }),
            receiver: SimulatedReceiver::default(),
            start: now,
            written_at: now,
            sentences: String::new(),
            travel: (0.0, 0.0),
            velocity: Velocity::default(),
            fault: None,
        }
    }

    /// The wheels turn for some seconds.
    pub(crate) fn travel(&mut self, velocity: Velocity, seconds: f64) {
        self.travel.0 += velocity.x * seconds;
        self.travel.1 += velocity.yaw * seconds;
        self.velocity = velocity;
    }

    /// Reads wheels and receiver.
    pub(crate) fn handle_time(&mut self, now: Instant, truth: &Pose) {
        self.navigator.handle_count(now, self.count(now));
        if now.saturating_duration_since(self.written_at) >= Self::PERIOD {
            self.written_at = now;
            let octets = self.octets(now, truth);
            self.navigator.handle_octets(now, &octets);
        }
    }

    /// The motion of a vehicle as its sensors show it.
    pub(crate) fn measure(&self, now: Instant, truth: Motion) -> Motion {
        match self.navigator.pose(now) {
            Ok(estimate) => Motion {
                pose: FRAME.to_local(&estimate.pose),
                sampled_at: Some(estimate.sampled_at),
                ..truth
            },
            Err(_) => Motion {
                pose: Pose::UNKNOWN,
                ..truth
            },
        }
    }

    fn count(&self, now: Instant) -> WheelCount {
        let (forward, turned) = self.travel;
        let lead = turned * Self::TRACK / 2.0;
        WheelCount {
            start: 7,
            time_ms: now.saturating_duration_since(self.start).as_millis() as u32,
            left: forward + lead,
            right: forward - lead,
            track: Self::TRACK,
        }
    }

    fn course(&self, truth: &Pose) -> Course {
        let ahead = if self.velocity.x < 0.0 {
            std::f64::consts::PI
        } else {
            0.0
        };
        Course {
            speed: self.velocity.x.abs(),
            direction: truth.yaw + ahead,
        }
    }

    /// What the receiver writes.
    fn octets(&mut self, now: Instant, truth: &Pose) -> Vec<u8> {
        let jump = match self.fault {
            Some(Fault::PositionJumps) => 100.0,
            _ => 0.0,
        };
        (self.receiver.quality, self.receiver.hdop) = match self.fault {
            Some(Fault::PositionVague) => (Quality::Autonomous, 20.0),
            _ => (Quality::RtkFixed, 0.8),
        };
        let seen = FRAME.to_global(&Pose::at(truth.x, truth.y + jump));
        let course = self.course(truth);
        let sentences = self.receiver.fix(now, &seen, Some(course));
        match self.fault {
            Some(Fault::ReceiverSilent) => Vec::new(),
            Some(Fault::ReceiverFrozen) => self.sentences.clone().into_bytes(),
            Some(Fault::ReceiverGarbled) => garbled(sentences),
            Some(Fault::FixLost) => self.receiver.no_fix(now).into_bytes(),
            _ => {
                self.sentences.clone_from(&sentences);
                sentences.into_bytes()
            }
        }
    }
}

/// A sentence that is cut, one with a wrong digit, and one with a wrong octet.
fn garbled(sentence: String) -> Vec<u8> {
    let cut = sentence.as_bytes()[..sentence.len() / 2].to_vec();
    let digit = sentence.replace("5230", "5231").into_bytes();
    let mut noise = sentence.into_bytes();
    noise[10] = 0xFF;
    [cut, digit, noise].concat()
}

#[expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]
mod tests {
    use super::*;

    #[test]
    fn a_receiver_that_freezes_does_not_turn_the_heading_of_a_vehicle_that_turns() {
        /// One step in seconds.
        const STEP: f64 = 0.02;
        let mut now = Instant::now();
        let mut positioning = Positioning::new(now);
        let mut truth = Pose::default();
        let mut drive = |positioning: &mut Positioning, rate: f64, seconds: f64| {
            for _ in 0..(seconds / STEP) as u32 {
                now += Duration::from_secs_f64(STEP);
                let velocity = Velocity::forward(1.0, rate);
                truth.yaw += rate * STEP;
                truth.x += STEP * truth.yaw.cos();
                truth.y += STEP * truth.yaw.sin();
                positioning.travel(velocity, STEP);
                positioning.handle_time(now, &truth);
            }
            let motion = Motion {
                pose: truth,
                ..Motion::default()
            };
            positioning.measure(now, motion).pose.yaw - truth.yaw
        };
        drive(&mut positioning, 0.0, 10.0);
        positioning.fault = Some(Fault::ReceiverFrozen);
        let missed = drive(
            &mut positioning,
            0.3,
            Positioning::OUTAGE.as_secs_f64() - 0.2,
        );
        assert!(missed.abs() < 0.1, "{missed}");
    }
}
