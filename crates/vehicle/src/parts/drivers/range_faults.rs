//! Every fault of a range sensor while a driver follows a planner's segment towards an obstacle, in
//! virtual time: the vehicle does not drive into what was seen, and stops within the limit.

use std::fmt;
use std::time::{Duration, Instant};

use super::{Order, RemotePlatform, RemotePlatformSettings};
use crate::motion::{
    Curve, Drive, Fence, FenceConfig, Frame, Goal, JumpCheck, Limits, Pilot, Platform, SkidSteer,
    SkidSteerConfig, Ticket, Velocity,
};
use crate::parts::drivers::remote_platform::Plan;
use crate::sensing::{Disc, RangerConfig, Ray, Scan, Scenery, SimulatedRanger};

/// On the straight line to the end of the segment, 10 m ahead.
const OBSTACLE: Disc = Disc {
    middle: (5.0, 0.1),
    radius: 0.3,
};
const END: (f64, f64) = (10.0, 0.0);
const SPEED: f64 = 1.0;
const STALE: Duration = Duration::from_millis(600);
/// From the fault to standstill: the age of the last scan, one period of the scans and one of the
/// orders, and braking from full speed, with what a frozen scan needs to be found out at least.
const LIMIT: Duration = Duration::from_millis(2000);

/// What the sensor reports instead of its scan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Fault {
    /// Nothing: its program has ended, or its network is gone.
    Dead,
    /// An error.
    Refuses,
    /// Its last report, again and again.
    Frozen,
    /// Its last distances, with the present time.
    Repeats,
    /// Its reports wait in a queue for a second.
    Late,
    /// Besides its scan, something close all around, in far more points than there are directions.
    Floods,
}

const FAULTS: [Fault; 6] = [
    Fault::Dead,
    Fault::Refuses,
    Fault::Frozen,
    Fault::Repeats,
    Fault::Late,
    Fault::Floods,
];

/// The drivers that use the sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Driver {
    Vector,
    PathSegment,
}

/// A vehicle, the driver that is given its motion and its scans, and the sensor.
struct Bench {
    vehicle: SkidSteer,
    remote_platform: RemotePlatform,
    fence: Fence,
    driver: Driver,
    pilot: Pilot,
    segment: Ticket,
    scenery: Scenery,
    ranger: SimulatedRanger,
    /// The scans so far, with the time of their measurement.
    scans: Vec<(Duration, Scan)>,
    /// The time of the last reported scan.
    reported: Duration,
    fault: Option<Fault>,
    /// Whether the obstacle is gone.
    is_free: bool,
    start: Instant,
    time: Duration,
    /// What a sensor that floods adds to its scan.
    flood: Scan,
}

impl Bench {
    #[expect(
        clippy::disallowed_methods,
        reason = "virtual time starts at any instant"
    )]
    fn new(driver: Driver) -> Self {
        let remote_platform = RemotePlatform::new(RemotePlatformSettings {
            limits: Limits::default(),
            noise: JumpCheck::RECKONED,
            stale: STALE,
            by_heading: driver == Driver::PathSegment,
            needs_scan: true,
        });
        let fence = Fence::new(FenceConfig::default());
        let scenery = Scenery::default();
        scenery.set(vec![OBSTACLE]);
        let pilot = Pilot::new(remote_platform.clone(), Frame::default());
        let mut pilot = pilot.with_fence(fence.clone());
        let segment = pilot.pursue(Goal::Path {
            curve: Curve {
                start: (0.0, 0.0),
                control: (END.0 / 2.0, 0.0),
                end: END,
                weight: 0.0,
            },
            speed: SPEED,
            tolerance: 0.3,
            goes_on: false,
        });
        let around = (0..60_000_u32).map(|ray| Ray {
            bearing: f64::from(ray) * 1e-4,
            range: 0.3,
        });
        Self {
            vehicle: SkidSteer::new(SkidSteerConfig::default()),
            remote_platform,
            fence,
            driver,
            pilot,
            segment,
            ranger: SimulatedRanger::new(RangerConfig::default(), scenery.clone()),
            scenery,
            scans: Vec::new(),
            reported: Duration::ZERO,
            fault: None,
            is_free: false,
            start: Instant::now(),
            time: Duration::ZERO,
            flood: Scan::new(around),
        }
    }

    fn now(&self) -> Instant {
        self.start + self.time
    }

    /// Runs for some time. The poses come at 25 Hz, the scans at 10 Hz, the orders at 12.5 Hz.
    fn run(&mut self, seconds: f64) {
        let end = self.time + Duration::from_secs_f64(seconds);
        while self.time < end {
            self.time += Pilot::STEP;
            let now = self.now();
            let step = self.time.as_millis() / Pilot::STEP.as_millis();
            self.vehicle.handle_time(now);
            if step.is_multiple_of(2) {
                self.report_motion(now);
            }
            if step.is_multiple_of(5) {
                self.report_scan(now);
            }
            self.pilot.handle_time(now);
            if step.is_multiple_of(4) {
                self.order(now);
            }
            let room = self.room();
            assert!(self.is_free || room > 0.0, "{self}: {room:.3} m");
        }
    }

    /// The sensor works, the obstacle is gone, and the vehicle arrives.
    fn goes_on(&mut self) {
        self.fault = None;
        self.is_free = true;
        self.scenery.set(Vec::new());
        self.run(20.0);
        assert!(self.pilot.has_arrived(self.segment), "{self}");
    }

    fn report_motion(&self, now: Instant) {
        let motion = self.vehicle.motion();
        let (pose, velocity) = (motion.pose, motion.velocity);
        let stamp = Some(self.time.into());
        let platform = &self.remote_platform;
        platform.handle_pose(now, stamp, Some((pose.x, pose.y, pose.yaw)));
        // Only the vector driver reads a velocity sensor.
        if self.driver == Driver::Vector {
            platform.handle_velocity(now, stamp, Some((velocity.x, velocity.yaw)));
        }
    }

    fn report_scan(&mut self, now: Instant) {
        let last = self.scans.last().cloned();
        let scan = self.ranger.scan(&self.vehicle.motion().pose);
        let reported = match self.fault {
            None => Some((self.time, scan.clone())),
            Some(Fault::Dead) => return,
            Some(Fault::Refuses) => None,
            Some(Fault::Frozen) => last,
            Some(Fault::Repeats) => last.map(|(_, scan)| (self.time, scan)),
            Some(Fault::Late) => {
                let before = self.time.saturating_sub(Duration::from_secs(1));
                let mut scans = self.scans.iter().rev();
                let arrives = scans.find(|(at, _)| *at <= before).cloned();
                // They do not overtake each other.
                if arrives.as_ref().is_none_or(|(at, _)| *at <= self.reported) {
                    self.scans.push((self.time, scan));
                    return;
                }
                arrives
            }
            Some(Fault::Floods) => {
                let rays = self.flood.rays().iter().chain(scan.rays());
                Some((self.time, Scan::new(rays.copied())))
            }
        };
        // A frozen sensor measures no more.
        let goes_on = matches!(self.fault, None | Some(Fault::Late));
        self.scans.extend(goes_on.then_some((self.time, scan)));
        let (stamp, scan) = reported.unzip();
        self.reported = stamp.unwrap_or(self.reported);
        let seen = self
            .remote_platform
            .handle_scan(now, stamp.map(Into::into), scan.as_ref());
        if let Some(obstacles) = seen {
            self.fence.set_obstacles(obstacles);
        }
    }

    /// What the driver orders. The lower drivers are as good as the vehicle; the line is straight.
    fn order(&mut self, now: Instant) {
        let command = match self.remote_platform.plan(now) {
            Plan::Go(Order::Velocity(velocity), _) => Drive::Velocity(velocity),
            Plan::Go(Order::Heading { speed, .. }, _) => {
                Drive::Velocity(Velocity::forward(speed, 0.0))
            }
            Plan::Rest | Plan::Wait(_) => Drive::Stop,
        };
        self.vehicle.drive(command);
    }

    /// Metres between the vehicle's disc and the obstacle.
    fn room(&self) -> f64 {
        let (x, y) = OBSTACLE.middle;
        let distance = self.vehicle.motion().pose.distance(x, y) - OBSTACLE.radius;
        distance - FenceConfig::default().radius
    }

    /// Whether it does not get anywhere.
    fn is_at_rest(&self) -> bool {
        self.vehicle.motion().velocity.x.abs() < 0.05
    }
}

impl fmt::Display for Bench {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let motion = self.vehicle.motion();
        write!(
            f,
            "{:?}, {:?}, {:.2} s: x {:.2} m, {:.2} m/s",
            self.driver,
            self.fault,
            self.time.as_secs_f64(),
            motion.pose.x,
            motion.velocity.x
        )
    }
}

#[test]
fn a_sound_sensor_lets_the_vehicle_drive_up_to_the_obstacle_and_on_when_it_is_gone() {
    for driver in [Driver::Vector, Driver::PathSegment] {
        let mut bench = Bench::new(driver);
        bench.run(15.0);
        assert!(bench.is_at_rest() && bench.room() < 0.5, "{bench}");
        bench.goes_on();
    }
}

#[test]
fn no_fault_of_the_sensor_drives_into_what_was_seen_or_lets_the_vehicle_go_on() {
    for driver in [Driver::Vector, Driver::PathSegment] {
        for fault in FAULTS {
            // At standstill, at full speed, while it brakes, and before the obstacle.
            for begin in (1..=20).map(|step| f64::from(step) * 0.4) {
                let mut bench = Bench::new(driver);
                bench.run(begin);
                bench.fault = Some(fault);
                bench.run(LIMIT.as_secs_f64());
                let place = bench.vehicle.motion().pose.x;
                assert!(bench.is_at_rest(), "{bench}");
                bench.run(5.0);
                let way = bench.vehicle.motion().pose.x - place;
                // Before 5 cm, unchanged distances are no fault.
                assert!(way < 0.06, "from {begin} s on, {bench}: {way:.2} m");
            }
        }
    }
}

#[test]
fn a_sensor_that_works_again_lets_the_vehicle_go_on() {
    for driver in [Driver::Vector, Driver::PathSegment] {
        for fault in FAULTS {
            let mut bench = Bench::new(driver);
            bench.run(2.0);
            bench.fault = Some(fault);
            bench.run(5.0);
            bench.goes_on();
        }
    }
}
