//! The in-memory collection of all objects, with a spatial index.

use std::collections::BTreeMap;
use std::sync::Arc;

use rstar::primitives::{GeomWithData, Rectangle};
use rstar::{AABB, RTree};

use super::object::{Object, ObjectId, Place};
use super::selection::{Region, Selection};
use super::shape::METRES_PER_DEGREE;

/// Degrees of latitude and longitude.
type Corner = [f64; 2];
type Entry = GeomWithData<Rectangle<Corner>, ObjectId>;

/// Objects by number and by location.
#[derive(Debug, Default)]
pub struct Collection {
    objects: BTreeMap<ObjectId, Arc<Object>>,
    places: RTree<Entry>,
    points: usize,
}

impl Collection {
    /// Maximum number of objects.
    pub const MOST_OBJECTS: usize = 100_000;
    /// Maximum number of points of all objects together: 8 MB of memory.
    pub const MOST_POINTS: usize = 1_000_000;

    /// Creates a collection of these objects.
    #[must_use]
    pub fn new(objects: impl Iterator<Item = (ObjectId, Object)>) -> Self {
        let objects: BTreeMap<_, _> = objects.map(|(id, it)| (id, Arc::new(it))).collect();
        Self {
            places: RTree::bulk_load(objects.iter().map(|(&id, it)| entry(id, it)).collect()),
            points: objects.values().map(|it| it.points.len()).sum(),
            objects,
        }
    }

    /// Number of objects.
    #[must_use]
    pub fn len(&self) -> usize {
        self.objects.len()
    }

    /// Whether the collection is empty.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.objects.is_empty()
    }

    /// Whether another object fits.
    pub(super) fn has_room_for(&self, object: &Object) -> bool {
        self.objects.len() < Self::MOST_OBJECTS
            && self.points + object.points.len() <= Self::MOST_POINTS
    }

    /// The object with this number.
    #[must_use]
    pub fn get(&self, id: ObjectId) -> Option<&Arc<Object>> {
        self.objects.get(&id)
    }

    pub(super) fn insert(&mut self, id: ObjectId, object: Object) {
        self.remove(id);
        self.points += object.points.len();
        self.places.insert(entry(id, &object));
        self.objects.insert(id, Arc::new(object));
    }

    pub(super) fn remove(&mut self, id: ObjectId) {
        if let Some(object) = self.objects.remove(&id) {
            self.points -= object.points.len();
            self.places.remove(&entry(id, &object));
        }
    }

    /// The numbers of the selected objects, sorted.
    #[must_use]
    pub fn select(&self, selection: &Selection) -> Vec<ObjectId> {
        if !selection.is_sound() {
            return Vec::new();
        }
        let mut found: Vec<ObjectId> = match (&selection.ids, &selection.region) {
            (Some(ids), _) => ids.clone(),
            (None, Some(region)) => {
                let near = self.places.locate_in_envelope_intersecting(around(region));
                near.map(|entry| entry.data).collect()
            }
            (None, None) => self.objects.keys().copied().collect(),
        };
        let meant = |id: &ObjectId| self.get(*id).is_some_and(|it| selection.describes(it));
        found.sort_unstable();
        found.dedup();
        found.retain(meant);
        found
    }

    /// The south-west and north-east corners of the bounding box of a class.
    #[must_use]
    pub fn bounds(&self, class: u16) -> Option<(Place, Place)> {
        let of_class = self.objects.values().filter(|it| it.belongs_to(class));
        let mut points = of_class.flat_map(|object| object.points.iter().copied());
        let first = points.next()?;
        Some(points.fold((first, first), |(low, high), point| {
            let low = Place {
                latitude: low.latitude.min(point.latitude),
                longitude: low.longitude.min(point.longitude),
            };
            let high = Place {
                latitude: high.latitude.max(point.latitude),
                longitude: high.longitude.max(point.longitude),
            };
            (low, high)
        }))
    }
}

fn entry(id: ObjectId, object: &Object) -> Entry {
    let envelope = envelope(&object.points, object.buffer);
    GeomWithData::new(Rectangle::from_aabb(envelope), id)
}

fn around(region: &Region) -> AABB<Corner> {
    envelope(&region.points, region.buffer)
}

/// A bounding box of a shape with its buffer. A box that crosses the date line or comes close to a
/// pole extends around the whole globe.
fn envelope(points: &[Place], buffer: f32) -> AABB<Corner> {
    let corners = points.iter().map(|point| <Corner>::from(point.degrees()));
    let (mut low, mut high) = ([90.0_f64, 180.0_f64], [-90.0_f64, -180.0_f64]);
    for corner in corners {
        for axis in 0..2 {
            low[axis] = low[axis].min(corner[axis]);
            high[axis] = high[axis].max(corner[axis]);
        }
    }
    // Slightly enlarged to allow for rounding in the exact distance test.
    let reach = f64::from(buffer) * 1.001 / METRES_PER_DEGREE;
    let widest = low[0].abs().max(high[0].abs()) + reach;
    let aside = reach / widest.min(90.0).to_radians().cos().max(1e-6);
    let (low, high) = (
        [low[0] - reach, low[1] - aside],
        [high[0] + reach, high[1] + aside],
    );
    if low[1] <= -180.0 || high[1] >= 180.0 || high[1] - low[1] > 180.0 || widest >= 89.0 {
        AABB::from_corners([low[0], -180.0], [high[0], 180.0])
    } else {
        AABB::from_corners(low, high)
    }
}
