//! The way to one goal of a pilot: the setpoint at each step, and the arrival.
//!
//! A vehicle with a least turning radius cannot turn to a heading at a waypoint. It drives to the
//! waypoint along a straight line that has this heading.

use super::steering::{Steering, towards, turn_rate};
use super::{Curve, Drive, Goal, Heading, Limits, Pose, Ticket, Velocity, Waypoint, wrap};

/// Setpoint that a course requests from the platform.
pub(super) enum Setpoint {
    /// A command that does not depend on the pose.
    Drive(Drive),
    /// Hold a heading in the local frame.
    Head {
        heading: f64,
        speed: f64,
        /// Distance in metres to the target, if it is a point that must not be missed. Otherwise
        /// infinite.
        distance: f64,
    },
}

/// A goal in progress.
#[derive(Debug)]
pub(super) struct Course {
    pub(super) goal: Goal,
    pub(super) ticket: Ticket,
    pub(super) has_arrived: bool,
    pub(super) steering: Steering,
    /// Whether the vehicle has reached its waypoint and only turns.
    is_turning: bool,
    /// The remaining points of a curve.
    ahead: Vec<(f64, f64)>,
    /// Heading at the end of the curve.
    final_heading: f64,
    /// The heading for driving straight ahead.
    straight: f64,
}

impl Goal {
    /// Whether pursuing the goal requires a pose.
    pub(super) const fn needs_pose(&self) -> bool {
        match self {
            Self::Effort(_) | Self::Velocity(_) => false,
            Self::Vector { .. } | Self::Waypoint { .. } | Self::Path { .. } => true,
        }
    }
}

/// The points of a curve from the one nearest to the vehicle.
fn ahead_on(curve: &Curve, pose: &Pose) -> Vec<(f64, f64)> {
    let distance = |&(x, y): &(f64, f64)| pose.distance(x, y);
    let mut points = curve.points();
    let nearest = points.iter().enumerate();
    let nearest = nearest.min_by(|(_, a), (_, b)| distance(a).total_cmp(&distance(b)));
    if let Some((index, _)) = nearest {
        points.drain(..index);
    }
    points
}

/// The straight line on which a vehicle with this turning radius arrives at a waypoint in a heading.
fn approach(to: &Waypoint, heading: f64, radius: f64) -> Vec<(f64, f64)> {
    let back = Course::APPROACH * radius;
    let start = (to.x - back * heading.cos(), to.y - back * heading.sin());
    let line = Curve {
        start,
        control: start,
        end: (to.x, to.y),
        weight: 0.0,
    };
    line.points()
}

impl Course {
    /// Look-ahead distance on a curve in metres.
    const LOOK_AHEAD: f64 = 0.4;
    /// Look-ahead distance in seconds of driving.
    const LOOK_AHEAD_TIME: f64 = 0.5;
    /// Length of the approach to a waypoint with a heading, in turning radii.
    const APPROACH: f64 = 5.0;
    /// Heading accuracy in radians of a vehicle that cannot turn on the spot.
    const STEERED_TOLERANCE: f64 = 0.1;

    pub(super) fn new(goal: Goal, ticket: Ticket, pose: &Pose, limits: &Limits) -> Self {
        let (ahead, final_heading) = match &goal {
            Goal::Path { curve, .. } => (ahead_on(curve, pose), curve.final_heading()),
            Goal::Waypoint {
                to:
                    to @ Waypoint {
                        heading: Some(heading),
                        ..
                    },
                goes_on: false,
                ..
            } if !limits.turns_on_the_spot() => {
                (approach(to, *heading, limits.turning_radius), *heading)
            }
            _ => (Vec::new(), 0.0),
        };
        Self {
            goal,
            ticket,
            has_arrived: false,
            steering: Steering::default(),
            is_turning: false,
            ahead,
            final_heading,
            straight: pose.yaw,
        }
    }

    /// The current setpoint. Records the arrival.
    pub(super) fn command(&mut self, pose: &Pose, north: f64, limits: &Limits) -> Setpoint {
        match self.goal {
            Goal::Effort(effort) => Setpoint::Drive(Drive::Effort(effort)),
            Goal::Velocity(velocity) => Setpoint::Drive(Drive::Velocity(velocity)),
            Goal::Vector { speed, heading } => Setpoint::Head {
                heading: match heading {
                    Some(Heading::Local(heading)) => heading,
                    Some(Heading::North(heading)) => heading + north,
                    None => self.straight,
                },
                speed,
                distance: f64::INFINITY,
            },
            Goal::Waypoint { to, speed, .. } if !self.ahead.is_empty() => {
                self.draw_near(pose, to, speed, limits)
            }
            Goal::Waypoint { to, speed, goes_on } => self.reach(pose, to, speed, goes_on, limits),
            Goal::Path {
                curve,
                speed,
                tolerance,
                goes_on,
            } => {
                let end = Waypoint {
                    tolerance,
                    ..Waypoint::at(curve.end.0, curve.end.1)
                };
                let is_through = goes_on && self.has_passed(pose, &end, speed, limits);
                self.has_arrived |= self.ahead.len() <= 2 && (end.is_reached(pose) || is_through);
                self.follow(pose, end, speed, goes_on, limits)
            }
        }
    }

    fn reach(
        &mut self,
        pose: &Pose,
        to: Waypoint,
        speed: f64,
        goes_on: bool,
        limits: &Limits,
    ) -> Setpoint {
        self.has_arrived |= to.is_reached(pose) && (goes_on || to.heading.is_none());
        match to.heading {
            Some(heading) if !goes_on && (self.is_turning || to.is_reached(pose)) => {
                self.turn(pose, heading, limits)
            }
            _ if self.has_arrived && !goes_on => Setpoint::Drive(Drive::Stop),
            _ => {
                let distance = pose.distance(to.x, to.y);
                let way = if goes_on { f64::INFINITY } else { distance };
                head_for(pose, &to, speed, way, limits)
            }
        }
    }

    /// Turns to the requested heading at the waypoint.
    fn turn(&mut self, pose: &Pose, heading: f64, limits: &Limits) -> Setpoint {
        // Keeps turning from here on, even if the vehicle slips out of the tolerance.
        self.is_turning = true;
        let error = wrap(heading - pose.yaw).abs();
        self.has_arrived |= error <= Waypoint::HEADING_TOLERANCE;
        if self.has_arrived {
            return Setpoint::Drive(Drive::Stop);
        }
        let turn = Velocity::forward(0.0, turn_rate(pose.yaw, heading, limits));
        Setpoint::Drive(Drive::Velocity(turn))
    }

    /// Drives to a waypoint along the line that has its heading. After a miss it starts over.
    fn draw_near(&mut self, pose: &Pose, to: Waypoint, speed: f64, limits: &Limits) -> Setpoint {
        let error = wrap(self.final_heading - pose.yaw).abs();
        self.has_arrived |= to.is_reached(pose) && error <= Self::STEERED_TOLERANCE;
        if !self.has_arrived && self.ahead.len() <= 2 && self.is_beyond(pose, &to) {
            self.ahead = approach(&to, self.final_heading, limits.turning_radius);
        }
        if let Some(&(x, y)) = self.ahead.first()
            && self.ahead.len() > usize::from(Curve::POINTS)
            && pose.distance(x, y) > Self::look_ahead(speed, limits)
        {
            return head_for(pose, &Waypoint::at(x, y), speed, f64::INFINITY, limits);
        }
        self.follow(pose, to, speed, false, limits)
    }

    /// Whether the end of a curve lies behind the vehicle.
    fn is_beyond(&self, pose: &Pose, end: &Waypoint) -> bool {
        let (sin, cos) = self.final_heading.sin_cos();
        (pose.x - end.x) * cos + (pose.y - end.y) * sin >= 0.0
    }

    /// Whether a vehicle that cannot turn back has passed the end of a curve at a small distance.
    fn has_passed(&self, pose: &Pose, end: &Waypoint, speed: f64, limits: &Limits) -> bool {
        !limits.turns_on_the_spot()
            && self.is_beyond(pose, end)
            && pose.distance(end.x, end.y) <= Self::look_ahead(speed, limits)
    }

    fn follow(
        &mut self,
        pose: &Pose,
        end: Waypoint,
        speed: f64,
        goes_on: bool,
        limits: &Limits,
    ) -> Setpoint {
        if self.has_arrived && !goes_on {
            return Setpoint::Drive(Drive::Stop);
        }
        self.pass(pose, Self::look_ahead(speed, limits));
        let way = if goes_on {
            f64::INFINITY
        } else {
            pose.distance(end.x, end.y)
        };
        match self.ahead[..] {
            [] | [_] if !goes_on => head_for(pose, &end, speed, way, limits),
            [] => slide_for(pose, (end.x, end.y), speed, way, limits),
            [target, ..] => slide_for(pose, target, speed, way, limits),
        }
    }

    /// Look-ahead distance on a curve in metres. A nearer point could lie within the circle that the
    /// vehicle cannot drive.
    fn look_ahead(speed: f64, limits: &Limits) -> f64 {
        Self::LOOK_AHEAD
            .max(speed * Self::LOOK_AHEAD_TIME)
            .max(limits.turning_radius)
    }

    /// Drops the points of the curve within the look-ahead distance.
    fn pass(&mut self, pose: &Pose, look: f64) {
        let ahead = |&(x, y): &(f64, f64)| pose.distance(x, y) > look;
        let passed = self.ahead.iter().position(ahead);
        let passed = passed.unwrap_or(self.ahead.len().saturating_sub(1));
        self.ahead.drain(..passed);
    }
}

/// Heads for a point that must be reached.
fn head_for(pose: &Pose, to: &Waypoint, speed: f64, way: f64, limits: &Limits) -> Setpoint {
    let (heading, speed) = towards(pose, (to.x, to.y), speed, way, limits);
    Setpoint::Head {
        heading,
        speed,
        distance: pose.distance(to.x, to.y) + to.tolerance,
    }
}

/// Heads for a point that moves on along a curve.
fn slide_for(pose: &Pose, to: (f64, f64), speed: f64, way: f64, limits: &Limits) -> Setpoint {
    let (heading, speed) = towards(pose, to, speed, way, limits);
    Setpoint::Head {
        heading,
        speed,
        distance: f64::INFINITY,
    }
}
