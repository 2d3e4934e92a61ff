//! A vehicle under random messages from random clients, in virtual time: it keeps its limits, moves
//! only for a client with permission, and stops when there is none.
#![allow(
    clippy::disallowed_methods,
    clippy::unwrap_used,
    reason = "virtual time starts at any instant; a test fails by panicking"
)]

use std::time::{Duration, Instant};

use bytes::Bytes;
use jaus::address::JausId;
use jaus::codec::arbitrary::Unstructured;
use jaus::codec::{FormattedBlob, Message, MessageInfo};
use jaus::endpoint::Received;
use jaus::messages::core::set_element::{ElementDataFormat, ElementRec};
use jaus::messages::core::{RequestControl, Resume, SetElement};
use jaus::messages::mobility::{ExecuteList, SetTravelSpeed};
use jaus::service::{Discovery, Kind, Management, Profile, Scope, Service, Stack, Timing};
use jaus::wire::{Broadcast, Priority};
use jaus_test_kit::random::Random;
use jaus_vehicle::messages::registry;
use jaus_vehicle::mobility::Vehicle;
use jaus_vehicle::motion::{Frame, Limits, Pilot, SkidSteer, SkidSteerConfig};

const ROVER: JausId = JausId::new(101, 1, 1);
const CLIENTS: [JausId; 3] = [
    JausId::new(42, 1, 1),
    JausId::new(42, 2, 1),
    JausId::new(43, 1, 1),
];
/// Longer than braking takes.
const BRAKING: Duration = Duration::from_millis(1100);

/// A vehicle with all its services.
struct Rover {
    vehicle: Vehicle,
    stack: Stack,
    now: Instant,
    /// Start of the time without permission to act.
    idle_since: Option<Instant>,
}

impl Rover {
    fn new() -> Self {
        let platform = SkidSteer::new(SkidSteerConfig::default());
        let vehicle = Vehicle::new(Pilot::new(platform, Frame::at(52.5, 13.4)));
        let services: Vec<Box<dyn Service>> = vec![
            Box::new(vehicle.list_manager()),
            Box::new(vehicle.velocity_state_sensor()),
            Box::new(vehicle.velocity_state_driver()),
            Box::new(vehicle.acceleration_state_sensor()),
            Box::new(vehicle.local_pose_sensor()),
            Box::new(vehicle.global_pose_sensor()),
            Box::new(vehicle.primitive_driver()),
            Box::new(vehicle.local_vector_driver()),
            Box::new(vehicle.local_waypoint_driver()),
            Box::new(vehicle.local_waypoint_list_driver()),
            Box::new(vehicle.local_path_segment_driver()),
            Box::new(vehicle.global_vector_driver()),
            Box::new(vehicle.global_waypoint_driver()),
            Box::new(vehicle.global_waypoint_list_driver()),
            Box::new(vehicle.global_path_segment_driver()),
        ];
        let profile = Profile::new(Kind::Vehicle, "Rover");
        let discovery = Discovery::new(ROVER, profile, Scope::Nobody, Timing::default(), 1);
        let now = Instant::now();
        let mut stack = Stack::new(discovery, services).management(Management::new());
        stack.start(now);
        Self {
            vehicle,
            stack,
            now,
            idle_since: Some(now),
        }
    }

    /// Handles a message from a client. The vehicle sends at most 60 messages in response.
    fn hear(&mut self, source: JausId, payload: Bytes) {
        let received = Received {
            source,
            destination: ROVER,
            to: ROVER,
            priority: Priority::Standard,
            broadcast: Broadcast::None,
            payload,
            sequence: None,
            path: None,
            acknowledged: false,
        };
        self.stack.handle_message(self.now, &received);
        let mut answers = 0;
        while self.stack.poll_transmit().is_some() {
            answers += 1;
        }
        assert!(answers <= 60, "{answers} messages for one");
        self.check();
    }

    fn run(&mut self, time: Duration) {
        let end = self.now + time;
        while let Some(wake) = self.stack.poll_timeout().filter(|&wake| wake <= end) {
            self.now = self.now.max(wake);
            self.stack.handle_timeout(self.now);
            while self.stack.poll_transmit().is_some() {}
            self.check();
        }
        self.now = end;
        self.stack.handle_timeout(end);
        self.check();
    }

    /// Checks the invariants.
    fn check(&mut self) {
        while self.stack.poll_event().is_some() {}
        let may_act = self.stack.standing().may_act();
        let since = self.idle_since.get_or_insert(self.now);
        let is_stopping = self.now < *since + BRAKING;
        if may_act {
            self.idle_since = None;
        }
        let motion = self.vehicle.motion();
        let (pose, velocity) = (motion.pose, motion.velocity);
        let numbers = [pose.x, pose.y, pose.yaw, velocity.x, velocity.yaw];
        assert!(
            numbers.iter().all(|number| number.is_finite()),
            "{motion:?}"
        );
        let limits = Limits::default();
        assert!(
            velocity.x <= limits.speed && velocity.x >= -limits.reverse,
            "{motion:?}"
        );
        assert!(velocity.yaw.abs() <= limits.yaw_rate, "{motion:?}");
        assert!(may_act || is_stopping || velocity.is_rest(), "{motion:?}");
    }
}

/// Any message of the core and mobility sets, mobility more often.
fn anything(random: &mut Random, infos: &[&'static MessageInfo]) -> Bytes {
    let info = infos[random.below(infos.len())];
    let octets: Vec<u8> = (0..200).map(|_| random.number() as u8).collect();
    let message = (info.arbitrary)(&mut Unstructured::new(&octets)).unwrap();
    message.encode().unwrap()
}

/// A message that is likely to make the vehicle move.
fn purposeful(random: &mut Random, infos: &[&'static MessageInfo]) -> Bytes {
    let octets = match random.below(5) {
        0 => RequestControl {
            authority_code: random.number() as u8,
        }
        .encode(),
        1 => Resume.encode(),
        2 => {
            let mut speed = SetTravelSpeed::default();
            speed.set_speed_m_per_s(random.below(300) as f64).unwrap();
            speed.encode()
        }
        3 => ExecuteList {
            element_uid: Some(random.below(4) as u16),
            ..ExecuteList::default()
        }
        .encode(),
        _ => {
            let uid = random.below(4) as u16;
            let data = anything(random, infos);
            let element = ElementRec {
                element_uid: uid,
                previous_uid: uid.saturating_sub(1),
                next_uid: random.below(4) as u16,
                element_data: FormattedBlob::new(ElementDataFormat::JAUS_MESSAGE, data),
            };
            SetElement {
                element_list: vec![element],
                ..SetElement::default()
            }
            .encode()
        }
    };
    octets.unwrap()
}

#[test]
fn whatever_anybody_says_the_vehicle_keeps_its_limits_and_moves_only_while_it_may() {
    let infos: Vec<&'static MessageInfo> = registry().iter().collect();
    let mut moved = 0;
    for seed in 0..48 {
        let mut random = Random::new(seed);
        let mut rover = Rover::new();
        for _ in 0..400 {
            let client = random.choose(&CLIENTS);
            let message = if random.happens(400) {
                purposeful(&mut random, &infos)
            } else {
                anything(&mut random, &infos)
            };
            rover.hear(client, message);
            if random.happens(500) {
                let time = random.up_to_millis(400);
                rover.run(time);
            }
            moved += u32::from(!rover.vehicle.motion().velocity.is_rest());
        }
    }
    assert!(
        moved > 100,
        "{moved}: a test in which nothing moves says nothing"
    );
}
