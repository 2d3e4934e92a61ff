//! The outline of an operating zone or keep-out zone, as a client has set it.

use crate::motion::{Frame, GlobalPose, Pose};
use crate::zones::{Point, Polygon, PolygonError, ZoneId};

/// A zone in the coordinates in which it was set, so that it stays where it is when the local frame
/// moves over the globe, or with the local frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Outline {
    /// The zone.
    pub id: ZoneId,
    /// Whether the vertices are latitude and longitude in degrees, not X and Y in metres.
    pub on_globe: bool,
    /// The vertices in their order.
    pub vertices: Vec<Point>,
}

/// Why an outline is no zone.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum OutlineError {
    /// The vertices make no polygon.
    #[error("{0}: {1}")]
    Polygon(ZoneId, PolygonError),
    /// A vertex is too far from the local frame's origin.
    #[error(
        "{0}: vertex {1} is more than {max} km from the origin of the local frame: set a zone \
         near the vehicle, or the position of the frame", max = Outline::REACH / 1000.0
    )]
    TooFar(ZoneId, usize),
}

impl Outline {
    /// The greatest distance of a vertex from the origin along each axis, in metres. Beyond it the
    /// globe is no plane.
    pub const REACH: f64 = 100_000.0;

    /// The polygon in the local frame.
    ///
    /// # Errors
    /// If the vertices make no polygon, or are too far away.
    pub fn polygon(&self, frame: &Frame) -> Result<Polygon, OutlineError> {
        let vertices = self.local(frame);
        let is_near = |&(x, y): &Point| x.abs().max(y.abs()) <= Self::REACH;
        let finite = vertices
            .iter()
            .filter(|(x, y)| x.is_finite() && y.is_finite());
        if let Some(far) = finite.clone().position(|it| !is_near(it)) {
            return Err(OutlineError::TooFar(self.id, far + 1));
        }
        Polygon::new(vertices).map_err(|error| OutlineError::Polygon(self.id, error))
    }

    /// The vertices as X and Y in metres.
    #[must_use]
    pub fn local(&self, frame: &Frame) -> Vec<Point> {
        let vertices = self.vertices.iter();
        let to_local = |&(latitude, longitude): &Point| {
            let pose = frame.to_local(&GlobalPose {
                latitude,
                longitude,
                ..GlobalPose::default()
            });
            (pose.x, pose.y)
        };
        match self.on_globe {
            true => vertices.map(to_local).collect(),
            false => vertices.copied().collect(),
        }
    }

    /// The vertices as latitude and longitude in degrees.
    #[must_use]
    pub fn global(&self, frame: &Frame) -> Vec<Point> {
        let vertices = self.vertices.iter();
        let to_global = |&(x, y): &Point| {
            let pose = frame.to_global(&Pose::at(x, y));
            (pose.latitude, pose.longitude)
        };
        match self.on_globe {
            true => vertices.copied().collect(),
            false => vertices.map(to_global).collect(),
        }
    }
}
