//! Motion control: pursues one goal at a time, and stops the platform without one.

use std::time::{Duration, Instant};

use super::course::{Course, Setpoint};
use super::fence::Bounds;
use super::{
    Curve, Drive, Effort, Fence, Frame, GlobalPose, JumpCheck, Limits, Motion, Platform, Pose,
    Velocity, Waypoint, wrap,
};

/// A motion goal of a vehicle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Goal {
    /// Control drives and brakes without feedback.
    Effort(Effort),
    /// Move with a velocity along and about the vehicle's axes.
    Velocity(Velocity),
    /// Hold a speed and a heading. Without a heading, drive straight ahead.
    Vector {
        /// Speed in metres per second.
        speed: f64,
        /// The heading to hold.
        heading: Option<Heading>,
    },
    /// Drive to a waypoint.
    Waypoint {
        /// The waypoint.
        to: Waypoint,
        /// Maximum speed in metres per second.
        speed: f64,
        /// Whether another goal follows, so that the vehicle need not stop.
        goes_on: bool,
    },
    /// Drive along a curve to its end.
    Path {
        /// The curve.
        curve: Curve,
        /// Maximum speed in metres per second.
        speed: f64,
        /// Distance in metres at which the end counts as reached.
        tolerance: f64,
        /// Whether another goal follows, so that the vehicle need not stop.
        goes_on: bool,
    },
}

/// A heading in radians, clockwise as seen from above.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Heading {
    /// Relative to the local X axis.
    Local(f64),
    /// Relative to true north, whatever the current local frame.
    North(f64),
}

/// Why a [`Pilot`] cannot steer or drive.
#[derive(Debug, Clone, PartialEq)]
pub enum Trouble {
    /// The platform reports a fault.
    Fault(String),
    /// The pose is too old to steer by.
    PoseStale(Duration),
    /// Part of the pose is unknown (NaN).
    PoseUnknown,
    /// The pose has changed further than the vehicle can have moved, as text for the operator.
    PoseJumped(String),
}

/// Identifies one goal of a [`Pilot`], to distinguish it from later ones.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Ticket(u64);

/// Drives a platform to its goal.
///
/// Time advances through [`handle_time`](Self::handle_time), which any caller may call at any rate.
/// The control loop runs once per [`STEP`](Self::STEP) of that time.
pub struct Pilot {
    platform: Box<dyn Platform>,
    frame: Frame,
    limits: Limits,
    course: Option<Course>,
    /// The last command to the platform.
    command: Drive,
    tickets: u64,
    steps: u64,
    time: Option<Instant>,
    /// Maximum age of a pose to steer by.
    max_pose_age: Duration,
    /// Compares the poses on the way to a goal.
    jumps: JumpCheck,
    fence: Fence,
    /// The trouble that ended the last goal, until it is taken.
    trouble: Option<Trouble>,
}

impl Pilot {
    /// Period of the control loop.
    pub const STEP: Duration = Duration::from_millis(20);
    /// The longest gap in time that is caught up. A longer gap means that the computer was
    /// suspended.
    pub const LONGEST_GAP: Duration = Duration::from_secs(2);
    /// Default maximum age of a pose to steer by.
    pub const MAX_POSE_AGE: Duration = Duration::from_millis(500);

    /// Creates a pilot without a goal for a platform with this local frame.
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
            jumps: JumpCheck::new(&limits, JumpCheck::RECKONED),
            fence: Fence::default(),
            trouble: None,
        }
    }

    /// Sets the maximum age of a pose to steer by; the default is
    /// [`MAX_POSE_AGE`](Self::MAX_POSE_AGE). It applies to platforms that report [the time of
    /// measurement](Motion::sampled_at).
    #[must_use]
    pub const fn max_pose_age(mut self, age: Duration) -> Self {
        self.max_pose_age = age;
        self
    }

    /// Keeps the vehicle within a fence, whatever its goal.
    #[must_use]
    pub fn with_fence(mut self, fence: Fence) -> Self {
        self.fence = fence;
        self
    }

    /// Advances to time `now`. May be called at any rate.
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

    /// Pursues a goal from now on, in place of any earlier one.
    pub fn pursue(&mut self, goal: Goal) -> Ticket {
        self.tickets += 1;
        let ticket = Ticket(self.tickets);
        let course = self.course.as_ref().filter(|course| !course.has_arrived);
        if !course.is_some_and(|course| course.goal.needs_pose()) {
            // A vehicle that does not drive by its pose may be put anywhere. A repeated goal must not
            // hide a jump.
            self.jumps.forget();
        }
        let course = Course::new(goal, ticket, &self.motion().pose, &self.limits);
        self.course = Some(course);
        ticket
    }

    /// Whether there is a goal that has not been reached.
    #[must_use]
    pub fn is_under_way(&self) -> bool {
        let course = self.course.as_ref();
        course.is_some_and(|course| !course.has_arrived)
    }

    /// Whether the last goal has been reached, whichever caller set it.
    #[must_use]
    pub fn is_there(&self) -> bool {
        let course = self.course.as_ref();
        course.is_some_and(|course| course.has_arrived)
    }

    /// Takes the trouble that ended a goal since the last call: a fault of the platform, or a pose
    /// unknown or too old for a goal that needs one.
    pub const fn take_trouble(&mut self) -> Option<Trouble> {
        self.trouble.take()
    }

    /// Whether the goal is a heading measured from the local X axis, or with `north` from true north.
    pub(crate) fn holds_heading(&self, north: bool) -> bool {
        let course = self.course.as_ref().filter(|course| !course.has_arrived);
        match course.map(|course| course.goal) {
            Some(Goal::Vector { heading, .. }) => {
                matches!(heading, Some(Heading::North(_))) == north
            }
            _ => false,
        }
    }

    /// The fault of the platform, if any.
    #[must_use]
    pub fn fault(&self) -> Option<Trouble> {
        self.platform.fault().map(Trouble::Fault)
    }

    /// Why the pose is unusable for steering at `now`, if it is.
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

    /// Drops the goal, if any, and stops.
    pub fn stop(&mut self) {
        self.course = None;
        self.drive(Drive::Stop);
    }

    /// Drops a goal and stops, unless a later goal has replaced it.
    pub fn give_up(&mut self, ticket: Ticket) {
        if self.pursues(ticket) {
            self.stop();
        }
    }

    /// Whether this is the current goal, reached or not.
    #[must_use]
    pub fn pursues(&self, ticket: Ticket) -> bool {
        self.course
            .as_ref()
            .is_some_and(|course| course.ticket == ticket)
    }

    /// Whether this is the current goal and has been reached.
    #[must_use]
    pub fn has_arrived(&self, ticket: Ticket) -> bool {
        let course = self.course.as_ref();
        course.is_some_and(|course| course.ticket == ticket && course.has_arrived)
    }

    /// Changes the speed of a goal, in metres per second.
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

    /// The platform's pose, velocity and acceleration.
    #[must_use]
    pub fn motion(&self) -> Motion {
        self.platform.motion()
    }

    /// Number of control steps so far. While it is unchanged, nothing has moved.
    #[must_use]
    pub const fn steps(&self) -> u64 {
        self.steps
    }

    /// The platform's pose on the globe.
    #[must_use]
    pub fn global_pose(&self) -> GlobalPose {
        self.frame.to_global(&self.motion().pose)
    }

    /// The local frame.
    #[must_use]
    pub const fn frame(&self) -> &Frame {
        &self.frame
    }

    /// Sets the platform's local pose by moving the local frame. Its global pose is unchanged.
    pub fn set_pose(&mut self, pose: Pose) {
        let pose = Pose {
            yaw: wrap(pose.yaw),
            ..pose
        };
        self.jumps.forget();
        self.frame = Frame::joining(&pose, &self.global_pose());
        self.platform.set_pose(pose);
    }

    /// Sets the platform's global pose by moving the local frame. Its local pose is unchanged.
    pub fn set_global_pose(&mut self, pose: GlobalPose) {
        self.frame = Frame::joining(&self.motion().pose, &pose);
        self.platform.set_global_pose(pose);
    }

    /// Moves the local frame. The platform's local pose is unchanged.
    pub const fn set_frame(&mut self, frame: Frame) {
        self.frame = frame;
    }

    /// The limits in force: those of the platform, or narrower ones.
    #[must_use]
    pub const fn limits(&self) -> &Limits {
        &self.limits
    }

    /// Narrows the limits. The platform's own limits always apply.
    pub fn set_limits(&mut self, limits: Limits) {
        self.limits = limits.and(&self.platform.limits());
        self.platform.set_limits(self.limits);
    }

    /// Restores the platform's own limits.
    pub fn reset_limits(&mut self) {
        self.set_limits(self.platform.limits());
    }

    /// Whether the platform stands still and is commanded to.
    #[must_use]
    pub fn is_at_rest(&self) -> bool {
        self.command == Drive::Stop && self.motion().velocity.is_rest()
    }

    /// When [`handle_time`](Self::handle_time) must be called next.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        if self.is_idle() {
            return None;
        }
        Some(self.time? + Self::STEP)
    }

    /// Whether the platform stands still and has no goal left.
    fn is_idle(&self) -> bool {
        let course = self.course.as_ref();
        // An unknown velocity would otherwise keep the control loop running forever.
        let stands = self.command == Drive::Stop && !self.motion().velocity.is_moving();
        stands && course.is_none_or(|course| course.has_arrived)
    }

    /// One control step. On trouble it stops and drops the goal.
    fn control(&mut self, time: Instant) {
        let course = self.course.as_ref().filter(|course| !course.has_arrived);
        if let Some(course) = course {
            let is_steered = course.goal.needs_pose();
            let trouble = is_steered.then(|| self.pose_trouble(time)).flatten();
            let jump = is_steered.then(|| self.jump()).flatten();
            if let Some(trouble) = self.fault().or(trouble).or(jump) {
                self.trouble = Some(trouble);
                self.course = None;
            }
        }
        let motion = self.motion();
        let pose = motion.pose;
        let limits = self.limits;
        let north = -self.frame.heading;
        let setpoint = match &mut self.course {
            Some(course) => course.command(&pose, north, &limits),
            None => Setpoint::Drive(Drive::Stop),
        };
        match setpoint {
            Setpoint::Drive(command) => {
                let wanted = Bounds::wanted(&command);
                let bounds = self.fence.bounds(time, &motion, &limits, wanted);
                self.drive(bounds.apply(command, motion.velocity.x));
            }
            Setpoint::Head {
                heading,
                speed,
                distance,
            } => {
                let Some(course) = &mut self.course else {
                    return;
                };
                let steering = &mut course.steering;
                let velocity = steering.along(pose.yaw, heading, speed, distance, &limits);
                // Before it drives, the vehicle may turn, or back up.
                let bounds = self.fence.bounds(time, &motion, &limits, velocity.x);
                let speed = bounds.clamp(speed);
                self.command = Drive::Velocity(Velocity::forward(speed, 0.0));
                if !self.platform.head(heading, speed) {
                    let x = bounds.clamp(velocity.x);
                    let velocity = limits.clamp(Velocity { x, ..velocity });
                    self.platform.drive(Drive::Velocity(velocity));
                }
            }
        }
    }

    /// The jump of the pose since the last control step, of a platform that reports when it measured.
    fn jump(&mut self) -> Option<Trouble> {
        let motion = self.motion();
        let at = motion.sampled_at?;
        let (metres, radians) = JumpCheck::RECKONED;
        let error = |rms: Option<f64>| 2.0 * rms.unwrap_or_default();
        let noise = (
            metres + error(motion.position_rms),
            radians + error(motion.attitude_rms),
        );
        self.jumps.set_noise(noise);
        let jump = self.jumps.handle_pose(at, &motion.pose)?;
        Some(Trouble::PoseJumped(jump.to_string()))
    }

    fn drive(&mut self, command: Drive) {
        self.command = match command {
            Drive::Velocity(velocity) => Drive::Velocity(self.limits.clamp(velocity)),
            other => other,
        };
        self.platform.drive(self.command);
    }
}

impl Drop for Pilot {
    /// Stops the platform.
    fn drop(&mut self) {
        self.platform.drive(Drive::Stop);
    }
}
