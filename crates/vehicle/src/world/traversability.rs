//! Raster map cells as vector objects, for clients that support only objects.

use super::object::{Attribute, FeatureClass, Geometry, Object, ObjectId, Place};
use super::raster::Raster;
use crate::motion::{Frame, Pose};

/// Converts each run of equal cells in a row to a polygon of the class
/// [`TRAVERSABILITY`](FeatureClass::TRAVERSABILITY) with the cell value as attribute. The object
/// number is the index of the run's first cell, counted row by row, plus [`ObjectId::LAST`] + 1.
#[must_use]
pub fn as_objects(raster: &Raster, cells: &[u8], frame: &Frame) -> Vec<(ObjectId, Object)> {
    let columns = usize::from(raster.columns).max(1);
    let mut objects = Vec::new();
    for (row, cells) in cells.chunks(columns).enumerate() {
        let mut begin = 0;
        for run in cells.chunk_by(|a, b| a == b) {
            let end = begin + run.len();
            let id = ObjectId(ObjectId::LAST.0 + 1 + (row * columns + begin) as u32);
            let object = Object {
                geometry: Geometry::Polygon,
                buffer: 0.0,
                classes: vec![FeatureClass {
                    id: FeatureClass::TRAVERSABILITY,
                    attribute: Attribute::Byte(run[0]),
                }],
                points: corners(raster, frame, row, begin..end).into(),
            };
            objects.push((id, object));
            begin = end;
        }
    }
    objects
}

/// The corners of a run of cells, from the south-west by way of the south-east.
fn corners(
    raster: &Raster,
    frame: &Frame,
    row: usize,
    columns: std::ops::Range<usize>,
) -> [Place; 4] {
    let side = f64::from(raster.cell);
    let place = |row: usize, column: usize| {
        let pose = Pose {
            x: raster.x + row as f64 * side,
            y: raster.y + column as f64 * side,
            ..Pose::default()
        };
        let there = frame.to_global(&pose);
        Place::from_degrees(there.latitude, there.longitude)
    };
    [
        place(row, columns.start),
        place(row, columns.end),
        place(row + 1, columns.end),
        place(row + 1, columns.start),
    ]
}
