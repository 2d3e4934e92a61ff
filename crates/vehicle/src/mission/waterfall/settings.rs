//! Settings of missions, and their destinations.

use std::time::Duration;

use crate::mission::LostLink;

/// Retry limits, timeouts and defaults of a mission.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Maximum number of attempts until the path is handed over, at least one.
    pub attempts: u8,
    /// How often the mission drives on by itself after a fault has stopped the vehicle. Otherwise it
    /// waits for the operator.
    pub retries: u8,
    /// Delay between a blocked attempt and the next one.
    pub pause: Duration,
    /// Timeout for a stage to start or recover.
    pub patience: Duration,
    /// How long a stage may report a block before the attempt fails.
    pub settling: Duration,
    /// How long the vehicle may drive without progress.
    pub stall: Duration,
    /// Maximum number of new paths in one attempt because the map has changed on the way.
    pub detours: u8,
    /// Default speed limit in metres per second, for destinations without one.
    pub speed: f64,
    /// Behaviour when the operator's link is lost.
    pub lost_link: LostLink,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            attempts: 3,
            retries: 0,
            pause: Duration::from_secs(3),
            patience: Duration::from_secs(15),
            settling: Duration::from_secs(1),
            stall: Duration::from_secs(60),
            detours: 10,
            speed: 1.0,
            lost_link: LostLink::Stop,
        }
    }
}

/// Destination of a mission.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Destination {
    /// X in the local frame, in metres.
    pub x: f64,
    /// Y in the local frame, in metres.
    pub y: f64,
    /// Speed limit in metres per second.
    pub speed: Option<f64>,
}

impl Destination {
    /// The highest speed limit that a client may request, in metres per second.
    pub const MAX_SPEED: f64 = 100.0;

    /// Describes what is invalid, with a remedy.
    pub(super) fn mistake(&self) -> Option<String> {
        let Self { x, y, speed } = *self;
        if !x.is_finite() || !y.is_finite() {
            return Some(format!(
                "the destination north {x} m, east {y} m is invalid: set finite numbers of metres"
            ));
        }
        let speed = speed.filter(|&speed| !(speed > 0.0 && speed <= Self::MAX_SPEED))?;
        Some(format!(
            "a speed of {speed} m/s is out of range: set one above 0 and up to {} m/s",
            Self::MAX_SPEED
        ))
    }
}
