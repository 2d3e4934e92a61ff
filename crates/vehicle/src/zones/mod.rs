//! Operating zones: one area that the vehicle must stay in, and areas that it must keep out of.
//!
//! [`Zones`] answers one question for the planner and for the drivers: how far is a point from
//! where the vehicle must not be? The zones are polygons of the local frame, checked when they are
//! made, so that every later question has a bounded cost and an answer.

mod polygon;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::fmt;

pub(crate) use polygon::distance;
pub use polygon::{Point, Polygon, PolygonError};

/// A zone, by its role and number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum ZoneId {
    /// The zone that the vehicle must stay in.
    Operating,
    /// A zone that it must keep out of, from 2 to 65535.
    KeepOut(u16),
}

impl ZoneId {
    /// The zone with a number of the messages; `None` for 0, which is reserved.
    #[must_use]
    pub const fn of(number: u16) -> Option<Self> {
        match number {
            0 => None,
            1 => Some(Self::Operating),
            other => Some(Self::KeepOut(other)),
        }
    }

    /// The number in messages.
    #[must_use]
    pub const fn number(self) -> u16 {
        match self {
            Self::Operating => 1,
            Self::KeepOut(number) => number,
        }
    }
}

impl fmt::Display for ZoneId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Operating => f.write_str("the edge of the operating zone"),
            Self::KeepOut(number) => write!(f, "keep-out zone {number}"),
        }
    }
}

/// Distance of a point from the nearest place where the vehicle must not be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clearance {
    /// Metres; negative for a point within a keep-out zone or outside the operating zone.
    pub metres: f64,
    /// The zone that determines it.
    pub zone: ZoneId,
}

/// The zones in force. Without any, the vehicle may be anywhere.
///
/// ```
/// use jaus_vehicle::zones::{Polygon, ZoneId, Zones};
///
/// let mut zones = Zones::default();
/// let yard = vec![(0.0, 0.0), (0.0, 20.0), (10.0, 20.0), (10.0, 0.0)];
/// zones.set(ZoneId::Operating, Polygon::new(yard)?);
/// let clearance = zones.clearance((8.0, 10.0)).map(|it| it.metres);
/// assert_eq!(clearance, Some(2.0));
/// # Ok::<(), jaus_vehicle::zones::PolygonError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Zones {
    polygons: BTreeMap<ZoneId, Polygon>,
}

impl Zones {
    /// Adds or replaces a zone.
    pub fn set(&mut self, id: ZoneId, polygon: Polygon) {
        self.polygons.insert(id, polygon);
    }

    /// Whether there is no zone.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.polygons.is_empty()
    }

    /// All zones.
    pub fn iter(&self) -> impl Iterator<Item = (ZoneId, &Polygon)> {
        self.polygons.iter().map(|(&id, polygon)| (id, polygon))
    }

    /// How far a point is from where the vehicle must not be; `None` without zones.
    #[must_use]
    pub fn clearance(&self, point: Point) -> Option<Clearance> {
        let mut nearest: Option<Clearance> = None;
        for (zone, polygon) in self.iter() {
            let metres = match zone {
                ZoneId::Operating => -polygon.signed_distance(point),
                // The box around the polygon is a lower bound, and costs nothing.
                ZoneId::KeepOut(_)
                    if nearest.is_some_and(|it| it.metres <= polygon.least_distance(point)) =>
                {
                    continue;
                }
                ZoneId::KeepOut(_) => polygon.signed_distance(point),
            };
            if nearest.is_none_or(|it| metres < it.metres) {
                nearest = Some(Clearance { metres, zone });
            }
        }
        nearest
    }
}
