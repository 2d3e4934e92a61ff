//! The motion control: pursues one goal at a time, and stops the platform when there is none.

use std::time::{Duration, Instant};

use super::steering::{towards, turn_rate};
use super::{
    Curve, Drive, Effort, Frame, GlobalPose, Limits, Motion, Platform, Pose, Velocity, Waypoint,
    wrap,
};

/// What a vehicle is to do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Goal {
    /// To use its drives and brakes without feedback.
    Effort(Effort),
    /// To move with a velocity along and about its own axes.
    Velocity(Velocity),
    /// To keep a speed and a heading; without a heading, to go straight on.
    Vector {
        /// Metres per second.
        speed: f64,
        /// Where to head for.
        heading: Option<Heading>,
    },
    /// To drive to a place.
    Waypoint {
        /// The place.
        to: Waypoint,
        /// Metres per second at most.
        speed: f64,
        /// Whether it goes on from there, so that it need not stop.
        goes_on: bool,
    },
    /// To drive along a curve to its end.
    Path {
        /// The curve.
        curve: Curve,
        /// Metres per second at most.
        speed: f64,
        /// At what distance in metres the end counts as reached.
        tolerance: f64,
        /// Whether it goes on from there, so that it need not stop.
        goes_on: bool,
    },
}

/// A heading in radians, clockwise seen from above.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Heading {
    /// From the local X axis.
    Local(f64),
    /// From true north, wherever the local frame lies at the time.
    North(f64),
}

/// Why a [`Pilot`] cannot steer or drive.
#[derive(Debug, Clone, PartialEq)]
pub enum Trouble {
    /// The platform reports a fault.
    Fault(String),
    /// The pose is older than may be steered by.
    PoseStale(Duration),
    /// Part of the pose is not known (NaN).
    PoseUnknown,
}

/// Names one goal of a [`Pilot`], so that whoever set it can tell it from later ones.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Ticket(u64);

/// Drives a platform to its goal.
///
/// Time comes through [`handle_time`](Self::handle_time), whoever calls it and however often; the
/// platform is controlled every [`STEP`](Self::STEP) of it.
pub struct Pilot {
    platform: Box<dyn Platform>,
    frame: Frame,
    limits: Limits,
    course: Option<Course>,
    /// What the platform was told last.
    command: Drive,
    tickets: u64,
    steps: u64,
    time: Option<Instant>,
    /// The oldest pose that is steered by.
    max_pose_age: Duration,
    /// What has ended the last goal, until that is asked for.
    trouble: Option<Trouble>,
}

/// What a course demands of the platform.
enum Setpoint {
    Drive(Drive),
    Head { heading: f64, speed: f64 },
}

/// A goal that is pursued.
#[derive(Debug)]
struct Course {
    goal: Goal,
    ticket: Ticket,
    has_arrived: bool,
    /// Whether it is at its waypoint, and only turns.
    is_turning: bool,
    /// The points of a curve that lie ahead.
    ahead: Vec<(f64, f64)>,
    /// The heading of somebody who goes straight on.
    straight: f64,
}

impl Pilot {
    /// Between two moments of control.
    pub const STEP: Duration = Duration::from_millis(20);
    /// The longest time that is made up for at once. What is longer was no driving, but a computer
    /// that slept.
    pub const LONGEST_GAP: Duration = Duration::from_secs(2);
    /// The oldest pose that is steered by, unless another limit is chosen.
    pub const MAX_POSE_AGE: Duration = Duration::from_millis(500);

    /// A pilot without a goal, on a platform whose local frame lies at a place of the globe.
    #[must_use]
    pub fn new(platform: impl Platform + 'static, frame: Frame) -> Self {
        let limits = platform.limits();
        Self {
            platform: Box::new(platform),
            frame,
            limits,
            course: None,
            command: Drive::Stop,
            tickets: 0,
            steps: 0,
            time: None,
            max_pose_age: Self::MAX_POSE_AGE,
            trouble: None,
        }
    }

    /// The oldest pose that is steered by; [`MAX_POSE_AGE`](Self::MAX_POSE_AGE) without this. It
    /// counts for platforms that say [when they measured](Motion::sampled_at).
    #[must_use]
    pub const fn max_pose_age(mut self, age: Duration) -> Self {
        self.max_pose_age = age;
        self
    }

    /// It is `now`. May be called as often as one likes.
    pub fn handle_time(&mut self, now: Instant) {
        let mut time = self.time.unwrap_or(now);
        if self.is_idle() {
            time = time.max(now);
        }
        let gap = now.saturating_duration_since(time);
        if gap > Self::LONGEST_GAP {
            tracing::warn!(
                seconds = gap.as_secs_f64(),
                "the vehicle's time stood still"
            );
            time = now.checked_sub(Self::LONGEST_GAP).unwrap_or(now);
        }
        while time + Self::STEP <= now {
            time += Self::STEP;
            self.steps += 1;
            self.control(time);
            self.platform.handle_time(time);
        }
        self.time = Some(time);
        if self.is_idle() {
            self.platform.handle_time(time);
        }
    }

    /// Pursues another goal from now on, instead of any earlier one.
    pub fn pursue(&mut self, goal: Goal) -> Ticket {
        self.tickets += 1;
        let ticket = Ticket(self.tickets);
        let ahead = match &goal {
            Goal::Path { curve, .. } => self.ahead_on(curve),
            _ => Vec::new(),
        };
        self.course = Some(Course {
            goal,
            ticket,
            has_arrived: false,
            is_turning: false,
            ahead,
            straight: self.motion().pose.yaw,
        });
        ticket
    }

    /// The points of a curve from the one on that is nearest.
    fn ahead_on(&self, curve: &Curve) -> Vec<(f64, f64)> {
        let pose = self.motion().pose;
        let distance = |&(x, y): &(f64, f64)| pose.distance(x, y);
        let mut points = curve.points();
        let nearest = points.iter().enumerate();
        let nearest = nearest.min_by(|(_, a), (_, b)| distance(a).total_cmp(&distance(b)));
        if let Some((index, _)) = nearest {
            points.drain(..index);
        }
        points
    }

    /// Whether there is a goal that has not been reached.
    #[must_use]
    pub fn is_under_way(&self) -> bool {
        let course = self.course.as_ref();
        course.is_some_and(|course| !course.has_arrived)
    }

    /// Whether the last goal has been reached, whoever has set it.
    #[must_use]
    pub fn is_there(&self) -> bool {
        let course = self.course.as_ref();
        course.is_some_and(|course| course.has_arrived)
    }

    /// What has ended a goal since this was asked last: a fault of the platform, or a pose that was
    /// not known or too old for a goal that needs one.
    pub const fn take_trouble(&mut self) -> Option<Trouble> {
        self.trouble.take()
    }

    /// A fault of the platform.
    #[must_use]
    pub fn fault(&self) -> Option<Trouble> {
        self.platform.fault().map(Trouble::Fault)
    }

    /// What keeps the pose from being steered by at `now`.
    #[must_use]
    pub fn pose_trouble(&self, now: Instant) -> Option<Trouble> {
        let Motion {
            pose, sampled_at, ..
        } = self.motion();
        if ![pose.x, pose.y, pose.yaw].iter().all(|it| it.is_finite()) {
            return Some(Trouble::PoseUnknown);
        }
        let age = now.saturating_duration_since(sampled_at?);
        (age > self.max_pose_age).then_some(Trouble::PoseStale(age))
    }

    /// Gives up whatever goal there is, and stops.
    pub fn stop(&mut self) {
        self.course = None;
        self.drive(Drive::Stop);
    }

    /// Gives up a goal and stops, unless another one has been set since.
    pub fn give_up(&mut self, ticket: Ticket) {
        if self.pursues(ticket) {
            self.stop();
        }
    }

    /// Whether this is the goal that is pursued, or that has been reached.
    #[must_use]
    pub fn pursues(&self, ticket: Ticket) -> bool {
        self.course
            .as_ref()
            .is_some_and(|course| course.ticket == ticket)
    }

    /// Whether this goal is the last one, and has been reached.
    #[must_use]
    pub fn has_arrived(&self, ticket: Ticket) -> bool {
        let course = self.course.as_ref();
        course.is_some_and(|course| course.ticket == ticket && course.has_arrived)
    }

    /// Changes the speed with which a goal is pursued, in metres per second.
    pub fn set_speed(&mut self, ticket: Ticket, wanted: f64) {
        let course = self
            .course
            .as_mut()
            .filter(|course| course.ticket == ticket);
        if let Some(
            Goal::Vector { speed, .. } | Goal::Waypoint { speed, .. } | Goal::Path { speed, .. },
        ) = course.map(|course| &mut course.goal)
        {
            *speed = wanted;
        }
    }

    /// Where the platform is and how it moves.
    #[must_use]
    pub fn motion(&self) -> Motion {
        self.platform.motion()
    }

    /// How many steps the platform has been controlled so far: as long as this is the same, nothing
    /// has moved.
    #[must_use]
    pub const fn steps(&self) -> u64 {
        self.steps
    }

    /// Where on the globe it is.
    #[must_use]
    pub fn global_pose(&self) -> GlobalPose {
        self.frame.to_global(&self.motion().pose)
    }

    /// Where the local frame lies.
    #[must_use]
    pub const fn frame(&self) -> &Frame {
        &self.frame
    }

    /// From now on the place where the platform is has this local pose. Its global pose stays.
    pub fn set_pose(&mut self, pose: Pose) {
        let pose = Pose {
            yaw: wrap(pose.yaw),
            ..pose
        };
        self.frame = Frame::joining(&pose, &self.global_pose());
        self.platform.set_pose(pose);
    }

    /// From now on the place where the platform is has this global pose. Its local pose stays.
    pub fn set_global_pose(&mut self, pose: GlobalPose) {
        self.frame = Frame::joining(&self.motion().pose, &pose);
    }

    /// The limits that are kept: those of the platform, or narrower ones.
    #[must_use]
    pub const fn limits(&self) -> &Limits {
        &self.limits
    }

    /// Narrows the limits; the platform's own hold in any case.
    pub fn set_limits(&mut self, limits: Limits) {
        self.limits = limits.and(&self.platform.limits());
        self.platform.set_limits(self.limits);
    }

    /// Goes back to the platform's own limits.
    pub fn reset_limits(&mut self) {
        self.set_limits(self.platform.limits());
    }

    /// Whether it stands still, and wants to.
    #[must_use]
    pub fn is_at_rest(&self) -> bool {
        self.command == Drive::Stop && self.motion().velocity.is_rest()
    }

    /// When [`handle_time`](Self::handle_time) must be called.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        if self.is_idle() {
            return None;
        }
        Some(self.time? + Self::STEP)
    }

    /// Whether it stands still and has nothing to do.
    fn is_idle(&self) -> bool {
        let course = self.course.as_ref();
        // A platform whose velocity is not known cannot be waited for.
        let stands = self.command == Drive::Stop && !self.motion().velocity.is_moving();
        stands && course.is_none_or(|course| course.has_arrived)
    }

    /// One moment of control. In trouble it stops, and does not go on afterwards.
    fn control(&mut self, time: Instant) {
        let course = self.course.as_ref().filter(|course| !course.has_arrived);
        if let Some(course) = course {
            let is_steered = course.goal.needs_pose();
            let trouble = is_steered.then(|| self.pose_trouble(time)).flatten();
            if let Some(trouble) = self.fault().or(trouble) {
                self.trouble = Some(trouble);
                self.course = None;
            }
        }
        let pose = self.motion().pose;
        let limits = self.limits;
        let north = -self.frame.heading;
        let setpoint = match &mut self.course {
            Some(course) => course.command(&pose, north, &limits),
            None => Setpoint::Drive(Drive::Stop),
        };
        match setpoint {
            Setpoint::Drive(command) => self.drive(command),
            Setpoint::Head { heading, speed } => {
                self.command = Drive::Velocity(Velocity::forward(speed, 0.0));
                self.platform.head(heading, speed, &limits);
            }
        }
    }

    fn drive(&mut self, command: Drive) {
        self.command = match command {
            Drive::Velocity(velocity) => Drive::Velocity(self.limits.clamp(velocity)),
            other => other,
        };
        self.platform.drive(self.command);
    }
}

fn head_for(pose: &Pose, to: (f64, f64), speed: f64, way: f64, limits: &Limits) -> Setpoint {
    let (heading, speed) = towards(pose, to, speed, way, limits);
    Setpoint::Head { heading, speed }
}

impl Drop for Pilot {
    /// A platform that nobody drives any more stands still.
    fn drop(&mut self) {
        self.platform.drive(Drive::Stop);
    }
}

impl Goal {
    /// Whether it takes a pose to pursue it.
    const fn needs_pose(&self) -> bool {
        match self {
            Self::Effort(_) | Self::Velocity(_) => false,
            Self::Vector { .. } | Self::Waypoint { .. } | Self::Path { .. } => true,
        }
    }
}

impl Course {
    /// What to do now; notes the arrival.
    fn command(&mut self, pose: &Pose, north: f64, limits: &Limits) -> Setpoint {
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
            },
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
                head_for(pose, (to.x, to.y), speed, way, limits)
            }
        }
    }

    /// At the waypoint, turns to the heading that is wanted there.
    fn turn(&mut self, pose: &Pose, heading: f64, limits: &Limits) -> Setpoint {
        // From here on it turns, even should it slip out of the tolerance.
        self.is_turning = true;
        let error = wrap(heading - pose.yaw).abs();
        self.has_arrived |= error <= Waypoint::HEADING_TOLERANCE;
        if self.has_arrived {
            return Setpoint::Drive(Drive::Stop);
        }
        let turn = Velocity::forward(0.0, turn_rate(pose.yaw, heading, limits));
        Setpoint::Drive(Drive::Velocity(turn))
    }

    fn follow(
        &mut self,
        pose: &Pose,
        end: Waypoint,
        speed: f64,
        goes_on: bool,
        limits: &Limits,
    ) -> Setpoint {
        self.has_arrived |= self.ahead.len() <= 2 && end.is_reached(pose);
        if self.has_arrived && !goes_on {
            return Setpoint::Drive(Drive::Stop);
        }
        let look = Self::LOOK_AHEAD.max(speed * Self::LOOK_AHEAD_TIME);
        self.pass(pose, look);
        let target = self.ahead.first().copied().unwrap_or((end.x, end.y));
        let way = if goes_on {
            f64::INFINITY
        } else {
            pose.distance(end.x, end.y)
        };
        head_for(pose, target, speed, way, limits)
    }

    /// How far ahead on a curve it aims, in metres.
    const LOOK_AHEAD: f64 = 0.4;
    /// The same in seconds of driving.
    const LOOK_AHEAD_TIME: f64 = 0.5;

    /// Leaves those points of the curve behind that are closer than it aims.
    fn pass(&mut self, pose: &Pose, look: f64) {
        let ahead = |&(x, y): &(f64, f64)| pose.distance(x, y) > look;
        let passed = self.ahead.iter().position(ahead);
        let passed = passed.unwrap_or(self.ahead.len().saturating_sub(1));
        self.ahead.drain(..passed);
    }
}
