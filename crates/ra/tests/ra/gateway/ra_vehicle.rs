//! An RA vehicle seen from JAUS clients: discovery, queries, subscriptions, driving.

use std::time::Duration;

use jaus::address::JausId;
use jaus::codec::Message;
use jaus::messages::core::{
    ClearEmergency, QueryStatus, ReportStatus, Resume, SetEmergency, Standby, clear_emergency,
    set_emergency,
};
use jaus::messages::mobility::{
    QueryGlobalPose, QueryVelocityState, ReportGlobalPose, ReportVelocityState, SetWrenchEffort,
    global_pose_sensor, primitive_driver, velocity_state_sensor,
};
use jaus::service::{
    ControlLost, ControlNews, ControlRefused, Event, Kind, Level, Patience, SubscriptionNews,
    Topic, When,
};
use jaus_ra::gateway::{Counter, Settings};
use jaus_ra::messages::ra33;

use crate::gateway::world::{COMMANDER, OPERATOR, World, stack, subsystem};
use jaus_test_kit::rover::{Rover, SUBSYSTEM, bytes};

const JAUS_DRIVER: JausId = JausId::new(20, 1, 33);
const JAUS_POSE: JausId = JausId::new(20, 1, 38);
const JAUS_VELOCITY: JausId = JausId::new(20, 1, 42);

/// An operator and an RA vehicle that have discovered each other.
fn world() -> (World, usize, usize) {
    let mut world = World::new(Settings::default());
    let parts = [
        (33, 1, "Driver"),
        (38, 1, "Compass and satellites"),
        (42, 1, ""),
    ];
    let ra = world.add_ra(subsystem(SUBSYSTEM, "Sim", &parts), Some(Rover::new()));
    let operator = world.add_operator();
    world.run(Duration::from_secs(10));
    (world, ra, operator)
}

fn seconds(seconds: f64) -> Duration {
    Duration::from_secs_f64(seconds)
}

#[test]
fn its_components_are_found_with_names_and_services() {
    let (world, _, operator) = world();
    let directory = world.jaus[operator].stack.directory();
    for (id, name, urn) in [
        (JAUS_DRIVER, "Driver", primitive_driver::URN),
        (JAUS_POSE, "Compass and satellites", global_pose_sensor::URN),
        (
            JAUS_VELOCITY,
            "Velocity State Sensor",
            velocity_state_sensor::URN,
        ),
    ] {
        let component = directory.component(id).unwrap();
        let told = component.identification.as_ref().unwrap();
        assert_eq!(told.name, name);
        assert!(component.offers(urn), "{id}: {component:?}");
    }
    let vehicle = directory.identification(Level::Subsystem, JAUS_DRIVER);
    let vehicle = vehicle.unwrap();
    assert_eq!(
        (vehicle.kind, vehicle.name.as_str()),
        (Kind::Vehicle, "Sim")
    );
}

#[test]
fn its_pose_is_told_when_it_is_asked_for_with_the_wanted_fields_alone() {
    let (mut world, _, operator) = world();
    let query = QueryGlobalPose {
        presence_vector: 0xFFFF,
    };
    let pose: ReportGlobalPose = world.ask(operator, JAUS_POSE, &query).unwrap();
    let latitude = pose.latitude_deg().unwrap();
    assert!((latitude - 37.2).abs() < 0.5, "{latitude}");
    assert!(pose.altitude_m().is_some());
    let query = QueryGlobalPose { presence_vector: 1 };
    let pose: ReportGlobalPose = world.ask(operator, JAUS_POSE, &query).unwrap();
    assert_eq!(pose.latitude_deg(), Some(latitude));
    assert!(pose.altitude_m().is_none() && pose.longitude_deg().is_none());
}

#[test]
fn a_component_that_answers_no_queries_is_listened_to_for_a_moment() {
    let (mut world, ra, operator) = world();
    world.ra[ra].rover.as_mut().unwrap().mute = true;
    let query = QueryVelocityState {
        presence_vector: 0xFFFF,
    };
    let report: Option<ReportVelocityState> = world.ask(operator, JAUS_VELOCITY, &query);
    assert!(report.is_some());
    world.run(seconds(3.0));
    let rover = world.ra[ra].rover.as_ref().unwrap();
    assert!(rover.connections.is_empty(), "{:?}", rover.connections);
}

#[test]
fn a_query_that_nobody_answers_is_given_up() {
    let (mut world, ra, operator) = world();
    world.ra[ra].rover = None;
    let query = jaus::messages::mobility::QueryWrenchEffort {
        presence_vector: 0xFFFF,
    };
    let report: Option<jaus::messages::mobility::ReportWrenchEffort> =
        world.ask(operator, JAUS_DRIVER, &query);
    assert!(report.is_none());
    assert!(world.count(Counter::Unanswered) > 0);
}

#[test]
fn a_subscription_runs_at_its_rate_over_one_service_connection() {
    let (mut world, ra, operator) = world();
    let topic = |hz, presence_vector| Topic {
        peer: JAUS_POSE,
        query: Message::encode(&QueryGlobalPose { presence_vector }).unwrap(),
        report: 0x4402,
        when: When::hz(hz),
    };
    let (now, patience) = (world.now, Patience::default());
    let stack = &mut world.jaus[operator].stack;
    let fast = stack.subscribe(now, &topic(10.0, 0xFF), patience).unwrap();
    let slow = stack.subscribe(now, &topic(2.0, 3), patience).unwrap();
    world.run(seconds(10.0));
    let reports = |world: &World, id| {
        let is_report = |event: &&Event| matches!(event, Event::Subscription(it, SubscriptionNews::Report { .. }) if *it == id);
        world.jaus[operator].events.iter().filter(is_report).count()
    };
    let (many, few) = (reports(&world, fast), reports(&world, slow));
    assert!((95..=105).contains(&many), "{many}");
    assert!((19..=22).contains(&few), "{few}");
    let rover = world.ra[ra].rover.as_ref().unwrap();
    let rate = rover.connections[&0x4402];
    assert!((rate - 10.0).abs() < 0.02, "{rate}");
    let now = world.now;
    let stack = &mut world.jaus[operator].stack;
    stack.unsubscribe(now, fast);
    stack.unsubscribe(now, slow);
    world.run(seconds(3.0));
    let rover = world.ra[ra].rover.as_ref().unwrap();
    assert!(rover.connections.is_empty(), "{:?}", rover.connections);
}

/// Takes control and sends Resume. Returns what the client learned about its control.
fn take_control(world: &mut World, who: usize, authority: u8) -> Vec<ControlNews> {
    let (now, patience) = (world.now, Patience::default());
    let stack = &mut world.jaus[who].stack;
    stack
        .request_control(now, JAUS_DRIVER, authority, patience)
        .unwrap();
    world.run(seconds(3.0));
    world.tell(who, JAUS_DRIVER, &Resume {});
    world.run(seconds(0.5));
    for peer in &mut world.ra {
        peer.rover.iter_mut().for_each(|it| it.efforts.clear());
    }
    control_news(world, who)
}

fn control_news(world: &mut World, who: usize) -> Vec<ControlNews> {
    let events = std::mem::take(&mut world.jaus[who].events);
    let news = |event| match event {
        Event::Control(_, ControlNews::Status(_)) => None,
        Event::Control(_, news) => Some(news),
        _ => None,
    };
    events.into_iter().filter_map(news).collect()
}

fn effort() -> SetWrenchEffort {
    let mut effort = SetWrenchEffort::default();
    effort.set_propulsive_linear_effort_x_percent(40.0).unwrap();
    effort
}

#[test]
fn it_is_driven_by_who_controls_it_and_by_nobody_else() {
    let (mut world, ra, operator) = world();
    let stranger = JausId::new(43, 1, 1);
    let stranger = world.add_jaus(stack(
        stranger,
        Kind::OtherSubsystem,
        "Stranger",
        Vec::new(),
    ));
    world.tell(operator, JAUS_DRIVER, &effort());
    let efforts = |world: &World| world.ra[ra].rover.as_ref().unwrap().efforts.len();
    let moving = |world: &World| world.ra[ra].rover.as_ref().unwrap().drives(world.now);
    assert!(!moving(&world));
    assert_eq!(
        take_control(&mut world, operator, 127),
        [ControlNews::Granted]
    );
    let rover = world.ra[ra].rover.as_ref().unwrap();
    assert_eq!(rover.controller, Some((COMMANDER, 127)));
    assert!(
        rover.controller_ready,
        "it is told that its controller is ready"
    );
    for _ in 0..5 {
        world.tell(operator, JAUS_DRIVER, &effort());
        world.tell(stranger, JAUS_DRIVER, &effort());
    }
    assert_eq!(efforts(&world), 5);
    assert_eq!(world.count(Counter::NotInControl), 6);
}

/// OpenJAUS's library keeps the fields that a command leaves out.
#[test]
fn an_effort_without_brakes_releases_those_of_the_stop_command() {
    let (mut world, ra, operator) = world();
    take_control(&mut world, operator, 127);
    let emergency_code = set_emergency::EmergencyCode(1);
    world.tell(operator, JAUS_DRIVER, &SetEmergency { emergency_code });
    world.tell(
        operator,
        JAUS_DRIVER,
        &ClearEmergency {
            emergency_code: clear_emergency::EmergencyCode(1),
        },
    );
    world.tell(operator, JAUS_DRIVER, &Resume {});
    world.run(seconds(0.3));
    let last = |world: &World| {
        let rover = world.ra[ra].rover.as_ref().unwrap();
        let data = rover.efforts.last().unwrap();
        let payload = [&[0x05, 0x04][..], data].concat();
        <ra33::SetWrenchEffort as Message>::decode(&payload.into()).unwrap()
    };
    let brakes = last(&world).resistive_linear_effort_x_percent();
    assert_eq!(brakes, Some(100.0), "the stop command");
    world.tell(operator, JAUS_DRIVER, &effort());
    world.run(seconds(0.1));
    let given = last(&world);
    assert!((given.propulsive_linear_effort_x_percent().unwrap() - 40.0).abs() < 0.01);
    assert_eq!(given.resistive_linear_effort_x_percent(), Some(0.0));
    assert_eq!(given.propulsive_rotational_effort_z_percent(), Some(0.0));
}

#[test]
fn control_is_given_back_when_its_client_gives_it_back() {
    let (mut world, ra, operator) = world();
    let (now, patience) = (world.now, Patience::default());
    let stack = &mut world.jaus[operator].stack;
    let control = stack
        .request_control(now, JAUS_DRIVER, 127, patience)
        .unwrap();
    world.run(seconds(2.0));
    let now = world.now;
    world.jaus[operator].stack.release_control(now, control);
    world.run(seconds(1.0));
    let news = control_news(&mut world, operator);
    assert_eq!(news, [ControlNews::Granted, ControlNews::Released]);
    assert_eq!(world.ra[ra].rover.as_ref().unwrap().controller, None);
}

#[test]
fn control_is_given_back_when_its_client_is_gone() {
    let (mut world, ra, operator) = world();
    assert_eq!(
        take_control(&mut world, operator, 127),
        [ControlNews::Granted]
    );
    world.jaus[operator].up = false;
    world.run(seconds(20.0));
    assert_eq!(world.ra[ra].rover.as_ref().unwrap().controller, None);
}

#[test]
fn whoever_has_less_authority_than_its_controller_is_refused_and_a_controller_is_told_of_its_loss()
{
    let (mut world, ra, operator) = world();
    let rover = world.ra[ra].rover.as_mut().unwrap();
    // A controller in its own subsystem.
    rover.controller = Some((jaus_ra::RaId::new(SUBSYSTEM, 1, 45, 1), 200));
    let news = take_control(&mut world, operator, 127);
    let refused = ControlNews::Refused(ControlRefused::InsufficientAuthority(127));
    assert_eq!(news, [refused]);
    assert_eq!(
        take_control(&mut world, operator, 220),
        [ControlNews::Granted]
    );
    let rover = world.ra[ra].rover.as_mut().unwrap();
    assert_eq!(rover.controller, Some((COMMANDER, 220)));
    rover.lose_controller();
    world.run(seconds(1.0));
    let news = control_news(&mut world, operator);
    assert_eq!(news, [ControlNews::Lost(ControlLost::TakenBack)]);
}

#[test]
fn a_jaus_client_with_more_authority_takes_it_over_from_another() {
    let (mut world, ra, operator) = world();
    take_control(&mut world, operator, 100);
    let rival = JausId::new(43, 1, 1);
    let rival = world.add_jaus(stack(rival, Kind::OperatorControlUnit, "Rival", Vec::new()));
    assert_eq!(take_control(&mut world, rival, 200), [ControlNews::Granted]);
    let news = control_news(&mut world, operator);
    assert_eq!(news, [ControlNews::Lost(ControlLost::TakenBack)]);
    let rover = world.ra[ra].rover.as_ref().unwrap();
    assert_eq!(rover.controller, Some((COMMANDER, 200)));
}

#[test]
fn its_states_are_told_and_set_and_anybody_may_stop_it_in_an_emergency() {
    let (mut world, ra, operator) = world();
    let state = |world: &mut World| {
        let report: ReportStatus = world.ask(operator, JAUS_DRIVER, &QueryStatus {}).unwrap();
        report.status.0
    };
    assert_eq!(state(&mut world), 1);
    world.tell(operator, JAUS_DRIVER, &Standby {});
    assert_eq!(state(&mut world), 1, "nobody controls it");
    take_control(&mut world, operator, 127);
    world.tell(operator, JAUS_DRIVER, &Standby {});
    assert_eq!(state(&mut world), 2);
    world.tell(operator, JAUS_DRIVER, &Resume {});
    assert_eq!(state(&mut world), 1);
    let stranger = JausId::new(43, 1, 1);
    let stranger = world.add_jaus(stack(
        stranger,
        Kind::OtherSubsystem,
        "Stranger",
        Vec::new(),
    ));
    let emergency = SetEmergency {
        emergency_code: set_emergency::EmergencyCode(1),
    };
    world.tell(stranger, JAUS_DRIVER, &emergency);
    assert_eq!(world.ra[ra].rover.as_ref().unwrap().state, 5);
}

#[test]
fn in_an_emergency_it_is_stopped_by_what_it_obeys_and_not_driven_until_that_is_over() {
    let (mut world, ra, operator) = world();
    take_control(&mut world, operator, 127);
    let mut ahead = SetWrenchEffort::default();
    ahead.set_propulsive_linear_effort_x_percent(60.0).unwrap();
    let drive = |world: &mut World| {
        world.tell(operator, JAUS_DRIVER, &ahead);
        world.run(seconds(0.3));
        world.ra[ra].rover.as_ref().unwrap().efforts.len()
    };
    assert_eq!(drive(&mut world), 1);
    let emergency_code = set_emergency::EmergencyCode(1);
    world.tell(operator, JAUS_DRIVER, &SetEmergency { emergency_code });
    world.run(seconds(0.1));
    // Like OpenJAUS's, it obeys efforts in every state.
    let rover = world.ra[ra].rover.as_mut().unwrap();
    let stop = rover.efforts.last().unwrap();
    assert_eq!(stop[..], bytes("ff0f000000000000000000000000ff0000000000"));
    assert_eq!(drive(&mut world), 2, "nobody drives it");
    assert_eq!(world.count(Counter::InEmergency), 1);
    // Another client has cleared the emergency; the next command detects it.
    world.ra[ra].rover.as_mut().unwrap().state = 1;
    assert_eq!(drive(&mut world), 2);
    assert_eq!(drive(&mut world), 2, "it is in standby");
    assert_eq!(world.count(Counter::InStandby), 1);
    world.tell(operator, JAUS_DRIVER, &Resume {});
    assert_eq!(drive(&mut world), 3);
}

#[test]
fn who_asks_for_control_of_it_is_told_who_has_it() {
    let (mut world, _, operator) = world();
    take_control(&mut world, operator, 127);
    let query = jaus::messages::core::QueryControl {};
    let report: jaus::messages::core::ReportControl =
        world.ask(operator, JAUS_DRIVER, &query).unwrap();
    let told = JausId::new(report.subsystem_id, report.node_id, report.component_id);
    assert_eq!((told, report.authority_code), (OPERATOR, 127));
}

#[test]
fn it_leaves_when_it_is_heard_no_more_and_is_not_taken_for_a_jaus_system() {
    let (mut world, ra, _) = world();
    assert!(world.attached().contains(&JAUS_DRIVER.to_string()));
    let gone = world.ra.remove(ra);
    world.run(seconds(30.0));
    assert_eq!(world.attached(), ["250.1.1"]);
    let report = world.gateway.report();
    assert!(
        report
            .jaus_components
            .iter()
            .all(|it| !it.ra.starts_with("20."))
    );
    world.ra.push(gone);
    world.run(seconds(10.0));
    assert!(world.attached().contains(&JAUS_DRIVER.to_string()));
}
