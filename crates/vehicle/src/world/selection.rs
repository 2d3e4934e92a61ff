//! Selection of objects by number, location and class.

use super::object::{Attribute, FeatureClass, Geometry, Object, ObjectId, Place};
use super::shape::Shape;

/// Conditions that must all hold. Without conditions, every object is selected.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Selection {
    /// Only these objects.
    pub ids: Option<Vec<ObjectId>>,
    /// Only objects that meet this region.
    pub region: Option<Region>,
    /// Only objects of this class. [`FeatureClass::ALL`] matches any.
    pub class: Option<u16>,
    /// Only objects with this attribute, in the given class if there is one.
    pub attribute: Option<Attribute>,
}

/// A region of the globe.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Region {
    /// Interpretation of the points.
    pub geometry: Geometry,
    /// Buffer around the points, in metres.
    pub buffer: f32,
    /// The points, from 1 to [`MOST_POINTS`](Self::MOST_POINTS).
    pub points: Vec<Place>,
}

impl Region {
    /// Maximum number of points, so that testing an object against a region does not take seconds.
    pub const MOST_POINTS: usize = 128;

    /// Whether the region is valid.
    #[must_use]
    pub fn is_sound(&self) -> bool {
        let few = (1..=Self::MOST_POINTS).contains(&self.points.len());
        few && self.buffer.is_finite() && self.buffer >= 0.0
    }

    fn meets(&self, object: &Object) -> bool {
        let Some(&origin) = self.points.first() else {
            return false;
        };
        let reach = f64::from(self.buffer) + f64::from(object.buffer);
        let here = Shape::new(self.geometry, &self.points, origin);
        let there = Shape::new(object.geometry, &object.points, origin);
        here.meets(&there, reach)
    }
}

impl Selection {
    /// Whether the selection is valid, which depends on its region.
    #[must_use]
    pub fn is_sound(&self) -> bool {
        self.region.as_ref().is_none_or(Region::is_sound)
    }

    /// Whether all conditions but the number hold for an object.
    pub(super) fn describes(&self, object: &Object) -> bool {
        let class = self.class.is_none_or(|class| object.belongs_to(class));
        let has = |wanted: Attribute| {
            let mut classes = object.classes.iter();
            classes.any(|it| {
                let right = match self.class {
                    Some(FeatureClass::ALL) | None => true,
                    Some(class) => it.id == class,
                };
                right && it.attribute == wanted
            })
        };
        class
            && self.attribute.is_none_or(has)
            && self.region.as_ref().is_none_or(|it| it.meets(object))
    }
}
