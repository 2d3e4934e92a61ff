//! No motion through the gateway without a living controller, on either side, whatever happens to
//! the controller, the gateway and the cables.

use std::time::Duration;

use jaus::address::JausId;
use jaus::messages::core::{QueryTimeout, ReportTimeout, RequestControl, Resume, Standby};
use jaus::messages::mobility::{ExecuteList, SetLocalVector, SetTravelSpeed, SetWrenchEffort};
use jaus::service::{Kind, Management, Service};
use jaus_ra::gateway::Settings;
use jaus_ra::{Message, RaId};
use jaus_vehicle::mobility::Vehicle;
use jaus_vehicle::motion::{Frame, Pilot, SkidSteer, SkidSteerConfig};

use crate::gateway::world::{COMMANDER, Power, World, stack, subsystem};
use jaus_test_kit::rover::{Rover, SUBSYSTEM, bytes};

fn millis(millis: u64) -> Duration {
    Duration::from_millis(millis)
}

// An RA vehicle and its JAUS client.

/// An RA driver of this type and an operator that has discovered it. The operator has no automatic
/// lease: it sends Request Control itself, and may stop renewing it.
struct Drive {
    world: World,
    ra: usize,
    operator: usize,
    driver: JausId,
}

impl Drive {
    fn of(part: u8) -> Self {
        Self::with(part, Rover::new())
    }

    fn with(part: u8, rover: Rover) -> Self {
        let mut world = World::new(Settings::default());
        let parts = [(part, 1, "Driver"), (38, 1, "Pose")];
        let ra = world.add_ra(subsystem(SUBSYSTEM, "Sim", &parts), Some(rover));
        let operator = world.add_operator();
        world.run(Duration::from_secs(10));
        Self {
            world,
            ra,
            operator,
            driver: JausId::new(20, 1, part),
        }
    }

    fn rover(&mut self) -> &mut Rover {
        self.world.ra[self.ra].rover.as_mut().unwrap()
    }

    fn drives(&mut self) -> bool {
        let now = self.world.now;
        self.rover().drives(now)
    }

    fn tell(&mut self, command: &impl jaus::codec::Message) {
        if self.world.jaus[self.operator].up {
            self.world.tell(self.operator, self.driver, command);
        }
    }

    fn request_control(&mut self) {
        let authority_code = 127;
        self.tell(&RequestControl { authority_code });
    }

    fn take_control(&mut self) {
        self.request_control();
        self.world.run(millis(200));
        self.tell(&Resume {});
        self.world.run(millis(200));
    }

    /// Sends an effort ten times per second. Returns the time from the start to the last motion, or
    /// `None` if it never moved.
    fn push(&mut self, time: Duration) -> Option<Duration> {
        let begin = self.world.now;
        self.watch(time, |drive| {
            let mut effort = SetWrenchEffort::default();
            effort.set_propulsive_linear_effort_x_percent(40.0).unwrap();
            drive.tell(&effort);
            let since = drive.world.now - begin;
            if since.as_millis() % 2000 < 100 {
                drive.request_control();
            }
        })
    }

    /// Calls `act` and checks for motion ten times per second. Returns the time of the last motion.
    fn watch(&mut self, time: Duration, mut act: impl FnMut(&mut Self)) -> Option<Duration> {
        let begin = self.world.now;
        let mut last = None;
        while self.world.now < begin + time {
            act(self);
            self.world.run(millis(100));
            if self.drives() {
                last = Some(self.world.now - begin);
            }
        }
        last
    }

    fn idle(&mut self, time: Duration) -> Option<Duration> {
        self.watch(time, |_| {})
    }

    /// Drives by effort for two seconds.
    fn driving() -> Self {
        let mut drive = Self::of(33);
        drive.take_control();
        assert_eq!(drive.push(millis(2000)), Some(millis(2000)));
        drive
    }

    fn control_within(&mut self, time: Duration) {
        self.world.run(time);
        assert_eq!(self.rover().controller, None);
    }
}

#[test]
fn a_restarted_gateway_stops_and_releases_what_it_finds_held_in_its_name() {
    for (reports_control, client_lives) in [(false, false), (false, true), (true, true)] {
        let mut rover = Rover::new();
        rover.reports_control = reports_control;
        let mut drive = Drive::with(33, rover);
        drive.take_control();
        assert!(drive.push(millis(2000)).is_some(), "it moved");
        drive.world.power = Power::Killed;
        let stopped = drive.push(millis(4000));
        assert!(stopped <= Some(millis(1500)), "{stopped:?}");
        assert_eq!(drive.rover().controller, Some((COMMANDER, 127)));
        drive.world.jaus[drive.operator].up = client_lives;
        drive.world.restart_gateway();
        // The client keeps sending efforts and renewals, but not Resume.
        assert_eq!(
            drive.push(millis(20_000)),
            None,
            "{reports_control} {client_lives}"
        );
        if !client_lives {
            assert_eq!(drive.rover().controller, None);
            continue;
        }
        drive.take_control();
        assert!(
            drive.push(millis(2000)).is_some(),
            "with a new lease it does"
        );
    }
}

#[test]
fn a_restarted_gateway_stops_a_driver_that_drives_on_without_a_controller() {
    for part in [44, 45] {
        let mut drive = Drive::of(part);
        drive.rover().controller = Some((COMMANDER, 127));
        match part {
            44 => drive.rover().vectors.push(bytes("661b0d8073e1")),
            _ => drive.rover().speeds.push(bytes("0d00")),
        }
        assert!(drive.drives());
        drive.world.power = Power::Killed;
        drive.world.run(millis(4000));
        drive.world.restart_gateway();
        drive.world.run(millis(3000));
        assert!(!drive.drives(), "component {part}");
        drive.control_within(millis(2000));
    }
}

#[test]
fn a_component_that_is_being_reclaimed_initializes_and_is_not_available() {
    use jaus::messages::core::{QueryStatus, ReportStatus};
    let mut drive = Drive::of(33);
    // It does not report its controller.
    drive.world.power = Power::Killed;
    drive.world.restart_gateway();
    while !drive.world.attached().contains(&"20.1.33".to_owned()) {
        drive.world.run(millis(10));
    }
    drive.tell(&QueryStatus {});
    drive.request_control();
    drive.world.run(millis(100));
    let told = |drive: &Drive, code: u16| {
        let events = drive.world.jaus[drive.operator].events.iter();
        events.rev().find_map(|event| match event {
            jaus::service::Event::Message(it) if it.payload[..2] == code.to_le_bytes() => {
                Some(it.payload[2])
            }
            _ => None,
        })
    };
    assert_eq!(told(&drive, 0x4002), Some(0));
    assert_eq!(told(&drive, 0x000F), Some(1));
    drive.world.run(millis(3000));
    let status: Option<ReportStatus> =
        drive
            .world
            .ask(drive.operator, drive.driver, &QueryStatus {});
    assert_eq!(status.unwrap().status.0, 1);
}

#[test]
fn the_gateway_is_ready_for_a_component_only_while_a_client_has_control_of_it() {
    let mut drive = Drive::of(33);
    let state = |drive: &mut Drive| {
        let driver = RaId::new(SUBSYSTEM, 1, 33, 1);
        let query = Message::new(driver, COMMANDER, 0x2002, bytes(""));
        drive.world.ra[drive.ra].heard.clear();
        drive.world.ra_says(drive.ra, &query);
        drive.world.ra_heard(drive.ra, 0x4002)[0].data[0]
    };
    assert_eq!(state(&mut drive), 0);
    drive.take_control();
    assert_eq!(state(&mut drive), 1);
    assert!(drive.rover().controller_ready);
    drive.tell(&jaus::messages::core::ReleaseControl {});
    assert_eq!(state(&mut drive), 0);
}

#[test]
fn an_effort_ends_with_its_client_and_so_does_control() {
    let mut drive = Drive::driving();
    drive.world.jaus[drive.operator].up = false;
    let stopped = drive.idle(millis(3000));
    assert!(stopped <= Some(millis(600)), "{stopped:?}");
    drive.control_within(millis(2200));
    assert_eq!(drive.rover().state, 2, "it is in standby");
}

#[test]
fn an_effort_that_is_not_repeated_ends_and_control_does_not() {
    let mut drive = Drive::driving();
    let stopped = drive.watch(millis(8000), |drive| drive.request_control());
    assert!(stopped <= Some(millis(600)), "{stopped:?}");
    assert_eq!(drive.rover().controller, Some((COMMANDER, 127)));
    assert!(drive.push(millis(500)).is_some());
}

#[test]
fn control_that_is_not_renewed_ends_though_the_client_lives() {
    let mut drive = Drive::driving();
    let timeout: Option<ReportTimeout> =
        drive
            .world
            .ask(drive.operator, drive.driver, &QueryTimeout {});
    assert_eq!(timeout.unwrap().timeout.0, 4);
    drive.control_within(millis(5100));
}

#[test]
fn a_vector_lasts_as_long_as_its_client_shows_life() {
    let mut drive = Drive::of(44);
    drive.take_control();
    let mut vector = SetLocalVector::default();
    vector.set_speed_m_per_s(2.0).unwrap();
    vector.set_heading_rad(0.75).unwrap();
    drive.tell(&vector);
    // The vector is sent once. The client renews its control and answers probes.
    for _ in 0..5 {
        drive.request_control();
        assert_eq!(drive.idle(millis(1000)), Some(millis(1000)));
    }
    drive.world.jaus[drive.operator].up = false;
    let stopped = drive.idle(millis(5500));
    assert!(stopped <= Some(millis(1100)), "{stopped:?}");
    let vectors = &drive.rover().vectors;
    assert_eq!(
        vectors[vectors.len() - 1][4..],
        vectors[vectors.len() - 2][4..],
        "the heading stays"
    );
    assert_eq!(drive.rover().controller, None);
}

#[test]
fn a_speed_of_travel_ends_with_its_client() {
    let mut drive = Drive::of(45);
    drive.take_control();
    let mut speed = SetTravelSpeed::default();
    speed.set_speed_m_per_s(2.0).unwrap();
    drive.tell(&speed);
    assert!(drive.idle(millis(1000)).is_some());
    drive.world.jaus[drive.operator].up = false;
    let stopped = drive.idle(millis(10_000));
    assert!(stopped <= Some(millis(4500)), "{stopped:?}");
    drive.control_within(millis(0));
}

#[test]
fn standby_stops_what_ignores_it_and_resume_revives_nothing() {
    let mut drive = Drive::driving();
    drive.tell(&Standby {});
    // Efforts keep arriving.
    let stopped = drive.push(millis(2000));
    assert!(stopped.is_none(), "{stopped:?}");
    drive.tell(&Resume {});
    assert_eq!(drive.watch(millis(2000), |it| it.request_control()), None);
    assert!(drive.push(millis(500)).is_some());
    let mut list = ExecuteList::default();
    list.set_speed_m_per_s(1.0).unwrap();
    drive.tell(&list);
}

#[test]
fn nothing_moves_after_a_cut_of_either_cable_and_its_repair_without_a_new_lease() {
    for (ra, jaus) in [(true, false), (false, true), (true, true)] {
        let mut drive = Drive::driving();
        (drive.world.ra_cut, drive.world.jaus_cut) = (ra, jaus);
        let stopped = drive.push(millis(10_000));
        assert!(stopped <= Some(millis(1600)), "{stopped:?}");
        (drive.world.ra_cut, drive.world.jaus_cut) = (false, false);
        assert_eq!(drive.push(millis(20_000)), None, "{ra} {jaus}");
        drive.take_control();
        assert!(drive.push(millis(1000)).is_some(), "{ra} {jaus}");
    }
}

#[test]
fn a_gateway_that_was_suspended_does_not_act_on_what_has_waited_for_it() {
    let mut drive = Drive::driving();
    drive.world.power = Power::Suspended(Vec::new());
    let stopped = drive.push(millis(8000));
    assert!(stopped <= Some(millis(1600)), "{stopped:?}");
    drive.world.jaus[drive.operator].up = false;
    drive.world.resume_gateway();
    assert!(!drive.drives());
    assert_eq!(drive.idle(millis(5000)), None);
    drive.control_within(millis(0));
}

#[test]
fn a_release_that_was_lost_is_repeated() {
    let mut drive = Drive::driving();
    drive.world.ra_cut = true;
    drive.tell(&jaus::messages::core::ReleaseControl {});
    drive.world.run(millis(1500));
    drive.world.ra_cut = false;
    drive.world.run(millis(200));
    assert_eq!(
        drive.rover().controller,
        Some((COMMANDER, 127)),
        "all were lost"
    );
    drive.control_within(millis(4000));
}

#[test]
fn a_gateway_that_ends_stops_and_releases_first() {
    let mut drive = Drive::driving();
    let now = drive.world.now;
    drive.world.gateway.take_leave(now);
    drive.world.settle();
    assert!(!drive.drives());
    drive.control_within(millis(0));
}

// A JAUS vehicle and its RA client.

const RA_DRIVER: RaId = RaId::new(101, 1, 33, 7);
const RA_VECTORS: RaId = RaId::new(101, 1, 44, 7);
const OPERATOR: RaId = RaId::new(30, 1, 32, 1);

struct Remote {
    world: World,
    ra: usize,
    vehicle: Vehicle,
    rover: usize,
    /// Whether the RA client answers status queries.
    answers: bool,
}

impl Remote {
    fn new(answers: bool) -> Self {
        let mut world = World::new(Settings::default());
        let operator = subsystem(30, "OCU", &[(32, 1, "Commander")]);
        let ra = world.add_ra(operator, None);
        let rover = SkidSteer::new(SkidSteerConfig::default());
        let vehicle = Vehicle::new(Pilot::new(rover, Frame::at(52.5, 13.4)));
        let services: Vec<Box<dyn Service>> = vec![
            Box::new(vehicle.primitive_driver()),
            Box::new(vehicle.local_vector_driver()),
        ];
        let id = JausId::new(101, 1, 7);
        let stack = stack(id, Kind::Vehicle, "Rover", services).management(Management::new());
        let rover = world.add_jaus(stack);
        world.run(Duration::from_secs(10));
        Self {
            world,
            ra,
            vehicle,
            rover,
            answers,
        }
    }

    fn says(&mut self, to: RaId, code: u16, hex: &str) {
        let message = Message::new(OPERATOR, to, code, bytes(hex));
        // The gateway may be absent.
        let _ = self.world.ra[self.ra].node.send(self.world.now, &message);
        self.world.settle();
    }

    fn take_control(&mut self) {
        self.says(RA_DRIVER, 0x000D, "7f");
        self.world.run(millis(500));
        self.says(RA_DRIVER, 0x0004, "");
        self.world.run(millis(200));
    }

    fn effort(&mut self) {
        self.says(RA_DRIVER, 0x0405, "0100ff3f");
    }

    fn moves(&self) -> bool {
        self.vehicle.motion().velocity.x.abs() > 0.02
    }

    /// Lets time pass. Returns the time of the last motion.
    fn watch(&mut self, time: Duration) -> Option<Duration> {
        let begin = self.world.now;
        let mut last = None;
        while self.world.now < begin + time {
            self.world.run(millis(100));
            for question in self.world.ra_heard(self.ra, 0x2002) {
                if self.answers {
                    self.world
                        .ra_says(self.ra, &question.answer(0x4002, bytes("0100000000")));
                }
            }
            if self.moves() {
                last = Some(self.world.now - begin);
            }
        }
        last
    }

    fn is_controlled(&self) -> bool {
        let standing = self.world.jaus[self.rover].stack.standing();
        standing.controller.is_some()
    }
}

#[test]
fn an_effort_of_an_ra_client_that_is_sent_once_lasts_as_long_as_the_client_shows_life() {
    for answers in [true, false] {
        let mut remote = Remote::new(answers);
        remote.take_control();
        remote.effort();
        let moved = remote.watch(millis(10_000));
        assert_eq!(moved, Some(millis(10_000)), "{answers}");
        remote.world.ra_cut = true;
        let stopped = remote.watch(millis(10_000));
        assert!(stopped <= Some(millis(2500)), "{answers} {stopped:?}");
        assert!(!remote.is_controlled());
        remote.world.ra_cut = false;
        assert_eq!(remote.watch(millis(10_000)), None);
    }
}

#[test]
fn an_ra_client_whose_component_is_dead_while_its_node_lives_does_not_drive_on() {
    let mut remote = Remote::new(true);
    remote.take_control();
    for vector in [false, true] {
        match vector {
            true => remote.says(RA_VECTORS, 0x0408, "661b0d8073e1"),
            false => remote.effort(),
        }
        assert!(remote.watch(millis(2000)).is_some());
        remote.answers = false;
        let stopped = remote.watch(millis(4000));
        assert!(stopped <= Some(millis(2000)), "{vector} {stopped:?}");
        remote.answers = true;
        remote.effort();
        remote.watch(millis(500));
    }
    remote.answers = false;
    remote.watch(millis(6000));
    assert!(!remote.is_controlled());
    assert_eq!(remote.watch(millis(5000)), None);
}

#[test]
fn a_gateway_that_restarts_at_once_does_not_keep_alive_what_its_ra_client_had_set() {
    let mut remote = Remote::new(true);
    remote.take_control();
    remote.says(RA_VECTORS, 0x0408, "661b0d8073e1");
    assert_eq!(remote.watch(millis(2000)), Some(millis(2000)));
    remote.world.power = Power::Killed;
    remote.watch(millis(200));
    remote.world.restart_gateway();
    let stopped = remote.watch(millis(6000));
    assert!(stopped <= Some(millis(2000)), "{stopped:?}");
    assert!(!remote.is_controlled());
}

#[test]
fn after_a_restart_of_the_gateway_an_ra_client_requests_control_anew() {
    let mut remote = Remote::new(true);
    remote.take_control();
    remote.effort();
    assert!(remote.watch(millis(2000)).is_some());
    remote.world.power = Power::Killed;
    remote.world.run(millis(1000));
    remote.world.restart_gateway();
    remote.world.run(millis(2000));
    let before = remote.world.jaus[remote.rover].stack.standing().controller;
    remote.world.ra[remote.ra].heard.clear();
    remote.effort();
    let rejected = remote.world.ra_heard(remote.ra, 0x0010);
    assert_eq!(rejected.len(), 1, "it is told that it has no control");
    assert_eq!(
        remote
            .world
            .count(jaus_ra::gateway::Counter::CommandsFromRa),
        0,
        "{before:?}"
    );
    remote.take_control();
    remote.effort();
    assert!(remote.watch(millis(1000)).is_some());
}

#[test]
fn a_gateway_that_ends_stops_jaus_vehicles_and_releases_them() {
    let mut remote = Remote::new(true);
    remote.take_control();
    remote.effort();
    assert!(remote.watch(millis(2000)).is_some());
    let now = remote.world.now;
    remote.world.gateway.take_leave(now);
    remote.world.settle();
    remote.world.power = Power::Killed;
    let stopped = remote.watch(millis(5000));
    assert!(stopped <= Some(millis(1000)), "{stopped:?}");
    assert!(!remote.is_controlled());
}
