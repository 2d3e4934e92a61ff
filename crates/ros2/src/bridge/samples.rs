//! Reports of the vehicle's sensors as samples in the frames of ROS.

use std::time::Duration;

use jaus::messages::mobility::{ReportGlobalPose, ReportLocalPose, ReportVelocityState};

use super::frames::{
    Attitude, Quaternion, between_local_and_map, between_vehicle_and_base, orientation,
};
use super::stamp::{Stamp, sampled_at};

/// The pose of `base_link` in `map`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoseSample {
    /// When it was taken, since the beginning of 1970 (UTC).
    pub stamp: Duration,
    /// Metres east, north and up.
    pub position: [f64; 3],
    /// The orientation of `base_link`.
    pub orientation: Quaternion,
    /// The variance of each coordinate, in m²; 0 if unknown.
    pub position_variance: f64,
    /// The variance of each angle, in rad²; 0 if unknown.
    pub attitude_variance: f64,
}

/// The velocity of the vehicle, in the axes of `base_link`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TwistSample {
    /// When it was taken, since the beginning of 1970 (UTC).
    pub stamp: Duration,
    /// Forward, to the left and up, in m/s.
    pub linear: [f64; 3],
    /// About these axes, in rad/s.
    pub angular: [f64; 3],
    /// The variance of each linear component, in m²/s²; 0 if unknown.
    pub linear_variance: f64,
    /// The variance of each turn rate, in rad²/s²; 0 if unknown.
    pub angular_variance: f64,
}

/// A position on the globe.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FixSample {
    /// When it was taken, since the beginning of 1970 (UTC).
    pub stamp: Duration,
    /// Degrees north (WGS 84).
    pub latitude: f64,
    /// Degrees east (WGS 84).
    pub longitude: f64,
    /// Metres above the ellipsoid; `None` if unknown.
    pub altitude: Option<f64>,
    /// The variance of each coordinate, in m²; `None` if unknown.
    pub variance: Option<f64>,
}

/// A pose with the velocity of the same vehicle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OdometrySample {
    /// The pose, with the time of the sample.
    pub pose: PoseSample,
    /// The velocity; its time may be a little earlier.
    pub twist: TwistSample,
}

/// Joins poses with velocities.
#[derive(Debug, Clone, Copy, Default)]
pub struct Odometry {
    twist: Option<(TwistSample, Duration)>,
}

fn square(deviation: Option<f64>) -> f64 {
    deviation.map_or(0.0, |it| it * it)
}

impl PoseSample {
    /// The sample of a report that arrived at `received`. `None` if it lacks X, Y or yaw, without
    /// which ROS has no pose.
    #[must_use]
    pub fn of(report: &ReportLocalPose, received: Duration) -> Option<Self> {
        let position = [report.x_m()?, report.y_m()?, report.z_m().unwrap_or(0.0)];
        let attitude = Attitude {
            roll: report.roll_rad().unwrap_or(0.0),
            pitch: report.pitch_rad().unwrap_or(0.0),
            yaw: report.yaw_rad()?,
        };
        let stamp = report.time_stamp.map(|it| Stamp(it.0));
        Some(Self {
            stamp: sampled_at(stamp, received),
            position: between_local_and_map(position),
            orientation: orientation(attitude),
            position_variance: square(report.position_rms_m()),
            attitude_variance: square(report.attitude_rms_rad()),
        })
    }
}

impl TwistSample {
    /// The sample of a report that arrived at `received`. `None` if it lacks the forward velocity.
    /// Other components are 0 if it lacks them.
    #[must_use]
    pub fn of(report: &ReportVelocityState, received: Duration) -> Option<Self> {
        let or_zero = |value: Option<f64>| value.unwrap_or(0.0);
        let linear = [
            report.velocity_x_m_per_s()?,
            or_zero(report.velocity_y_m_per_s()),
            or_zero(report.velocity_z_m_per_s()),
        ];
        let angular = [
            or_zero(report.roll_rate_rad_per_s()),
            or_zero(report.pitch_rate_rad_per_s()),
            or_zero(report.yaw_rate_rad_per_s()),
        ];
        let stamp = report.time_stamp.map(|it| Stamp(it.0));
        Some(Self {
            stamp: sampled_at(stamp, received),
            linear: between_vehicle_and_base(linear),
            angular: between_vehicle_and_base(angular),
            linear_variance: square(report.velocity_rms_m_per_s()),
            angular_variance: square(report.rate_rms_rad_per_s()),
        })
    }
}

impl FixSample {
    /// The sample of a report that arrived at `received`. `None` if it lacks latitude or longitude.
    #[must_use]
    pub fn of(report: &ReportGlobalPose, received: Duration) -> Option<Self> {
        let stamp = report.time_stamp.map(|it| Stamp(it.0));
        Some(Self {
            stamp: sampled_at(stamp, received),
            latitude: report.latitude_deg()?,
            longitude: report.longitude_deg()?,
            altitude: report.altitude_m(),
            variance: report.position_rms_m().map(|it| it * it),
        })
    }
}

impl Odometry {
    /// A velocity that arrived earlier than this does not describe a pose.
    pub const VALID: Duration = Duration::from_secs(1);

    /// Handles a velocity.
    pub const fn handle_twist(&mut self, received: Duration, twist: TwistSample) {
        self.twist = Some((twist, received));
    }

    /// Joins a pose with the last velocity; `None` without a recent one.
    #[must_use]
    pub fn with_pose(&self, received: Duration, pose: PoseSample) -> Option<OdometrySample> {
        let (twist, at) = self.twist?;
        let is_recent = received.saturating_sub(at) <= Self::VALID;
        is_recent.then_some(OdometrySample { pose, twist })
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;

    const RECEIVED: Duration = Duration::from_secs(1_700_000_000);

    #[test]
    fn a_pose_without_yaw_is_none_and_one_that_heads_east_has_no_rotation() {
        let mut report = ReportLocalPose::default();
        report.set_x_m(1.0).unwrap();
        report.set_y_m(2.0).unwrap();
        assert_eq!(PoseSample::of(&report, RECEIVED), None);
        report.set_yaw_rad(FRAC_PI_2).unwrap();
        report.set_position_rms_m(0.5).unwrap();
        let pose = PoseSample::of(&report, RECEIVED).unwrap();
        let expected = [2.0, 1.0, 0.0];
        let close = pose.position.iter().zip(expected);
        assert!(
            close.into_iter().all(|(a, b)| (a - b).abs() < 1e-3),
            "{pose:?}"
        );
        assert!(pose.orientation.w > 0.999_99, "{pose:?}");
        assert!((pose.position_variance - 0.25).abs() < 1e-3, "{pose:?}");
        assert_eq!((pose.attitude_variance, pose.stamp), (0.0, RECEIVED));
    }

    #[test]
    fn a_turn_to_the_right_is_negative_in_ros() {
        let mut report = ReportVelocityState::default();
        assert_eq!(TwistSample::of(&report, RECEIVED), None);
        report.set_velocity_x_m_per_s(1.5).unwrap();
        report.set_yaw_rate_rad_per_s(0.5).unwrap();
        let twist = TwistSample::of(&report, RECEIVED).unwrap();
        assert!((twist.linear[0] - 1.5).abs() < 0.01, "{twist:?}");
        assert!((twist.angular[2] + 0.5).abs() < 0.01, "{twist:?}");
        assert_eq!(twist.linear[1..], [0.0, 0.0]);
    }

    #[test]
    fn a_position_that_does_not_tell_its_error_has_no_variance() {
        let mut report = ReportGlobalPose::default();
        report.set_latitude_deg(48.5).unwrap();
        assert_eq!(FixSample::of(&report, RECEIVED), None);
        report.set_longitude_deg(-9.25).unwrap();
        let fix = FixSample::of(&report, RECEIVED).unwrap();
        assert!((fix.latitude - 48.5).abs() < 1e-6, "{fix:?}");
        assert!((fix.longitude + 9.25).abs() < 1e-6, "{fix:?}");
        assert_eq!((fix.altitude, fix.variance), (None, None));
    }

    #[test]
    fn odometry_needs_a_velocity_of_the_last_second() {
        let mut pose = ReportLocalPose::default();
        pose.set_x_m(0.0).unwrap();
        pose.set_y_m(0.0).unwrap();
        pose.set_yaw_rad(0.0).unwrap();
        let pose = PoseSample::of(&pose, RECEIVED).unwrap();
        let mut velocity = ReportVelocityState::default();
        velocity.set_velocity_x_m_per_s(1.0).unwrap();
        let twist = TwistSample::of(&velocity, RECEIVED).unwrap();
        let mut odometry = Odometry::default();
        assert_eq!(odometry.with_pose(RECEIVED, pose), None);
        odometry.handle_twist(RECEIVED, twist);
        let late = RECEIVED + Odometry::VALID;
        assert!(odometry.with_pose(late, pose).is_some());
        let too_late = late + Duration::from_millis(1);
        assert_eq!(odometry.with_pose(too_late, pose), None);
    }
}
