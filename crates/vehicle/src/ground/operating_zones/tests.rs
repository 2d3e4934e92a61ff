use redb::backends::InMemoryBackend;

use super::*;
use jaus::address::JausId;
use jaus::messages::mobility::delete_zone::ZoneIdRec;
use jaus::messages::mobility::query_local_operating_zone::QueryZoneId;
use jaus::service::rig::{CLIENT, Rig, STRANGER};

const SQUARE: [Point; 4] = [(2.0, 2.0), (4.0, 2.0), (4.0, 4.0), (2.0, 4.0)];
const YARD: [Point; 4] = [(-10.0, -10.0), (10.0, -10.0), (10.0, 10.0), (-10.0, 10.0)];

struct Bench {
    rig: Rig,
    zones: OperatingZones,
}

impl Bench {
    fn new() -> Self {
        let world = World::on(InMemoryBackend::new()).unwrap();
        let store = WorldStore::new(world, Frame::at(52.5, 13.4), |error| panic!("{error}"));
        let zones = store.operating_zones();
        let rig = Rig::new(vec![Box::new(zones.clone())]);
        Self { rig, zones }
    }

    /// Sends a message, and returns whether its command has ended, and how.
    fn send(&mut self, source: JausId, message: &impl Message) -> Option<bool> {
        let before = self.rig.ended().len();
        assert!(self.rig.send(source, message));
        self.rig.run(WorldStore::LINGER);
        self.rig
            .ended()
            .get(before)
            .map(|&(_, successful)| successful)
    }

    fn local(&mut self, number: u16) -> ReportLocalOperatingZone {
        let query = QueryLocalOperatingZone {
            query_zone_id: QueryZoneId(number),
        };
        self.rig.ask(&query).unwrap()
    }

    /// The zones in force, as drivers read them.
    fn in_force(&mut self) -> Zones {
        reported_zones(&self.local(0)).unwrap()
    }
}

fn keep_out(number: u16, vertices: &[Point]) -> Vec<LocalExclusionZoneSeq> {
    let vertex = |&it: &Point| LocalExclusionZoneSeq {
        local_exclusion_zone_rec: LocalExclusionZoneRec {
            zone_id: delete_zone::ZoneId(number),
        },
        local_polygon_point_rec: point(it),
    };
    vertices.iter().map(vertex).collect()
}

fn point((x, y): Point) -> LocalPolygonPointRec {
    LocalPolygonPointRec {
        x: X::new(x).unwrap(),
        y: Y::new(y).unwrap(),
        ..LocalPolygonPointRec::default()
    }
}

fn set(operating: &[Point], zones: &[(u16, &[Point])]) -> SetLocalOperatingZone {
    SetLocalOperatingZone {
        local_operating_zone: operating.iter().copied().map(point).collect(),
        local_exclusion_zones: zones.iter().map(|(id, it)| keep_out(*id, it)).collect(),
    }
}

#[test]
fn zones_of_the_client_in_control_are_set_replaced_and_deleted() {
    let mut bench = Bench::new();
    let message = set(&YARD, &[(7, &SQUARE), (8, &SQUARE)]);
    assert_eq!(bench.send(STRANGER, &message), None, "not in control");
    assert!(bench.in_force().is_empty());
    assert_eq!(bench.send(CLIENT, &message), Some(true));
    let numbers = |bench: &mut Bench| -> Vec<u16> {
        bench.in_force().iter().map(|(id, _)| id.number()).collect()
    };
    assert_eq!(numbers(&mut bench), [1, 7, 8]);
    let changed = bench.rig.changed().clone();
    for code in [
        QueryLocalOperatingZone::CODE,
        QueryGlobalOperatingZone::CODE,
        QueryExcursion::CODE,
    ] {
        assert!(changed.contains(&code), "{code:04X}");
    }
    let triangle = [(0.0, 5.0), (1.0, 5.0), (0.0, 6.0)];
    assert_eq!(bench.send(CLIENT, &set(&[], &[(8, &triangle)])), Some(true));
    assert_eq!(numbers(&mut bench), [1, 7, 8], "the others are kept");
    assert_eq!(bench.local(8).local_exclusion_zones[0].len(), 3);
    assert!(
        bench.local(8).local_operating_zone.is_empty(),
        "only that one"
    );
    let delete = DeleteZone {
        zone_id_list: [1, 8, 99]
            .map(|number| ZoneIdRec {
                zone_id: delete_zone::ZoneId(number),
            })
            .to_vec(),
    };
    assert_eq!(bench.send(STRANGER, &delete), None);
    assert_eq!(bench.send(CLIENT, &delete), Some(true));
    assert_eq!(numbers(&mut bench), [7]);
}

#[test]
fn a_message_with_an_invalid_zone_changes_nothing_and_ends_without_success() {
    let mut bench = Bench::new();
    assert_eq!(bench.send(CLIENT, &set(&YARD, &[(7, &SQUARE)])), Some(true));
    let before = bench.in_force();
    let bow_tie = [(0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.0)];
    let far = [(0.0, 0.0), (1.0, 1.0), (200_000.0, 0.0)];
    let mut two_numbers = set(&[], &[(9, &SQUARE)]);
    two_numbers.local_exclusion_zones[0][2] = keep_out(10, &SQUARE)[2].clone();
    for message in [
        set(&[], &[(9, &SQUARE), (10, &bow_tie)]),
        set(&bow_tie, &[]),
        set(&[], &[(9, &SQUARE[..2])]),
        set(&[], &[(9, &[])]),
        set(&[], &[(9, &far)]),
        set(&[], &[(0, &SQUARE)]),
        set(&[], &[(1, &SQUARE)]),
        two_numbers,
    ] {
        assert_eq!(bench.send(CLIENT, &message), Some(false), "{message:?}");
        assert_eq!(bench.in_force(), before);
    }
}

#[test]
fn the_number_of_vertices_of_all_zones_is_bounded() {
    let mut bench = Bench::new();
    // A ring of teeth with 250 vertices.
    let ring: Vec<Point> = (0..250)
        .map(|index| {
            let angle = f64::from(index) * std::f64::consts::TAU / 250.0;
            let radius = if index % 2 == 0 { 50.0 } else { 60.0 };
            (radius * angle.cos(), radius * angle.sin())
        })
        .collect();
    let ends: Vec<_> = (2..42)
        .map(|number| bench.send(CLIENT, &set(&[], &[(number, &ring)])))
        .collect();
    let accepted = ends.iter().filter(|&&end| end == Some(true)).count();
    assert_eq!(accepted, 16, "4000 of 10000 vertices");
    assert!(ends[16..].iter().all(|&end| end == Some(false)));
    assert_eq!(bench.in_force().iter().count(), 16);
}

#[test]
fn zones_on_the_globe_are_the_same_zones_in_the_local_frame() {
    let mut bench = Bench::new();
    assert_eq!(bench.send(CLIENT, &set(&YARD, &[(7, &SQUARE)])), Some(true));
    let all = QueryGlobalOperatingZone::default();
    let global: ReportGlobalOperatingZone = bench.rig.ask(&all).unwrap();
    let again = SetGlobalOperatingZone {
        global_operating_zone: global.global_operating_zone,
        global_exclusion_zones: global.global_exclusion_zones,
    };
    assert_eq!(bench.send(CLIENT, &again), Some(true));
    let zones = bench.in_force();
    let (_, square) = zones.iter().nth(1).unwrap();
    for (found, expected) in square.vertices().iter().zip(SQUARE) {
        let off = (found.0 - expected.0).hypot(found.1 - expected.1);
        assert!(off < 0.02, "{found:?} is not {expected:?}");
    }
}

#[test]
fn an_excursion_tells_each_zone_that_the_vehicle_is_not_where_it_should_be() {
    let mut bench = Bench::new();
    bench.send(CLIENT, &set(&YARD, &[(7, &SQUARE)]));
    let mut statuses = |place: Option<Point>| -> Vec<u8> {
        let _ = bench.zones.handle_place(place);
        let report: ReportExcursion = bench.rig.ask(&QueryExcursion::default()).unwrap();
        report.excursion.iter().map(|it| it.zone_status.0).collect()
    };
    assert_eq!(statuses(None), [0_u8; 0], "unknown");
    assert_eq!(statuses(Some((0.0, 0.0))), [0, 0]);
    assert_eq!(statuses(Some((3.0, 3.0))), [0, 2]);
    assert_eq!(statuses(Some((30.0, 3.0))), [1, 0]);
    assert!(bench.zones.handle_place(Some((3.0, 3.0))), "news");
    assert!(!bench.zones.handle_place(Some((3.5, 3.0))), "no news");
}
