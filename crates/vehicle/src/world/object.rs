//! Objects on the globe: geometry, location and feature classes.

use std::fmt;

use deku::prelude::*;

/// The number of an object in the store: from 1 to [`LAST`](Self::LAST).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ObjectId(pub u32);

impl ObjectId {
    /// The greatest number of a stored object. Higher numbers are reserved for objects derived from
    /// other data.
    pub const LAST: Self = Self(0x7FFF_FFFF);
}

impl fmt::Display for ObjectId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "object {}", self.0)
    }
}

/// A position on the globe in the resolution of the messages, so that conversion is lossless.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, DekuRead, DekuWrite)]
#[deku(endian = "endian", ctx = "endian: deku::ctx::Endian")]
pub struct Place {
    /// North positive; a step is 180 degrees divided by 2^32 - 1.
    pub latitude: i32,
    /// East positive; a step is 360 degrees divided by 2^32 - 1.
    pub longitude: i32,
}

impl Place {
    /// Number of steps between the limits of a range.
    const STEPS: f64 = u32::MAX as f64;

    /// The nearest representable position. Latitudes beyond a pole become the pole.
    #[must_use]
    pub fn from_degrees(latitude: f64, longitude: f64) -> Self {
        let steps = |degrees: f64, range: f64| (degrees * (Self::STEPS / range)).round() as i32;
        Self {
            latitude: steps(latitude, 180.0),
            longitude: steps(longitude, 360.0),
        }
    }

    /// Latitude and longitude in degrees.
    #[must_use]
    pub fn degrees(self) -> (f64, f64) {
        let degrees = |steps: i32, range: f64| f64::from(steps) * (range / Self::STEPS);
        (
            degrees(self.latitude, 180.0),
            degrees(self.longitude, 360.0),
        )
    }
}

/// The interpretation of an object's points.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, DekuRead, DekuWrite)]
#[deku(id_type = "u8", endian = "endian", ctx = "endian: deku::ctx::Endian")]
pub enum Geometry {
    /// A single point.
    #[default]
    #[deku(id = "0")]
    Point,
    /// A polyline through the points in order.
    #[deku(id = "1")]
    Line,
    /// The area enclosed by the points. The last point connects to the first.
    #[deku(id = "2")]
    Polygon,
}

/// The attribute value of a feature class.
#[derive(Debug, Clone, Copy, PartialEq, DekuRead, DekuWrite)]
#[deku(id_type = "u8", endian = "endian", ctx = "endian: deku::ctx::Endian")]
pub enum Attribute {
    /// One octet, unsigned.
    #[deku(id = "0")]
    Byte(u8),
    /// Two octets, signed.
    #[deku(id = "1")]
    Short(i16),
    /// Four octets, signed.
    #[deku(id = "2")]
    Integer(i32),
    /// Eight octets, signed.
    #[deku(id = "3")]
    Long(i64),
    /// Two octets, unsigned.
    #[deku(id = "4")]
    UnsignedShort(u16),
    /// Four octets, unsigned.
    #[deku(id = "5")]
    UnsignedInteger(u32),
    /// Eight octets, unsigned.
    #[deku(id = "6")]
    UnsignedLong(u64),
    /// A single-precision number.
    #[deku(id = "7")]
    Float(f32),
    /// A double-precision number.
    #[deku(id = "8")]
    LongFloat(f64),
    /// Red, green, blue.
    #[deku(id = "9")]
    Colour([u8; 3]),
}

impl Default for Attribute {
    fn default() -> Self {
        Self::Byte(0)
    }
}

/// Membership of an object in a feature class.
#[derive(Debug, Clone, Copy, PartialEq, Default, DekuRead, DekuWrite)]
#[deku(endian = "endian", ctx = "endian: deku::ctx::Endian")]
pub struct FeatureClass {
    /// Number of the class.
    pub id: u16,
    /// Attribute of the object in this class.
    pub attribute: Attribute,
}

impl FeatureClass {
    /// Stands for all classes in queries.
    pub const ALL: u16 = u16::MAX;
    /// Traversability class: a byte, from 0 for impassable to 255 for free.
    pub const TRAVERSABILITY: u16 = 1;
}

/// A point, a line or a polygon.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Object {
    /// Interpretation of the points.
    pub geometry: Geometry,
    /// Buffer around the points, in metres.
    pub buffer: f32,
    /// The classes of the object.
    pub classes: Vec<FeatureClass>,
    /// The points.
    pub points: Vec<Place>,
}

impl Object {
    /// Maximum number of classes of one object.
    pub const MOST_CLASSES: usize = u8::MAX as usize;
    /// Maximum number of points of one object.
    pub const MOST_POINTS: usize = u16::MAX as usize;

    /// Whether the object is valid: a point has one point, a line two or more, a polygon three or
    /// more, and the buffer is finite and not negative.
    #[must_use]
    pub fn is_sound(&self) -> bool {
        let points = self.points.len();
        let enough = match self.geometry {
            Geometry::Point => points == 1,
            Geometry::Line => points >= 2,
            Geometry::Polygon => points >= 3,
        };
        enough
            && points <= Self::MOST_POINTS
            && self.classes.len() <= Self::MOST_CLASSES
            && self.buffer.is_finite()
            && self.buffer >= 0.0
    }

    /// Whether the object belongs to a class. [`FeatureClass::ALL`] matches every object.
    #[must_use]
    pub fn belongs_to(&self, class: u16) -> bool {
        class == FeatureClass::ALL || self.classes.iter().any(|it| it.id == class)
    }
}
