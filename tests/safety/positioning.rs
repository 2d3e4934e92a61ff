//! The pose on the globe of a simulated vehicle: a GNSS receiver that can fail, and the library's
//! navigator.

use std::time::{Duration, Instant};

use jaus_vehicle::motion::{Frame, Motion, Pose, Velocity, WheelCount};
use jaus_vehicle::navigation::{Navigator, NavigatorConfig, Quality, SimulatedReceiver};

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
            fault: None,
        }
    }

    /// The wheels turn for some seconds.
    pub(crate) fn travel(&mut self, velocity: Velocity, seconds: f64) {
        self.travel.0 += velocity.x * seconds;
        self.travel.1 += velocity.yaw * seconds;
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
        let sentences = self.receiver.fix(now, &seen, None);
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
