//! Objects on the globe: what they are, where, and which feature classes they belong to.

use std::fmt;

use deku::prelude::*;

/// The number that a store gives an object: from 1 to [`LAST`](Self::LAST).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ObjectId(pub u32);

impl ObjectId {
    /// The greatest number that an object is given; those above are left to whoever derives objects
    /// from something else.
    pub const LAST: Self = Self(0x7FFF_FFFF);
}

impl fmt::Display for ObjectId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "object {}", self.0)
    }
}

/// A place on the globe, in the steps of the messages, which therefore lose nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, DekuRead, DekuWrite)]
#[deku(endian = "endian", ctx = "endian: deku::ctx::Endian")]
pub struct Place {
    /// North positive; a step is 180 degrees divided by 2^32 - 1.
    pub latitude: i32,
    /// East positive; a step is 360 degrees divided by 2^32 - 1.
    pub longitude: i32,
}

impl Place {
    /// Steps from one limit of a range to the other.
    const STEPS: f64 = u32::MAX as f64;

    /// The nearest place that can be told; beyond a pole that is the pole.
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

/// What the points of an object are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, DekuRead, DekuWrite)]
#[deku(id_type = "u8", endian = "endian", ctx = "endian: deku::ctx::Endian")]
pub enum Geometry {
    /// One point.
    #[default]
    #[deku(id = "0")]
    Point,
    /// Points joined in their order.
    #[deku(id = "1")]
    Line,
    /// What the points enclose; the last is joined to the first.
    #[deku(id = "2")]
    Polygon,
}

/// A value that goes with a feature class.
#[derive(Debug, Clone, Copy, PartialEq, DekuRead, DekuWrite)]
#[deku(id_type = "u8", endian = "endian", ctx = "endian: deku::ctx::Endian")]
pub enum Attribute {
    /// One octet.
    #[deku(id = "0")]
    Byte(u8),
    /// Two octets.
    #[deku(id = "1")]
    Short(i16),
    /// Four octets.
    #[deku(id = "2")]
    Integer(i32),
    /// Eight octets.
    #[deku(id = "3")]
    Long(i64),
    /// Two octets, not negative.
    #[deku(id = "4")]
    UnsignedShort(u16),
    /// Four octets, not negative.
    #[deku(id = "5")]
    UnsignedInteger(u32),
    /// Eight octets, not negative.
    #[deku(id = "6")]
    UnsignedLong(u64),
    /// A real number.
    #[deku(id = "7")]
    Float(f32),
    /// A real number of double precision.
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

/// A class that an object belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Default, DekuRead, DekuWrite)]
#[deku(endian = "endian", ctx = "endian: deku::ctx::Endian")]
pub struct FeatureClass {
    /// Its number.
    pub id: u16,
    /// What is known about the object as one of the class.
    pub attribute: Attribute,
}

impl FeatureClass {
    /// Stands for all classes where a class is asked for.
    pub const ALL: u16 = u16::MAX;
    /// How well a place can be driven on: a byte, 0 impassable to 255 free.
    pub const TRAVERSABILITY: u16 = 1;
}

/// A point, a line or a polygon.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Object {
    /// What the points are.
    pub geometry: Geometry,
    /// How far it reaches beyond its points, in metres.
    pub buffer: f32,
    /// The classes that it belongs to.
    pub classes: Vec<FeatureClass>,
    /// Where it is.
    pub points: Vec<Place>,
}

impl Object {
    /// The most classes of one object.
    pub const MOST_CLASSES: usize = u8::MAX as usize;
    /// The most points of one object.
    pub const MOST_POINTS: usize = u16::MAX as usize;

    /// Whether it is an object: a point has one point, a line two or more, a polygon three or more,
    /// and the buffer is a distance.
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

    /// Whether it belongs to a class, or to any if that is [`FeatureClass::ALL`].
    #[must_use]
    pub fn belongs_to(&self, class: u16) -> bool {
        class == FeatureClass::ALL || self.classes.iter().any(|it| it.id == class)
    }
}
