//! Driving to a goal: from the request until the vehicle has arrived, or why it does not. It does no
//! I/O and reads no clock.

use std::fmt;
use std::time::{Duration, Instant};

use super::drive::Access;
use super::frames::between_local_and_map;
use super::ports::GoalPose;
use crate::interface::shown;

/// A place in the local frame of JAUS.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Goal {
    /// Metres north.
    pub x: f64,
    /// Metres east.
    pub y: f64,
    /// The heading at the goal, in radians clockwise from north.
    pub heading: f64,
}

impl Goal {
    /// The goal of a pose, which has to be in the frame `map`.
    ///
    /// # Errors
    /// The reason why it cannot be one: another frame, a position that is not finite, or no rotation.
    pub fn of(pose: &GoalPose, map: &str) -> Result<Self, String> {
        if pose.frame != map {
            let frame = shown(&pose.frame);
            return Err(format!("its frame_id is `{frame}` and has to be `{map}`"));
        }
        if !pose.position.iter().all(|it| it.is_finite()) {
            return Err("its position is not finite".to_owned());
        }
        let attitude = pose.orientation.attitude();
        let attitude = attitude.ok_or("its orientation is no quaternion of length 1")?;
        let [x, y, _] = between_local_and_map(pose.position);
        Ok(Self {
            x,
            y,
            heading: attitude.yaw,
        })
    }
}

/// A command about the goal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Order {
    /// Drive there.
    Go(Goal),
    /// End it.
    Stop,
}

/// The progress of the last goal.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum Progress {
    /// No goal was set.
    #[default]
    None,
    /// It waits for control of the planner or the waypoint driver.
    Waiting,
    /// The vehicle is under way.
    Underway,
    /// The vehicle is there.
    Arrived,
    /// It was not reached, for this reason.
    Failed(String),
    /// It was cancelled.
    Cancelled,
}

/// The state of a mission as the planner reports it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mission {
    /// Counts the destinations that were set.
    pub number: u32,
    /// How it ended; `None` while it goes on.
    pub end: Option<MissionEnd>,
}

/// The end of a mission.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum MissionEnd {
    /// At the destination.
    Arrived,
    /// Given up or stopped, for this reason.
    Failed(String),
}

/// Driving to one goal at a time.
#[derive(Debug, Default)]
pub struct Navigation {
    phase: Phase,
    progress: Progress,
    access: Option<Access>,
    /// The number of the planner's last mission.
    mission: u32,
    /// The order whose delivery has not ended.
    delivery: Option<Order>,
    /// Whether the vehicle may be under way because of an order.
    may_move: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Default)]
enum Phase {
    #[default]
    None,
    /// Until control is granted, at most until then.
    Waiting { goal: Goal, until: Instant },
    /// Until the vehicle acknowledges it.
    Sending { goal: Goal },
    Underway {
        goal: Goal,
        /// The number of the planner's mission before this one.
        before: u32,
    },
    /// The vehicle finishes, until then.
    Arrived { until: Instant },
    /// The vehicle is being stopped, until then at most. `next` is when to send the stop at the
    /// earliest.
    Stopping { until: Instant, next: Instant },
}

impl Navigation {
    /// How long control may take.
    pub const PATIENCE: Duration = Duration::from_secs(10);
    /// How long control is kept after the arrival, so that the vehicle comes to rest by itself.
    pub const HOLD: Duration = Duration::from_secs(3);
    /// Within this distance a waypoint counts as reached, in metres.
    pub const TOLERANCE: f64 = 0.5;
    /// How long a stop is repeated that is not acknowledged.
    const STOPPING: Duration = Duration::from_secs(3);
    /// Delay before a stop is repeated.
    const PAUSE: Duration = Duration::from_millis(100);

    /// Sets a goal. It replaces the one before.
    pub fn set(&mut self, now: Instant, goal: Goal) {
        let until = now + Self::PATIENCE;
        self.phase = Phase::Waiting { goal, until };
        self.progress = Progress::Waiting;
    }

    /// Cancels the goal, if the vehicle is not there yet.
    pub fn cancel(&mut self, now: Instant) {
        match self.phase {
            Phase::Waiting { .. } if !self.may_move => self.end(Progress::Cancelled),
            Phase::Waiting { .. } | Phase::Sending { .. } | Phase::Underway { .. } => {
                self.stop(now, Progress::Cancelled);
            }
            Phase::None | Phase::Arrived { .. } | Phase::Stopping { .. } => {}
        }
    }

    fn stop(&mut self, now: Instant, progress: Progress) {
        let until = now + Self::STOPPING;
        self.phase = Phase::Stopping { until, next: now };
        self.progress = progress;
    }

    /// Handles a change of access. A goal whose control is lost is not resumed; `why` is for people.
    pub fn handle_access(&mut self, access: Access, why: &str) {
        self.access = Some(access);
        if access != Access::Lost {
            return;
        }
        self.may_move = false;
        match self.phase {
            Phase::None | Phase::Arrived { .. } | Phase::Stopping { .. } => {
                self.phase = Phase::None;
            }
            _ => self.end(Progress::Failed(why.to_owned())),
        }
    }

    /// Handles the end of the control that was wanted.
    pub const fn handle_released(&mut self) {
        self.access = None;
    }

    /// Handles the acknowledgement of an order, or its failure.
    pub fn handle_delivered(&mut self, now: Instant, order: Order, result: Result<(), String>) {
        if self.delivery == Some(order) {
            self.delivery = None;
        }
        match (&mut self.phase, order, result) {
            (Phase::Sending { goal }, Order::Go(sent), Ok(())) if *goal == sent => {
                let (goal, before) = (sent, self.mission);
                self.phase = Phase::Underway { goal, before };
                self.progress = Progress::Underway;
            }
            // It may have arrived all the same.
            (Phase::Sending { goal }, Order::Go(sent), Err(why)) if *goal == sent => {
                self.stop(now, Progress::Failed(why));
            }
            (Phase::Stopping { .. }, Order::Stop, Ok(())) => {
                self.may_move = false;
                self.phase = Phase::None;
            }
            (Phase::Stopping { next, .. }, Order::Stop, Err(_)) => *next = now + Self::PAUSE,
            _ => {}
        }
    }

    /// Handles a report of the planner.
    pub fn handle_mission(&mut self, now: Instant, mission: Mission) {
        if let Phase::Underway { before, .. } = self.phase
            && mission.number != before
            && let Some(end) = mission.end
        {
            match end {
                MissionEnd::Arrived => self.arrive(now),
                MissionEnd::Failed(why) => {
                    self.may_move = false;
                    self.end(Progress::Failed(why));
                }
            }
        }
        // While an order is on its way, the report may already be that of the new mission.
        if !matches!(self.phase, Phase::Sending { .. }) {
            self.mission = mission.number;
        }
    }

    /// Handles the position of a vehicle without a planner, in metres north and east.
    pub fn handle_position(&mut self, now: Instant, x: f64, y: f64) {
        if let Phase::Underway { goal, .. } = self.phase
            && (goal.x - x).hypot(goal.y - y) <= Self::TOLERANCE
        {
            self.arrive(now);
        }
    }

    /// Whether an order is being delivered that the next one replaces: its delivery has to be ended.
    #[must_use]
    pub const fn is_superseded(&self) -> bool {
        let is_current = match (self.delivery, self.phase) {
            (None, _) => true,
            (Some(Order::Go(_)), phase) => matches!(phase, Phase::Sending { .. }),
            (Some(Order::Stop), phase) => matches!(phase, Phase::Stopping { .. }),
        };
        !is_current
    }

    /// The order to deliver now. Each one waits until the delivery of the one before has ended, so that
    /// none overtakes another.
    pub fn poll_order(&mut self, now: Instant) -> Option<Order> {
        self.handle_time(now);
        if self.access != Some(Access::Ready) || self.delivery.is_some() {
            return None;
        }
        self.delivery = match self.phase {
            Phase::Waiting { goal, .. } => {
                self.may_move = true;
                self.phase = Phase::Sending { goal };
                Some(Order::Go(goal))
            }
            Phase::Stopping { next, .. } if now >= next => Some(Order::Stop),
            _ => None,
        };
        self.delivery
    }

    /// Applies the timeouts.
    pub fn handle_time(&mut self, now: Instant) {
        match self.phase {
            Phase::Waiting { until, .. } if now >= until => {
                let waited = Self::PATIENCE.as_secs();
                self.end(Progress::Failed(format!("no control within {waited} s")));
            }
            Phase::Arrived { until } | Phase::Stopping { until, .. } if now >= until => {
                self.phase = Phase::None;
            }
            _ => {}
        }
    }

    fn arrive(&mut self, now: Instant) {
        self.may_move = false;
        let until = now + Self::HOLD;
        self.phase = Phase::Arrived { until };
        self.progress = Progress::Arrived;
    }

    fn end(&mut self, progress: Progress) {
        self.phase = Phase::None;
        self.progress = progress;
    }

    /// Whether control of the planner or the waypoint driver is wanted.
    #[must_use]
    pub const fn wants_control(&self) -> bool {
        !matches!(self.phase, Phase::None)
    }

    /// The progress of the last goal.
    #[must_use]
    pub const fn progress(&self) -> &Progress {
        &self.progress
    }
}

impl fmt::Display for Order {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Go(_) => "the goal",
            Self::Stop => "the stop on the way to a goal",
        })
    }
}

impl fmt::Display for Progress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::None => f.write_str("none"),
            Self::Waiting => f.write_str("waiting for control"),
            Self::Underway => f.write_str("under way"),
            Self::Arrived => f.write_str("arrived"),
            Self::Failed(why) => write!(f, "failed: {why}"),
            Self::Cancelled => f.write_str("cancelled"),
        }
    }
}

#[cfg(test)]
#[expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, PI};

    use proptest::array::{uniform3, uniform4};
    use proptest::num;
    use proptest::prelude::*;

    use super::super::frames::Quaternion;
    use super::*;

    const GOAL: Goal = Goal {
        x: 10.0,
        y: -5.0,
        heading: 0.0,
    };

    fn going(number: u32) -> Mission {
        Mission { number, end: None }
    }

    fn over(number: u32, end: MissionEnd) -> Mission {
        Mission {
            number,
            end: Some(end),
        }
    }

    /// Under way to the goal; the planner has had three missions before.
    fn underway(now: Instant) -> Navigation {
        let mut navigation = Navigation::default();
        navigation.handle_mission(now, over(3, MissionEnd::Arrived));
        navigation.set(now, GOAL);
        assert!(navigation.wants_control());
        assert_eq!(navigation.poll_order(now), None, "no control yet");
        navigation.handle_access(Access::Ready, "");
        assert_eq!(navigation.poll_order(now), Some(Order::Go(GOAL)));
        assert_eq!(navigation.poll_order(now), None, "it is on its way");
        navigation.handle_delivered(now, Order::Go(GOAL), Ok(()));
        navigation
    }

    #[test]
    fn the_end_of_an_earlier_mission_does_not_end_this_one() {
        let now = Instant::now();
        let mut navigation = underway(now);
        navigation.handle_mission(now, over(3, MissionEnd::Arrived));
        assert_eq!(*navigation.progress(), Progress::Underway);
        navigation.handle_mission(now, going(4));
        navigation.handle_mission(now, over(4, MissionEnd::Arrived));
        assert_eq!(*navigation.progress(), Progress::Arrived);
    }

    #[test]
    fn a_mission_that_is_reported_before_its_acknowledgement_is_this_one() {
        let now = Instant::now();
        let mut navigation = Navigation::default();
        navigation.set(now, GOAL);
        navigation.handle_access(Access::Ready, "");
        assert!(navigation.poll_order(now).is_some());
        navigation.handle_mission(now, going(1));
        navigation.handle_delivered(now, Order::Go(GOAL), Ok(()));
        let failed = MissionEnd::Failed("there is no path".to_owned());
        navigation.handle_mission(now, over(1, failed));
        let why = Progress::Failed("there is no path".to_owned());
        assert_eq!(*navigation.progress(), why);
        assert!(!navigation.wants_control());
    }

    #[test]
    fn control_is_kept_for_a_moment_after_the_arrival() {
        let now = Instant::now();
        let mut navigation = underway(now);
        navigation.handle_position(now, 10.0, -4.4);
        assert_eq!(*navigation.progress(), Progress::Underway);
        navigation.handle_position(now, 10.0, -4.6);
        assert_eq!(*navigation.progress(), Progress::Arrived);
        assert!(navigation.wants_control());
        navigation.handle_time(now + Navigation::HOLD);
        assert!(!navigation.wants_control());
    }

    #[test]
    fn a_goal_without_control_fails_after_ten_seconds_and_is_never_sent_later() {
        let now = Instant::now();
        let mut navigation = Navigation::default();
        navigation.set(now, GOAL);
        let late = now + Navigation::PATIENCE;
        assert_eq!(navigation.poll_order(late), None);
        navigation.handle_access(Access::Ready, "");
        assert_eq!(navigation.poll_order(late), None);
        assert!(matches!(navigation.progress(), Progress::Failed(_)));
    }

    #[test]
    fn a_loss_of_control_ends_the_goal_with_its_reason() {
        let now = Instant::now();
        let mut navigation = underway(now);
        navigation.handle_access(Access::Lost, "60.1.1 is in control of it");
        let why = Progress::Failed("60.1.1 is in control of it".to_owned());
        assert_eq!(*navigation.progress(), why);
        assert!(!navigation.wants_control());
    }

    #[test]
    fn a_cancelled_goal_is_stopped_before_control_is_released() {
        let now = Instant::now();
        let mut navigation = underway(now);
        navigation.cancel(now);
        assert!(navigation.wants_control());
        assert_eq!(navigation.poll_order(now), Some(Order::Stop));
        assert_eq!(navigation.poll_order(now), None);
        navigation.handle_delivered(now, Order::Stop, Ok(()));
        assert!(!navigation.wants_control());
        assert_eq!(*navigation.progress(), Progress::Cancelled);
    }

    #[test]
    fn a_new_goal_replaces_the_one_that_is_under_way() {
        let now = Instant::now();
        let mut navigation = underway(now);
        navigation.handle_mission(now, going(4));
        let other = Goal { x: 0.0, ..GOAL };
        navigation.set(now, other);
        assert_eq!(navigation.poll_order(now), Some(Order::Go(other)));
        navigation.handle_delivered(now, Order::Go(other), Ok(()));
        let stopped = MissionEnd::Failed("replaced".to_owned());
        navigation.handle_mission(now, over(4, stopped));
        assert_eq!(*navigation.progress(), Progress::Underway);
    }

    #[test]
    fn a_stop_or_another_goal_waits_until_the_delivery_of_the_goal_has_ended() {
        let now = Instant::now();
        let other = Goal { x: 0.0, ..GOAL };
        for replacement in [None, Some(other)] {
            let mut navigation = Navigation::default();
            navigation.set(now, GOAL);
            navigation.handle_access(Access::Ready, "");
            assert_eq!(navigation.poll_order(now), Some(Order::Go(GOAL)));
            assert!(!navigation.is_superseded());
            match replacement {
                None => navigation.cancel(now),
                Some(goal) => navigation.set(now, goal),
            }
            assert!(navigation.is_superseded());
            assert_eq!(navigation.poll_order(now), None, "the first is on its way");
            navigation.handle_delivered(now, Order::Go(GOAL), Err("replaced".to_owned()));
            assert!(!navigation.is_superseded());
            let next = replacement.map_or(Order::Stop, Order::Go);
            assert_eq!(navigation.poll_order(now), Some(next));
        }
    }

    #[test]
    fn a_goal_that_waits_to_replace_another_one_is_cancelled_with_a_stop() {
        let now = Instant::now();
        let mut navigation = underway(now);
        navigation.set(now, Goal { x: 0.0, ..GOAL });
        navigation.cancel(now);
        assert_eq!(navigation.poll_order(now), Some(Order::Stop));
    }

    #[test]
    fn a_stop_that_is_not_acknowledged_is_repeated_for_three_seconds() {
        let now = Instant::now();
        let mut navigation = underway(now);
        navigation.cancel(now);
        let mut at = now;
        let mut stops = 0;
        while navigation.wants_control() {
            if navigation.poll_order(at) == Some(Order::Stop) {
                stops += 1;
                navigation.handle_delivered(at, Order::Stop, Err("no answer".to_owned()));
            }
            at += Duration::from_millis(50);
        }
        assert_eq!(stops, 30);
        assert!(at >= now + Navigation::STOPPING);
    }

    #[test]
    fn a_goal_that_was_not_acknowledged_is_stopped_because_it_may_have_arrived() {
        let now = Instant::now();
        let mut navigation = Navigation::default();
        navigation.set(now, GOAL);
        navigation.handle_access(Access::Ready, "");
        assert!(navigation.poll_order(now).is_some());
        navigation.handle_delivered(now, Order::Go(GOAL), Err("no answer".to_owned()));
        assert_eq!(navigation.poll_order(now), Some(Order::Stop));
        let why = Progress::Failed("no answer".to_owned());
        assert_eq!(*navigation.progress(), why);
    }

    const EAST: Quaternion = Quaternion {
        x: 0.0,
        y: 0.0,
        z: 0.0,
        w: 1.0,
    };

    #[test]
    fn the_goal_of_a_pose_is_north_and_east_and_its_frame_is_compared() {
        let mut pose = GoalPose {
            frame: "map".to_owned(),
            position: [2.0, 1.0, 0.5],
            orientation: EAST,
        };
        let goal = Goal::of(&pose, "map").unwrap();
        assert_eq!((goal.x, goal.y, goal.heading), (1.0, 2.0, FRAC_PI_2));
        pose.frame = "odom".to_owned();
        let why = Goal::of(&pose, "map").unwrap_err();
        assert_eq!(why, "its frame_id is `odom` and has to be `map`");
    }

    proptest! {
        #[test]
        fn any_pose_is_a_goal_or_refused_for_a_reason_that_a_log_can_show(
            frame in prop_oneof![Just("map".to_owned()), any::<String>()],
            repeated in 0..200_usize,
            position in uniform3(num::f64::ANY),
            orientation in prop_oneof![
                Just(EAST),
                uniform4(num::f64::ANY).prop_map(|[x, y, z, w]| Quaternion { x, y, z, w }),
            ],
        ) {
            let frame = if frame == "map" { frame } else { frame.repeat(repeated) };
            let pose = GoalPose { frame, position, orientation };
            match Goal::of(&pose, "map") {
                Ok(goal) => {
                    prop_assert!(goal.x.is_finite() && goal.y.is_finite(), "{goal:?}");
                    prop_assert!((-PI..PI).contains(&goal.heading), "{goal:?}");
                }
                Err(why) => {
                    prop_assert!(why.len() < 500, "{why}");
                    prop_assert!(!why.contains(char::is_control), "{why:?}");
                }
            }
        }
    }
}
