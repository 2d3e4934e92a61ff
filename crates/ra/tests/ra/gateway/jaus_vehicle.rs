//! A JAUS vehicle seen from RA systems: discovery, queries, service connections, driving.

use std::time::Duration;

use bytes::Bytes;
use jaus::address::JausId;
use jaus::rights::{Acceptance, Refusal, Unaccepted, Verdict};
use jaus::service::{Kind, Management, Service, Stack, State};
use jaus_ra::gateway::{Counter, Settings, Show};
use jaus_ra::node::Event;
use jaus_ra::{Message, RaId};
use jaus_vehicle::mobility::Vehicle;
use jaus_vehicle::motion::{Frame, Pilot, SkidSteer, SkidSteerConfig};

use crate::gateway::world::{World, stack, subsystem};
use jaus_test_kit::rover::bytes;

const VEHICLE: JausId = JausId::new(101, 1, 7);
const RA_DRIVER: RaId = RaId::new(101, 1, 33, 7);
const RA_POSE: RaId = RaId::new(101, 1, 38, 7);
/// The RA operator.
const COMMANDER: RaId = RaId::new(30, 1, 32, 1);

fn vehicle() -> Stack {
    let rover = SkidSteer::new(SkidSteerConfig::default());
    let vehicle = Vehicle::new(Pilot::new(rover, Frame::at(52.5, 13.4)));
    let services: Vec<Box<dyn Service>> = vec![
        Box::new(vehicle.primitive_driver()),
        Box::new(vehicle.global_pose_sensor()),
        Box::new(vehicle.velocity_state_sensor()),
        Box::new(vehicle.local_vector_driver()),
    ];
    stack(VEHICLE, Kind::Vehicle, "Rover", services).management(Management::new())
}

fn world_with(settings: Settings) -> (World, usize, usize) {
    let mut world = World::new(settings);
    let operator = subsystem(30, "OCU", &[(32, 1, "Commander")]);
    let ra = world.add_ra(operator, None);
    let rover = world.add_jaus(vehicle());
    world.run(Duration::from_secs(10));
    (world, ra, rover)
}

/// A gateway with these grants for RA components, an RA operator and a JAUS vehicle.
fn world_granting(grants: Acceptance) -> (World, usize) {
    let mut world = World::closed(Settings {
        grants,
        ..Settings::default()
    });
    let ra = world.add_ra(subsystem(30, "OCU", &[(32, 1, "Commander")]), None);
    world.add_jaus(vehicle());
    world.run(Duration::from_secs(10));
    (world, ra)
}

fn decisions(world: &mut World) -> Vec<(RaId, String, Verdict)> {
    let decided = std::iter::from_fn(|| world.gateway.poll_decision());
    decided
        .map(|it| (it.client, it.decision.what, it.decision.verdict))
        .collect()
}

/// The state that the vehicle reports to the RA operator.
fn reported_state(world: &mut World, ra: usize) -> u8 {
    world.ra_says(ra, &says(RA_DRIVER, 0x2002, ""));
    world.run(Duration::from_secs(1));
    world.ra_heard(ra, 0x4002).last().unwrap().data[0]
}

#[test]
fn without_a_grant_an_ra_client_looks_and_stops_and_takes_no_control() {
    let (mut world, ra) = world_granting(Settings::default().grants);
    world.ra_says(ra, &says(RA_POSE, 0x2402, "ff00"));
    world.run(Duration::from_secs(1));
    assert_eq!(world.ra_heard(ra, 0x4402).len(), 1);
    world.ra_says(ra, &says(RA_DRIVER, 0x000D, "7f"));
    world.run(Duration::from_secs(2));
    assert_eq!(world.ra_heard(ra, 0x0010).len(), 1, "it is answered");
    let decided = decisions(&mut world);
    let refused = Verdict::Refused(Unaccepted::Rule(Refusal::Control));
    let expected = (COMMANDER, "RequestControl".to_owned(), refused);
    assert!(decided.contains(&expected), "{decided:?}");
    assert!(
        !decided.iter().any(|it| it.2 == Verdict::Granted),
        "{decided:?}"
    );
    world.ra_says(ra, &says(RA_DRIVER, 0x0006, "0100"));
    world.run(Duration::from_secs(1));
    let stopped = (COMMANDER, "SetEmergency".to_owned(), Verdict::Passed);
    assert!(decisions(&mut world).contains(&stopped));
    assert_eq!(reported_state(&mut world, ra), State::Emergency as u8);
}

#[test]
fn the_name_of_an_ra_component_is_kept_as_received_and_escaped_where_it_is_shown() {
    let mut world = World::new(Settings::default());
    let name = "Commander\u{1b}[2J\nfake line";
    world.add_ra(subsystem(30, "OCU", &[(32, 1, name)]), None);
    world.run(Duration::from_secs(10));
    let report = world.gateway.report();
    let mut names = report.ra_components.iter().map(|it| it.name.as_str());
    assert!(names.any(|it| it == name), "{report:?}");
    let shown = report.to_string();
    assert!(
        !shown.contains("\u{1b}") && shown.contains(r"\u{1b}[2J\nfake line"),
        "{shown}"
    );
}

#[test]
fn while_nothing_can_be_recorded_an_ra_client_stops_and_takes_no_control() {
    let grants = Acceptance::new(["30 control=127".parse().unwrap()]);
    let (mut world, ra) = world_granting(grants);
    world.gateway.refuse_commands(true);
    world.ra_says(ra, &says(RA_DRIVER, 0x000D, "7f"));
    world.run(Duration::from_secs(2));
    let refused = Verdict::Refused(Unaccepted::Rule(Refusal::Unrecorded));
    let expected = (COMMANDER, "RequestControl".to_owned(), refused);
    assert!(decisions(&mut world).contains(&expected));
    world.ra_says(ra, &says(RA_DRIVER, 0x0006, "0100"));
    world.run(Duration::from_secs(1));
    assert_eq!(reported_state(&mut world, ra), State::Emergency as u8);
    world.gateway.refuse_commands(false);
    world.ra_says(ra, &says(RA_DRIVER, 0x000D, "7f"));
    world.run(Duration::from_secs(2));
    let decided = decisions(&mut world);
    assert!(
        decided.iter().any(|it| it.2 == Verdict::Passed),
        "{decided:?}"
    );
}

#[test]
fn a_grant_gives_an_ra_client_control_and_both_are_recorded() {
    let grants = ["30 control=127", "65535.255.255 observe"].map(|it| it.parse().unwrap());
    let (mut world, ra) = world_granting(Acceptance::new(grants));
    world.ra_says(ra, &says(RA_DRIVER, 0x000D, "7f"));
    world.run(Duration::from_secs(2));
    assert_eq!(world.ra_heard(ra, 0x000F)[0].data[0], 0);
    let decided = decisions(&mut world);
    for (what, verdict) in [
        ("RequestControl", Verdict::Passed),
        ("ConfirmControl", Verdict::Granted),
    ] {
        let expected = (COMMANDER, what.to_owned(), verdict);
        assert!(decided.contains(&expected), "{decided:?}");
    }
}

fn world() -> (World, usize, usize) {
    world_with(Settings::default())
}

fn says(destination: RaId, code: u16, hex: &str) -> Message {
    Message::new(COMMANDER, destination, code, bytes(hex))
}

#[test]
fn it_is_listed_by_name_once_per_service() {
    let (world, ra, _) = world();
    let peer = &world.ra[ra].node;
    let shown = peer.subsystems().find(|it| it.id == 101).unwrap();
    assert_eq!(shown.name, "Rover");
    let parts: Vec<u8> = shown.components().map(|(id, _)| id.component).collect();
    for part in [1, 33, 35, 38, 42, 44] {
        assert!(parts.contains(&part), "{parts:?}");
    }
    let mut components = shown.components();
    let (_, driver) = components.find(|(id, _)| *id == RA_DRIVER).unwrap();
    assert!(driver.name.contains("Primitive Driver"), "{driver:?}");
    let inputs = driver.services.iter().flat_map(|it| &it.inputs);
    assert!(inputs.clone().any(|it| it.code == 0x0405));
}

#[test]
fn the_gateway_lists_itself_as_a_commander() {
    let (world, ra, _) = world();
    let shown = world.ra[ra].node.subsystems().find(|it| it.id == 250);
    let (id, _) = shown
        .unwrap()
        .components()
        .find(|(id, _)| id.component == 32)
        .unwrap();
    assert_eq!(id, RaId::new(250, 1, 32, 1));
}

#[test]
fn only_the_chosen_subsystems_are_shown() {
    let settings = Settings {
        show: Show::Only([102].into()),
        ..Settings::default()
    };
    let (world, ra, _) = world_with(settings);
    let shown: Vec<u8> = world.ra[ra].node.subsystems().map(|it| it.id).collect();
    assert_eq!(shown, [250]);
}

#[test]
fn it_answers_a_pose_query() {
    let (mut world, ra, _) = world();
    world.ra_says(ra, &says(RA_POSE, 0x2402, "ff00"));
    world.run(Duration::from_secs(1));
    let told = world.ra_heard(ra, 0x4402);
    let [told] = &told[..] else {
        panic!("{told:?}");
    };
    assert_eq!((told.source, told.destination), (RA_POSE, COMMANDER));
    let latitude = i32::from_le_bytes([told.data[2], told.data[3], told.data[4], told.data[5]]);
    let latitude = f64::from(latitude) * 90.0 / f64::from(i32::MAX);
    assert!((latitude - 52.5).abs() < 1e-4, "{latitude}");
}

#[test]
fn a_service_connection_runs_at_its_rate_until_it_is_terminated() {
    let (mut world, ra, _) = world();
    // Global poses at 10 Hz.
    world.ra_says(ra, &says(RA_POSE, 0x0008, "02445802ff000000"));
    world.run(Duration::from_secs(5));
    let heard = std::mem::take(&mut world.ra[ra].heard);
    let confirms: Vec<&Message> = heard.iter().filter(|it| it.code == 0x0009).collect();
    let [confirm] = &confirms[..] else {
        panic!("{confirms:?}");
    };
    assert_eq!(
        (&confirm.data[..2], confirm.data[5]),
        (&[0x02, 0x44][..], 0)
    );
    let reports = heard.iter().filter(|it| it.code == 0x4402);
    assert!(reports.clone().all(|it| it.connection));
    let reports = reports.count();
    assert!((48..=52).contains(&reports), "{reports}");
    world.ra_says(ra, &says(RA_POSE, 0x000C, "024400"));
    world.run(Duration::from_secs(1));
    world.ra[ra].heard.clear();
    world.run(Duration::from_secs(2));
    assert_eq!(world.ra_heard(ra, 0x4402).len(), 0);
}

#[test]
fn a_service_connection_to_a_missing_service_is_refused() {
    let (mut world, ra, _) = world();
    world.ra_says(ra, &says(RA_POSE, 0x0008, "00405802ff000000"));
    let told = world.ra_heard(ra, 0x0009);
    assert_eq!(told[0].data[5], 2, "the component is not capable");
}

#[test]
fn it_is_driven_by_the_ra_component_that_controls_it() {
    let (mut world, ra, rover) = world();
    world.ra_says(ra, &says(RA_DRIVER, 0x000D, "7f"));
    world.run(Duration::from_secs(1));
    let told = world.ra_heard(ra, 0x000F);
    assert_eq!(told[0].data, Bytes::from_static(&[0]));
    let standing = *world.jaus[rover].stack.standing();
    assert_eq!(standing.controller.unwrap().id, JausId::new(30, 1, 32));
    world.ra_says(ra, &says(RA_DRIVER, 0x0004, ""));
    assert_eq!(world.jaus[rover].stack.standing().state, State::Ready);
    for _ in 0..10 {
        // Half of the propulsive effort, forward.
        world.ra_says(ra, &says(RA_DRIVER, 0x0405, "0100ff3f"));
        world.run(Duration::from_millis(100));
    }
    let velocity = RaId::new(101, 1, 42, 7);
    world.ra_says(ra, &says(velocity, 0x2404, "0100"));
    world.run(Duration::from_secs(1));
    let told = world.ra_heard(ra, 0x4404);
    let speed = i32::from_le_bytes([
        told[0].data[2],
        told[0].data[3],
        told[0].data[4],
        told[0].data[5],
    ]);
    assert!(speed > 0, "{told:?}");
    world.ra_says(ra, &says(RA_DRIVER, 0x000E, ""));
    world.run(Duration::from_secs(1));
    assert_eq!(world.jaus[rover].stack.standing().controller, None);
}

#[test]
fn unavailable_control_is_rejected_as_openjaus_does() {
    let (mut world, ra, rover) = world();
    let operator = world.add_operator();
    let now = world.now;
    let patience = jaus::service::Patience::default();
    let stack = &mut world.jaus[operator].stack;
    stack.request_control(now, VEHICLE, 200, patience).unwrap();
    world.run(Duration::from_secs(1));
    world.ra_says(ra, &says(RA_DRIVER, 0x000D, "7f"));
    world.run(Duration::from_secs(1));
    assert_eq!(world.ra_heard(ra, 0x0010).len(), 1);
    let controller = world.jaus[rover].stack.standing().controller.unwrap();
    assert_eq!(controller.authority, 200);
}

#[test]
fn control_ends_when_its_ra_system_disappears() {
    let (mut world, ra, rover) = world();
    world.ra_says(ra, &says(RA_DRIVER, 0x000D, "7f"));
    world.run(Duration::from_secs(1));
    assert!(world.jaus[rover].stack.standing().controller.is_some());
    world.ra.remove(ra);
    world.run(Duration::from_secs(10));
    assert!(world.jaus[rover].stack.standing().controller.is_none());
}

#[test]
fn a_query_repeated_before_its_answer_is_forwarded_once() {
    let (mut world, ra, rover) = world();
    world.jaus[rover].up = false;
    for _ in 0..50 {
        world.ra_says(ra, &says(RA_POSE, 0x2402, "ff00"));
    }
    assert_eq!(world.count(Counter::QueriesFromRa), 1);
    assert_eq!(world.count(Counter::Repeated), 49);
}

#[test]
fn its_departure_is_reported() {
    let (mut world, ra, rover) = world();
    world.jaus[rover].up = false;
    world.run(Duration::from_secs(25));
    assert!(world.ra[ra].seen.contains(&Event::Lost(101)));
}

#[test]
fn a_message_without_counterpart_is_refused_and_counted() {
    let (mut world, ra, _) = world();
    world.ra_says(ra, &says(RA_DRIVER, 0x000D, "7f"));
    world.run(Duration::from_secs(1));
    let before = world.count(Counter::NoCounterpart);
    world.ra_says(ra, &says(RA_DRIVER, 0x0406, "0000"));
    assert_eq!(world.count(Counter::NoCounterpart), before + 1);
}
