//! Foxglove's schemas, as JSON Schema: names and fields as <https://docs.foxglove.dev/docs/sdk/schemas>
//! lists them.

use std::sync::{Arc, LazyLock};

use serde_json::{Value as Json, json};

use crate::schema::Schema;

/// A schema that is made when it is first used.
pub(super) type Known = LazyLock<Arc<Schema>>;

pub(super) static LOCATION_FIX: Known = LazyLock::new(|| {
    let numbers =
        json!({ "type": "array", "items": { "type": "number" }, "minItems": 9, "maxItems": 9 });
    let kinds = json!({ "type": "integer", "oneOf": [
        { "title": "UNKNOWN", "const": 0 },
        { "title": "APPROXIMATED", "const": 1 },
        { "title": "DIAGONAL_KNOWN", "const": 2 },
        { "title": "KNOWN", "const": 3 },
    ] });
    schema(
        "foxglove.LocationFix",
        &json!({
            "timestamp": time(),
            "frame_id": text(),
            "latitude": number(),
            "longitude": number(),
            "altitude": number(),
            "position_covariance": numbers,
            "position_covariance_type": kinds,
        }),
    )
});

pub(super) static POSE_IN_FRAME: Known = LazyLock::new(|| {
    schema(
        "foxglove.PoseInFrame",
        &json!({ "timestamp": time(), "frame_id": text(), "pose": pose() }),
    )
});

pub(super) static FRAME_TRANSFORM: Known = LazyLock::new(|| {
    schema(
        "foxglove.FrameTransform",
        &json!({
            "timestamp": time(),
            "parent_frame_id": text(),
            "child_frame_id": text(),
            "translation": vector("foxglove.Vector3"),
            "rotation": quaternion(),
        }),
    )
});

pub(super) static POINT_CLOUD: Known = LazyLock::new(|| {
    let field = object(
        "foxglove.PackedElementField",
        &json!({ "name": text(), "offset": integer(), "type": integer() }),
    );
    schema(
        "foxglove.PointCloud",
        &json!({
            "timestamp": time(),
            "frame_id": text(),
            "pose": pose(),
            "point_stride": integer(),
            "fields": { "type": "array", "items": field },
            "data": octets(),
        }),
    )
});

pub(super) static COMPRESSED_IMAGE: Known = LazyLock::new(|| {
    schema(
        "foxglove.CompressedImage",
        &json!({ "timestamp": time(), "frame_id": text(), "data": octets(), "format": text() }),
    )
});

fn schema(name: &str, properties: &Json) -> Arc<Schema> {
    Arc::new(Schema {
        name: name.to_owned(),
        text: object(name, properties).to_string(),
    })
}

fn object(title: &str, properties: &Json) -> Json {
    json!({ "title": title, "type": "object", "properties": properties })
}

fn time() -> Json {
    object("time", &json!({ "sec": integer(), "nsec": integer() }))
}

fn pose() -> Json {
    object(
        "foxglove.Pose",
        &json!({ "position": vector("foxglove.Vector3"), "orientation": quaternion() }),
    )
}

fn vector(title: &str) -> Json {
    object(
        title,
        &json!({ "x": number(), "y": number(), "z": number() }),
    )
}

fn quaternion() -> Json {
    object(
        "foxglove.Quaternion",
        &json!({ "x": number(), "y": number(), "z": number(), "w": number() }),
    )
}

fn number() -> Json {
    json!({ "type": "number" })
}

fn integer() -> Json {
    json!({ "type": "integer", "minimum": 0 })
}

fn text() -> Json {
    json!({ "type": "string" })
}

fn octets() -> Json {
    json!({ "type": "string", "contentEncoding": "base64" })
}
