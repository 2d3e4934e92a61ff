//! The obstacle that appears on the vehicle's way.

use std::f64::consts::TAU;

use jaus_vehicle::mission::{Footprint, Point, Terrain, plan};
use jaus_vehicle::parts::KnowledgeStore;
use jaus_vehicle::sensing::{Disc, Scenery};

/// An obstacle that is put on the path of the vehicle once.
pub(super) struct Surprise {
    /// What the vehicle's range sensor sees.
    pub(super) scenery: Scenery,
    pub(super) vehicle: Footprint,
}

impl Surprise {
    /// Radius of the obstacle in metres.
    const RADIUS: f64 = 0.3;
    /// Least distance from the vehicle and from the destination, in metres.
    const AWAY: f64 = 2.0;
    /// Distance between the places that are tried, in metres.
    const STEP: f64 = 0.5;
    /// Number of points of its edge.
    const EDGE: u32 = 16;

    /// Puts the obstacle on the rest of the path where the shortest path leads round it, and returns
    /// its middle. `None` if there is no such place, for example on a short path.
    pub(super) fn put(&self, path: &[Point], here: Point) -> Option<Point> {
        let destination = *path.last()?;
        let is_away = |place: Point, from: Point| distance(place, from) >= Self::AWAY;
        let places: Vec<_> = places(path, Self::STEP).collect();
        let gaps = places.iter().map(|&it| distance(it, here));
        let (passed, _) = gaps.enumerate().min_by(|a, b| a.1.total_cmp(&b.1))?;
        let places = places.into_iter().skip(passed);
        let places = places.filter(|&it| is_away(it, here) && is_away(it, destination));
        let detours = places.filter_map(|place| {
            let length = self.length_around(place, here, destination)?;
            Some((place, length))
        });
        let (middle, _) = detours.min_by(|a, b| a.1.total_cmp(&b.1))?;
        let radius = Self::RADIUS;
        self.scenery.set(vec![Disc { middle, radius }]);
        Some(middle)
    }

    /// Length of the path round an obstacle on the demonstration map, if there is one.
    fn length_around(&self, (x, y): Point, here: Point, destination: Point) -> Option<f64> {
        let (raster, picture) = KnowledgeStore::fine_demo_map();
        let corner = (raster.x, raster.y);
        let cell = f64::from(raster.cell);
        let map = Terrain::new(picture.rows, picture.columns, cell, corner, picture.cells).ok()?;
        let edge = (0..Self::EDGE).map(|number| {
            let (sin, cos) = (f64::from(number) * TAU / f64::from(Self::EDGE)).sin_cos();
            (x + Self::RADIUS * cos, y + Self::RADIUS * sin)
        });
        let map = map.with_obstacles(edge.collect(), self.vehicle.clearance());
        let path = plan(&map, &self.vehicle, here, destination).ok()?;
        Some(path.length())
    }
}

/// Places along a path, at most `step` metres apart.
fn places(path: &[Point], step: f64) -> impl Iterator<Item = Point> {
    path.windows(2).flat_map(move |ends| {
        let (from, to) = (ends[0], ends[1]);
        let parts = (distance(from, to) / step).ceil().max(1.0);
        // Casts saturate.
        (0..parts as u32).map(move |part| {
            let share = f64::from(part) / parts;
            let between = |from: f64, to: f64| from + (to - from) * share;
            (between(from.0, to.0), between(from.1, to.1))
        })
    })
}

fn distance(a: Point, b: Point) -> f64 {
    (a.0 - b.0).hypot(a.1 - b.1)
}
