//! Verifiable writes: each step is one write that changes objects, cells and a description. The
//! expected world after a step follows from its number.

use bytes::Bytes;
use jaus_vehicle::world::{
    Attribute, Change, Describe, FeatureClass, MapId, Object, ObjectId, Place, Raster, Selection,
    Window, World,
};

/// Number of objects kept; older ones are removed.
const OBJECTS: u32 = 20;
/// Side length of the map, which has several tiles.
const SIDE: u16 = 100;
const MAP: MapId = MapId(1);
const CLASS: u16 = 3;

/// Creates the map if it is missing.
pub(crate) fn begin(world: &mut World) {
    if world.rasters().is_empty() {
        let raster = Raster {
            name: "ledger".to_owned(),
            rows: SIDE,
            columns: SIDE,
            cell: 1.0,
            x: 0.0,
            y: 0.0,
            fill: 0,
            revision: 0,
        };
        let results = world.apply(vec![Change::AddRaster(raster, Bytes::new())]);
        assert!(results.is_ok_and(|results| results[0].is_ok()));
    }
}

/// Takes step `n`, counted from 1. Returns whether it was acknowledged.
pub(crate) fn step(world: &mut World, n: u32) -> bool {
    let object = Object {
        classes: vec![FeatureClass {
            id: CLASS,
            attribute: Attribute::UnsignedInteger(n),
        }],
        points: vec![Place {
            latitude: n as i32,
            longitude: 0,
        }],
        ..Object::default()
    };
    let mut changes = vec![
        Change::AddObjects(vec![object]),
        Change::SetCells(MAP, window(n), vec![value(n); window(n).cells()].into()),
        Change::DescribeClass(CLASS, Describe::Overwrite(n.to_string())),
    ];
    if n > OBJECTS {
        let oldest = Selection {
            ids: Some(vec![ObjectId(n - OBJECTS)]),
            ..Selection::default()
        };
        changes.push(Change::RemoveObjects(oldest));
    }
    world.apply(changes).is_ok()
}

/// The last step in the store. Panics if any content differs from that of this step.
pub(crate) fn last_step(world: &World) -> u32 {
    let Some(description) = world.classes().get(&CLASS) else {
        assert!(world.objects().is_empty());
        return 0;
    };
    let last: u32 = description.parse().expect("a number");
    let ids = world.objects().select(&Selection::default());
    let expected: Vec<_> = (1..=last)
        .rev()
        .take(OBJECTS as usize)
        .map(ObjectId)
        .collect();
    assert_eq!(ids, expected.into_iter().rev().collect::<Vec<_>>());
    for id in ids {
        let object = world.object(id).expect("it has just been found");
        let attribute = Attribute::UnsignedInteger(id.0);
        assert_eq!(object.classes[0].attribute, attribute);
    }
    assert_eq!(world.rasters()[&MAP].revision, last + 1);
    assert_eq!(cells(world), expected_cells(last), "after step {last}");
    last
}

fn cells(world: &World) -> Vec<u8> {
    world
        .cells(MAP, Window::default())
        .expect("read")
        .expect("on the map")
}

/// Number of windows on the map; each is overwritten one lap later.
const LAP: u32 = 50;

fn expected_cells(last: u32) -> Vec<u8> {
    let mut cells = vec![0; usize::from(SIDE) * usize::from(SIDE)];
    for n in last.saturating_sub(2 * LAP) + 1..=last {
        let window = window(n);
        for row in window.row..window.row + window.rows {
            let begin = usize::from(row) * usize::from(SIDE) + usize::from(window.column);
            cells[begin..begin + usize::from(window.columns)].fill(value(n));
        }
    }
    cells
}

/// A window that crosses tile borders.
fn window(n: u32) -> Window {
    let place = (n % LAP) as u16;
    Window {
        row: place,
        column: place % 25,
        rows: 40,
        columns: 60,
    }
}

fn value(n: u32) -> u8 {
    (n % 251) as u8 + 1
}
