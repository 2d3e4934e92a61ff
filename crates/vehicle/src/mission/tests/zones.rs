//! Paths keep to operating zones.

use std::sync::Arc;

use crate::mission::{Footprint, NoPath, Path, Point, Terrain, blocked_after, plan};
use crate::zones::{Polygon, ZoneId, Zones};

/// An open map of cells of `cell` metres, 20 m wide, from the origin.
fn open(cell: f64) -> Terrain {
    let side = (20.0 / cell) as u16;
    let cells = vec![255; usize::from(side) * usize::from(side)];
    Terrain::new(side, side, cell, (0.0, 0.0), cells).unwrap()
}

fn zones(list: &[(ZoneId, &[Point])]) -> Arc<Zones> {
    let mut zones = Zones::default();
    for (id, vertices) in list {
        zones.set(*id, Polygon::new(vertices.to_vec()).unwrap());
    }
    Arc::new(zones)
}

/// The least clearance of a vehicle's side along a path.
fn least(path: &Path, zones: &Zones) -> f64 {
    let points = path.segments().flat_map(|(a, b)| {
        (0..=200).map(move |step| {
            let share = f64::from(step) / 200.0;
            (a.0 + (b.0 - a.0) * share, a.1 + (b.1 - a.1) * share)
        })
    });
    let clearance = |point| zones.clearance(point).map_or(f64::INFINITY, |it| it.metres);
    let least = points.map(clearance).fold(f64::INFINITY, f64::min);
    least - Footprint::default().width / 2.0
}

const WEDGE: [Point; 3] = [(3.3, 10.4), (16.8, 9.1), (17.2, 20.9)];

#[test]
fn a_path_leads_round_keep_out_zones_and_stays_in_the_operating_zone() {
    // The short way, east of the wedge, is outside.
    let field = [(0.1, 0.2), (19.7, 0.1), (19.9, 19.8), (0.2, 19.9)];
    let sliver = [(10.0, 2.0), (10.0, 8.0), (10.01, 8.0)];
    let zones = zones(&[
        (ZoneId::Operating, &field),
        (ZoneId::KeepOut(2), &WEDGE),
        (ZoneId::KeepOut(3), &sliver),
    ]);
    for cell in [1.0, 0.25] {
        let map = open(cell).within(Arc::clone(&zones));
        let path = plan(&map, &Footprint::default(), (2.0, 18.0), (18.5, 17.5)).unwrap();
        let least = least(&path, &zones);
        assert!(least >= 0.0, "{cell}: {least:.2} m, {path:?}");
        assert!(path.length() < 45.0, "{cell}: {:.1} m", path.length());
    }
}

#[test]
fn where_zones_leave_no_way_the_reason_names_them() {
    let wall = [(8.0, -5.0), (9.0, -5.0), (9.0, 25.0), (8.0, 25.0)];
    let zones = zones(&[(ZoneId::KeepOut(5), &wall)]);
    let map = open(1.0).within(zones);
    let go = |from, to| plan(&map, &Footprint::default(), from, to).unwrap_err();
    let error = go((2.0, 2.0), (18.0, 2.0));
    assert!(
        matches!(error, NoPath::Unreachable { .. }) && error.may_pass(),
        "{error}"
    );
    let error = go((2.0, 2.0), (8.5, 2.0)).to_string();
    assert!(error.contains("is barred by keep-out zone 5"), "{error}");
    let error = go((8.5, 2.0), (18.0, 2.0)).to_string();
    assert!(error.contains("is beyond keep-out zone 5"), "{error}");
}

#[test]
fn a_vehicle_that_stopped_at_an_edge_can_leave_although_its_cell_is_barred() {
    let wall = [(8.3, -5.0), (9.0, -5.0), (9.0, 25.0), (8.3, 25.0)];
    let zones = zones(&[(ZoneId::KeepOut(5), &wall)]);
    for cell in [1.0, 0.25] {
        let map = open(cell).within(Arc::clone(&zones));
        let path = plan(&map, &Footprint::default(), (8.0, 4.0), (2.0, 4.0));
        assert!(path.is_ok(), "{cell}: {path:?}");
    }
}

#[test]
fn zones_far_outside_the_map_bar_all_or_nothing_of_it() {
    let far = 20_000_000.0;
    let around = [(-far, -far), (far, -far), (far, far), (-far, far)];
    let elsewhere = [(far, far), (far - 1.0, far), (far, far - 1.0)];
    let go = |id, vertices: &[Point]| {
        let map = open(1.0).within(zones(&[(id, vertices)]));
        plan(&map, &Footprint::default(), (2.0, 2.0), (18.0, 18.0)).is_ok()
    };
    assert!(go(ZoneId::Operating, &around));
    assert!(!go(ZoneId::Operating, &elsewhere));
    assert!(!go(ZoneId::KeepOut(2), &around));
    assert!(go(ZoneId::KeepOut(2), &elsewhere));
}

#[test]
fn a_new_zone_blocks_the_rest_of_a_path_but_not_what_lies_behind() {
    let vehicle = Footprint::default();
    let path = Path::new(vec![(2.0, 2.0), (2.0, 12.0), (12.0, 12.0)]);
    let blocked = |wall: &[Point], here, segment| {
        let map = open(0.25).within(zones(&[(ZoneId::KeepOut(5), wall)]));
        blocked_after(&map, &vehicle, here, &path, segment)
    };
    let across_the_first = [(1.0, 6.0), (3.0, 6.0), (3.0, 7.0), (1.0, 7.0)];
    let after = blocked(&across_the_first, (2.0, 3.0), 0).unwrap();
    assert!((2.0..3.0).contains(&after), "{after:.2} m");
    assert_eq!(blocked(&across_the_first, (2.1, 8.0), 0), None, "behind");
    let across_the_second = [(8.0, 11.0), (8.0, 13.0), (9.0, 13.0)];
    let after = blocked(&across_the_second, (2.0, 3.0), 0).unwrap();
    assert!((14.0..15.0).contains(&after), "{after:.2} m");
    assert_eq!(blocked(&across_the_second, (10.0, 12.0), 1), None);
}

#[test]
fn a_planned_path_is_clear() {
    let zones = zones(&[(ZoneId::KeepOut(2), &WEDGE)]);
    for cell in [1.0, 0.25] {
        let map = open(cell).within(Arc::clone(&zones));
        let vehicle = Footprint::default();
        let path = plan(&map, &vehicle, (2.0, 18.0), (18.5, 17.5)).unwrap();
        assert_eq!(blocked_after(&map, &vehicle, (2.0, 18.0), &path, 0), None);
    }
}

#[test]
fn a_path_leads_round_obstacles_that_were_seen_also_from_close_before_them() {
    let vehicle = Footprint::default();
    let seen: Vec<Point> = (0..6)
        .map(|it| (10.1, 9.0 + 0.25 * f64::from(it)))
        .collect();
    for cell in [1.0, 0.25] {
        for start in [(2.0, 10.0), (9.7, 10.0)] {
            let map = open(cell).with_obstacles(seen.clone(), vehicle.clearance());
            let path = plan(&map, &vehicle, start, (18.0, 10.0)).unwrap();
            let near = |point: &Point| {
                let near = |(a, b)| crate::zones::distance(*point, a, b);
                // The first segment may begin closer than the clearance.
                path.segments()
                    .skip(1)
                    .map(near)
                    .fold(f64::INFINITY, f64::min)
            };
            let nearest = seen.iter().map(near).fold(f64::INFINITY, f64::min);
            assert!(nearest > 0.3, "{cell}, {start:?}: {nearest:.2} m, {path:?}");
        }
    }
}
