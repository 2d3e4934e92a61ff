//! A world that is changed, closed and reopened.

use std::path::PathBuf;

use bytes::Bytes;

use super::*;
use crate::zones::ZoneId;

/// A test directory, deleted afterwards.
struct Directory(PathBuf);

impl Directory {
    fn new(test: &str) -> Self {
        let name = format!("jaus-world-{test}-{}", std::process::id());
        let path = std::env::temp_dir().join(name);
        let _ = std::fs::remove_dir_all(&path);
        Self(path)
    }

    fn file(&self) -> PathBuf {
        self.0.join("deep/world.redb")
    }
}

impl Drop for Directory {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn object(geometry: Geometry, degrees: &[(f64, f64)]) -> Object {
    let points = degrees.iter().map(|&(a, b)| Place::from_degrees(a, b));
    Object {
        geometry,
        points: points.collect(),
        ..Object::default()
    }
}

fn of_class(object: Object, id: u16, attribute: Attribute) -> Object {
    let classes = vec![FeatureClass { id, attribute }];
    Object { classes, ..object }
}

fn map(rows: u16, columns: u16) -> Raster {
    Raster {
        name: "map".to_owned(),
        rows,
        columns,
        cell: 0.5,
        x: -1.0,
        y: 2.0,
        fill: 7,
        revision: 0,
    }
}

fn change(world: &mut World, change: Change) -> Result<Done, Refusal> {
    world.apply(vec![change]).unwrap().pop().unwrap()
}

fn add(world: &mut World, objects: &[Object]) -> Vec<Option<u32>> {
    match change(world, Change::AddObjects(objects.to_vec())) {
        Ok(Done::Added(ids)) => ids.into_iter().map(|id| id.map(|id| id.0)).collect(),
        other => panic!("{other:?}"),
    }
}

fn select(world: &World, selection: &Selection) -> Vec<u32> {
    let ids = world.objects().select(selection);
    ids.into_iter().map(|id| id.0).collect()
}

fn region(geometry: Geometry, degrees: &[(f64, f64)], buffer: f32) -> Selection {
    let points = object(geometry, degrees).points;
    Selection {
        region: Some(Region {
            geometry,
            buffer,
            points,
        }),
        ..Selection::default()
    }
}

fn window(row: u16, column: u16, rows: u16, columns: u16) -> Window {
    Window {
        row,
        column,
        rows,
        columns,
    }
}

#[test]
fn everything_is_there_when_the_file_is_opened_again() {
    let directory = Directory::new("again");
    let mut world = World::open(&directory.file()).unwrap();
    let every_attribute = [
        Attribute::Byte(1),
        Attribute::Short(-2),
        Attribute::Integer(-3),
        Attribute::Long(-4),
        Attribute::UnsignedShort(5),
        Attribute::UnsignedInteger(6),
        Attribute::UnsignedLong(7),
        Attribute::Float(8.5),
        Attribute::LongFloat(-9.25),
        Attribute::Colour([1, 2, 3]),
    ];
    let line = Object {
        buffer: 1.5,
        classes: (1..)
            .zip(every_attribute)
            .map(|(id, attribute)| FeatureClass { id, attribute })
            .collect(),
        ..object(
            Geometry::Line,
            &[(52.5, 13.4), (-90.0, -180.0), (90.0, 180.0)],
        )
    };
    assert_eq!(add(&mut world, std::slice::from_ref(&line)), [Some(1)]);
    let text = Describe::Overwrite("trees".to_owned());
    change(&mut world, Change::DescribeClass(3, text)).unwrap();
    change(&mut world, Change::AddRaster(map(40, 70), Bytes::new())).unwrap();
    let cells = Bytes::from_static(&[1, 2, 3, 4, 5, 6]);
    change(
        &mut world,
        Change::SetCells(MapId(1), window(31, 62, 2, 3), cells.clone()),
    )
    .unwrap();
    drop(world);

    let world = World::open(&directory.file()).unwrap();
    assert_eq!(**world.object(ObjectId(1)).unwrap(), line);
    assert_eq!(world.classes()[&3], "trees");
    let raster = &world.rasters()[&MapId(1)];
    assert_eq!((raster.revision, raster.cell, raster.y), (2, 0.5, 2.0));
    let told = world
        .cells(MapId(1), window(31, 62, 2, 3))
        .unwrap()
        .unwrap();
    assert_eq!(told, cells);
    let all = world.cells(MapId(1), Window::default()).unwrap().unwrap();
    assert_eq!(all.len(), 40 * 70);
    assert_eq!(all.iter().filter(|&&cell| cell != 7).count(), 6);
}

#[test]
fn zones_are_there_after_a_restart_and_a_file_from_before_them_opens() {
    let directory = Directory::new("zones");
    let mut world = World::open(&directory.file()).unwrap();
    let outline = |id, on_globe| Outline {
        id,
        on_globe,
        vertices: vec![(0.5, 1.0), (-2.0, 1.0), (0.5, 3.25)],
    };
    let zones = [
        outline(ZoneId::Operating, true),
        outline(ZoneId::KeepOut(2), false),
        outline(ZoneId::KeepOut(65535), false),
    ];
    drop(world);
    world = World::open(&directory.file()).unwrap();
    assert!(world.zones().is_empty());
    change(&mut world, Change::SetZones(zones.to_vec())).unwrap();
    let removed = Change::RemoveZones(vec![ZoneId::KeepOut(2), ZoneId::KeepOut(3)]);
    change(&mut world, removed).unwrap();
    drop(world);
    let world = World::open(&directory.file()).unwrap();
    let kept: Vec<_> = world.zones().values().collect();
    assert_eq!(kept, [&zones[0], &zones[2]]);
}

#[test]
fn a_number_is_never_given_twice() {
    let directory = Directory::new("numbers");
    let mut world = World::open(&directory.file()).unwrap();
    let point = object(Geometry::Point, &[(1.0, 1.0)]);
    assert_eq!(
        add(&mut world, &[point.clone(), point.clone()]),
        [Some(1), Some(2)]
    );
    change(&mut world, Change::RemoveObjects(Selection::default())).unwrap();
    change(&mut world, Change::AddRaster(map(1, 1), Bytes::new())).unwrap();
    change(&mut world, Change::RemoveRaster(MapId(1))).unwrap();
    drop(world);
    let mut world = World::open(&directory.file()).unwrap();
    assert_eq!(add(&mut world, &[point]), [Some(3)]);
    let done = change(&mut world, Change::AddRaster(map(1, 1), Bytes::new()));
    assert_eq!(done, Ok(Done::Raster(MapId(2), 1)));
}

#[test]
fn objects_that_are_none_are_left_out_and_the_others_kept() {
    let mut world = in_memory();
    let point = object(Geometry::Point, &[(1.0, 1.0)]);
    let far = Object {
        buffer: f32::NAN,
        ..point.clone()
    };
    let two = object(Geometry::Polygon, &[(1.0, 1.0), (2.0, 2.0)]);
    let none = object(Geometry::Point, &[]);
    let added = add(&mut world, &[far, point, two, none]);
    assert_eq!(added, [None, Some(1), None, None]);
}

#[test]
fn objects_are_found_by_what_and_where_they_are() {
    let mut world = in_memory();
    let tree = of_class(
        object(Geometry::Point, &[(10.0, 10.0)]),
        5,
        Attribute::Byte(1),
    );
    let wall = of_class(
        object(Geometry::Line, &[(9.0, 11.0), (11.0, 11.0)]),
        6,
        Attribute::Byte(1),
    );
    let lake = of_class(
        object(
            Geometry::Polygon,
            &[(20.0, 20.0), (20.0, 30.0), (30.0, 30.0), (30.0, 20.0)],
        ),
        5,
        Attribute::Float(2.0),
    );
    add(&mut world, &[tree, wall, lake]);
    let found = |selection: Selection| select(&world, &selection);
    assert_eq!(found(Selection::default()), [1, 2, 3]);
    let numbers = [3, 9, 1].map(ObjectId).to_vec();
    let ids = Selection {
        ids: Some(numbers),
        ..Selection::default()
    };
    assert_eq!(found(ids), [1, 3]);
    let class = Selection {
        class: Some(5),
        ..Selection::default()
    };
    assert_eq!(found(class.clone()), [1, 3]);
    let attribute = Some(Attribute::Byte(1));
    assert_eq!(found(Selection { attribute, ..class }), [1]);
    let attribute_of_any = Selection {
        attribute,
        ..Selection::default()
    };
    assert_eq!(found(attribute_of_any), [1, 2]);
    let square = [(9.5, 9.5), (9.5, 10.5), (10.5, 10.5), (10.5, 9.5)];
    assert_eq!(found(region(Geometry::Polygon, &square, 0.0)), [1]);
    // Half a degree of longitude is 54.7 km at this latitude.
    assert_eq!(found(region(Geometry::Polygon, &square, 54_000.0)), [1]);
    assert_eq!(found(region(Geometry::Polygon, &square, 55_500.0)), [1, 2]);
    assert_eq!(
        found(region(Geometry::Point, &[(25.0, 25.0)], 0.0)),
        [3],
        "inside"
    );
    assert_eq!(
        found(region(Geometry::Line, &[(25.0, 19.0), (25.0, 31.0)], 0.0)),
        [3],
        "across"
    );
    assert_eq!(
        found(region(Geometry::Polygon, &[], 0.0)),
        [0_u32; 0],
        "no region"
    );
}

#[test]
fn regions_reach_over_the_date_line() {
    let mut world = in_memory();
    add(&mut world, &[object(Geometry::Point, &[(0.0, -179.999)])]);
    let near = region(Geometry::Point, &[(0.0, 179.999)], 300.0);
    assert_eq!(select(&world, &near), [1]);
    let too_near = region(Geometry::Point, &[(0.0, 179.999)], 200.0);
    assert_eq!(select(&world, &too_near), [0_u32; 0]);
}

#[test]
fn bounds_are_those_of_the_class() {
    let mut world = in_memory();
    let at = |place, class| of_class(object(Geometry::Point, &[place]), class, Attribute::Byte(0));
    add(
        &mut world,
        &[at((1.0, -2.0), 1), at((3.0, 5.0), 1), at((50.0, 50.0), 2)],
    );
    let (low, high) = world.objects().bounds(1).unwrap();
    assert_eq!(low, Place::from_degrees(1.0, -2.0));
    assert_eq!(high, Place::from_degrees(3.0, 5.0));
    let (_, high) = world.objects().bounds(FeatureClass::ALL).unwrap();
    assert_eq!(high, Place::from_degrees(50.0, 50.0));
    assert_eq!(world.objects().bounds(3), None);
}

#[test]
fn a_removed_object_is_found_no_more() {
    let mut world = in_memory();
    let point = object(Geometry::Point, &[(1.0, 1.0)]);
    add(&mut world, &[point.clone(), point]);
    let first = Selection {
        ids: Some(vec![ObjectId(1)]),
        ..Selection::default()
    };
    let done = change(&mut world, Change::RemoveObjects(first));
    assert_eq!(done, Ok(Done::Removed(1)));
    assert_eq!(
        select(&world, &region(Geometry::Point, &[(1.0, 1.0)], 1.0)),
        [2]
    );
}

#[test]
fn any_window_of_a_map_reads_as_it_was_written() {
    let mut world = in_memory();
    let (rows, columns) = (97_u16, 65_u16);
    let done = change(
        &mut world,
        Change::AddRaster(map(rows, columns), Bytes::new()),
    );
    assert_eq!(done, Ok(Done::Raster(MapId(1), 1)));
    let mut model = vec![7_u8; usize::from(rows) * usize::from(columns)];
    for (value, part) in (8..).zip([
        window(0, 0, rows, columns),
        window(96, 64, 1, 1),
        window(31, 31, 2, 2),
        window(32, 0, 32, 33),
        window(5, 60, 90, 5),
    ]) {
        let cells: Vec<u8> = (0..part.cells())
            .map(|i| (i as u8).wrapping_mul(value))
            .collect();
        for (i, &cell) in cells.iter().enumerate() {
            let row = usize::from(part.row) + i / usize::from(part.columns);
            let column = usize::from(part.column) + i % usize::from(part.columns);
            model[row * usize::from(columns) + column] = cell;
        }
        change(&mut world, Change::SetCells(MapId(1), part, cells.into())).unwrap();
    }
    assert_eq!(
        world.cells(MapId(1), Window::default()).unwrap().unwrap(),
        model
    );
    let part = world
        .cells(MapId(1), window(30, 30, 40, 30))
        .unwrap()
        .unwrap();
    for (i, cell) in part.iter().enumerate() {
        assert_eq!(
            *cell,
            model[(30 + i / 30) * usize::from(columns) + 30 + i % 30]
        );
    }
}

#[test]
fn maps_and_cells_that_can_not_be_are_refused_with_what_is_wrong() {
    let mut world = in_memory();
    for wrong in [
        map(0, 1),
        map(1, 4097),
        Raster {
            cell: 0.0,
            ..map(1, 1)
        },
        Raster {
            x: f64::NAN,
            ..map(1, 1)
        },
    ] {
        let refused = change(&mut world, Change::AddRaster(wrong, Bytes::new()));
        assert!(matches!(refused, Err(Refusal::Size(_))), "{refused:?}");
    }
    let few = Bytes::from_static(&[1]);
    let refused = change(&mut world, Change::AddRaster(map(2, 1), few));
    assert!(matches!(refused, Err(Refusal::Size(_))));
    change(&mut world, Change::AddRaster(map(16, 16), Bytes::new())).unwrap();
    let mut set = |map, window, count| {
        change(
            &mut world,
            Change::SetCells(MapId(map), window, vec![0; count].into()),
        )
    };
    assert_eq!(
        set(2, window(0, 0, 1, 1), 1),
        Err(Refusal::NoSuchMap(MapId(2)))
    );
    assert!(matches!(
        set(1, window(0, 0, 4, 4), 15),
        Err(Refusal::Size(_))
    ));
    assert!(matches!(
        set(1, window(0, 0, 0, 0), 0),
        Err(Refusal::Size(_))
    ));
    let outside = set(1, window(15, 0, 2, 1), 2).unwrap_err();
    assert_eq!(
        outside.to_string(),
        "2 x 1 cells from row 15, column 0 extend beyond the map, which has 16 x 16"
    );
    assert!(matches!(
        set(1, window(u16::MAX, u16::MAX, 1, 1), 1),
        Err(Refusal::Outside { .. })
    ));
    assert_eq!(world.rasters()[&MapId(1)].revision, 1);
}

#[test]
fn no_more_cells_are_kept_than_four_of_the_greatest_maps_have() {
    let mut world = in_memory();
    for _ in 0..4 {
        change(&mut world, Change::AddRaster(map(4096, 4096), Bytes::new())).unwrap();
    }
    let refused = change(&mut world, Change::AddRaster(map(1, 1), Bytes::new()));
    assert!(matches!(refused, Err(Refusal::Full(_))));
}

#[test]
fn descriptions_are_put_together_and_forgotten() {
    let mut world = in_memory();
    let mut describe = |how| change(&mut world, Change::DescribeClass(9, how)).unwrap();
    describe(Describe::Append("b".to_owned()));
    describe(Describe::Prepend("a".to_owned()));
    describe(Describe::Append("c".to_owned()));
    assert_eq!(world.classes()[&9], "abc");
    change(&mut world, Change::DescribeClass(9, Describe::Erase)).unwrap();
    assert!(world.classes().is_empty());
}

#[test]
fn a_file_that_is_no_store_is_refused_and_left_as_it_is() {
    let directory = Directory::new("broken");
    let file = directory.file();
    std::fs::create_dir_all(file.parent().unwrap()).unwrap();
    for octets in [&b"nonsense"[..], &[0; 5000], b"redb"] {
        std::fs::write(&file, octets).unwrap();
        let error = World::open(&file).unwrap_err();
        assert!(matches!(error, OpenError::Broken { .. }), "{error}");
        assert_eq!(std::fs::read(&file).unwrap(), octets);
    }
}

#[test]
fn a_damaged_store_is_refused_and_an_open_one_is_not_opened_twice() {
    let directory = Directory::new("damaged");
    let file = directory.file();
    let mut world = World::open(&file).unwrap();
    let points: Vec<_> = (0..200)
        .map(|i| object(Geometry::Point, &[(f64::from(i) / 10.0, 0.0)]))
        .collect();
    add(&mut world, &points);
    assert!(matches!(
        World::open(&file).unwrap_err(),
        OpenError::InUse(_)
    ));
    drop(world);
    let mut octets = std::fs::read(&file).unwrap();
    let length = octets.len();
    octets[4096..length].fill(0x5A);
    std::fs::write(&file, &octets).unwrap();
    let error = World::open(&file).unwrap_err();
    assert!(matches!(error, OpenError::Broken { .. }), "{error}");
    assert!(error.to_string().contains("damaged"), "{error}");
}

#[test]
fn a_new_store_is_alone_in_its_folder() {
    let directory = Directory::new("draft");
    let file = directory.file();
    World::open(&file).unwrap();
    let names = std::fs::read_dir(file.parent().unwrap()).unwrap();
    let names: Vec<_> = names.map(|it| it.unwrap().path()).collect();
    assert_eq!(names, [file]);
}

#[test]
fn pictures_and_text_become_maps_with_north_at_the_top() {
    let cells = |octets: &[u8]| Picture::read(octets).map(|it| (it.rows, it.columns, it.cells));
    let expected = Ok((2, 3, vec![255, 113, 255, 0, 255, 255]));
    assert_eq!(cells(b"#..\n.4 \n"), expected);
    assert_eq!(cells(b"#..\r\n.4.\r\n"), expected);
    assert_eq!(cells(b"P2 # a comment\n3 2 9\n0 9 9 9 4 9"), expected);
    assert_eq!(cells(b"P5\n3 2\n255\n\x00\xff\xff\xff\x71\xff"), expected);
    assert_eq!(cells(b"P5 1 1 65535\n\x80\x00"), Ok((1, 1, vec![127])));
    let demo = Picture::demo();
    assert_eq!((demo.rows, demo.columns), (16, 16));
}

#[test]
fn a_divided_map_has_several_cells_for_each_one() {
    let map = Picture::read(b".#\n4.\n").unwrap();
    let fine = map.divided(2).unwrap();
    assert_eq!((fine.rows, fine.columns), (4, 4));
    let [south, north] = [[113, 113, 255, 255], [255, 255, 0, 0]];
    assert_eq!(fine.cells, [south, south, north, north].concat());
    assert_eq!(map.divided(1), Some(map.clone()));
    assert_eq!(map.divided(3000), None);
    assert_eq!(map.divided(0), None);
}

#[test]
fn files_that_are_no_map_are_refused_with_what_is_wrong() {
    let error = |octets: &[u8]| Picture::read(octets).unwrap_err().to_string();
    assert!(error(b"").contains("0 rows"));
    assert!(error(b"...\n..\n").starts_with("line 2 has 2 cells, but the first has 3"));
    assert!(error(b"..\n.x\n").starts_with("line 2: 'x'"));
    assert!(error(b"P5 3 2 255\n\0\0").contains("2 readable values"));
    assert!(error(b"P2 3 2 70000\n").contains("PGM"));
    assert!(error(b"P5 99999 99999 255\n").contains("99999 rows"));
    assert!(error(b"P2 2 1 9\n3 x").contains("1 readable values"));
}

#[test]
fn the_cells_of_a_map_become_one_object_for_each_run() {
    let raster = map(2, 3);
    let frame = crate::motion::Frame::at(52.5, 13.4);
    let objects = as_objects(&raster, &[0, 0, 9, 9, 9, 9], &frame);
    let found: Vec<_> = objects
        .iter()
        .map(|(id, it)| (id.0 & 0xFFFF, it.classes[0].attribute))
        .collect();
    let expected = [(0, 0), (2, 9), (3, 9)].map(|(id, value)| (id, Attribute::Byte(value)));
    assert_eq!(found, expected);
    assert!(
        objects
            .iter()
            .all(|(id, it)| *id > ObjectId::LAST && it.is_sound())
    );
    let (latitude, longitude) = objects[0].1.points[0].degrees();
    // A metre south of the origin, two metres east.
    assert!(
        (latitude - (52.5 - 1.0 / 111_267.0)).abs() < 1e-7,
        "{latitude}"
    );
    assert!(
        (longitude - (13.4 + 2.0 / 67_890.0)).abs() < 1e-6,
        "{longitude}"
    );
}

fn in_memory() -> World {
    World::on(redb::backends::InMemoryBackend::new()).unwrap()
}
