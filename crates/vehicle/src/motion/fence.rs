//! The fence: the speed up to which a vehicle can still stop before the edge of a zone, or before an
//! obstacle that a range sensor sees.
//!
//! A fence limits, it does not stop: the command stays in force, and the vehicle moves on when the
//! zones allow it. Turning on the spot is always possible, because the vehicle counts as a disc.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use super::{Drive, Effort, Limits, Motion, Pose, Velocity};
use crate::zones::{Clearance, Point, Zones};

/// Dimensions and delays of a vehicle for its fence.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FenceConfig {
    /// Radius of the disc that covers the vehicle, in metres.
    pub radius: f64,
    /// Distance to keep from a zone's edge in the direction of travel, in metres.
    pub margin: f64,
    /// Time from a measurement to the brakes, in seconds.
    pub reaction: f64,
}

impl Default for FenceConfig {
    fn default() -> Self {
        Self {
            radius: 0.25,
            margin: 0.1,
            reaction: 0.3,
        }
    }
}

/// The zones and obstacles that a vehicle keeps to. Cheap to clone; all clones share one state.
#[derive(Debug, Clone, Default)]
pub struct Fence(Arc<Mutex<State>>);

#[derive(Debug, Default)]
struct State {
    config: FenceConfig,
    zones: Arc<Zones>,
    /// Where a range sensor sees something, in the local frame.
    obstacles: Vec<Point>,
    /// The pose in the zones' frame, if it is not the platform's own.
    located: Option<Located>,
    held: Option<String>,
}

/// A pose that another component measures.
#[derive(Debug, Clone, Copy, Default)]
struct Located(Option<(Pose, Instant)>);

/// Speeds that a fence allows, in metres per second and not negative.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Bounds {
    ahead: f64,
    back: f64,
}

impl Fence {
    /// Maximum age of a pose that another component measures.
    const MAX_POSE_AGE: Duration = Duration::from_millis(600);
    /// Maximum speed of a vehicle that leaves a place where it must not be, in metres per second.
    const LEAVING: f64 = 0.3;
    /// Distance over which leaving must not lead deeper, in metres.
    const STRIDE: f64 = 0.1;
    /// Fraction of the brakes on which a stop relies.
    const BRAKES: f64 = 0.8;
    /// Distances below this are none, in metres.
    const LEAST: f64 = 0.02;
    /// Shortest step of the search along the vehicle's way, in metres. It bounds the cost of driving
    /// beside an edge.
    const STEP: f64 = 0.05;

    /// A fence without zones.
    #[must_use]
    pub fn new(config: FenceConfig) -> Self {
        Self(Arc::new(Mutex::new(State {
            config,
            ..State::default()
        })))
    }

    /// A fence for a platform whose own pose is not in the frame of the zones: it holds the vehicle
    /// while there are zones but no [pose](Self::handle_pose) from elsewhere.
    #[must_use]
    pub fn located_elsewhere(config: FenceConfig) -> Self {
        Self(Arc::new(Mutex::new(State {
            config,
            located: Some(Located::default()),
            ..State::default()
        })))
    }

    /// Sets the zones.
    pub fn set_zones(&self, zones: Zones) {
        let mut state = self.lock();
        if *state.zones != zones {
            state.zones = Arc::new(zones);
        }
    }

    /// Sets the places where a range sensor sees something, in the local frame.
    pub fn set_obstacles(&self, obstacles: Vec<Point>) {
        self.lock().obstacles = obstacles;
    }

    /// Sets the pose that another component measured at `sampled_at`; `None` if it is unknown.
    pub fn handle_pose(&self, pose: Option<(Pose, Instant)>) {
        self.lock().located = Some(Located(pose));
    }

    /// Why the vehicle may not go where its command leads, if so.
    #[must_use]
    pub fn held(&self) -> Option<String> {
        self.lock().held.clone()
    }

    /// The speeds allowed now to a vehicle that is to drive at `wanted` metres per second, or with an
    /// effort of this sign.
    pub(super) fn bounds(
        &self,
        now: Instant,
        motion: &Motion,
        limits: &Limits,
        wanted: f64,
    ) -> Bounds {
        let mut state = self.lock();
        state.held = None;
        if state.zones.is_empty() && state.obstacles.is_empty() {
            return Bounds::NONE;
        }
        let Some(pose) = state.pose(now, motion) else {
            let why = "zones are set, but the pose is unknown or too old: restore the pose \
                       sensor, or delete the zones";
            state.held = Some(why.to_owned());
            return Bounds::HOLD;
        };
        let speed = |sign: f64| {
            let is_asked = wanted * sign > 0.0 || motion.velocity.x * sign > 0.0;
            let speed = || state.speed(&pose, &motion.velocity, sign, limits);
            is_asked.then(speed).unwrap_or(f64::INFINITY)
        };
        let bounds = Bounds {
            ahead: speed(1.0),
            back: speed(-1.0),
        };
        if bounds.hold(wanted) {
            state.held = Some(state.reason((pose.x, pose.y)));
        }
        bounds
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl State {
    /// The pose in the zones' frame; `None` if it is unknown or too old.
    fn pose(&self, now: Instant, motion: &Motion) -> Option<Pose> {
        let pose = match self.located {
            None => motion.pose,
            Some(Located(pose)) => {
                let (pose, at) = pose?;
                let age = now.saturating_duration_since(at);
                (age <= Fence::MAX_POSE_AGE).then_some(pose)?
            }
        };
        let is_known = [pose.x, pose.y, pose.yaw].iter().all(|it| it.is_finite());
        is_known.then_some(pose)
    }

    /// The speed allowed forward (`sign` 1) or backward (-1).
    fn speed(&self, pose: &Pose, velocity: &Velocity, sign: f64, limits: &Limits) -> f64 {
        let FenceConfig {
            margin, reaction, ..
        } = self.config;
        let here = self.room((pose.x, pose.y));
        // The arc that the vehicle drives now; straight ahead if it stands or turns on the spot.
        let turn = if velocity.x.abs() > 0.1 {
            velocity.yaw / velocity.x
        } else {
            0.0
        };
        let turn = if turn.is_finite() { turn } else { 0.0 };
        let along = |way: f64| arc(pose, turn, sign * way);
        if here < Fence::LEAST {
            let is_no_deeper = self.room(along(Fence::STRIDE)) > here - Fence::LEAST / 10.0;
            return if is_no_deeper { Fence::LEAVING } else { 0.0 };
        }
        let brakes = Fence::BRAKES * limits.deceleration;
        let fastest = limits.speed.max(limits.reverse).max(velocity.x.abs());
        let farthest = margin + fastest * reaction + fastest * fastest / (2.0 * brakes);
        // A step as long as the room at its start crosses no edge.
        let mut way = 0.0;
        while way < farthest {
            let room = self.room(along(way));
            if room < Fence::LEAST {
                break;
            }
            way += room.max(Fence::STEP);
        }
        if way >= farthest {
            return f64::INFINITY;
        }
        let way = (way - margin).max(0.0);
        let lag = brakes * reaction;
        // The speed from which `reaction` at that speed and braking take this way.
        lag.mul_add(lag, 2.0 * brakes * way).sqrt() - lag
    }

    /// Distance between the vehicle's disc at a point and the nearest forbidden place.
    fn room(&self, point: Point) -> f64 {
        let clearance = self.zones.clearance(point);
        let clearance = clearance.map_or(f64::INFINITY, |it| it.metres);
        clearance.min(self.nearest_obstacle(point)) - self.config.radius
    }

    fn nearest_obstacle(&self, (x, y): Point) -> f64 {
        let obstacles = self.obstacles.iter();
        let distances = obstacles.map(|it| (it.0 - x).hypot(it.1 - y));
        distances.fold(f64::INFINITY, f64::min)
    }

    /// Why a vehicle at a point is held.
    fn reason(&self, point: Point) -> String {
        let obstacle = self.nearest_obstacle(point);
        let zone = self.zones.clearance(point);
        match zone.filter(|it| it.metres <= obstacle) {
            Some(clearance) => beyond_or_before(clearance),
            None => format!("an obstacle is {obstacle:.1} m away: turn or drive back"),
        }
    }
}

fn beyond_or_before(Clearance { metres, zone }: Clearance) -> String {
    if metres < 0.0 {
        let beyond = -metres;
        return format!(
            "the vehicle is {beyond:.1} m beyond {zone}: drive out the shortest way, or delete \
             the zone"
        );
    }
    format!("{zone} is {metres:.1} m away: turn or drive back")
}

/// The point after `way` metres, forward or backward, with `turn` radians per metre.
fn arc(pose: &Pose, turn: f64, way: f64) -> Point {
    // The chord has the mean direction of the arc.
    let half = turn * way / 2.0;
    let chord = if half.abs() < 1e-6 {
        way
    } else {
        way * half.sin() / half
    };
    let (sin, cos) = (pose.yaw + half).sin_cos();
    (pose.x + chord * cos, pose.y + chord * sin)
}

impl Bounds {
    /// Speed beyond a bound at which the vehicle brakes, in metres per second.
    const EXCESS: f64 = 0.1;
    /// Speed below which a vehicle does not get anywhere, in metres per second.
    const CRAWL: f64 = 0.02;
    /// No bounds.
    const NONE: Self = Self {
        ahead: f64::INFINITY,
        back: f64::INFINITY,
    };
    /// No motion.
    const HOLD: Self = Self {
        ahead: 0.0,
        back: 0.0,
    };

    /// The speed nearest to `wanted` within the bounds.
    pub(super) fn clamp(&self, wanted: f64) -> f64 {
        wanted.clamp(-self.back, self.ahead)
    }

    /// Whether nothing is left of a wanted speed.
    fn hold(&self, wanted: f64) -> bool {
        let bound = if wanted < 0.0 { self.back } else { self.ahead };
        wanted != 0.0 && bound < Self::CRAWL
    }

    /// The speed along the vehicle's axis that a command asks for; of an effort only the sign counts.
    pub(super) const fn wanted(command: &Drive) -> f64 {
        match command {
            Drive::Stop => 0.0,
            Drive::Velocity(velocity) => velocity.x,
            Drive::Effort(effort) => effort.forward,
        }
    }

    /// The command within the bounds, for a vehicle that moves at `speed`.
    pub(super) fn apply(&self, command: Drive, speed: f64) -> Drive {
        if speed > self.ahead + Self::EXCESS || speed < -self.back - Self::EXCESS {
            return Drive::Stop;
        }
        match command {
            Drive::Stop => Drive::Stop,
            Drive::Velocity(velocity) => Drive::Velocity(Velocity {
                x: self.clamp(velocity.x),
                ..velocity
            }),
            // Effort has no speed: it ends where the speed is reached.
            Drive::Effort(effort) => {
                let is_over = (effort.forward > 0.0 && speed >= self.ahead)
                    || (effort.forward < 0.0 && -speed >= self.back);
                Drive::Effort(match is_over {
                    true => Effort {
                        forward: 0.0,
                        // Brakes may block the wheels of a vehicle that turns on the spot.
                        brake: if speed.abs() > Self::CRAWL { 1.0 } else { 0.0 },
                        ..effort
                    },
                    false => effort,
                })
            }
        }
    }
}

#[cfg(test)]
#[expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]
mod tests {
    use super::*;
    use crate::motion::{Curve, Frame, Goal, Heading, Pilot, SkidSteer, SkidSteerConfig, Waypoint};
    use crate::zones::{Polygon, ZoneId};

    /// A simulated rover before a wall of keep-out from X 5 to 8, within an operating zone whose
    /// edge is at X -3.
    struct Bench {
        pilot: Pilot,
        fence: Fence,
        now: Instant,
    }

    const RADIUS: f64 = 0.25;

    fn rectangle(south: f64, west: f64, north: f64, east: f64) -> Polygon {
        let vertices = vec![(south, west), (north, west), (north, east), (south, east)];
        Polygon::new(vertices).unwrap()
    }

    fn walled() -> Zones {
        let mut zones = Zones::default();
        zones.set(ZoneId::Operating, rectangle(-3.0, -20.0, 40.0, 20.0));
        zones.set(ZoneId::KeepOut(7), rectangle(5.0, -10.0, 8.0, 10.0));
        zones
    }

    impl Bench {
        fn new(zones: Zones) -> Self {
            let fence = Fence::new(FenceConfig::default());
            fence.set_zones(zones);
            let rover = SkidSteer::new(SkidSteerConfig::default());
            let pilot = Pilot::new(rover, Frame::default()).with_fence(fence.clone());
            Self {
                pilot,
                fence,
                now: Instant::now(),
            }
        }

        /// Pursues a goal for some seconds. Returns the least clearance of the vehicle's disc.
        fn drive(&mut self, goal: Goal, seconds: u32) -> f64 {
            self.pilot.pursue(goal);
            let mut least = f64::INFINITY;
            for _ in 0..seconds * 50 {
                self.now += Pilot::STEP;
                self.pilot.handle_time(self.now);
                least = least.min(self.room());
            }
            least
        }

        fn room(&self) -> f64 {
            let Pose { x, y, .. } = self.pilot.motion().pose;
            let zones = Arc::clone(&self.fence.lock().zones);
            zones
                .clearance((x, y))
                .map_or(f64::INFINITY, |it| it.metres)
                - RADIUS
        }

        fn x(&self) -> f64 {
            self.pilot.motion().pose.x
        }
    }

    fn effort(forward: f64, turn: f64) -> Goal {
        Goal::Effort(Effort {
            forward,
            turn,
            ..Effort::default()
        })
    }

    fn every_goal() -> [Goal; 5] {
        let speed = 2.0;
        [
            effort(1.0, 0.0),
            Goal::Velocity(Velocity::forward(speed, 0.0)),
            Goal::Vector {
                speed,
                heading: Some(Heading::Local(0.1)),
            },
            Goal::Waypoint {
                to: Waypoint::at(20.0, 0.0),
                speed,
                goes_on: false,
            },
            Goal::Path {
                curve: Curve {
                    start: (0.0, 0.0),
                    control: (10.0, 0.5),
                    end: (20.0, 1.0),
                    weight: 0.0,
                },
                speed,
                tolerance: 0.3,
                goes_on: false,
            },
        ]
    }

    #[test]
    fn no_goal_leads_into_a_keep_out_zone_and_the_vehicle_stops_close_to_it() {
        for goal in every_goal() {
            let mut bench = Bench::new(walled());
            let least = bench.drive(goal, 15);
            assert!(least > 0.0, "{goal:?}: {least:.2} m");
            assert!(bench.x() > 4.0, "{goal:?}: only to {:.2} m", bench.x());
            let held = bench.fence.held().unwrap_or_default();
            assert!(held.starts_with("keep-out zone 7 is"), "{goal:?}: {held}");
        }
    }

    #[test]
    fn the_operating_zone_is_not_left_in_reverse() {
        for goal in [
            effort(-1.0, 0.0),
            Goal::Velocity(Velocity::forward(-1.0, 0.0)),
        ] {
            let mut bench = Bench::new(walled());
            let least = bench.drive(goal, 10);
            assert!(
                least > 0.0 && bench.x() < -2.0,
                "{goal:?}: {least:.2}, {:.2}",
                bench.x()
            );
        }
    }

    #[test]
    fn from_an_edge_the_vehicle_turns_and_drives_away() {
        let mut bench = Bench::new(walled());
        bench.drive(effort(1.0, 0.0), 15);
        let at_edge = bench.x();
        let least = bench.drive(effort(-0.5, 0.0), 2);
        assert!(
            bench.x() < at_edge - 0.5 && least > 0.0,
            "back from {at_edge:.2}"
        );
        bench.drive(effort(1.0, 0.0), 15);
        let around = Goal::Vector {
            speed: 1.0,
            heading: Some(Heading::Local(std::f64::consts::PI)),
        };
        let least = bench.drive(around, 6);
        assert!(
            bench.x() < at_edge - 1.0 && least > 0.0,
            "{:.2}: {least:.2}",
            bench.x()
        );
    }

    #[test]
    fn a_vehicle_in_a_new_zone_leaves_it_slowly_and_drives_no_deeper() {
        let mut zones = walled();
        zones.set(ZoneId::KeepOut(9), rectangle(-1.0, -5.0, 10.0, 5.0));
        let mut bench = Bench::new(zones);
        bench.drive(effort(1.0, 0.0), 3);
        assert!(bench.x() < 0.01, "deeper: {:.2}", bench.x());
        let held = bench.fence.held().unwrap_or_default();
        assert!(held.contains("1.0 m beyond keep-out zone 9"), "{held}");
        bench.drive(Goal::Velocity(Velocity::forward(-1.0, 0.0)), 3);
        assert!(
            (-1.1..-0.6).contains(&bench.x()),
            "slowly: {:.2}",
            bench.x()
        );
        bench.drive(Goal::Velocity(Velocity::forward(-1.0, 0.0)), 10);
        assert!(
            (-2.8..-2.0).contains(&bench.x()),
            "then to the edge: {:.2}",
            bench.x()
        );
    }

    #[test]
    fn zones_that_go_let_the_command_in_force_go_on() {
        let mut bench = Bench::new(walled());
        let goal = every_goal()[3];
        bench.drive(goal, 15);
        bench.fence.set_zones(Zones::default());
        bench.drive(goal, 15);
        assert!(bench.x() > 19.0);
    }

    #[test]
    fn without_a_pose_a_driver_that_needs_one_from_elsewhere_stands_while_there_are_zones() {
        let mut bench = Bench::new(Zones::default());
        bench.fence = Fence::located_elsewhere(FenceConfig::default());
        let rover = SkidSteer::new(SkidSteerConfig::default());
        bench.pilot = Pilot::new(rover, Frame::default()).with_fence(bench.fence.clone());
        bench.drive(effort(1.0, 0.0), 2);
        let moved = bench.x();
        assert!(moved > 0.5, "no zones: {moved:.2}");
        bench.fence.set_zones(walled());
        bench.drive(effort(1.0, 0.0), 3);
        let after = bench.x();
        assert!(after < moved + 1.5, "{moved:.2} to {after:.2}");
        assert!(
            bench
                .fence
                .held()
                .unwrap_or_default()
                .contains("pose is unknown")
        );
        for pose in [Pose::at(f64::NAN, 0.0), Pose::default()] {
            bench.fence.handle_pose(Some((pose, bench.now)));
            bench.drive(effort(1.0, 0.0), 1);
            assert!(
                pose.x.is_nan() == (bench.x() - after < 0.1),
                "{pose:?}: {:.2}",
                bench.x()
            );
        }
    }
}
