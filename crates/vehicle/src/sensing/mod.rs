//! What a range sensor sees: its scans, a simulated sensor, and the obstacles that scans show.
//!
//! A [`SimulatedRanger`] measures the [`Scenery`] around a pose. [`Obstacles`] remembers what scans
//! have shown, and forgets what is gone. A [`Lookout`] tells when they block a path. Nothing here
//! handles messages or reads a clock.

mod lookout;
mod obstacles;
mod simulated;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

pub use lookout::Lookout;
pub use obstacles::Obstacles;
pub use simulated::{Disc, RangerConfig, Scenery, SimulatedRanger};

use crate::motion::{Pose, wrap};
use crate::zones::Point;

/// One measurement of all rays, from the vehicle's position.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Scan {
    rays: Vec<Ray>,
}

/// The distance to the first thing in a direction, or the sensor's reach if there is nothing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// Direction in radians clockwise from the vehicle's heading.
    pub bearing: f64,
    /// Distance in metres.
    pub range: f64,
}

impl Scan {
    /// Distance in metres beyond which rays count as free. Farther away a small error of the heading
    /// moves an obstacle by more than a vehicle's width.
    pub const HORIZON: f64 = 6.0;
    /// Maximum number of rays: one for each half degree.
    pub const MOST_RAYS: u16 = 720;

    /// A scan of these rays. Of several in one half degree the shortest counts; rays that are no
    /// numbers are left out.
    #[must_use]
    pub fn new(rays: impl IntoIterator<Item = Ray>) -> Self {
        let mut sectors = BTreeMap::<u16, Ray>::new();
        let rays = rays.into_iter();
        for ray in rays.filter(|it| it.bearing.is_finite() && it.range.is_finite()) {
            let share = (wrap(ray.bearing) + PI) / TAU;
            // Casts saturate.
            let sector = (share * f64::from(Self::MOST_RAYS)) as u16 % Self::MOST_RAYS;
            let shortest = sectors.entry(sector).or_insert(ray);
            if ray.range < shortest.range {
                *shortest = ray;
            }
        }
        Self {
            rays: sectors.into_values().collect(),
        }
    }

    /// The rays, in the order of their bearings.
    #[must_use]
    pub fn rays(&self) -> &[Ray] {
        &self.rays
    }

    /// The places in the local frame where something stands, for a vehicle with this pose.
    pub fn hits(&self, pose: Pose) -> impl Iterator<Item = Point> {
        let hits = self.rays.iter().filter(|ray| ray.range < Self::HORIZON);
        hits.map(move |ray| ray.point(&pose, ray.range))
    }
}

impl Ray {
    /// The point at a distance along the ray.
    fn point(&self, pose: &Pose, way: f64) -> Point {
        let (sin, cos) = (pose.yaw + self.bearing).sin_cos();
        (pose.x + way * cos, pose.y + way * sin)
    }
}
