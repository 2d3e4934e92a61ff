//! Simulated vehicles with a range sensor in virtual time, on their way to a destination 10 m ahead.

use std::time::{Duration, Instant};

use super::*;
use crate::actuator::{
    MotorConfig, Odometer, SimulatedMotor, SimulatedServo, SteeredDrive, Wheels, WheelsConfig,
};
use crate::mission::{Footprint, Path, Terrain, plan};
use crate::motion::{
    Ackermann, Curve, Fence, FenceConfig, Frame, Goal, Pilot, SkidSteer, SkidSteerConfig, Ticket,
};

const DESTINATION: Point = (10.0, 0.0);
/// An obstacle on the straight line to the destination.
const ON_THE_WAY: Disc = Disc {
    middle: (5.0, 0.1),
    radius: 0.3,
};

/// A vehicle whose driver stops before obstacles, and whose planner looks along its path every
/// second.
struct Bench {
    pilot: Pilot,
    fence: Fence,
    ranger: SimulatedRanger,
    scenery: Scenery,
    discs: Vec<Disc>,
    lookout: Lookout,
    vehicle: Footprint,
    plans_again: bool,
    /// The corners ahead, and the segment under way.
    corners: Vec<Point>,
    segment: Option<Ticket>,
    /// Why there is no path.
    refused: Option<String>,
    now: Instant,
    /// Least distance between the vehicle's disc and an obstacle so far.
    least: f64,
}

impl Bench {
    /// A vehicle that turns on the spot.
    fn rover() -> Self {
        let rover = Pilot::new(SkidSteer::new(SkidSteerConfig::default()), Frame::default());
        Self::new(rover, 0.0)
    }

    /// A vehicle with steered front wheels.
    fn car() -> Self {
        let motor = SimulatedMotor::new(MotorConfig::default());
        let servo = SimulatedServo::new(SimulatedServo::RATE);
        let (config, geometry) = (WheelsConfig::default(), Ackermann::default());
        let car: Wheels<SteeredDrive<SimulatedMotor, SimulatedServo>> =
            Wheels::steered(motor, servo, config, geometry, Odometer::new(1));
        Self::new(Pilot::new(car, Frame::default()), geometry.turning_radius())
    }

    #[expect(
        clippy::disallowed_methods,
        reason = "virtual time starts at any instant"
    )]
    fn new(pilot: Pilot, turning_radius: f64) -> Self {
        let fence = Fence::new(FenceConfig::default());
        let scenery = Scenery::default();
        let vehicle = Footprint {
            turning_radius,
            ..Footprint::default()
        };
        let mut bench = Self {
            pilot: pilot.with_fence(fence.clone()),
            fence,
            ranger: SimulatedRanger::new(RangerConfig::default(), scenery.clone()),
            scenery,
            discs: Vec::new(),
            lookout: Lookout::default(),
            vehicle,
            plans_again: true,
            corners: Vec::new(),
            segment: None,
            refused: None,
            now: Instant::now(),
            least: f64::INFINITY,
        };
        bench.pilot.handle_time(bench.now);
        bench.plan();
        bench
    }

    fn put(&mut self, discs: Vec<Disc>) {
        self.discs.clone_from(&discs);
        self.scenery.set(discs);
    }

    fn here(&self) -> Point {
        let pose = self.pilot.motion().pose;
        (pose.x, pose.y)
    }

    fn plan(&mut self) {
        self.pilot.stop();
        self.segment = None;
        let cells = vec![255; 80 * 80];
        let map = Terrain::new(80, 80, 0.25, (-5.0, -10.0), cells).unwrap();
        let map = map.with_obstacles(self.lookout.obstacles(), self.vehicle.clearance());
        match plan(&map, &self.vehicle, self.here(), DESTINATION) {
            Ok(path) => {
                self.refused = None;
                self.corners = Path::points(&path)[1..].to_vec();
            }
            Err(why) => {
                self.corners.clear();
                self.refused = Some(why.to_string());
            }
        }
        self.lookout.begin();
    }

    /// Drives for some seconds.
    fn drive(&mut self, seconds: u32) {
        for step in 0..seconds * 50 {
            self.now += Pilot::STEP;
            self.pilot.handle_time(self.now);
            let pose = self.pilot.motion().pose;
            for disc in &self.discs {
                let distance = pose.distance(disc.middle.0, disc.middle.1) - disc.radius;
                self.least = self.least.min(distance - FenceConfig::default().radius);
            }
            if step % 5 == 0 {
                let scan = self.ranger.scan(&pose);
                self.fence.set_obstacles(scan.hits(pose).collect());
                self.lookout.handle_pose(pose);
                self.lookout.handle_scan(self.now, &scan);
            }
            let width = self.vehicle.width / 2.0;
            let is_time_to_look = self.plans_again && step % 50 == 0;
            if is_time_to_look
                && self
                    .lookout
                    .sees_blocked(self.corners.iter().copied(), width)
            {
                self.plan();
            }
            self.follow();
        }
    }

    /// Begins the next segment of the path when the one before is done.
    fn follow(&mut self) {
        if let Some(ticket) = self.segment {
            if !self.pilot.has_arrived(ticket) {
                return;
            }
            self.corners.remove(0);
            self.segment = None;
        }
        let Some(&end) = self.corners.first() else {
            return;
        };
        let start = self.here();
        let straight = Curve {
            start,
            control: ((start.0 + end.0) / 2.0, (start.1 + end.1) / 2.0),
            end,
            weight: 0.0,
        };
        self.segment = Some(self.pilot.pursue(Goal::Path {
            curve: straight,
            speed: 1.0,
            tolerance: 0.3,
            goes_on: self.corners.len() > 1,
        }));
    }

    fn has_arrived(&self) -> bool {
        let (x, y) = self.here();
        (x - DESTINATION.0).hypot(y - DESTINATION.1) < 0.5
    }

    /// Drives until the vehicle is under way, puts discs around it, and drives on.
    fn meets(&mut self, discs: Vec<Disc>) {
        self.drive(2);
        assert!(self.here().0 > 0.5, "under way: {:?}", self.here());
        self.put(discs);
        self.drive(60);
    }
}

#[test]
fn a_vehicle_drives_round_an_obstacle_that_appears_on_its_way() {
    for (kind, mut bench) in [("rover", Bench::rover()), ("car", Bench::car())] {
        bench.meets(vec![ON_THE_WAY]);
        assert!(bench.has_arrived(), "{kind}: {:?}", bench.here());
        assert!(bench.least > 0.0, "{kind}: {:.2} m", bench.least);
    }
}

#[test]
fn without_another_path_it_stands_before_the_obstacle_until_it_is_gone() {
    for (kind, mut bench) in [("rover", Bench::rover()), ("car", Bench::car())] {
        bench.plans_again = false;
        bench.meets(vec![ON_THE_WAY]);
        let (x, _) = bench.here();
        assert!((3.0..4.6).contains(&x), "{kind}: {x:.2}");
        assert!(bench.least > 0.0, "{kind}: {:.2} m", bench.least);
        let held = bench.fence.held().unwrap_or_default();
        assert!(held.starts_with("an obstacle is 0."), "{kind}: {held}");
        bench.put(Vec::new());
        bench.drive(20);
        assert!(bench.has_arrived(), "{kind}: {:?}", bench.here());
    }
}

#[test]
fn before_a_wall_without_a_way_round_it_stops_and_says_why() {
    let post = |number: i32| Disc {
        middle: (6.0, f64::from(number) * 0.4),
        radius: 0.3,
    };
    for (kind, mut bench) in [("rover", Bench::rover()), ("car", Bench::car())] {
        bench.meets((-40..=40).map(post).collect());
        assert!(bench.least > 0.0, "{kind}: {:.2} m", bench.least);
        assert!(bench.pilot.is_at_rest(), "{kind}");
        let refused = bench.refused.as_deref().unwrap_or_default();
        // For a car, the last narrow gap that it knows is too tight.
        assert!(refused.contains(" path "), "{kind}: {refused}");
        assert!(bench.here().0 < 5.5, "{kind}: {:?}", bench.here());
    }
}

#[test]
fn a_vehicle_that_sees_obstacles_all_around_stands() {
    let mut bench = Bench::rover();
    bench.plans_again = false;
    bench.drive(2);
    let before = bench.here();
    let around = (0..60_000_u32).map(|ray| Ray {
        bearing: f64::from(ray) * 1e-4,
        range: 1.0,
    });
    let scan = Scan::new(around);
    assert!(scan.rays().len() <= usize::from(Scan::MOST_RAYS));
    let pose = bench.pilot.motion().pose;
    let hits: Vec<_> = scan.hits(pose).collect();
    for _ in 0..500 {
        bench.now += Pilot::STEP;
        bench.fence.set_obstacles(hits.clone());
        bench.pilot.handle_time(bench.now);
    }
    let here = bench.here();
    let moved = (here.0 - before.0).hypot(here.1 - before.1);
    assert!(moved < 0.75, "{moved:.2} m");
}

#[test]
fn a_scan_keeps_the_shortest_ray_of_each_half_degree_and_no_invalid_numbers() {
    let ray = |bearing: f64, range: f64| Ray { bearing, range };
    let rays = [
        ray(0.001, 3.0),
        ray(0.002, 1.0),
        ray(0.003, 2.0),
        ray(f64::NAN, 1.0),
        ray(0.5, f64::NAN),
        ray(0.6, f64::INFINITY),
        ray(-1.0, 4.0),
    ];
    let scan = Scan::new(rays);
    assert_eq!(scan.rays(), [ray(-1.0, 4.0), ray(0.002, 1.0)]);
    assert_eq!(Scan::new([ray(1e300, 1.0)]).rays().len(), 1);
}

#[test]
fn one_wrong_measurement_blocks_no_path() {
    let mut lookout = Lookout::default();
    let ahead = [DESTINATION];
    #[expect(
        clippy::disallowed_methods,
        reason = "virtual time starts at any instant"
    )]
    let mut now = Instant::now();
    let mut look = |range: f64| {
        now += Duration::from_secs(1);
        lookout.handle_pose(Pose::default());
        let ray = |bearing| Ray { bearing, range };
        lookout.handle_scan(now, &Scan::new([-0.1, 0.0, 0.1].map(ray)));
        lookout.sees_blocked(ahead, 0.3)
    };
    assert_eq!([2.0, 8.0, 2.0].map(&mut look), [false; 3], "gone at once");
    assert!(look(2.0), "it is still there");
}
