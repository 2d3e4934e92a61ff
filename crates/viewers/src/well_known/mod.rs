//! Reports in the schemas of Foxglove, which its map, 3D and image panels show without settings.
//!
//! | report | schema | topic below that of the source |
//! |---|---|---|
//! | ReportGlobalPose, ReportGlobalPoseExt | `foxglove.LocationFix` | `fix` |
//! | ReportLocalPose, ReportLocalPoseExt | `foxglove.PoseInFrame`, `foxglove.FrameTransform` | `pose`, `transform` |
//! | ReportSensorGeometricProperties | `foxglove.FrameTransform` | `sensor/1/transform` |
//! | ReportRangeSensorData | `foxglove.PointCloud` | `sensor/1/points` |
//! | ReportStillImageDataExt | `foxglove.CompressedImage` | `sensor/1/image` |
//!
//! The axes of JAUS point forward, to the right and down; those of the viewers forward, to the left
//! and up. Y and Z change their sign, so that a vehicle on the ground is upright in a 3D panel.
//!
//! The frames are `101/local`, `101/vehicle`, and `101/1/40/sensor/1` for a sensor with data in its
//! own frame.

mod geometry;
mod schemas;
mod sensors;

use std::sync::Arc;

use serde_json::{Value as Json, json};

use crate::schema::Schema;
use crate::topic::topic;
use geometry::{Quaternion, Vector};

/// A message that may have samples here.
pub(crate) struct Message<'m> {
    pub(crate) service: &'m str,
    pub(crate) name: &'m str,
    /// The sender, such as `101.1.40`.
    pub(crate) source: &'m str,
    pub(crate) body: &'m Json,
    /// Nanoseconds since 1970.
    pub(crate) time: u64,
}

/// A sample with a schema of Foxglove.
pub(crate) struct WellKnown {
    pub(crate) topic: String,
    pub(crate) schema: Arc<Schema>,
    pub(crate) value: Json,
}

/// The samples of a message; mostly none.
pub(crate) fn samples(message: &Message<'_>) -> Vec<WellKnown> {
    // The Reference Architecture has messages of the same names with other fields.
    if !message.service.starts_with("urn:jaus:jss:") {
        return Vec::new();
    }
    match message.name {
        "ReportGlobalPose" | "ReportGlobalPoseExt" => message.location().into_iter().collect(),
        "ReportLocalPose" | "ReportLocalPoseExt" => message.local_pose(),
        "ReportSensorGeometricProperties" => sensors::mountings(message),
        "ReportRangeSensorData" => sensors::points(message),
        "ReportStillImageDataExt" => sensors::images(message),
        _ => Vec::new(),
    }
}

impl Message<'_> {
    fn location(&self) -> Option<WellKnown> {
        let altitude = ["Altitude", "AltitudeMSL"]
            .iter()
            .find_map(|name| self.number(name));
        let value = json!({
            "timestamp": self.timestamp(),
            "frame_id": self.vehicle(),
            "latitude": self.number("Latitude")?,
            "longitude": self.number("Longitude")?,
            "altitude": altitude.unwrap_or(0.0),
            "position_covariance": [0, 0, 0, 0, 0, 0, 0, 0, 0],
            // Unknown.
            "position_covariance_type": 0,
        });
        Some(self.sample("fix", &schemas::LOCATION_FIX, value))
    }

    fn local_pose(&self) -> Vec<WellKnown> {
        let (Some(x), Some(y)) = (self.number("X"), self.number("Y")) else {
            return Vec::new();
        };
        let any = |names: [&str; 2]| names.iter().find_map(|name| self.number(name));
        let position = Vector([x, y, any(["Z", "ZLocal"]).unwrap_or(0.0)]);
        let angle = |names| any(names).unwrap_or(0.0);
        let rotation = Quaternion::of_angles(
            angle(["Roll", "Roll"]),
            angle(["Pitch", "Pitch"]),
            angle(["Yaw", "Heading"]),
        );
        let frame = format!("{}/local", self.subsystem());
        let pose = json!({
            "timestamp": self.timestamp(),
            "frame_id": frame,
            "pose": {
                "position": position.for_viewers(),
                "orientation": rotation.for_viewers(),
            },
        });
        let transform = self.transform(&frame, &self.vehicle(), position, rotation);
        vec![
            self.sample("pose", &schemas::POSE_IN_FRAME, pose),
            self.sample("transform", &schemas::FRAME_TRANSFORM, transform),
        ]
    }

    fn transform(&self, parent: &str, child: &str, at: Vector, turned: Quaternion) -> Json {
        json!({
            "timestamp": self.timestamp(),
            "parent_frame_id": parent,
            "child_frame_id": child,
            "translation": at.for_viewers(),
            "rotation": turned.for_viewers(),
        })
    }

    fn sample(&self, name: &str, schema: &schemas::Known, value: Json) -> WellKnown {
        WellKnown {
            topic: topic(self.source, name),
            schema: Arc::clone(schema),
            value,
        }
    }

    fn number(&self, field: &str) -> Option<f64> {
        self.body.get(field)?.as_f64()
    }

    fn subsystem(&self) -> &str {
        self.source.split('.').next().unwrap_or_default()
    }

    fn vehicle(&self) -> String {
        format!("{}/vehicle", self.subsystem())
    }

    fn timestamp(&self) -> Json {
        json!({ "sec": self.time / 1_000_000_000, "nsec": self.time % 1_000_000_000 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    pub(super) fn of(name: &str, body: &Json) -> Vec<WellKnown> {
        samples(&Message {
            service: "urn:jaus:jss:mobility:Any",
            name,
            source: "101.1.40",
            body,
            time: 1_500_000_000,
        })
    }

    #[test]
    fn a_position_on_the_globe_is_a_location_fix() {
        let body = json!({ "Latitude": 48.5, "Longitude": -9.25, "Altitude": 400.0 });
        let fixes = of("ReportGlobalPose", &body);
        assert_eq!(fixes.len(), 1);
        assert_eq!(fixes[0].topic, "/jaus/101/1/40/fix");
        assert_eq!(fixes[0].schema.name, "foxglove.LocationFix");
        let value = &fixes[0].value;
        assert_eq!(value["timestamp"], json!({ "sec": 1, "nsec": 500_000_000 }));
        assert_eq!(
            (&value["latitude"], &value["longitude"]),
            (&json!(48.5), &json!(-9.25))
        );
        assert!(of("ReportGlobalPose", &json!({ "Latitude": 48.5 })).is_empty());
    }

    #[test]
    fn a_local_pose_is_a_pose_and_a_transform_with_axes_that_point_left_and_up() {
        let body = json!({ "X": 1.0, "Y": 2.0, "Z": -3.0, "Yaw": std::f64::consts::FRAC_PI_2 });
        let samples = of("ReportLocalPose", &body);
        let names: Vec<_> = samples.iter().map(|it| &*it.schema.name).collect();
        assert_eq!(names, ["foxglove.PoseInFrame", "foxglove.FrameTransform"]);
        let transform = &samples[1].value;
        assert_eq!(transform["parent_frame_id"], "101/local");
        assert_eq!(transform["child_frame_id"], "101/vehicle");
        let expected = json!({ "x": 1.0, "y": -2.0, "z": 3.0 });
        assert_eq!(transform["translation"], expected);
        // A turn to the right is one about the axis that points up, by a negative angle.
        let z = transform["rotation"]["z"].as_f64().unwrap();
        assert!((z + std::f64::consts::FRAC_1_SQRT_2).abs() < 1e-12, "{z}");
    }

    #[test]
    fn messages_of_other_architectures_are_left_alone() {
        let body = json!({ "Latitude": 1.0, "Longitude": 1.0 });
        let message = Message {
            service: "urn:jaus-rs:ra33:GlobalPoseSensor",
            name: "ReportGlobalPose",
            source: "101.1.40.1",
            body: &body,
            time: 0,
        };
        assert!(samples(&message).is_empty());
    }
}
