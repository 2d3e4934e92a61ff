//! Operating zones on a planning map: closes every cell that the vehicle must not enter.

use super::Terrain;
use crate::zones::{Point, ZoneId, Zones};

/// The cells of a map that zones bar, row by row: each cell that a forbidden area touches.
pub(super) fn cells(terrain: &Terrain, zones: &Zones) -> Vec<bool> {
    let columns = usize::from(terrain.columns());
    let mut barred = vec![false; terrain.cells().len()];
    for (zone, polygon) in zones.iter() {
        let is_operating = zone == ZoneId::Operating;
        let edges: Vec<_> = polygon
            .edges()
            .map(|(a, b)| (grid(terrain, a), grid(terrain, b)))
            .collect();
        for (row, cells) in barred.chunks_mut(columns).enumerate() {
            close_area(cells, row as f64 + 0.5, &edges, is_operating);
            for &edge in &edges {
                close_edge(cells, row as f64, edge);
            }
        }
    }
    barred
}

/// A point in rows and columns, on the map or not.
fn grid(terrain: &Terrain, (x, y): Point) -> Point {
    let [(south, west), _] = terrain.corners();
    ((x - south) / terrain.cell(), (y - west) / terrain.cell())
}

/// Closes the cells of a row whose centres are inside the polygon, or outside the operating zone.
fn close_area(cells: &mut [bool], middle: f64, edges: &[(Point, Point)], is_operating: bool) {
    let crossed = edges
        .iter()
        .filter(|(a, b)| (a.0 > middle) != (b.0 > middle));
    let mut crossings: Vec<f64> = crossed
        .map(|(a, b)| a.1 + (b.1 - a.1) * (middle - a.0) / (b.0 - a.0))
        .collect();
    crossings.sort_by(f64::total_cmp);
    let mut is_inside = false;
    let mut from = f64::NEG_INFINITY;
    for crossing in crossings.into_iter().chain([f64::INFINITY]) {
        if is_inside != is_operating {
            close(cells, from, crossing);
        }
        (from, is_inside) = (crossing, !is_inside);
    }
}

/// Closes the cells of a row that an edge touches.
fn close_edge(cells: &mut [bool], row: f64, (a, b): (Point, Point)) {
    let (low, high) = if a.0 <= b.0 { (a, b) } else { (b, a) };
    if high.0 < row || low.0 > row + 1.0 {
        return;
    }
    let at = |level: f64| {
        let share = (level - low.0) / (high.0 - low.0);
        low.1 + (high.1 - low.1) * share
    };
    let first = if low.0 < row { at(row) } else { low.1 };
    let last = if high.0 > row + 1.0 {
        at(row + 1.0)
    } else {
        high.1
    };
    close(
        cells,
        first.min(last).floor(),
        first.max(last).floor() + 1.0,
    );
}

/// Closes the cells whose centres lie between two columns.
fn close(cells: &mut [bool], from: f64, to: f64) {
    // Casts saturate.
    let bound = |column: f64| (column - 0.5).ceil().max(0.0) as usize;
    let (from, to) = (bound(from), bound(to).min(cells.len()));
    if let Some(cells) = cells.get_mut(from..to) {
        cells.fill(true);
    }
}
