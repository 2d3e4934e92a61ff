//! Discovery of components that start, change, fall silent and stop.

use std::time::{Duration, Instant};

use jaus::address::JausId;
use jaus::codec::ServiceId;
use jaus::messages::core::{
    QueryConfiguration, QueryIdentification, QueryServices, ReportConfiguration,
    ReportHeartbeatPulse, ReportIdentification, ReportServices, report_configuration,
    report_services,
};
use jaus::service::{
    Change, Discovery, Handlers, Kind, Level, Loss, Offer, Profile, Scope, Stack, Timing,
};

use crate::discovery::world::{World, stack};

const VEHICLE: JausId = JausId::new(101, 1, 33);
const OPERATOR: JausId = JausId::new(42, 1, 1);
const CAMERA: ServiceId = ServiceId {
    urn: "urn:test:Camera",
    major: 1,
    minor: 0,
};

fn seconds(seconds: u64) -> Duration {
    Duration::from_secs(seconds)
}

fn plain(id: JausId, name: &str) -> Stack {
    stack(id, name, Vec::new())
}

#[test]
fn two_components_find_each_other_within_a_second_of_the_second_ones_start() {
    let mut world = World::new();
    let vehicle = world.start(plain(VEHICLE, "rover"));
    world.run(seconds(100));
    let operator = world.start(plain(OPERATOR, "station"));
    world.run(seconds(1));
    for (place, other, name) in [(vehicle, OPERATOR, "station"), (operator, VEHICLE, "rover")] {
        let directory = world.stack(place).directory();
        let found = directory.component(other).expect("found");
        assert!(
            found.offers("urn:jaus:jss:core:Liveness"),
            "services are known too"
        );
        for level in [Level::Subsystem, Level::Node, Level::Component] {
            let told = directory.identification(level, other).expect("named");
            assert_eq!(told.name, name);
        }
        let told = directory
            .identification(Level::Subsystem, other)
            .map(|told| told.kind);
        assert_eq!(told, Some(Kind::Vehicle));
    }
}

#[test]
fn the_application_is_told_what_has_changed() {
    let mut world = World::new();
    let operator = world.start(plain(OPERATOR, "station"));
    world.start(plain(VEHICLE, "rover"));
    world.run(seconds(1));
    let changes: Vec<_> = world
        .changes(operator)
        .into_iter()
        .map(|(_, change)| change)
        .collect();
    assert_eq!(
        changes[..2],
        [Change::SubsystemFound(101), Change::Found(VEHICLE)]
    );
    for expected in [
        Change::Identified(Level::Subsystem, VEHICLE),
        Change::Identified(Level::Node, VEHICLE),
        Change::Identified(Level::Component, VEHICLE),
        Change::Services(VEHICLE),
    ] {
        assert_eq!(
            changes.iter().filter(|change| **change == expected).count(),
            1,
            "{expected:?}"
        );
    }
    world.run(seconds(300));
    assert_eq!(
        world.changes(operator),
        [],
        "nothing changes, so nothing is told"
    );
}

#[test]
fn versions_1_0_and_1_1_of_the_core_services_are_listed() {
    let mut world = World::new();
    let operator = world.start(plain(OPERATOR, "station"));
    world.start(plain(VEHICLE, "rover"));
    world.run(seconds(1));
    let directory = world.stack(operator).directory();
    let services = directory
        .component(VEHICLE)
        .unwrap()
        .services
        .as_ref()
        .unwrap();
    for name in ["Transport", "Discovery", "Liveness"] {
        for minor in [0, 1] {
            let offer = Offer {
                urn: format!("urn:jaus:jss:core:{name}"),
                major: 1,
                minor,
            };
            assert!(services.contains(&offer), "{offer}");
        }
    }
}

#[test]
fn a_dead_peer_leaves_the_tree_within_twelve_seconds() {
    let mut world = World::new();
    let vehicle = world.start(plain(VEHICLE, "rover"));
    let operator = world.start(plain(OPERATOR, "station"));
    world.run(seconds(60));
    world.changes(operator);
    world.kill(vehicle);
    world.run(seconds(4));
    assert_eq!(world.changes(operator), [], "it may only be slow");
    world.run(seconds(8));
    let changes: Vec<_> = world
        .changes(operator)
        .into_iter()
        .map(|(_, change)| change)
        .collect();
    assert_eq!(
        changes,
        [
            Change::Lost(VEHICLE, Loss::Silent),
            Change::SubsystemLost(101)
        ]
    );
    assert!(
        world
            .stack(operator)
            .directory()
            .component(VEHICLE)
            .is_none()
    );
}

#[test]
fn newcomers_are_found_at_once_while_many_others_have_fallen_silent() {
    let mut world = World::new();
    let watcher = world.start(plain(OPERATOR, "station"));
    let fleet: Vec<_> = (1..=40)
        .map(|number| world.start(plain(JausId::new(200 + number, 1, 1), "rover")))
        .collect();
    world.run(seconds(300));
    assert_eq!(world.stack(watcher).directory().len(), 41, "and itself");
    for dead in fleet {
        world.kill(dead);
    }
    // From before the first losses are noticed until all silent components are given up.
    for newcomer in 1..=12 {
        world.run(seconds(4));
        let id = JausId::new(100 + newcomer, 1, 1);
        let place = world.start(plain(id, "late"));
        world.run(seconds(2));
        let directory = world.stack(watcher).directory();
        let found = directory.component(id).expect("found");
        assert!(
            found.offers("urn:jaus:jss:core:Liveness"),
            "the {newcomer}th is known with its services"
        );
        world.kill(place);
    }
}

#[test]
fn a_peer_that_comes_back_is_found_again() {
    let mut world = World::new();
    let vehicle = world.start(plain(VEHICLE, "rover"));
    let operator = world.start(plain(OPERATOR, "station"));
    world.run(seconds(10));
    world.kill(vehicle);
    world.run(seconds(20));
    world.changes(operator);
    world.revive(vehicle);
    world.run(seconds(8));
    let changes: Vec<_> = world
        .changes(operator)
        .into_iter()
        .map(|(_, change)| change)
        .collect();
    assert_eq!(
        changes[..2],
        [Change::SubsystemFound(101), Change::Found(VEHICLE)]
    );
    assert!(changes.contains(&Change::Services(VEHICLE)));
}

#[test]
fn a_peer_that_restarts_under_another_name_is_asked_anew_at_once() {
    let mut world = World::new();
    let operator = world.start(plain(OPERATOR, "station"));
    let first = world.start(plain(VEHICLE, "rover"));
    world.run(seconds(10));
    world.kill(first);
    let camera: Vec<Box<dyn jaus::service::Service>> = vec![Box::new(Handlers::new(CAMERA))];
    world.start(stack(VEHICLE, "rover with a camera", camera));
    world.run(seconds(8));
    let directory = world.stack(operator).directory();
    assert!(directory.component(VEHICLE).unwrap().offers(CAMERA.urn));
    for level in [Level::Subsystem, Level::Node, Level::Component] {
        let told = directory.identification(level, VEHICLE).unwrap();
        assert_eq!(told.name, "rover with a camera");
    }
}

#[test]
fn components_that_disagree_about_their_subsystems_name_do_not_make_it_flicker() {
    let mut world = World::new();
    let operator = world.start(plain(OPERATOR, "station"));
    world.start(plain(VEHICLE, "rover"));
    world.start(plain(JausId::new(101, 2, 7), "arm of the rover"));
    world.run(seconds(10));
    world.changes(operator);
    world.run(seconds(600));
    assert_eq!(world.changes(operator), []);
}

#[test]
fn a_service_that_is_offered_or_withdrawn_later_is_noticed_at_once() {
    let mut world = World::new();
    let operator = world.start(plain(OPERATOR, "station"));
    let vehicle = world.start(plain(VEHICLE, "rover"));
    world.run(seconds(10));
    let offered = |world: &mut World| {
        world.run(Duration::from_millis(10));
        world
            .stack(operator)
            .directory()
            .component(VEHICLE)
            .unwrap()
            .offers(CAMERA.urn)
    };
    assert!(!offered(&mut world));
    let now = world.now;
    world
        .stack(vehicle)
        .offer(now, Box::new(Handlers::new(CAMERA)))
        .unwrap();
    assert!(offered(&mut world));
    let now = world.now;
    assert!(world.stack(vehicle).withdraw(now, CAMERA.urn));
    assert!(!offered(&mut world));
}

#[test]
fn a_peer_that_restarts_with_other_services_is_noticed_with_the_next_refresh() {
    let mut world = World::new();
    let operator = world.start(plain(OPERATOR, "station"));
    let first = world.start(plain(VEHICLE, "rover"));
    world.run(seconds(10));
    world.kill(first);
    world.start(stack(
        VEHICLE,
        "rover",
        vec![Box::new(Handlers::new(CAMERA))],
    ));
    world.run(seconds(33));
    let lost = |change: &(Instant, Change)| matches!(change.1, Change::Lost(..));
    assert!(
        !world.changes(operator).iter().any(lost),
        "it was not away for long"
    );
    let directory = world.stack(operator).directory();
    assert!(directory.component(VEHICLE).unwrap().offers(CAMERA.urn));
}

#[test]
fn nobody_is_lost_in_an_hour_in_which_every_tenth_datagram_is() {
    let mut world = World::new();
    let places = [VEHICLE, OPERATOR, JausId::new(7, 1, 1)]
        .map(|id| world.start(plain(id, "on a bad network")));
    world.lose_every(10);
    world.run(seconds(3600));
    for place in places {
        assert_eq!(world.stack(place).directory().len(), 3);
        let changes = world.changes(place);
        let lost = changes
            .iter()
            .filter(|(_, change)| matches!(change, Change::Lost(..)));
        assert_eq!(lost.count(), 0);
    }
}

fn scoped(id: JausId, scope: Scope) -> Stack {
    let profile = Profile::new(Kind::Vehicle, "scoped");
    Stack::new(
        Discovery::new(id, profile, scope, Timing::default(), 1),
        Vec::new(),
    )
}

#[test]
fn a_component_that_looks_for_nobody_says_nothing_unless_it_is_asked() {
    let mut world = World::new();
    let quiet = world.start(scoped(VEHICLE, Scope::Nobody));
    world.run(seconds(3600));
    assert_eq!(world.datagrams(quiet), 0);
    let operator = world.start(plain(OPERATOR, "station"));
    world.run(seconds(1));
    assert!(
        world
            .stack(operator)
            .directory()
            .component(VEHICLE)
            .is_some()
    );
    assert_eq!(world.stack(quiet).directory().len(), 1);
}

#[test]
fn a_component_that_looks_for_its_subsystem_does_not_see_others() {
    let sibling = JausId::new(101, 2, 1);
    let mut world = World::new();
    let near = world.start(scoped(VEHICLE, Scope::Subsystem));
    world.start(plain(OPERATOR, "station"));
    world.start(plain(sibling, "rover"));
    world.run(seconds(60));
    let known: Vec<_> = world
        .stack(near)
        .directory()
        .components()
        .map(|c| c.id)
        .collect();
    assert_eq!(known, [VEHICLE, sibling]);
}

#[test]
fn three_components_agree_on_who_is_there() {
    let mut world = World::new();
    let ids = [VEHICLE, OPERATOR, JausId::new(101, 2, 7)];
    let places = ids.map(|id| world.start(plain(id, "one of three")));
    world.run(seconds(2));
    for place in places {
        let directory = world.stack(place).directory();
        let mut known: Vec<_> = directory
            .components()
            .map(|component| component.id)
            .collect();
        known.sort_unstable();
        assert_eq!(known, [OPERATOR, VEHICLE, JausId::new(101, 2, 7)]);
    }
}

/// A subsystem whose manager lists a component without Discovery service.
#[test]
fn a_component_that_is_only_listed_is_in_the_tree_as_long_as_it_is_listed() {
    let manager = JausId::new(7, 1, 1);
    let silent = JausId::new(7, 1, 2);
    let mut world = World::new();
    let operator = world.start(plain(OPERATOR, "station"));
    let puppet = world.puppet(manager);
    let mut listed = vec![1, 2];
    for second in 0..80 {
        if second == 40 {
            listed.pop();
        }
        world.run(seconds(1));
        for message in world.received(puppet) {
            play_manager(&mut world, puppet, &listed, &message.payload);
        }
        if second == 30 {
            let directory = world.stack(operator).directory();
            assert!(directory.component(silent).unwrap().offers(CAMERA.urn));
        }
    }
    let lost = world
        .changes(operator)
        .into_iter()
        .filter_map(|(_, change)| match change {
            Change::Lost(id, loss) => Some((id, loss)),
            _ => None,
        });
    assert_eq!(lost.collect::<Vec<_>>(), [(silent, Loss::Unlisted)]);
}

#[test]
fn a_component_that_was_listed_is_asked_who_it_is_once_it_speaks_for_itself() {
    let mut world = World::new();
    world.start(plain(OPERATOR, "station"));
    let manager = world.puppet(JausId::new(7, 1, 1));
    let late = world.puppet(JausId::new(7, 1, 2));
    for _ in 0..4 {
        world.run(seconds(1));
        for message in world.received(manager) {
            play_manager(&mut world, manager, &[1, 2], &message.payload);
        }
    }
    world.received(late);
    let call = QueryIdentification {
        query_type: 2.into(),
    };
    world.say(late, OPERATOR, &call);
    world.run(seconds(1));
    let asked = world.received_as::<QueryIdentification>(late);
    let levels: Vec<_> = asked.iter().map(|query| query.query_type.0).collect();
    assert!(levels.contains(&4), "{levels:?}");
}

fn play_manager(
    world: &mut World,
    puppet: crate::discovery::world::Place,
    listed: &[u8],
    query: &bytes::Bytes,
) {
    use jaus::codec::Message;

    if let Ok(query) = QueryIdentification::decode(query) {
        let report = ReportIdentification {
            query_type: query.query_type.0.into(),
            r#type: 10001.into(),
            identification: "managed".into(),
        };
        world.say(puppet, OPERATOR, &report);
    } else if QueryConfiguration::decode(query).is_ok() {
        let components = listed
            .iter()
            .map(|&component_id| report_configuration::ComponentRec {
                component_id,
                instance_id: 0,
            });
        let node = report_configuration::NodeSeq {
            node_rec: report_configuration::NodeRec { node_id: 1 },
            component_list: components.collect(),
        };
        world.say(
            puppet,
            OPERATOR,
            &ReportConfiguration {
                node_list: vec![node],
            },
        );
    } else if let Ok(query) = QueryServices::decode(query) {
        let service = report_services::ServiceRec {
            uri: CAMERA.urn.into(),
            major_version_number: 1,
            minor_version_number: 0,
        };
        let component_id = query.node_list[0].component_list[0].component_id.0;
        let component = report_services::ComponentSeq {
            component_rec: report_services::ComponentRec {
                component_id,
                instance_id: 0,
            },
            service_list: vec![service],
        };
        let node = report_services::NodeSeq {
            node_rec: report_services::NodeRec { node_id: 1 },
            component_list: vec![component],
        };
        world.say(
            puppet,
            OPERATOR,
            &ReportServices {
                node_list: vec![node],
            },
        );
    }
}

#[test]
fn a_component_goes_with_the_one_that_listed_it() {
    let manager = JausId::new(7, 1, 1);
    let mut world = World::new();
    let operator = world.start(plain(OPERATOR, "station"));
    let puppet = world.puppet(manager);
    for _ in 0..10 {
        world.run(seconds(1));
        for message in world.received(puppet) {
            play_manager(&mut world, puppet, &[1, 2], &message.payload);
        }
    }
    assert_eq!(world.stack(operator).directory().len(), 3);
    world.changes(operator);
    world.run(seconds(20));
    let changes: Vec<_> = world
        .changes(operator)
        .into_iter()
        .map(|(_, change)| change)
        .collect();
    assert_eq!(
        changes,
        [
            Change::Lost(manager, Loss::Silent),
            Change::Lost(JausId::new(7, 1, 2), Loss::WithItsReporter),
            Change::SubsystemLost(7),
        ]
    );
}

#[test]
fn a_stranger_that_says_nothing_about_itself_is_asked_a_few_times_and_not_for_ever() {
    let stranger = JausId::new(9, 1, 1);
    let mut world = World::new();
    let operator = world.start(plain(OPERATOR, "station"));
    let puppet = world.puppet(stranger);
    let mut asked = 0;
    for _ in 0..250 {
        world.say(puppet, OPERATOR, &ReportHeartbeatPulse {});
        world.run(Duration::from_millis(100));
        let received = world.received(puppet).into_iter();
        asked += received
            .filter(|message| !message.destination.has_wildcard())
            .count();
    }
    assert_eq!(asked, 5, "in 25 s");
    assert!(
        world
            .stack(operator)
            .directory()
            .component(stranger)
            .is_none()
    );
}

#[test]
fn a_full_directory_ignores_the_next_component_and_keeps_the_others() {
    let mut world = World::new();
    let profile = Profile::new(Kind::Vehicle, "small");
    let timing = Timing {
        max_components: 2,
        ..Timing::default()
    };
    let discovery = Discovery::new(OPERATOR, profile, Scope::System, timing, 1);
    let operator = world.start(Stack::new(discovery, Vec::new()));
    for subsystem in 1..=5 {
        world.start(plain(JausId::new(subsystem, 1, 1), "one of many"));
    }
    world.run(seconds(60));
    assert_eq!(world.stack(operator).directory().len(), 1 + 2);
}
