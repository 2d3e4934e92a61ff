//! Samples as messages of ROS, and messages of ROS as inputs.

use std::sync::Arc;
use std::time::Duration;

use super::diagnostics::Diagnostic;
use super::frames::Quaternion;
use super::ports::GoalPose;
use super::samples::{FixSample, OdometrySample, PoseSample, TwistSample};
use super::velocity::Twist;
use crate::Value;
use crate::interface::{Interface, InterfaceError, Interfaces};
use crate::message::{Message, ValueError};

/// The types of the messages that the bridge converts itself.
#[derive(Debug)]
pub(super) struct Types {
    pub(super) odometry: Arc<Interface>,
    pub(super) pose: Arc<Interface>,
    pub(super) twist: Arc<Interface>,
    pub(super) stamped_twist: Arc<Interface>,
    pub(super) fix: Arc<Interface>,
    pub(super) status: Arc<Interface>,
    pub(super) transforms: Arc<Interface>,
    pub(super) bool: Arc<Interface>,
    pub(super) empty: Arc<Interface>,
}

/// The frames of the vehicle, as ROS names them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Frames {
    /// The local frame, by default `map`.
    pub map: String,
    /// The vehicle, by default `base_link`.
    pub base: String,
}

impl Default for Frames {
    fn default() -> Self {
        Self {
            map: "map".to_owned(),
            base: "base_link".to_owned(),
        }
    }
}

type Converted = Result<Message, ValueError>;

impl Types {
    pub(super) fn bundled() -> Result<Self, InterfaceError> {
        let all = Interfaces::bundled()?;
        Ok(Self {
            odometry: all.get("nav_msgs/msg/Odometry")?,
            pose: all.get("geometry_msgs/msg/PoseStamped")?,
            twist: all.get("geometry_msgs/msg/Twist")?,
            stamped_twist: all.get("geometry_msgs/msg/TwistStamped")?,
            fix: all.get("sensor_msgs/msg/NavSatFix")?,
            status: all.get("diagnostic_msgs/msg/DiagnosticArray")?,
            transforms: all.get("tf2_msgs/msg/TFMessage")?,
            bool: all.get("std_msgs/msg/Bool")?,
            empty: all.get("std_msgs/msg/Empty")?,
        })
    }

    pub(super) fn pose(&self, sample: &PoseSample, frames: &Frames) -> Converted {
        let mut message = Message::new(&self.pose);
        set_header(&mut message, "header", sample.stamp, &frames.map)?;
        set_vector(&mut message, "pose.position", sample.position)?;
        set_quaternion(&mut message, "pose.orientation", sample.orientation)?;
        Ok(message)
    }

    pub(super) fn odometry(&self, sample: &OdometrySample, frames: &Frames) -> Converted {
        let OdometrySample { pose, twist } = sample;
        let mut message = Message::new(&self.odometry);
        set_header(&mut message, "header", pose.stamp, &frames.map)?;
        message.set("child_frame_id", frames.base.as_str())?;
        set_vector(&mut message, "pose.pose.position", pose.position)?;
        set_quaternion(&mut message, "pose.pose.orientation", pose.orientation)?;
        let covariance = covariance(pose.position_variance, pose.attitude_variance);
        message.set("pose.covariance", covariance)?;
        set_vector(&mut message, "twist.twist.linear", twist.linear)?;
        set_vector(&mut message, "twist.twist.angular", twist.angular)?;
        let covariance = self::covariance(twist.linear_variance, twist.angular_variance);
        message.set("twist.covariance", covariance)?;
        Ok(message)
    }

    pub(super) fn twist(&self, sample: &TwistSample, frames: &Frames) -> Converted {
        let mut message = Message::new(&self.stamped_twist);
        set_header(&mut message, "header", sample.stamp, &frames.base)?;
        set_vector(&mut message, "twist.linear", sample.linear)?;
        set_vector(&mut message, "twist.angular", sample.angular)?;
        Ok(message)
    }

    pub(super) fn fix(&self, sample: &FixSample, frames: &Frames) -> Converted {
        let mut message = Message::new(&self.fix);
        set_header(&mut message, "header", sample.stamp, &frames.base)?;
        message.set("latitude", sample.latitude)?;
        message.set("longitude", sample.longitude)?;
        message.set("status.status", HAS_FIX)?;
        // ROS says so for an unknown altitude.
        message.set("altitude", sample.altitude.unwrap_or(f64::NAN))?;
        if let Some(variance) = sample.variance {
            let mut covariance = [0.0; 9];
            for axis in 0..3 {
                covariance[4 * axis] = variance;
            }
            if sample.altitude.is_none() {
                covariance[8] = UNKNOWN_ALTITUDE;
            }
            message.set("position_covariance", covariance)?;
            message.set("position_covariance_type", APPROXIMATED)?;
        }
        Ok(message)
    }

    pub(super) fn transform(&self, sample: &PoseSample, frames: &Frames) -> Converted {
        let mut message = Message::new(&self.transforms);
        message.resize("transforms", 1)?;
        set_header(
            &mut message,
            "transforms[0].header",
            sample.stamp,
            &frames.map,
        )?;
        message.set("transforms[0].child_frame_id", frames.base.as_str())?;
        let translation = "transforms[0].transform.translation";
        set_vector(&mut message, translation, sample.position)?;
        let rotation = "transforms[0].transform.rotation";
        set_quaternion(&mut message, rotation, sample.orientation)?;
        Ok(message)
    }

    pub(super) fn status(&self, stamp: Duration, all: &[Diagnostic]) -> Converted {
        let mut message = Message::new(&self.status);
        set_header(&mut message, "header", stamp, "")?;
        let status = all.iter().map(|it| {
            let values = it.values.iter();
            let values = values.map(|(key, value)| Value::Message(vec![text(key), text(value)]));
            Value::Message(vec![
                (it.level as u8).into(),
                text(&it.name),
                text(&it.message),
                text(&it.hardware_id),
                Value::Sequence(values.collect()),
            ])
        });
        message.set("status", Value::Sequence(status.collect()))?;
        Ok(message)
    }
}

/// NavSatFix: the covariance is an estimate.
const APPROXIMATED: u8 = 1;

/// NavSatStatus: there is a position. JAUS reports none without one.
const HAS_FIX: i8 = 0;
/// The variance of an unknown altitude: a deviation of 10 km. m²
const UNKNOWN_ALTITUDE: f64 = 1e8;

/// A text without NUL, which ROS cannot have in a string.
fn text(text: &str) -> Value {
    text.replace('\0', " ").into()
}

fn set_header(
    message: &mut Message,
    path: &str,
    stamp: Duration,
    frame: &str,
) -> Result<(), ValueError> {
    // After 2038 ROS has no times.
    let seconds = i32::try_from(stamp.as_secs()).unwrap_or(i32::MAX);
    message.set(&format!("{path}.stamp.sec"), seconds)?;
    message.set(&format!("{path}.stamp.nanosec"), stamp.subsec_nanos())?;
    message.set(&format!("{path}.frame_id"), frame)
}

fn set_vector(message: &mut Message, path: &str, [x, y, z]: [f64; 3]) -> Result<(), ValueError> {
    message.set(&format!("{path}.x"), x)?;
    message.set(&format!("{path}.y"), y)?;
    message.set(&format!("{path}.z"), z)
}

fn set_quaternion(
    message: &mut Message,
    path: &str,
    Quaternion { x, y, z, w }: Quaternion,
) -> Result<(), ValueError> {
    set_vector(message, path, [x, y, z])?;
    message.set(&format!("{path}.w"), w)
}

/// The matrix of a position or a linear velocity, and of angles or turn rates, row by row.
fn covariance(linear: f64, angular: f64) -> [f64; 36] {
    let mut matrix = [0.0; 36];
    for axis in 0..6 {
        matrix[7 * axis] = if axis < 3 { linear } else { angular };
    }
    matrix
}

fn vector(message: &Message, path: &str) -> Result<[f64; 3], ValueError> {
    Ok([
        message.float(&format!("{path}.x"))?,
        message.float(&format!("{path}.y"))?,
        message.float(&format!("{path}.z"))?,
    ])
}

/// The velocity of a Twist, or of a TwistStamped with the path `twist.`.
pub(super) fn read_twist(message: &Message, path: &str) -> Result<Twist, ValueError> {
    Ok(Twist {
        linear: vector(message, &format!("{path}linear"))?,
        angular: vector(message, &format!("{path}angular"))?,
    })
}

/// The goal of a PoseStamped.
pub(super) fn read_goal(message: &Message) -> Result<GoalPose, ValueError> {
    let [x, y, z] = vector(message, "pose.orientation")?;
    let w = message.float("pose.orientation.w")?;
    Ok(GoalPose {
        frame: message.text("header.frame_id")?.to_owned(),
        position: vector(message, "pose.position")?,
        orientation: Quaternion { x, y, z, w },
    })
}

#[cfg(test)]
mod tests {
    use super::super::diagnostics::Level;
    use super::*;
    use crate::cdr;

    const STAMP: Duration = Duration::from_millis(1_700_000_000_250);
    const EAST: Quaternion = Quaternion {
        x: 0.0,
        y: 0.0,
        z: 0.0,
        w: 1.0,
    };

    fn pose() -> PoseSample {
        PoseSample {
            stamp: STAMP,
            position: [1.0, 2.0, 3.0],
            orientation: EAST,
            position_variance: 0.25,
            attitude_variance: 0.01,
        }
    }

    fn twist() -> TwistSample {
        TwistSample {
            stamp: STAMP,
            linear: [1.5, 0.0, 0.0],
            angular: [0.0, 0.0, -0.5],
            linear_variance: 0.0,
            angular_variance: 0.0,
        }
    }

    /// The message after its way through CDR.
    fn sent(message: &Message) -> Message {
        cdr::decode(message.interface(), &cdr::encode(message)).unwrap()
    }

    #[test]
    fn odometry_has_the_pose_in_map_and_the_velocity_in_base_link() {
        let types = Types::bundled().unwrap();
        let (pose, twist) = (pose(), twist());
        let sample = OdometrySample { pose, twist };
        let message = sent(&types.odometry(&sample, &Frames::default()).unwrap());
        assert_eq!(message.text("header.frame_id").unwrap(), "map");
        assert_eq!(message.text("child_frame_id").unwrap(), "base_link");
        for (path, expected) in [
            ("header.stamp.sec", 1_700_000_000.0),
            ("header.stamp.nanosec", 250_000_000.0),
            ("pose.pose.position.y", 2.0),
            ("pose.pose.orientation.w", 1.0),
            ("pose.covariance[14]", 0.25),
            ("pose.covariance[21]", 0.01),
            ("pose.covariance[1]", 0.0),
            ("twist.twist.linear.x", 1.5),
            ("twist.twist.angular.z", -0.5),
        ] {
            assert_eq!(message.float(path).unwrap(), expected, "{path}");
        }
    }

    #[test]
    fn every_sample_has_a_message() {
        let types = Types::bundled().unwrap();
        let frames = Frames::default();
        let message = sent(&types.pose(&pose(), &frames).unwrap());
        assert_eq!(message.float("pose.position.x").unwrap(), 1.0);
        let message = sent(&types.transform(&pose(), &frames).unwrap());
        let z = message.float("transforms[0].transform.translation.z");
        assert_eq!(z.unwrap(), 3.0);
        let message = sent(&types.twist(&twist(), &frames).unwrap());
        assert_eq!(message.float("twist.linear.x").unwrap(), 1.5);
        let fix = FixSample {
            stamp: STAMP,
            latitude: 48.5,
            longitude: -9.25,
            altitude: None,
            variance: Some(4.0),
        };
        let message = sent(&types.fix(&fix, &frames).unwrap());
        assert!(message.float("altitude").unwrap().is_nan());
        assert_eq!(message.float("status.status").unwrap(), 0.0);
        assert_eq!(message.float("position_covariance[4]").unwrap(), 4.0);
        assert_eq!(message.float("position_covariance[8]").unwrap(), 1e8);
        let diagnostic = Diagnostic {
            level: Level::Error,
            name: "a\0b".to_owned(),
            message: "emergency".to_owned(),
            hardware_id: "101.1.33".to_owned(),
            values: vec![("age_s".to_owned(), "0.1".to_owned())],
        };
        let message = sent(&types.status(STAMP, &[diagnostic]).unwrap());
        assert_eq!(message.float("status[0].level").unwrap(), 2.0);
        assert_eq!(message.text("status[0].name").unwrap(), "a b");
        assert_eq!(message.text("status[0].values[0].key").unwrap(), "age_s");
    }

    #[test]
    fn commands_are_read_from_messages() {
        let types = Types::bundled().unwrap();
        let mut message = Message::new(&types.stamped_twist);
        message.set("twist.linear.x", 1.0).unwrap();
        message.set("twist.angular.z", 0.5).unwrap();
        let read = read_twist(&message, "twist.").unwrap();
        assert_eq!((read.linear[0], read.angular[2]), (1.0, 0.5));
        let mut message = Message::new(&types.pose);
        message.set("header.frame_id", "map").unwrap();
        message.set("pose.position.y", 2.0).unwrap();
        let goal = read_goal(&message).unwrap();
        assert_eq!((goal.frame.as_str(), goal.position[1]), ("map", 2.0));
        assert_eq!(goal.orientation, EAST, "the default of the type");
    }
}
