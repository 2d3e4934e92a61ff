//! Arbitrary messages from arbitrary senders, in any order and with any time between them, to all
//! services of a vehicle: no panic, bounded tables and output, advancing time, and the vehicle
//! moves only while a client controls it and it is ready.
//!
//! The input is a sequence of steps. Each begins with an octet for the time that passes, one for
//! the source and the form of the payload (raw, or a definition of our choice filled with it), and
//! one for the length of the data that follows.
#![no_main]

use std::sync::{Arc, LazyLock, Mutex};
use std::time::{Duration, Instant};

use jaus::address::JausId;
use jaus::endpoint::{LinkId, Path, Received};
use jaus::service::{
    Discovery, Kind, Liveness, Management, Profile, Scope, Service, Stack, Standing, State, Time,
    TimeOfDay, Timing, Transport,
};
use jaus::wire::{Broadcast, Priority};
use jaus_fuzz::message;
use jaus_vehicle::mobility;
use jaus_vehicle::motion::{Drive, Frame, Limits, Motion, Pilot, Platform, Pose, Velocity};
use libfuzzer_sys::fuzz_target;

/// Time zero of every input.
static START: LazyLock<Instant> = LazyLock::new(Instant::now);

const VEHICLE: JausId = JausId::new(101, 1, 1);
const CLIENTS: [JausId; 4] = [
    JausId::new(42, 1, 1),
    JausId::new(42, 1, 2),
    JausId::new(43, 1, 1),
    JausId::new(101, 1, 2),
];
/// The limit of components in the directory here.
const COMPONENTS: usize = 16;
/// The limit of messages that a single call may produce: queries to all components, reports to all
/// subscribers.
const MOST_OUT: usize = 2048;

/// Wheels that execute each command at once, and remember it.
#[derive(Clone, Default)]
struct Wheels(Arc<Mutex<(Drive, Motion)>>);

impl Wheels {
    fn command(&self) -> Drive {
        self.0.lock().expect("no panic").0
    }
}

impl Platform for Wheels {
    fn handle_time(&mut self, _now: Instant) {}

    fn motion(&self) -> Motion {
        self.0.lock().expect("no panic").1
    }

    fn set_pose(&mut self, pose: Pose) {
        self.0.lock().expect("no panic").1.pose = pose;
    }

    fn drive(&mut self, command: Drive) {
        assert!(command.is_finite(), "{command:?}");
        let mut state = self.0.lock().expect("no panic");
        state.0 = command;
        state.1.velocity = match command {
            Drive::Velocity(velocity) => velocity,
            Drive::Stop | Drive::Effort(_) => Velocity::default(),
        };
    }

    fn limits(&self) -> Limits {
        Limits::default()
    }

    fn set_limits(&mut self, _limits: Limits) {}
}

fuzz_target!(|octets: &[u8]| {
    let mut now = *START;
    let wheels = Wheels::default();
    let mut stack = stack(&wheels);
    stack.start(now);
    settle(&mut stack, &wheels);
    let mut story = octets;
    while let Some((&[pause, how, length], rest)) = story.split_first_chunk() {
        let (data, rest) = rest.split_at(rest.len().min(length.into()));
        story = rest;
        now = pass(&mut stack, &wheels, now, pause);
        let Some(payload) = message(how & 8 != 0, data) else {
            continue;
        };
        let client = CLIENTS[usize::from(how & 3)];
        stack.handle_message(now, &received(client, payload, how & 4 != 0));
        settle(&mut stack, &wheels);
    }
    // The client in control is lost, so the motion may end.
    pass(&mut stack, &wheels, now, u8::MAX);
    assert!(!moves(&wheels), "it moves for a client that is dead");
});

fn stack(wheels: &Wheels) -> Stack {
    let timing = Timing {
        max_components: COMPONENTS,
        ..Timing::default()
    };
    let profile = Profile::new(Kind::Vehicle, "Rover");
    let discovery = Discovery::new(VEHICLE, profile, Scope::System, timing, 1);
    let vehicle = mobility::Vehicle::new(Pilot::new(wheels.clone(), Frame::at(52.5, 13.4)));
    let time = TimeOfDay::new(|| Duration::from_secs(1_767_225_600));
    let services: Vec<Box<dyn Service>> = vec![
        Box::new(Transport),
        Box::new(Liveness::new()),
        Box::new(Time::new(time)),
        Box::new(vehicle.velocity_state_sensor()),
        Box::new(vehicle.local_pose_sensor()),
        Box::new(vehicle.primitive_driver()),
        Box::new(vehicle.velocity_state_driver()),
        Box::new(vehicle.local_vector_driver()),
        Box::new(vehicle.local_waypoint_driver()),
        Box::new(vehicle.list_manager()),
        Box::new(vehicle.local_waypoint_list_driver()),
        Box::new(vehicle.local_path_segment_driver()),
    ];
    Stack::new(discovery, services).management(Management::new())
}

/// Advances time, by up to 13 seconds, and wakes the component whenever it is due.
fn pass(stack: &mut Stack, wheels: &Wheels, mut now: Instant, pause: u8) -> Instant {
    let end = now + Duration::from_millis(u64::from(pause).pow(2) / 5);
    while let Some(next) = stack.poll_timeout().filter(|&next| next <= end) {
        now = now.max(next);
        stack.handle_timeout(now);
        settle(stack, wheels);
        let next = stack.poll_timeout();
        assert!(next.is_none_or(|next| next > now), "time stands still");
    }
    end
}

/// Takes the component's output, and checks the invariants that hold between any two calls.
fn settle(stack: &mut Stack, wheels: &Wheels) {
    let sent = std::iter::from_fn(|| stack.poll_transmit()).count();
    let news = std::iter::from_fn(|| stack.poll_event()).count();
    assert!(sent + news <= MOST_OUT, "{sent} messages, {news} events");
    assert!(stack.directory().len() <= COMPONENTS + 1);
    let Standing {
        state, controller, ..
    } = stack.standing();
    let may_move = *state == State::Ready && controller.is_some();
    assert!(may_move || !moves(wheels), "{state}, for {controller:?}");
}

fn moves(wheels: &Wheels) -> bool {
    match wheels.command() {
        Drive::Stop => false,
        Drive::Velocity(velocity) => !velocity.is_rest(),
        Drive::Effort(effort) => effort.forward != 0.0 || effort.turn != 0.0,
    }
}

fn received(source: JausId, payload: bytes::Bytes, to_all: bool) -> Received {
    Received {
        source,
        destination: if to_all { JausId::EVERYONE } else { VEHICLE },
        to: VEHICLE,
        priority: Priority::Standard,
        broadcast: if to_all {
            Broadcast::Global
        } else {
            Broadcast::None
        },
        sequence: None,
        path: Some(Path {
            link: LinkId(0),
            peer: std::net::SocketAddr::from(([10, 0, 0, 2], 3794)).into(),
        }),
        payload,
        acknowledged: false,
    }
}
