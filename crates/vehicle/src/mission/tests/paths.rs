//! Path planning: paths exist where they should, keep their distance, and prefer good ground.

use proptest::prelude::*;

use crate::mission::ground::Ground;
use crate::mission::{Footprint, NoPath, Path, Point, Terrain, plan, search, sight};

/// A map of 1 m cells from text whose first line is the south: `#` is closed, `.` open. The lower a
/// digit, the worse the ground.
fn map(picture: &[&str]) -> Terrain {
    let cells = picture.iter().flat_map(|line| line.bytes());
    let cells = cells.map(|cell| match cell {
        b'#' => 0,
        b'.' => 255,
        digit => (digit - b'0') * 25 + 1,
    });
    let (rows, columns) = (picture.len() as u16, picture[0].len() as u16);
    Terrain::new(rows, columns, 1.0, (0.0, 0.0), cells.collect()).unwrap()
}

/// A vehicle that fits within its cell.
const THIN: Footprint = Footprint {
    width: 0.0,
    margin: 0.0,
    turning_radius: 0.0,
};

fn wide(width: f64) -> Footprint {
    Footprint { width, ..THIN }
}

/// Distance of the path from the nearest centre of a closed cell.
fn closest(path: &Path, terrain: &Terrain) -> f64 {
    let columns = usize::from(terrain.columns());
    let closed = terrain.cells().iter().enumerate();
    let closed = closed.filter(|(_, cell)| **cell == 0).map(|(index, _)| {
        (
            (index / columns) as f64 + 0.5,
            (index % columns) as f64 + 0.5,
        )
    });
    let closed: Vec<_> = closed.map(|at| terrain.to_local(at)).collect();
    let along = path.segments().flat_map(|(a, b)| {
        (0..=64).map(move |step| {
            let share = f64::from(step) / 64.0;
            (a.0 + (b.0 - a.0) * share, a.1 + (b.1 - a.1) * share)
        })
    });
    let distance = |p: Point| {
        let to = closed.iter().map(|c| (c.0 - p.0).hypot(c.1 - p.1));
        to.fold(f64::INFINITY, f64::min)
    };
    along.map(distance).fold(f64::INFINITY, f64::min)
}

#[test]
fn over_open_ground_the_path_is_one_straight_segment() {
    let terrain = map(&["................"; 16]);
    let path = plan(&terrain, &Footprint::default(), (0.5, 0.5), (14.2, 9.7)).unwrap();
    assert_eq!(path.points(), [(0.5, 0.5), (14.2, 9.7)]);
    assert!((path.length() - 13.7_f64.hypot(9.2)).abs() < 1e-9);
}

#[test]
fn whoever_is_there_already_has_nowhere_to_go() {
    let terrain = map(&["..", ".."]);
    let path = plan(&terrain, &THIN, (0.5, 0.5), (0.6, 0.5)).unwrap();
    assert_eq!(path.points(), [(0.5, 0.5), (0.6, 0.5)]);
}

#[test]
fn it_goes_around_a_wall_and_does_not_cut_its_corner() {
    let terrain = map(&[".....", ".###.", ".....", ".....", "....."]);
    let path = plan(&terrain, &THIN, (0.5, 2.5), (2.5, 2.5)).unwrap();
    assert!(path.segments().len() >= 2, "{path:?}");
    assert!(closest(&path, &terrain) >= 0.5, "{path:?}");
}

#[test]
fn between_two_cells_that_touch_at_a_corner_there_is_no_way() {
    let terrain = map(&["..#", ".#.", "#.."]);
    let error = plan(&terrain, &THIN, (0.5, 0.5), (2.5, 2.5)).unwrap_err();
    assert!(matches!(error, NoPath::Unreachable { .. }), "{error}");
    assert!(error.may_pass());
}

#[test]
fn a_gap_is_taken_only_by_a_vehicle_that_fits() {
    let terrain = map(&[
        ".........",
        ".........",
        ".........",
        "####.####",
        ".........",
        ".........",
        ".........",
    ]);
    let go = |vehicle: Footprint| plan(&terrain, &vehicle, (1.5, 4.5), (5.5, 4.5));
    assert_eq!(go(wide(0.9)).unwrap().points().len(), 2);
    assert!(matches!(go(wide(1.4)), Err(NoPath::Unreachable { .. })));
}

#[test]
fn it_keeps_its_distance_where_there_is_room() {
    let mut rows = vec!["..............."; 15];
    rows[7] = ".....#####.....";
    let terrain = map(&rows);
    let path = plan(&terrain, &wide(4.0), (2.5, 7.5), (12.5, 7.5)).unwrap();
    // The centre of a closed cell is half a cell farther away, and the line may pass cell centres.
    assert!(closest(&path, &terrain) > 2.0, "{path:?}");
}

#[test]
fn a_vehicle_that_stands_too_close_to_a_wall_can_leave() {
    let terrain = map(&[
        "#######", ".......", ".......", ".......", ".......", ".......",
    ]);
    let path = plan(&terrain, &wide(2.0), (1.5, 3.5), (4.5, 3.5)).unwrap();
    assert_eq!(path.points().first(), Some(&(1.5, 3.5)));
}

#[test]
fn bad_ground_is_driven_around_if_that_is_not_far() {
    let terrain = map(&[
        ".......", ".......", "..000..", "..000..", ".......", ".......",
    ]);
    let over = plan(&terrain, &THIN, (0.5, 3.5), (5.5, 3.5)).unwrap();
    assert!(over.points().len() > 2, "{over:?}");
    let all_bad = map(&["0000000"; 6]);
    let straight = plan(&all_bad, &THIN, (0.5, 3.5), (5.5, 3.5)).unwrap();
    assert_eq!(straight.points().len(), 2);
}

#[test]
fn each_mistake_is_told_with_what_to_do() {
    let terrain = map(&["...", ".#.", "..."]);
    let go = |from, to| plan(&terrain, &THIN, from, to).unwrap_err().to_string();
    let inside = (0.5, 0.5);
    for (from, to, says) in [
        (
            inside,
            (3.5, 0.5),
            "the destination at north 3.50 m, east 0.50 m is outside the map, which extends from \
             north 0.00 m, east 0.00 m to north 3.00 m, east 3.00 m: choose one on the map",
        ),
        (inside, (f64::NAN, 0.5), "is outside the map"),
        (
            inside,
            (1.5, 1.5),
            "an obstacle: choose one with more clearance",
        ),
        (
            (-0.1, 0.5),
            inside,
            "the vehicle at north -0.10 m, east 0.50 m is outside the map",
        ),
        (
            (1.5, 1.5),
            inside,
            "is in an obstacle of the map: drive it out manually",
        ),
    ] {
        let told = go(from, to);
        assert!(told.contains(says), "{told}");
    }
}

#[test]
fn a_raster_that_is_no_map_is_refused() {
    let new = |rows, columns, cell, count| {
        let cells = vec![255; count];
        let error = Terrain::new(rows, columns, cell, (0.0, 0.0), cells).unwrap_err();
        error.to_string()
    };
    assert!(new(0, 4, 1.0, 0).contains("0 x 4 cells"));
    assert!(new(4097, 1, 1.0, 4097).contains("from 1 to 4096"));
    assert!(new(2, 2, 1.0, 3).contains("3 cells instead of 2 x 2"));
    assert!(new(2, 2, f64::NAN, 4).contains("invalid geometry"));
}

/// Walls with gaps at alternating ends: the path is much longer than the distance.
fn comb(side: usize, apart: usize) -> Terrain {
    let cell = |at: usize| {
        let (row, column) = (at / side, at % side);
        let wall = row % apart == apart - 1;
        let gap = if (row / apart).is_multiple_of(2) {
            column + 4 >= side
        } else {
            column < 4
        };
        if wall && !gap { 0 } else { 255 }
    };
    let cells = (0..side * side).map(cell).collect();
    Terrain::new(side as u16, side as u16, 0.1, (0.0, 0.0), cells).unwrap()
}

#[test]
fn on_a_large_map_the_way_through_a_maze_is_found_block_by_block() {
    let side = 600;
    let terrain = comb(side, 20);
    let end = side as f64 * 0.1 - 0.25;
    let path = plan(&terrain, &wide(0.0), (0.05, 0.05), (end, end)).unwrap();
    assert!(path.length() > 29.0 * 59.0, "{}", path.length());
    assert!(path.length() < 31.0 * 64.0, "{}", path.length());
    assert!(path.segments().len() < 200, "{}", path.segments().len());
    let ground = Ground::new(&terrain, 0.0, (0.0, 0.0));
    for (a, b) in path.segments() {
        let [a, b] = [a, b].map(|point| terrain.to_grid(point).unwrap());
        assert!(sight::cost(&ground, a, b).is_some(), "{a:?} {b:?}");
    }
}

/// Random ground with a given fraction of closed cells.
fn ground() -> impl Strategy<Value = Terrain> {
    let cell = prop_oneof![1 => Just(0_u8), 2 => 1..=255_u8];
    (3..40_u16, 3..40_u16).prop_flat_map(move |(rows, columns)| {
        let count = usize::from(rows) * usize::from(columns);
        prop::collection::vec(cell.clone(), count)
            .prop_map(move |cells| Terrain::new(rows, columns, 1.0, (0.0, 0.0), cells).unwrap())
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn over_blocks_there_is_a_way_exactly_if_there_is_one_over_cells(
        terrain in ground(), from: prop::sample::Index, to: prop::sample::Index,
    ) {
        let ground = Ground::new(&terrain, 0.0, (0.0, 0.0));
        let open: Vec<_> = (0..ground.len() as u32).filter(|&cell| {
            let (row, column) = ground.place(cell);
            ground.is_open(row, column)
        }).collect();
        prop_assume!(!open.is_empty());
        let (from, to) = (*from.get(&open), *to.get(&open));
        let direct = search::find(&ground, from, to);
        let by_blocks = search::find_by_blocks(&ground, from, to);
        prop_assert_eq!(direct.is_some(), by_blocks.is_some());
        if let Some(way) = by_blocks {
            prop_assert_eq!((way.first(), way.last()), (Some(&from), Some(&to)));
            for pair in way.windows(2) {
                prop_assert!(ground.neighbours(pair[0]).any(|(next, _)| next == pair[1]));
            }
        }
    }

    #[test]
    fn no_segment_touches_what_is_closed(
        terrain in ground(), x in 0.0..40.0_f64, y in 0.0..40.0_f64, width in 0.0..4.0_f64,
    ) {
        let (from, to) = ((0.5, 0.5), (x, y));
        if let Ok(path) = plan(&terrain, &wide(width), from, to) {
            prop_assert_eq!(path.points().first(), Some(&from));
            prop_assert_eq!(path.points().last(), Some(&to));
            let ground = Ground::new(&terrain, width / 2.0, from);
            for (a, b) in path.segments() {
                prop_assert!(sight::cost(&ground, a, b).is_some(), "{:?} {:?}", a, b);
            }
        }
    }
}
