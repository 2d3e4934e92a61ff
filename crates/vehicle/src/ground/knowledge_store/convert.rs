//! Conversion of objects and selections between messages and the world model.

use crate::messages::ground::create_vks_objects::{
    Attribute as AttributeRec, ByteRec, ColourRec, FeatureClassRec, FeatureClassSeq, FloatRec,
    IntegerRec, LongFloatRec, LongRec, ObjectRec, ObjectType, Objects, PointRec, ShortRec,
    UnsignedIntegerRec, UnsignedLongRec, UnsignedShortRec,
};
use crate::messages::ground::query_vks_objects::RegionType;
use crate::messages::ground::report_vks_objects::{BufferRec, ObjectIdRec, ObjectSeq};
use crate::messages::ground::{
    CreateVksObjects, DeleteVksObjects, QueryVksObjects, QueryVksTraversability,
};
use crate::world::{Attribute, FeatureClass, Geometry, Object, ObjectId, Place, Region, Selection};

/// A decoded Create VKS Objects request.
pub(super) struct Creation {
    pub(super) request_id: u8,
    pub(super) confirm: bool,
    pub(super) objects: Vec<Object>,
}

/// Decodes a creation. An object of unknown kind gets no points, so the world refuses it.
pub(super) fn creation(message: &CreateVksObjects) -> Creation {
    match &message.objects {
        Objects::PlainSeq(seq) => Creation {
            request_id: seq.request_rec.request_id,
            confirm: wants_confirmation(seq.request_rec.message_properties),
            objects: seq
                .plain_list
                .iter()
                .map(|it| object(&it.object_rec, 0.0, &it.feature_class_list, &it.point_list))
                .collect(),
        },
        Objects::BufferedSeq(seq) => Creation {
            request_id: seq.request_rec.request_id,
            confirm: wants_confirmation(seq.request_rec.message_properties),
            objects: seq
                .buffered_list
                .iter()
                .map(|it| {
                    let buffer = it.buffer_rec.buffer;
                    object(
                        &it.object_rec,
                        buffer,
                        &it.feature_class_list,
                        &it.point_list,
                    )
                })
                .collect(),
        },
    }
}

const fn wants_confirmation(message_properties: u8) -> bool {
    message_properties & 1 != 0
}

fn object(
    kind: &ObjectRec,
    buffer: f32,
    classes: &[FeatureClassSeq],
    points: &[PointRec],
) -> Object {
    let geometry = geometry(kind.object_type.0, points.len());
    Object {
        geometry: geometry.unwrap_or_default(),
        buffer,
        classes: classes.iter().map(class).collect(),
        points: geometry.map_or_else(Vec::new, |_| places(points)),
    }
}

/// The geometry for a number of the message. An unknown one is derived from the number of points.
const fn geometry(number: u8, points: usize) -> Option<Geometry> {
    match (ObjectType(number), points) {
        (ObjectType::POINT, _) | (ObjectType::UNKNOWN, 0 | 1) => Some(Geometry::Point),
        (ObjectType::LINE, _) | (ObjectType::UNKNOWN, 2) => Some(Geometry::Line),
        (ObjectType::POLYGON | ObjectType::UNKNOWN, _) => Some(Geometry::Polygon),
        _ => None,
    }
}

fn class(seq: &FeatureClassSeq) -> FeatureClass {
    FeatureClass {
        id: seq.feature_class_rec.feature_class_id,
        attribute: attribute(&seq.attribute),
    }
}

fn attribute(record: &AttributeRec) -> Attribute {
    match *record {
        AttributeRec::ByteRec(ByteRec { value }) => Attribute::Byte(value),
        AttributeRec::ShortRec(ShortRec { value }) => Attribute::Short(value),
        AttributeRec::IntegerRec(IntegerRec { value }) => Attribute::Integer(value),
        AttributeRec::LongRec(LongRec { value }) => Attribute::Long(value),
        AttributeRec::UnsignedShortRec(UnsignedShortRec { value }) => {
            Attribute::UnsignedShort(value)
        }
        AttributeRec::UnsignedIntegerRec(UnsignedIntegerRec { value }) => {
            Attribute::UnsignedInteger(value)
        }
        AttributeRec::UnsignedLongRec(UnsignedLongRec { value }) => Attribute::UnsignedLong(value),
        AttributeRec::FloatRec(FloatRec { value }) => Attribute::Float(value),
        AttributeRec::LongFloatRec(LongFloatRec { value }) => Attribute::LongFloat(value),
        AttributeRec::ColourRec(ColourRec { red, green, blue }) => {
            Attribute::Colour([red, green, blue])
        }
    }
}

fn attribute_record(attribute: Attribute) -> AttributeRec {
    match attribute {
        Attribute::Byte(value) => AttributeRec::ByteRec(ByteRec { value }),
        Attribute::Short(value) => AttributeRec::ShortRec(ShortRec { value }),
        Attribute::Integer(value) => AttributeRec::IntegerRec(IntegerRec { value }),
        Attribute::Long(value) => AttributeRec::LongRec(LongRec { value }),
        Attribute::UnsignedShort(value) => {
            AttributeRec::UnsignedShortRec(UnsignedShortRec { value })
        }
        Attribute::UnsignedInteger(value) => {
            AttributeRec::UnsignedIntegerRec(UnsignedIntegerRec { value })
        }
        Attribute::UnsignedLong(value) => AttributeRec::UnsignedLongRec(UnsignedLongRec { value }),
        Attribute::Float(value) => AttributeRec::FloatRec(FloatRec { value }),
        Attribute::LongFloat(value) => AttributeRec::LongFloatRec(LongFloatRec { value }),
        Attribute::Colour([red, green, blue]) => {
            AttributeRec::ColourRec(ColourRec { red, green, blue })
        }
    }
}

fn places(points: &[PointRec]) -> Vec<Place> {
    let place = |point: &PointRec| Place {
        latitude: point.latitude,
        longitude: point.longitude,
    };
    points.iter().map(place).collect()
}

/// Converts an object to its report form.
pub(super) fn reported(id: ObjectId, object: &Object) -> ObjectSeq {
    let object_type = match object.geometry {
        Geometry::Point => ObjectType::POINT,
        Geometry::Line => ObjectType::LINE,
        Geometry::Polygon => ObjectType::POLYGON,
    };
    let classes = object.classes.iter().map(|class| FeatureClassSeq {
        feature_class_rec: FeatureClassRec {
            feature_class_id: class.id,
        },
        attribute: attribute_record(class.attribute),
    });
    let points = object.points.iter().map(|place| PointRec {
        latitude: place.latitude,
        longitude: place.longitude,
    });
    ObjectSeq {
        object_id_rec: ObjectIdRec { object_id: id.0 },
        object_rec: ObjectRec { object_type },
        buffer_rec: BufferRec {
            buffer: object.buffer,
        },
        feature_class_list: classes.collect(),
        point_list: points.collect(),
    }
}

/// The conditions of a query; `None` if they contradict each other.
pub(super) fn selection(query: &QueryVksObjects) -> Option<Selection> {
    let named = query.feature_class_rec.is_some() || query.attribute.is_some();
    let count = query.feature_class_count_rec.as_ref();
    let count = count.map(|it| it.feature_class_count);
    if named != (count == Some(1)) || count.is_some_and(|count| count > 1) {
        return None;
    }
    let points = query.point_list.as_deref().unwrap_or_default();
    let region = match (&query.region_rec, &query.point_list) {
        (None, None) if query.buffer_rec.is_none() => None,
        (Some(region), Some(_)) => Some(Region {
            geometry: region_geometry(region.region_type, points.len())?,
            buffer: query.buffer_rec.as_ref().map_or(0.0, |it| it.buffer),
            points: places(points),
        }),
        _ => return None,
    };
    let ids = query.object_id_list.as_ref();
    let selection = Selection {
        ids: ids.map(|ids| ids.iter().map(|it| ObjectId(it.object_id)).collect()),
        region,
        class: query
            .feature_class_rec
            .as_ref()
            .map(|it| it.feature_class_id),
        attribute: query.attribute.as_ref().map(attribute),
    };
    selection.is_sound().then_some(selection)
}

const fn region_geometry(kind: RegionType, points: usize) -> Option<Geometry> {
    geometry(kind.0, points)
}

/// The conditions of a deletion as a query.
pub(super) fn as_query(delete: DeleteVksObjects) -> QueryVksObjects {
    QueryVksObjects {
        object_id_list: delete.object_id_list,
        region_rec: delete.region_rec,
        buffer_rec: delete.buffer_rec,
        feature_class_count_rec: delete.feature_class_count_rec,
        feature_class_rec: delete.feature_class_rec,
        attribute: delete.attribute,
        point_list: delete.point_list,
        ..QueryVksObjects::default()
    }
}

/// A traversability query as an objects query.
pub(super) fn as_objects_query(query: QueryVksTraversability) -> QueryVksObjects {
    QueryVksObjects {
        request_rec: query.request_rec,
        object_id_list: query.object_id_list,
        region_rec: query.region_rec,
        buffer_rec: query.buffer_rec,
        feature_class_count_rec: query.feature_class_count_rec,
        feature_class_rec: query.feature_class_rec,
        attribute: query.attribute,
        point_list: query.point_list,
    }
}
