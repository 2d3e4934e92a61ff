//! Behaviour of a mission on a lost link, under each policy.

use super::stages::{SETTINGS, World};
use crate::mission::{Action, LostLink, Path, Stage};
use jaus::address::JausId;

const CLIENT: JausId = JausId::new(42, 1, 1);
const WHY: &str = "control has ended";

/// A mission that has driven 2 m along X when the link is lost.
fn lost(policy: LostLink) -> World {
    let mut world = World::with(policy);
    world.go(true);
    world.drive();
    for step in 0..=20 {
        world.mission.handle_pose((0.1 * f64::from(step), 0.0));
    }
    world.mission.lose_client(CLIENT, WHY);
    world
}

#[test]
fn by_default_the_vehicle_stops_and_the_mission_is_over() {
    let mut world = lost(LostLink::default());
    assert_eq!((world.stage(), world.reason()), (Stage::Stopped, WHY));
    assert_eq!(world.take_actions(), [Action::Halt]);
    assert_eq!(world.mission.poll_timeout(), None);
}

#[test]
fn a_held_mission_waits_for_its_approval_and_is_planned_anew() {
    let mut world = lost(LostLink::Hold);
    assert_eq!(world.stage(), Stage::AwaitingApproval);
    assert_eq!(world.take_actions(), [Action::Halt]);
    world.pass(86_400 * super::stages::SECOND);
    assert_eq!(
        world.take_actions(),
        [],
        "it stands for as long as it takes"
    );
    world.mission.handle_new_client("another client");
    let run = world.run();
    world.mission.approve(world.now, run.mission).unwrap();
    assert_eq!(world.take_actions(), [Action::FetchMap(run)]);
    world.map();
    world.plan();
    assert_eq!(world.stage(), Stage::Path, "approved once");
}

#[test]
fn a_client_that_is_dead_has_the_vehicle_drive_back_the_way_it_came() {
    let mut world = lost(LostLink::Return);
    let run = world.run();
    assert_eq!(
        world.take_actions(),
        [Action::Halt, Action::CheckClient(run, CLIENT)]
    );
    world.mission.handle_lost_client(world.now, run, false);
    let run = world.run();
    let actions = world.take_actions();
    let [Action::HandOver(for_run, path, speed)] = &actions[..] else {
        panic!("{actions:?}");
    };
    assert_eq!((*for_run, *speed), (run, SETTINGS.speed));
    let points = path.points();
    assert_eq!(
        (points[0], points[points.len() - 1]),
        ((2.0, 0.0), (0.0, 0.0))
    );
    assert_eq!(world.reason(), format!("returns: {WHY}"));
    // If it is blocked on the return, it stops: another attempt would drive to the destination.
    world.hand_over();
    world.set_back("blocked");
    assert_eq!(world.stage(), Stage::Failed);
    assert_eq!(world.take_actions(), [Action::Halt]);
}

#[test]
fn a_client_that_has_released_control_does_not_have_it_drive_back() {
    let mut world = lost(LostLink::Return);
    let run = world.run();
    world.take_actions();
    world.mission.handle_lost_client(world.now, run, true);
    assert_eq!((world.stage(), world.reason()), (Stage::Stopped, WHY));
    assert_eq!(world.take_actions(), [Action::Halt]);
}

#[test]
fn a_new_client_ends_the_way_back_before_it_begins() {
    let mut world = lost(LostLink::Return);
    let run = world.run();
    world.take_actions();
    world.mission.handle_new_client("another client");
    world.mission.handle_lost_client(world.now, run, false);
    assert_eq!(world.stage(), Stage::Stopped);
    assert_eq!(world.take_actions(), [Action::Halt]);
}

#[test]
fn without_a_way_driven_there_is_no_way_back() {
    let mut world = World::with(LostLink::Return);
    world.go(true);
    world.drive();
    world.mission.lose_client(CLIENT, WHY);
    assert_eq!(world.stage(), Stage::Stopped);
}

#[test]
fn the_way_back_is_that_of_this_mission() {
    let mut world = lost(LostLink::Return);
    world.go(true);
    world.drive();
    world.mission.handle_pose((7.0, 0.0));
    world.mission.handle_pose((8.0, 0.0));
    world.mission.lose_client(CLIENT, WHY);
    let run = world.run();
    world.mission.handle_lost_client(world.now, run, false);
    let back = Path::new(vec![(8.0, 0.0), (7.0, 0.0)]);
    assert_eq!(world.mission.path().points(), back.points());
}
