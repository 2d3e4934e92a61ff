//! A path that is blocked on the way is planned again, within bounds.

use super::stages::{SETTINGS, World};
use crate::mission::{Action, LostLink, NotPlanned, Stage};

/// A mission that drives when its path is blocked.
fn blocked() -> World {
    let mut world = World::with(LostLink::Stop);
    world.go(true);
    world.drive();
    block(&mut world);
    world
}

fn block(world: &mut World) {
    let run = world.run();
    world.mission.handle_blocked_path(world.now, run, "a zone");
}

#[test]
fn a_blocked_path_is_planned_again_at_once_but_not_forever() {
    let mut world = blocked();
    for detour in 1..=SETTINGS.detours {
        let to = world.mission.report().destination;
        let expected = [Action::Halt, Action::Plan(world.run(), to)];
        assert_eq!(world.take_actions(), expected, "{detour}");
        assert_eq!((world.stage(), world.reason()), (Stage::Planning, "a zone"));
        world.plan();
        assert_eq!(world.stage(), Stage::Path, "without another approval");
        block(&mut world);
    }
    let report = world.mission.report();
    assert_eq!((report.stage, report.run.attempt), (Stage::Map, 2));
    assert_eq!(report.reason, "a zone, after 2 other paths");
    world.pass(SETTINGS.pause);
    world.drive();
    block(&mut world);
    assert_eq!(world.stage(), Stage::Planning, "a new attempt has its own");
}

#[test]
fn without_another_path_the_mission_waits_with_the_reason_after_its_retries() {
    let mut world = blocked();
    for attempt in 1..=SETTINGS.attempts {
        assert_eq!(world.run().attempt, attempt);
        let why = NotPlanned {
            reason: "no way".to_owned(),
            hopeless: false,
        };
        let run = world.run();
        world.mission.handle_path(world.now, run, Err(why));
        world.pass(SETTINGS.pause);
        world.map();
    }
    assert_eq!((world.stage(), world.reason()), (Stage::Waiting, "no way"));
    block(&mut world);
    assert_eq!(world.stage(), Stage::Waiting);
}
