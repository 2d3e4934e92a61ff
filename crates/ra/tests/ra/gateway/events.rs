//! Events of the Reference Architecture between an RA client and a JAUS component.

use std::time::Duration;

use jaus::address::JausId;
use jaus::service::{Kind, Management, Service};
use jaus_ra::gateway::{Counter, Settings};
use jaus_ra::{Message, RaId};
use jaus_vehicle::mobility::Vehicle;
use jaus_vehicle::motion::{Frame, Pilot, SkidSteer, SkidSteerConfig};

use crate::gateway::world::{World, stack, subsystem};
use jaus_test_kit::rover::bytes;

const RA_POSE: RaId = RaId::new(101, 1, 38, 7);
/// The RA operator.
const COMMANDER: RaId = RaId::new(30, 1, 32, 1);

fn world() -> (World, usize) {
    let mut world = World::new(Settings::default());
    let ra = world.add_ra(subsystem(30, "OCU", &[(32, 1, "Commander")]), None);
    let rover = SkidSteer::new(SkidSteerConfig::default());
    let vehicle = Vehicle::new(Pilot::new(rover, Frame::at(52.5, 13.4)));
    let services: Vec<Box<dyn Service>> = vec![
        Box::new(vehicle.primitive_driver()),
        Box::new(vehicle.global_pose_sensor()),
    ];
    let vehicle = stack(JausId::new(101, 1, 7), Kind::Vehicle, "Rover", services);
    world.add_jaus(vehicle.management(Management::new()));
    world.run(Duration::from_secs(10));
    (world, ra)
}

fn says(world: &mut World, ra: usize, code: u16, hex: &str) {
    world.ra_says(ra, &Message::new(COMMANDER, RA_POSE, code, bytes(hex)));
}

/// Query for global poses, latitude and longitude, at 10 Hz: the rate comes first, then the query.
const POSES: &str = "c0 09 0244 00 5802 02000000 0300";

fn create(world: &mut World, ra: usize, hex: &str) -> Message {
    says(world, ra, 0x01F0, &hex.replace(' ', ""));
    world.run(Duration::from_secs(1));
    let mut confirmed = world.ra_heard(ra, 0x01F3);
    assert_eq!(confirmed.len(), 1, "{confirmed:?}");
    confirmed.remove(0)
}

#[test]
fn reports_come_at_the_rate_until_the_event_is_cancelled() {
    let (mut world, ra) = world();
    let confirmed = create(&mut world, ra, POSES);
    // Request, report, event, rate, and the response code for granted.
    assert_eq!(
        confirmed.data,
        bytes("01090244005802 00".replace(' ', "").as_str())
    );
    assert_eq!(confirmed.source, RA_POSE);
    world.run(Duration::from_secs(5));
    let events = world.ra_heard(ra, 0x41F1);
    assert!((48..=52).contains(&events.len()), "{}", events.len());
    // Event, report, sequence number, and the data of a ten-octet report.
    let first = &events[0].data;
    assert_eq!(
        (first[0], &first[1..3], first.len()),
        (0, &[0x02, 0x44][..], 18)
    );
    let numbers: Vec<u8> = events.iter().map(|it| it.data[3]).collect();
    let one_more = |pair: &[u8]| pair[1] == pair[0].wrapping_add(1);
    assert!(numbers.windows(2).all(one_more), "{numbers:?}");
    says(&mut world, ra, 0x01F2, "020a00");
    assert_eq!(
        world.ra_heard(ra, 0x01F3).last().unwrap().data.last(),
        Some(&0)
    );
    world.run(Duration::from_secs(3));
    assert_eq!(world.ra_heard(ra, 0x41F1).len(), 0);
}

#[test]
fn an_event_that_is_asked_for_twice_is_one_and_an_update_changes_its_rate() {
    let (mut world, ra) = world();
    create(&mut world, ra, POSES);
    create(&mut world, ra, POSES);
    // The same event, now twice per second.
    says(
        &mut world,
        ra,
        0x01F1,
        "c00a02440078000002000000 0300".replace(' ', "").as_str(),
    );
    world.run(Duration::from_secs(1));
    world.ra[ra].heard.clear();
    world.run(Duration::from_secs(5));
    let events = world.ra_heard(ra, 0x41F1).len();
    assert!((9..=11).contains(&events), "{events}");
}

#[test]
fn what_ours_do_not_have_is_refused_with_the_code_for_it() {
    let (mut world, ra) = world();
    for (hex, code) in [
        ("80 09 0244 02 02000000 0300", 2),
        ("80 09 0244 04 02000000 0300", 1),
        ("80 09 0244 05 02000000 0300", 4),
        ("c0 09 0045 00 5802 02000000 0300", 5),
    ] {
        let confirmed = create(&mut world, ra, hex);
        assert_eq!(confirmed.data.last(), Some(&code), "{hex}");
    }
    assert_eq!(world.count(Counter::NotConverted), 3);
    says(&mut world, ra, 0x01F2, "020a07");
    assert_eq!(world.ra_heard(ra, 0x01F3)[0].data.last(), Some(&4));
}
