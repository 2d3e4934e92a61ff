//! Conversion between the local frame and positions on the globe.

use super::{Pose, wrap};

/// A position (WGS 84) and attitude on the globe.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct GlobalPose {
    /// Latitude in degrees, north positive.
    pub latitude: f64,
    /// Longitude in degrees, east positive.
    pub longitude: f64,
    /// Altitude in metres above the ellipsoid.
    pub altitude: f64,
    /// Roll in radians about the forward axis.
    pub roll: f64,
    /// Pitch in radians about the axis to the right.
    pub pitch: f64,
    /// Yaw in radians clockwise from true north.
    pub yaw: f64,
}

/// The local frame: a plane tangent to the globe at the origin.
///
/// Distances within a few kilometres of the origin are accurate to one part in a thousand. The
/// frame does not extend to the poles.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Frame {
    /// The origin's latitude in degrees, -90 to 90.
    pub latitude: f64,
    /// The origin's longitude in degrees, -180 to 180.
    pub longitude: f64,
    /// The origin's altitude in metres above the ellipsoid.
    pub altitude: f64,
    /// Direction of the local X axis in radians clockwise from true north.
    pub heading: f64,
}

impl Frame {
    /// Semi-major axis of WGS 84 in metres.
    const SEMI_MAJOR_AXIS: f64 = 6_378_137.0;
    /// Square of the first eccentricity of WGS 84.
    const ECCENTRICITY_SQUARED: f64 = 6.694_379_990_14e-3;

    /// Creates a frame at a position, with its X axis pointing north.
    #[must_use]
    pub fn at(latitude: f64, longitude: f64) -> Self {
        Self {
            latitude,
            longitude,
            ..Self::default()
        }
    }

    /// Converts a pose in this frame to a pose on the globe.
    #[must_use]
    pub fn to_global(&self, pose: &Pose) -> GlobalPose {
        let (sin, cos) = self.heading.sin_cos();
        let north = pose.x * cos - pose.y * sin;
        let east = pose.x * sin + pose.y * cos;
        let (meridian, parallel) = self.metres_per_degree();
        GlobalPose {
            latitude: (self.latitude + north / meridian).clamp(-90.0, 90.0),
            longitude: wrap_degrees(self.longitude + east / parallel),
            altitude: self.altitude - pose.z,
            roll: pose.roll,
            pitch: pose.pitch,
            yaw: wrap(pose.yaw + self.heading),
        }
    }

    /// Converts a pose on the globe to this frame.
    #[must_use]
    pub fn to_local(&self, global: &GlobalPose) -> Pose {
        let (sin, cos) = self.heading.sin_cos();
        let (meridian, parallel) = self.metres_per_degree();
        let north = (global.latitude - self.latitude) * meridian;
        let east = wrap_degrees(global.longitude - self.longitude) * parallel;
        Pose {
            x: north * cos + east * sin,
            y: east * cos - north * sin,
            z: self.altitude - global.altitude,
            roll: global.roll,
            pitch: global.pitch,
            yaw: wrap(global.yaw - self.heading),
        }
    }

    /// The frame in which `local` and `global` describe the same pose.
    #[must_use]
    pub fn joining(local: &Pose, global: &GlobalPose) -> Self {
        let mut frame = Self {
            latitude: global.latitude,
            longitude: global.longitude,
            altitude: global.altitude + local.z,
            heading: wrap(global.yaw - local.yaw),
        };
        // The length of a degree depends on the origin. Each iteration divides the error by
        // thousands.
        for _ in 0..4 {
            let found = frame.to_global(local);
            frame.latitude += global.latitude - found.latitude;
            frame.longitude = wrap_degrees(frame.longitude + global.longitude - found.longitude);
            frame.latitude = frame.latitude.clamp(-90.0, 90.0);
        }
        frame
    }

    /// Metres per degree of latitude and of longitude at the origin.
    fn metres_per_degree(&self) -> (f64, f64) {
        let (sin, cos) = self.latitude.to_radians().sin_cos();
        let bulge = 1.0 - Self::ECCENTRICITY_SQUARED * sin * sin;
        let normal = Self::SEMI_MAJOR_AXIS / bulge.sqrt();
        let meridian = normal * (1.0 - Self::ECCENTRICITY_SQUARED) / bulge;
        // At a pole all longitudes coincide. The minimum avoids a division by zero.
        let parallel = (normal * cos).max(1.0);
        (meridian.to_radians(), parallel.to_radians())
    }
}

/// Wraps a longitude to -180 to 180 degrees.
fn wrap_degrees(degrees: f64) -> f64 {
    wrap(degrees.to_radians()).to_degrees()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    #[test]
    fn a_pose_on_the_globe_and_back_is_the_same_pose() {
        let frame = Frame {
            heading: 0.7,
            ..Frame::at(52.5, 13.4)
        };
        let pose = Pose {
            x: 123.0,
            y: -456.0,
            z: 7.0,
            yaw: 3.0,
            ..Pose::default()
        };
        let back = frame.to_local(&frame.to_global(&pose));
        assert!(back.distance(pose.x, pose.y) < 1e-6 && (back.z - pose.z).abs() < 1e-9);
        assert!(wrap(back.yaw - pose.yaw).abs() < 1e-9);
    }

    #[test]
    fn a_degree_of_latitude_is_as_long_as_the_geodesists_say() {
        for (latitude, metres) in [(0.0, 110_574.0), (45.0, 111_132.0), (89.0, 111_693.0)] {
            let frame = Frame::at(latitude, 0.0);
            let north = frame.to_global(&Pose::at(metres / 100.0, 0.0)).latitude - latitude;
            assert!((north - 0.01).abs() < 1e-6, "{latitude}: {north}");
        }
    }

    #[test]
    fn across_the_date_line_is_a_short_way() {
        let frame = Frame::at(0.0, 179.999);
        let there = GlobalPose {
            longitude: -179.999,
            ..GlobalPose::default()
        };
        assert!((frame.to_local(&there).y - 222.6).abs() < 0.1);
    }

    #[test]
    fn a_frame_joins_a_local_and_a_global_pose_of_one_place() {
        let local = Pose {
            x: 10.0,
            y: 20.0,
            yaw: PI / 2.0,
            ..Pose::default()
        };
        let global = GlobalPose {
            latitude: 45.0,
            longitude: 8.0,
            altitude: 300.0,
            ..GlobalPose::default()
        };
        let found = Frame::joining(&local, &global).to_global(&local);
        assert!((found.latitude - 45.0).abs() < 1e-9, "{found:?}");
        assert!((found.longitude - 8.0).abs() < 1e-9, "{found:?}");
        assert!(found.yaw.abs() < 1e-12 && (found.altitude - 300.0).abs() < 1e-9);
    }
}
