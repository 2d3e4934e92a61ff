//! Which objects somebody means: by number, by where they are, by what they are.

use super::object::{Attribute, FeatureClass, Geometry, Object, ObjectId, Place};
use super::shape::Shape;

/// Conditions that all must hold; without any, every object is meant.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Selection {
    /// Only these.
    pub ids: Option<Vec<ObjectId>>,
    /// Only what meets this region.
    pub region: Option<Region>,
    /// Only what belongs to this class; [`FeatureClass::ALL`] is any.
    pub class: Option<u16>,
    /// Only what has this attribute, in that class if one is given.
    pub attribute: Option<Attribute>,
}

/// A part of the globe.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Region {
    /// What the points are.
    pub geometry: Geometry,
    /// How far it reaches beyond its points, in metres.
    pub buffer: f32,
    /// Where it is; from 1 to [`MOST_POINTS`](Self::MOST_POINTS).
    pub points: Vec<Place>,
}

impl Region {
    /// The most points, so that looking whether an object meets a region does not take seconds.
    pub const MOST_POINTS: usize = 128;

    /// Whether it is a region that can be looked for.
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
    /// Whether it can be looked for: its region is one.
    #[must_use]
    pub fn is_sound(&self) -> bool {
        self.region.as_ref().is_none_or(Region::is_sound)
    }

    /// Whether all but the number holds for an object.
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
