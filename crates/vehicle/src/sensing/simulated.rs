//! A simulated range sensor among round obstacles.

use std::sync::{Arc, Mutex, PoisonError};

use super::{Ray, Scan};
use crate::motion::{Noise, Pose};
use crate::zones::Point;

/// A round obstacle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Disc {
    /// Its middle in the local frame.
    pub middle: Point,
    /// Its radius in metres.
    pub radius: f64,
}

/// The obstacles of a simulation. Cheap to clone; all clones share one state.
#[derive(Debug, Clone, Default)]
pub struct Scenery(Arc<Mutex<Vec<Disc>>>);

impl Scenery {
    /// Replaces all obstacles.
    pub fn set(&self, discs: Vec<Disc>) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = discs;
    }

    fn discs(&self) -> Vec<Disc> {
        self.0
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .clone()
    }
}

/// Parameters of a simulated range sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RangerConfig {
    /// Greatest distance that it measures, in metres.
    pub reach: f64,
    /// Field of view in radians, symmetrical about the vehicle's heading.
    pub field_of_view: f64,
    /// Number of rays, from 2 to [`Scan::MOST_RAYS`].
    pub rays: u16,
    /// Standard deviation of the distance, in metres.
    pub noise: f64,
    /// Seed of the noise.
    pub seed: u64,
}

impl Default for RangerConfig {
    fn default() -> Self {
        Self {
            reach: 8.0,
            field_of_view: 1.5 * std::f64::consts::PI,
            rays: 181,
            noise: 0.02,
            seed: 1,
        }
    }
}

/// A simulated range sensor in the middle of a vehicle.
#[derive(Debug)]
pub struct SimulatedRanger {
    config: RangerConfig,
    scenery: Scenery,
    noise: Noise,
}

impl SimulatedRanger {
    /// Creates a sensor in a scenery.
    #[must_use]
    pub const fn new(config: RangerConfig, scenery: Scenery) -> Self {
        Self {
            config,
            scenery,
            noise: Noise::new(config.seed),
        }
    }

    /// Measures from a pose.
    pub fn scan(&mut self, pose: &Pose) -> Scan {
        let RangerConfig {
            reach,
            field_of_view,
            rays,
            noise,
            ..
        } = self.config;
        let discs = self.scenery.discs();
        let step = field_of_view / f64::from(rays.max(2) - 1);
        let ray = |index: u16| {
            let bearing = f64::from(index) * step - field_of_view / 2.0;
            let ways = discs.iter().filter_map(|disc| disc.way(pose, bearing));
            let way = ways.fold(f64::INFINITY, f64::min);
            let range = if way < reach {
                (way + noise * self.noise.normal()).clamp(0.0, reach)
            } else {
                reach
            };
            Ray { bearing, range }
        };
        Scan::new((0..rays.max(2)).map(ray))
    }
}

impl Disc {
    /// Distance along a ray to the disc; 0 inside it, `None` if the ray misses it.
    fn way(&self, pose: &Pose, bearing: f64) -> Option<f64> {
        let (sin, cos) = (pose.yaw + bearing).sin_cos();
        let (x, y) = (self.middle.0 - pose.x, self.middle.1 - pose.y);
        let (along, aside) = (x * cos + y * sin, x * sin - y * cos);
        let half = (self.radius * self.radius - aside * aside).max(0.0).sqrt();
        let is_hit = aside.abs() <= self.radius && along + half >= 0.0;
        is_hit.then(|| (along - half).max(0.0))
    }
}
