//! The fence: the speed up to which a vehicle can still stop before the edge of a zone, or before an
//! obstacle that a range sensor sees.
//!
//! A fence limits, it does not stop: the command stays in force, and the vehicle moves on when the
//! zones allow it. Turning on the spot is always possible, because the vehicle counts as a disc.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use super::{Drive, Effort, JumpCheck, Limits, Motion, Pose, Velocity};
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
#[derive(Debug)]
struct Located {
    pose: Option<(Pose, Instant)>,
    jumps: JumpCheck,
    /// Why the pose does not count before it is confirmed.
    doubt: Option<String>,
}

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
    /// Limit of steps. A vehicle too fast for that drives no faster than it can stop within them.
    const MAX_STEPS: usize = 2000;

    /// A fence without zones.
    #[must_use]
    pub fn new(config: FenceConfig) -> Self {
        Self(Arc::new(Mutex::new(State {
            config,
            ..State::default()
        })))
    }

    /// A fence for a platform whose own pose is not in the frame of the zones: it holds the vehicle
    /// while there are zones but no [pose](Self::handle_pose) from elsewhere, or one that has jumped
    /// further than a vehicle with these limits can drive.
    #[must_use]
    pub fn located_elsewhere(config: FenceConfig, limits: &Limits) -> Self {
        Self(Arc::new(Mutex::new(State {
            config,
            located: Some(Located {
                pose: None,
                jumps: JumpCheck::new(limits, JumpCheck::RECKONED),
                doubt: None,
            }),
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

    /// Sets the pose that another component measured, and when; `None` if it is unknown. If it
    /// jumps while there are zones, the vehicle is held until the pose is
    /// [confirmed](Self::confirm_pose).
    pub fn handle_pose(&self, pose: Option<(Pose, Instant)>) {
        let mut state = self.lock();
        let has_zones = !state.zones.is_empty();
        let Some(located) = &mut state.located else {
            return;
        };
        located.pose = pose;
        let Some((pose, at)) = pose else {
            return;
        };
        let jump = located.jumps.handle_pose(at, &pose);
        if let Some(jump) = jump.filter(|_| has_zones) {
            tracing::error!("{jump}: the vehicle is held");
            located.doubt = Some(format!(
                "{jump} while zones are set: check it, then take control again"
            ));
        }
    }

    /// Accepts the pose again after a jump, because control was taken or released since.
    pub fn confirm_pose(&self) {
        if let Some(located) = &mut self.lock().located {
            located.doubt = None;
        }
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
        let doubt = state.located.as_ref().and_then(|it| it.doubt.clone());
        if doubt.is_some() {
            state.held = doubt;
            return Bounds::HOLD;
        }
        let Some(pose) = state.pose(now, motion) else {
            let why = "zones are set, but the pose is unknown or too old: restore the pose \
                       sensor, or delete the zones";
            state.held = Some(why.to_owned());
            return Bounds::HOLD;
        };
        if !(limits.deceleration > 0.0 && limits.deceleration.is_finite()) {
            let limit = limits.deceleration;
            state.held = Some(format!(
                "the deceleration limit is {limit} m/s², so no way is long enough to stop: set it \
                 to what the brakes achieve"
            ));
            return Bounds::HOLD;
        }
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
        let pose = match &self.located {
            None => motion.pose,
            Some(located) => {
                let (pose, at) = located.pose?;
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
        let way = self.free_way(along, farthest);
        if way >= farthest {
            return f64::INFINITY;
        }
        let way = (way - margin).max(0.0);
        let lag = brakes * reaction;
        // The speed from which `reaction` at that speed and braking take this way.
        lag.mul_add(lag, 2.0 * brakes * way).sqrt() - lag
    }

    /// How far the vehicle can drive before it meets something, as far as that is searched.
    fn free_way(&self, along: impl Fn(f64) -> Point, farthest: f64) -> f64 {
        let mut way = 0.0;
        for _ in 0..Fence::MAX_STEPS {
            if way >= farthest {
                break;
            }
            let room = self.room(along(way));
            if room < Fence::LEAST {
                break;
            }
            // A step as long as the room at its start crosses no edge.
            way += room.max(Fence::STEP);
        }
        way
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
mod tests;
