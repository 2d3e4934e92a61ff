//! State shared by all services of a vehicle: pilot, motion guard, clock, list, and the current
//! journey.
//!
//! A component has one instance, whichever of its drivers receives a message.

use std::time::{Duration, Instant};

use super::clock::SampleClock;
use super::place::Place;
use crate::motion::{GlobalPose, Jump, JumpCheck, Pilot, Pose, Ticket, Trouble};
use jaus::messages::core::set_element::ElementRec;
use jaus::messages::mobility::{
    QueryActiveElement, QueryGlobalPathSegment, QueryGlobalPathSegmentExt, QueryGlobalWaypoint,
    QueryGlobalWaypointExt, QueryLocalPathSegment, QueryLocalPathSegmentExt, QueryLocalWaypoint,
    QueryLocalWaypointExt, QueryTravelSpeed, QueryTravelSpeedExt,
};
use jaus::service::{Context, Elements, MotionGuard, State, StopCause};

/// A journey to a place or along a list of places.
#[derive(Debug, Default)]
pub(super) struct Travel {
    /// The requested speed in metres per second. The pilot limits it to what the vehicle can do.
    speed: f64,
    place: Option<Place>,
    /// Start of the path to the place, in the local frame.
    start: (f64, f64),
    /// The list element being driven to, if a list is being executed.
    active: Option<u16>,
    /// The element after it, 0 for the last.
    next: u16,
    ticket: Option<Ticket>,
    /// Code of the command that the journey executes, until its completion is reported.
    command: Option<u16>,
}

impl Travel {
    /// The list element being driven to, if a list is being executed.
    pub(super) const fn active(&self) -> Option<u16> {
        self.active
    }

    /// The requested speed in metres per second.
    pub(super) const fn speed(&self) -> f64 {
        self.speed
    }

    /// Whether there is a place to drive to.
    pub(super) const fn has_place(&self) -> bool {
        self.place.is_some()
    }
}

/// A limit below this lets nothing move, in metres or radians per second.
const LEAST_MOTION: f64 = 0.01;
/// Interval between checks while a fault persists.
const LOOK: Duration = Duration::from_millis(100);

/// State shared by the services of a vehicle: pilot, motion guard, list.
pub(super) struct Controls {
    pub(super) pilot: Pilot,
    pub(super) guard: MotionGuard,
    /// Number of stops, so that each service notices a stop.
    pub(super) stops: u64,
    /// The fault that prevents driving, until it clears.
    trouble: Option<StopCause>,
    looked: Option<Instant>,
    /// Whether the command in force moves nothing because of a limit.
    is_held: bool,
    /// The list that the list drivers execute.
    pub(super) elements: Elements,
    pub(super) travel: Travel,
    pub(super) clock: Option<SampleClock>,
    /// Magnetic variation from true north in radians, once set.
    pub(super) magnetic_variation: f64,
}

impl Controls {
    /// Creates the state without a driver and without a clock.
    pub(super) fn new(pilot: Pilot) -> Self {
        Self {
            pilot,
            guard: MotionGuard::default(),
            stops: 0,
            trouble: None,
            looked: None,
            is_held: false,
            elements: Elements::new(),
            travel: Travel::default(),
            clock: None,
            magnetic_variation: 0.0,
        }
    }

    /// Advances to `now`. Stops if the setpoint in force expires or a fault occurs.
    pub(super) fn advance(&mut self, now: Instant, context: &mut Context<'_>) {
        self.guard.note_life(|owner| context.last_sign(owner));
        self.advance_within(now);
        if let Some(cause) = self.guard.expire(now) {
            self.halt(&cause);
        }
        self.pilot.handle_time(now);
        self.looked = Some(now);
        if self.pilot.is_there() && self.travel.active.is_none() {
            self.guard.finish();
        }
        self.follow_trouble(now, context);
        let held = self.held();
        if let Some(why) = held.as_ref().filter(|_| !self.is_held) {
            tracing::warn!("the vehicle does not move: {why}");
        }
        self.is_held = held.is_some();
    }

    /// Advances to `now`, but not beyond the expiry of the setpoint in force.
    pub(super) fn advance_within(&mut self, now: Instant) {
        let end = self.guard.expires_at().unwrap_or(now);
        self.pilot.handle_time(now.min(end));
    }

    /// Stops the vehicle. All stops go through here.
    pub(super) fn halt(&mut self, cause: &StopCause) {
        if self.guard.is_active() || self.pilot.is_under_way() {
            self.stops += 1;
        }
        self.guard.stop(cause.clone());
        self.pilot.stop();
    }

    /// Puts the component into failure on a fault, until the fault clears.
    fn follow_trouble(&mut self, now: Instant, context: &mut Context<'_>) {
        let trouble = self.pilot.take_trouble().or_else(|| self.pilot.fault());
        if let Some(cause) = trouble.map(StopCause::from) {
            if self.trouble.is_none() {
                self.halt(&cause);
                context.fail(cause.clone());
                self.trouble = Some(cause);
            }
        } else if let Some(cause) = &self.trouble {
            let is_gone = match cause {
                StopCause::Fault(_) => true,
                _ => self.pilot.pose_trouble(now).is_none(),
            };
            if is_gone {
                self.trouble = None;
                context.recover();
            }
        }
    }

    /// Sets the pose in the local frame. A vehicle that drives by it stops, unless the change is
    /// small.
    pub(super) fn set_pose(&mut self, pose: Pose) {
        let before = self.pilot.motion().pose;
        self.stop_after(Jump::between(&before, &pose, JumpCheck::RECKONED), false);
        self.pilot.set_pose(pose);
        self.handle_new_frame();
    }

    /// Sets the pose on the globe. A vehicle that drives by it stops, unless the change is small.
    pub(super) fn set_global_pose(&mut self, pose: GlobalPose) {
        let local = |pose: &GlobalPose| self.pilot.frame().to_local(pose);
        let (before, after) = (local(&self.pilot.global_pose()), local(&pose));
        self.stop_after(Jump::between(&before, &after, JumpCheck::RECKONED), true);
        self.pilot.set_global_pose(pose);
        self.handle_new_frame();
    }

    /// Stops after a jump of the pose in the local frame, or with `on_globe` of the one on the globe,
    /// if the goal is in that frame.
    fn stop_after(&mut self, jump: Option<Jump>, on_globe: bool) {
        let is_place_on_globe = matches!(
            self.travel.place,
            Some(Place::Global(_) | Place::GlobalPath(_))
        );
        let is_steered = match self.is_travelling() && self.pilot.is_under_way() {
            true => is_place_on_globe == on_globe,
            false => self.pilot.holds_heading(on_globe),
        };
        if let Some(jump) = jump.filter(|_| is_steered) {
            tracing::warn!("stopped: {jump}");
            self.halt(&StopCause::Fault(jump.to_string()));
        }
    }

    /// Why a command in force moves nothing, if a limit that the client in control has set is the
    /// reason.
    pub(super) fn held(&self) -> Option<String> {
        let limits = self.pilot.limits();
        let still = |limit: f64| limit < LEAST_MOTION;
        let is_held = still(limits.speed) && still(limits.reverse) && still(limits.yaw_rate);
        let what = match (still(limits.speed), still(limits.reverse)) {
            _ if is_held => "any motion",
            (true, _) => "the speed forward",
            (_, true) => "the speed in reverse",
            _ if still(limits.yaw_rate) => "the yaw rate",
            _ => return None,
        };
        self.pilot.is_under_way().then(|| {
            format!("{what} is limited to 0 by Set Velocity Command: set a higher limit, or Reset")
        })
    }

    /// Whether a fault prevents driving.
    pub(super) const fn is_in_trouble(&self) -> bool {
        self.trouble.is_some()
    }

    /// When to check again whether the fault has cleared.
    pub(super) fn next_look(&self) -> Option<Instant> {
        self.looked
            .filter(|_| self.trouble.is_some())
            .map(|at| at + LOOK)
    }

    /// Whether the vehicle is driving to a place.
    pub(super) fn is_travelling(&self) -> bool {
        let ticket = self.travel.ticket;
        ticket.is_some_and(|ticket| self.pilot.pursues(ticket))
    }

    /// Number of list elements before the current one, in percent of all.
    pub(super) fn progress(&self) -> u8 {
        let Some(active) = self.travel.active else {
            return 0;
        };
        let (before, all) = self.elements.place_of(active);
        u8::try_from(100 * before / all.max(1)).unwrap_or(100)
    }

    /// The place set last, or the first one of the list.
    pub(super) fn place(&self) -> Option<Place> {
        let first = || Place::of(&self.elements.get(0)?);
        self.travel.place.or_else(first)
    }

    /// Whether a place is within reach.
    pub(super) fn can_reach(&self, place: &Place) -> bool {
        place
            .goal(self.pilot.frame(), (0.0, 0.0), 0.0, false)
            .is_some()
    }

    /// Sets the place to drive to on behalf of the command `command`. Starts if `acts` is set and
    /// the speed is positive.
    pub(super) fn set_place(
        &mut self,
        place: Place,
        command: u16,
        acts: bool,
        context: &mut Context<'_>,
    ) {
        self.take_up(command, context);
        self.travel.place = Some(place);
        self.travel.start = self.here();
        self.travel.active = None;
        self.travel.next = 0;
        self.set_out(acts);
    }

    /// Assigns the journey to another command.
    pub(super) fn take_up(&mut self, command: u16, context: &mut Context<'_>) {
        let before = self.travel.command.replace(command);
        // A repeated command with the same code replaces its predecessor implicitly.
        if let Some(before) = before.filter(|&before| before != command) {
            context.ended(before, false);
        }
    }

    /// Reports the completion of the command that the journey executes.
    fn finish(&mut self, successful: bool, context: &mut Context<'_>) {
        if let Some(command) = self.travel.command.take() {
            context.ended(command, successful);
        }
    }

    /// Changes the speed. If `acts` is set, starts or stops accordingly.
    pub(super) fn set_speed(&mut self, speed: f64, acts: bool) {
        self.travel.speed = speed;
        match self.travel.ticket.filter(|_| speed > 0.0) {
            Some(ticket) if self.pilot.pursues(ticket) => self.pilot.set_speed(ticket, speed),
            _ => self.set_out(acts),
        }
    }

    /// Executes the list from an element; 0 stands for the first. Returns whether the element
    /// exists.
    pub(super) fn execute(&mut self, uid: u16, speed: f64, acts: bool) -> bool {
        let Some(element) = self.elements.get(uid) else {
            return false;
        };
        self.travel.start = self.here();
        self.begin(&element, speed, acts);
        true
    }

    /// Drives to an element of the list.
    fn begin(&mut self, element: &ElementRec, speed: f64, acts: bool) {
        self.travel.place = Place::of(element);
        self.travel.active = Some(element.element_uid);
        self.travel.next = element.next_uid;
        self.travel.speed = speed;
        self.set_out(acts);
    }

    /// The vehicle's position in the local frame.
    fn here(&self) -> (f64, f64) {
        let pose = self.pilot.motion().pose;
        (pose.x, pose.y)
    }

    /// Drives to the place if `acts` is set and the speed is positive. Stops otherwise.
    fn set_out(&mut self, acts: bool) {
        let Travel {
            speed, next, start, ..
        } = self.travel;
        let place = self.travel.place.filter(|_| acts && speed > 0.0);
        let goal = place.and_then(|place| place.goal(self.pilot.frame(), start, speed, next != 0));
        if let Some(goal) = goal {
            self.travel.ticket = Some(self.pilot.pursue(goal));
            return;
        }
        if place.is_some() {
            tracing::warn!(?place, "waypoint rejected: out of reach");
            self.travel.active = None;
        }
        if let Some(ticket) = self.travel.ticket.take() {
            self.pilot.give_up(ticket);
        }
    }

    /// Handles a moved local frame: places on the globe have new local coordinates.
    pub(super) fn handle_new_frame(&mut self) {
        let on_globe = matches!(
            self.travel.place,
            Some(Place::Global(_) | Place::GlobalPath(_))
        );
        let is_under_way = |ticket| self.pilot.pursues(ticket) && !self.pilot.has_arrived(ticket);
        if on_globe && self.travel.ticket.is_some_and(is_under_way) {
            self.travel.start = self.here();
            self.set_out(true);
        }
    }

    /// Continues with the next element of the list when one has been reached.
    pub(super) fn work_off(&mut self, context: &mut Context<'_>) {
        let Some(ticket) = self.travel.ticket else {
            return;
        };
        if !self.pilot.pursues(ticket) {
            // Another driver has replaced the goal.
            self.abandon(context);
            return;
        }
        let Some(active) = self.travel.active else {
            if self.pilot.has_arrived(ticket) {
                self.finish(true, context);
            }
            return;
        };
        // The list may have changed in the meantime.
        let Some(element) = self.elements.get(active) else {
            tracing::warn!(active, "the active element was deleted");
            self.pilot.give_up(ticket);
            self.abandon(context);
            return;
        };
        let place = Place::of(&element);
        if self.travel.next != element.next_uid || self.travel.place != place {
            self.travel.next = element.next_uid;
            self.travel.place = place;
            self.set_out(true);
        } else if self.pilot.has_arrived(ticket) {
            tracing::info!(element = active, next = element.next_uid, "element reached");
            // The next path starts where this one should have ended.
            if let Some(place) = self.travel.place {
                let end = place.waypoint(self.pilot.frame());
                self.travel.start = (end.x, end.y);
            }
            let next = self.elements.get(element.next_uid);
            match next.filter(|_| element.next_uid != 0) {
                Some(next) => self.begin(&next, self.travel.speed, true),
                None => {
                    self.travel.active = None;
                    self.finish(true, context);
                }
            }
            changed(context);
        }
    }

    /// Abandons the journey but keeps the place.
    pub(super) fn abandon(&mut self, context: &mut Context<'_>) {
        if let Some(ticket) = self.travel.ticket {
            self.pilot.give_up(ticket);
        }
        self.finish(false, context);
        let place = self.travel.place;
        let is_reset = context.standing().state == State::Initialize;
        self.travel = Travel {
            place: place.filter(|_| !is_reset),
            ..Travel::default()
        };
        changed(context);
    }
}

/// Announces that every report about a journey may have changed.
pub(super) fn changed(context: &mut Context<'_>) {
    context.changed::<QueryTravelSpeed>();
    context.changed::<QueryTravelSpeedExt>();
    context.changed::<QueryActiveElement>();
    context.changed::<QueryLocalWaypoint>();
    context.changed::<QueryLocalWaypointExt>();
    context.changed::<QueryGlobalWaypoint>();
    context.changed::<QueryGlobalWaypointExt>();
    context.changed::<QueryLocalPathSegment>();
    context.changed::<QueryLocalPathSegmentExt>();
    context.changed::<QueryGlobalPathSegment>();
    context.changed::<QueryGlobalPathSegmentExt>();
}

impl From<Trouble> for StopCause {
    fn from(trouble: Trouble) -> Self {
        match trouble {
            Trouble::Fault(what) | Trouble::PoseJumped(what) => Self::Fault(what),
            Trouble::PoseStale(age) => Self::PoseStale(age),
            Trouble::PoseUnknown => Self::PoseUnknown,
        }
    }
}
