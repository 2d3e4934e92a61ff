use super::*;

fn polygon(vertices: &[Point]) -> Result<Polygon, PolygonError> {
    Polygon::new(vertices.to_vec())
}

/// A square from 0 to `side` metres.
fn square(from: Point, side: f64) -> Polygon {
    let (x, y) = from;
    polygon(&[(x, y), (x + side, y), (x + side, y + side), (x, y + side)]).unwrap()
}

#[test]
fn vertices_that_enclose_no_single_area_are_refused_with_the_reason() {
    let nan = f64::NAN;
    let many = (0..10_000)
        .map(|it| (f64::from(it), f64::from(it * it)))
        .collect();
    for (vertices, error) in [
        (vec![], PolygonError::TooFew(0)),
        (
            vec![(0.0, 0.0), (1.0, 0.0), (1.0, 0.0)],
            PolygonError::TooFew(2),
        ),
        (
            vec![(0.0, 0.0), (1.0, nan), (1.0, 0.0)],
            PolygonError::NotFinite(2),
        ),
        (
            vec![(0.0, 0.0), (f64::INFINITY, 1.0), (1.0, 0.0)],
            PolygonError::NotFinite(2),
        ),
        // A bow tie, a line there and back, a spike, and an edge that touches another.
        (
            vec![(0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.0)],
            PolygonError::Crossing(1, 3),
        ),
        (
            vec![(0.0, 0.0), (1.0, 0.0), (2.0, 0.0)],
            PolygonError::Crossing(1, 3),
        ),
        (
            vec![
                (0.0, 0.0),
                (2.0, 0.0),
                (2.0, 2.0),
                (4.0, 2.0),
                (2.0, 2.0),
                (0.0, 2.0),
            ],
            PolygonError::Crossing(2, 4),
        ),
        (
            vec![(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (1.0, 0.0), (0.0, 2.0)],
            PolygonError::Crossing(1, 3),
        ),
        (many, PolygonError::TooMany(10_000)),
    ] {
        let found = Polygon::new(vertices.clone());
        assert_eq!(
            found,
            Err(error),
            "{:?}",
            &vertices[..vertices.len().min(8)]
        );
    }
}

#[test]
fn a_closing_vertex_and_repeated_ones_are_dropped() {
    let vertices = [(0.0, 0.0), (0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 0.0)];
    let triangle = polygon(&vertices).unwrap();
    assert_eq!(triangle.vertices(), [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0)]);
}

#[test]
fn the_distance_from_an_edge_is_negative_inside() {
    // An L, whose notch is outside.
    let shape = [
        (0.0, 0.0),
        (4.0, 0.0),
        (4.0, 2.0),
        (2.0, 2.0),
        (2.0, 4.0),
        (0.0, 4.0),
    ];
    let shape = polygon(&shape).unwrap();
    for (point, distance) in [
        ((1.0, 1.0), -1.0),
        ((3.0, 3.0), 1.0),
        ((5.0, 1.0), 1.0),
        ((-3.0, -4.0), 5.0),
        ((2.0, 3.0), 0.0),
    ] {
        let found = shape.signed_distance(point);
        assert!(
            (found.abs() - f64::abs(distance)).abs() < 1e-9,
            "{point:?}: {found}"
        );
        assert!(
            distance == 0.0 || found * distance > 0.0,
            "{point:?}: {found}"
        );
    }
}

#[test]
fn the_clearance_is_that_from_the_most_pressing_zone() {
    let mut zones = Zones::default();
    assert_eq!(zones.clearance((0.0, 0.0)), None);
    zones.set(ZoneId::Operating, square((0.0, 0.0), 10.0));
    zones.set(ZoneId::KeepOut(7), square((4.0, 4.0), 2.0));
    let at = |x, y| {
        let clearance = zones.clearance((x, y)).unwrap();
        (clearance.metres, clearance.zone)
    };
    assert_eq!(at(1.0, 5.0), (1.0, ZoneId::Operating));
    assert_eq!(at(3.5, 5.0), (0.5, ZoneId::KeepOut(7)));
    assert_eq!(at(5.0, 5.0), (-1.0, ZoneId::KeepOut(7)));
    assert_eq!(at(-2.0, 5.0), (-2.0, ZoneId::Operating));
}
