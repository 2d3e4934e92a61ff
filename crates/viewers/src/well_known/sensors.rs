//! Sensors of the environment: how they are mounted, their points and their images.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use jaus_view::from_hex;
use serde_json::{Value as Json, json};

use super::geometry::{Quaternion, Vector};
use super::schemas::{COMPRESSED_IMAGE, FRAME_TRANSFORM, POINT_CLOUD};
use super::{Message, WellKnown};

/// Octets of a point: three numbers of four.
const STRIDE: usize = 12;
/// Foxglove's number for a field of type FLOAT32.
const FLOAT32: u8 = 7;

/// How sensors are mounted on the vehicle.
pub(super) fn mountings(message: &Message<'_>) -> Vec<WellKnown> {
    elements(message.body)
        .filter_map(|properties| mounting(message, properties))
        .collect()
}

fn mounting(message: &Message<'_>, properties: &Json) -> Option<WellKnown> {
    let sensor = properties.pointer("/SensorIdRec/SensorID")?.as_u64()?;
    let variant = properties.get("GeometricPropertiesVariant")?;
    let fixed = variant.get("StaticGeometricPropertiesRec")?;
    let position = Vector(numbers(fixed.get("SensorPosition")?)?);
    let rotation = Quaternion(numbers(fixed.get("UnitQuaternion")?)?);
    let child = sensor_frame(message, sensor);
    let value = message.transform(&message.vehicle(), &child, position, rotation);
    let name = format!("sensor/{sensor}/transform");
    Some(message.sample(&name, &FRAME_TRANSFORM, value))
}

/// The points that range sensors measured.
pub(super) fn points(message: &Message<'_>) -> Vec<WellKnown> {
    elements(message.body)
        .filter_map(|data| cloud(message, data.get("RangeSensorDataSeq")?))
        .collect()
}

fn cloud(message: &Message<'_>, data: &Json) -> Option<WellKnown> {
    let record = data.get("RangeSensorDataRec")?;
    let (sensor, frame) = sensor_and_frame(message, record)?;
    let points = elements(data.get("RangeSensorDataPointList")?);
    let mut octets = Vec::new();
    for [x, y, z] in points.filter_map(point) {
        for number in [x, y, z] {
            octets.extend_from_slice(&(number as f32).to_le_bytes());
        }
    }
    let field = |(place, name)| json!({ "name": name, "offset": 4 * place, "type": FLOAT32 });
    let fields: Vec<_> = ["x", "y", "z"].into_iter().enumerate().map(field).collect();
    let value = json!({
        "timestamp": message.timestamp(),
        "frame_id": frame,
        "pose": {
            "position": { "x": 0, "y": 0, "z": 0 },
            "orientation": { "x": 0, "y": 0, "z": 0, "w": 1 },
        },
        "point_stride": STRIDE,
        "fields": fields,
        "data": STANDARD.encode(octets),
    });
    let name = format!("sensor/{sensor}/points");
    Some(message.sample(&name, &POINT_CLOUD, value))
}

/// A point in the axes of viewers; `None` if the sensor says that it is not valid.
fn point(record: &Json) -> Option<[f64; 3]> {
    let is_invalid = |field: &str| {
        let validity = record.get(field);
        validity.is_some_and(|it| it == "False" || it == 0)
    };
    let validities = ["RangeValidity", "BearingValidity", "InclinationValidity"];
    if validities.into_iter().any(is_invalid) {
        return None;
    }
    let number = |field: &str| record.get(field)?.as_f64();
    let (range, bearing) = (number("Range")?, number("Bearing")?);
    Some(Vector::of_polar(range, bearing, number("Inclination")?).turned())
}

/// The pictures of cameras, in the formats that viewers show.
pub(super) fn images(message: &Message<'_>) -> Vec<WellKnown> {
    elements(message.body)
        .filter_map(|record| image(message, record))
        .collect()
}

fn image(message: &Message<'_>, record: &Json) -> Option<WellKnown> {
    let (sensor, frame) = sensor_and_frame(message, record)?;
    let picture = record.get("ImageFrame")?;
    let format = match picture.get("format")?.as_u64()? {
        0 => "jpeg",
        2 => "png",
        _ => return None,
    };
    let octets = from_hex(picture.get("data")?.as_str()?).ok()?;
    let value = json!({
        "timestamp": message.timestamp(),
        "frame_id": frame,
        "data": STANDARD.encode(octets),
        "format": format,
    });
    let name = format!("sensor/{sensor}/image");
    Some(message.sample(&name, &COMPRESSED_IMAGE, value))
}

/// The number of a sensor, and the frame of its data.
fn sensor_and_frame(message: &Message<'_>, record: &Json) -> Option<(u64, String)> {
    let sensor = record.get("SensorID")?.as_u64()?;
    let system = record.get("ReportCoordinateSystem")?;
    let is_vehicle = system == 1 || system == "Vehicle Coordinate System";
    let frame = match is_vehicle {
        true => message.vehicle(),
        false => sensor_frame(message, sensor),
    };
    Some((sensor, frame))
}

fn sensor_frame(message: &Message<'_>, sensor: u64) -> String {
    format!("{}/sensor/{sensor}", message.source.replace('.', "/"))
}

fn elements(list: &Json) -> impl Iterator<Item = &Json> {
    list.as_array().into_iter().flatten()
}

fn numbers<const N: usize>(list: &Json) -> Option<[f64; N]> {
    let numbers: Option<Vec<f64>> = list.as_array()?.iter().map(Json::as_f64).collect();
    numbers?.try_into().ok()
}

#[cfg(test)]
mod tests {
    use super::super::tests::of;
    use super::*;

    #[test]
    fn points_of_a_sensor_are_a_cloud_in_its_frame_without_the_invalid_ones() {
        let body = json!([{ "RangeSensorDataSeq": {
            "RangeSensorDataRec": {
                "SensorID": 3, "ReportCoordinateSystem": "Native Coordinate System",
            },
            "RangeSensorDataPointList": [
                { "Range": 2.0, "Bearing": 0.0, "Inclination": 0.0 },
                { "Range": 9.0, "Bearing": 0.0, "Inclination": 0.0, "RangeValidity": "False" },
            ],
        } }, { "RangeSensorDataErrorRec": {} }]);
        let clouds = of("ReportRangeSensorData", &body);
        assert_eq!(clouds.len(), 1);
        assert_eq!(clouds[0].topic, "/jaus/101/1/40/sensor/3/points");
        assert_eq!(clouds[0].value["frame_id"], "101/1/40/sensor/3");
        let data = STANDARD.decode(clouds[0].value["data"].as_str().unwrap());
        let expected = [2.0_f32, 0.0, 0.0].map(f32::to_le_bytes).concat();
        assert_eq!(data.unwrap(), expected);
    }

    #[test]
    fn a_mounting_on_the_vehicle_is_a_transform_to_the_sensor() {
        let body = json!([{
            "SensorIdRec": { "SensorID": 1 },
            "GeometricPropertiesVariant": { "StaticGeometricPropertiesRec": {
                "SensorPosition": [1.0, 0.5, -0.25], "UnitQuaternion": [1.0, 0.0, 0.0, 0.0],
            } },
        }]);
        let transforms = of("ReportSensorGeometricProperties", &body);
        let value = &transforms[0].value;
        assert_eq!(value["parent_frame_id"], "101/vehicle");
        assert_eq!(value["child_frame_id"], "101/1/40/sensor/1");
        assert_eq!(
            value["translation"],
            json!({ "x": 1.0, "y": -0.5, "z": 0.25 })
        );
    }

    #[test]
    fn a_picture_is_a_compressed_image_if_viewers_know_its_format() {
        let record = |format: u8| {
            json!([{
                "SensorID": 1, "ReportCoordinateSystem": 1,
                "ImageFrame": { "format": format, "data": "FFD8" },
            }])
        };
        let images = of("ReportStillImageDataExt", &record(0));
        assert_eq!(images[0].value["format"], "jpeg");
        assert_eq!(images[0].value["data"], "/9g=");
        assert_eq!(images[0].value["frame_id"], "101/vehicle");
        assert!(of("ReportStillImageDataExt", &record(9)).is_empty());
    }
}
