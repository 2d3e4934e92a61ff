//! Rounded corners for vehicles with a least turning radius.

use super::ground::Ground;
use super::sight;

/// A point in rows and columns.
type Point = (f64, f64);

/// Replaces the corners of a path by arcs of this radius in cells, drawn inside each corner as short
/// chords. Fails with the first corner that leaves no room for its arc, between its neighbours or
/// on open cells.
pub(super) fn round(ground: &Ground, corners: &[Point], radius: f64) -> Result<Vec<Point>, Point> {
    let mut points: Vec<Point> = corners.first().copied().into_iter().collect();
    let last = corners.len().saturating_sub(3);
    for (index, corner) in corners.windows(3).enumerate() {
        let &[before, at, after] = corner else {
            continue;
        };
        // A line between two corners is shared by their arcs.
        let share = |is_end: bool| if is_end { 1.0 } else { 0.5 };
        let room =
            (length(before, at) * share(index == 0)).min(length(at, after) * share(index == last));
        let arc = arc(before, at, after, radius, room).ok_or(at)?;
        let from = points.last().copied().unwrap_or(before);
        let line = std::iter::once(from).chain(arc.iter().copied());
        let is_open = line
            .zip(&arc)
            .all(|(from, &to)| from == to || sight::cost(ground, from, to).is_some());
        if !is_open {
            return Err(at);
        }
        points.extend(arc);
    }
    points.extend(corners.iter().skip(1).next_back());
    Ok(points)
}

/// Largest turn of a chord in radians.
const CHORD: f64 = 0.3;
/// Smaller turns in radians need no arc.
const STRAIGHT: f64 = 0.1;

/// The points of the arc in a corner; `None` if it begins or ends more than `room` away.
fn arc(before: Point, at: Point, after: Point, radius: f64, room: f64) -> Option<Vec<Point>> {
    let (entry, exit) = (bearing(before, at), bearing(at, after));
    let turn = crate::motion::wrap(exit - entry);
    if turn.abs() < STRAIGHT {
        return Some(vec![at]);
    }
    let back = radius * (turn.abs() / 2.0).tan();
    if back > room {
        return None;
    }
    let start = (at.0 - back * entry.cos(), at.1 - back * entry.sin());
    let side = radius * turn.signum();
    let centre = (start.0 - side * entry.sin(), start.1 + side * entry.cos());
    let chords = (turn.abs() / CHORD).ceil();
    let points = (0..=chords as u32).map(|index| {
        let heading = entry + turn * f64::from(index) / chords;
        (
            centre.0 + side * heading.sin(),
            centre.1 - side * heading.cos(),
        )
    });
    Some(points.collect())
}

fn length(a: Point, b: Point) -> f64 {
    (b.0 - a.0).hypot(b.1 - a.1)
}

fn bearing(from: Point, to: Point) -> f64 {
    (to.1 - from.1).atan2(to.0 - from.0)
}

#[cfg(test)]
mod tests {
    use super::super::Terrain;
    use super::*;

    fn ground() -> Ground {
        let terrain = Terrain::new(20, 20, 1.0, (0.0, 0.0), vec![255; 400]).unwrap();
        Ground::new(&terrain, 0.0, (0.0, 0.0))
    }

    #[test]
    fn a_corner_becomes_an_arc_of_the_radius_between_the_same_ends() {
        for side in [15.0, 1.0] {
            let corners = [(1.0, 8.0), (10.0, 8.0), (10.0, side)];
            let points = round(&ground(), &corners, 3.0).unwrap();
            assert_eq!(points.first(), corners.first());
            assert_eq!(points.last(), corners.last());
            let centre = (7.0, 8.0 + 3.0 * (side - 8.0).signum());
            let arc = &points[1..points.len() - 1];
            assert!(arc.len() > 5);
            for &point in arc {
                assert!((length(point, centre) - 3.0).abs() < 1e-9, "{point:?}");
            }
        }
    }

    #[test]
    fn a_corner_without_room_for_its_arc_is_named() {
        let near = [(1.0, 8.0), (10.0, 8.0), (10.0, 9.0)];
        assert_eq!(round(&ground(), &near, 3.0), Err((10.0, 8.0)));
        let zigzag = [(1.0, 8.0), (6.0, 8.0), (6.0, 13.0), (12.0, 13.0)];
        assert_eq!(round(&ground(), &zigzag, 3.0), Err((6.0, 8.0)));
        assert!(round(&ground(), &zigzag, 2.4).is_ok());
    }
}
