//! The platform of a driver that commands another driver: sensors report its motion, and its
//! commands become orders for the next driver.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use super::FaultMonitor;
use crate::motion::{
    CommandDeadline, Drive, JumpCheck, Limits, Motion, Platform, Pose, Velocity, wrap,
};
use crate::sensing::Scan;
use crate::zones::Point;
use jaus::service::{SampleAge, SampleStamp};

/// Motion and orders of a driver. Cheap to clone; all clones share one state.
#[derive(Debug, Clone)]
pub(in crate::parts) struct RemotePlatform(Arc<Mutex<State>>);

#[derive(Debug)]
struct State {
    settings: RemotePlatformSettings,
    limits: Limits,
    motion: Motion,
    pose: SampleAge,
    jumps: JumpCheck,
    /// Why no pose counts before a time.
    distrust: Option<(Instant, String)>,
    velocity: SampleAge,
    /// The scans of the range sensor.
    scan: SampleAge,
    /// The last scan, and the pose when it was first reported.
    last_scan: Option<(Scan, Pose)>,
    /// Whether the vehicle must not move without scans.
    needs_scan: bool,
    order: Option<Order>,
    /// Deadline since the pilot's last control step.
    deadline: CommandDeadline,
}

/// Settings of a remote platform.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::parts) struct RemotePlatformSettings {
    /// Limits of the vehicle.
    pub(in crate::parts) limits: Limits,
    /// Errors of the pose that are no jump, in metres and radians.
    pub(in crate::parts) noise: (f64, f64),
    /// Maximum age of sensor samples. The vehicle stops when they are older.
    pub(in crate::parts) stale: Duration,
    /// Whether the next driver holds headings. Otherwise it needs velocity commands, which require
    /// velocity measurements.
    pub(in crate::parts) by_heading: bool,
    /// Whether it needs a range sensor from the start. Otherwise it needs one from its first scan on.
    pub(in crate::parts) needs_scan: bool,
}

/// An order to the next driver.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::parts) enum Order {
    /// Move with this velocity.
    Velocity(Velocity),
    /// Hold a heading in radians, from -π to π, and a speed in metres per second.
    Heading { heading: f64, speed: f64 },
}

/// The action possible now.
#[derive(Debug, Clone, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "one at a time, used up at once")]
pub(in crate::parts) enum Plan {
    /// There is no order.
    Rest,
    /// Carry out the order. The vehicle's motion is attached.
    Go(Order, Motion),
    /// The order must wait.
    Wait(Lack),
}

/// Why an order must wait.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(in crate::parts) struct Lack {
    /// The reason, as text for the operator.
    pub(in crate::parts) why: String,
    /// How long the vehicle has certainly been without what it needs.
    pub(in crate::parts) lasts: Duration,
}

impl RemotePlatform {
    /// No pose counts for this time after a jump: a vehicle under way then comes to a stop and the
    /// driver fails.
    pub(in crate::parts) const DISTRUST: Duration =
        FaultMonitor::LIMIT.saturating_add(Duration::from_secs(1));
    /// Time from the measurement of a scan to its report in seconds, at a scan rate of 10 Hz.
    const SCAN_LAG: f64 = 0.1;

    pub(in crate::parts) fn new(settings: RemotePlatformSettings) -> Self {
        Self(Arc::new(Mutex::new(State {
            settings,
            limits: settings.limits,
            motion: Motion::default(),
            pose: SampleAge::default(),
            jumps: JumpCheck::new(&settings.limits, settings.noise),
            distrust: None,
            velocity: SampleAge::default(),
            scan: SampleAge::default(),
            last_scan: None,
            needs_scan: settings.needs_scan,
            order: None,
            deadline: CommandDeadline::default(),
        })))
    }

    /// Handles a sensor report of a pose: X, Y and yaw, sampled at `stamp` of the sensor's clock.
    /// Without a pose the sensor does not know the position, and the vehicle stops immediately.
    ///
    /// A pose that jumps is an error of the old one or of the new one, and nobody knows which. A
    /// vehicle under way therefore has no pose for [`DISTRUST`](Self::DISTRUST). Then the new one
    /// counts.
    pub(in crate::parts) fn handle_pose(
        &self,
        now: Instant,
        stamp: Option<SampleStamp>,
        pose: Option<(f64, f64, f64)>,
    ) {
        let mut state = self.lock();
        match pose {
            None => state.pose.forget(),
            Some((x, y, yaw)) => {
                let pose = Pose {
                    yaw,
                    ..Pose::at(x, y)
                };
                state.accept_pose(now, stamp, pose);
            }
        }
    }

    /// Like [`handle_pose`](Self::handle_pose), for a velocity: forward speed and yaw rate.
    pub(in crate::parts) fn handle_velocity(
        &self,
        now: Instant,
        stamp: Option<SampleStamp>,
        velocity: Option<(f64, f64)>,
    ) {
        let mut state = self.lock();
        match velocity {
            None => state.velocity.forget(),
            Some((x, yaw)) => {
                state.velocity.handle(now, stamp);
                state.motion.velocity = Velocity::forward(x, yaw);
            }
        }
    }

    /// Handles a scan of the range sensor, sampled at `stamp`; `None` if the sensor does not measure.
    /// Returns the places of the obstacles in the local frame; `None` if it says nothing new, so that
    /// the places seen before remain.
    pub(in crate::parts) fn handle_scan(
        &self,
        now: Instant,
        stamp: Option<SampleStamp>,
        scan: Option<&Scan>,
    ) -> Option<Vec<Point>> {
        let mut state = self.lock();
        let Some(scan) = scan else {
            state.scan.forget();
            return None;
        };
        state.needs_scan = true;
        if state.has_frozen(scan) {
            return None;
        }
        state.scan.handle(now, stamp)?;
        let Motion { pose, velocity, .. } = state.motion;
        let (way, turn) = (velocity.x * Self::SCAN_LAG, velocity.yaw * Self::SCAN_LAG);
        let measured_at = Pose {
            x: pose.x - way * pose.yaw.cos(),
            y: pose.y - way * pose.yaw.sin(),
            yaw: pose.yaw - turn,
            ..pose
        };
        Some(scan.hits(measured_at).collect())
    }

    /// The action to take now.
    pub(in crate::parts) fn plan(&self, now: Instant) -> Plan {
        let mut state = self.lock();
        let Some(order) = state.order else {
            return Plan::Rest;
        };
        if state.deadline.has_passed(now) {
            return Plan::Wait(Lack::now(
                "the driver's control loop is not running".to_owned(),
            ));
        }
        match state.lack(now) {
            Some(lack) => Plan::Wait(lack),
            None => Plan::Go(order, state.motion),
        }
    }

    /// The sensor whose samples are missing or too old, if any.
    pub(in crate::parts) fn lack(&self, now: Instant) -> Option<Lack> {
        self.lock().lack(now)
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Lack {
    /// A lack that has just begun.
    const fn now(why: String) -> Self {
        Self {
            why,
            lasts: Duration::ZERO,
        }
    }
}

impl State {
    /// Distance in metres, and turn in radians, after which a sensor that measures something cannot
    /// report the same scan again, whatever its time stamp.
    const CHANGES: f64 = 0.05;
    /// From this number of obstacles on, the noise of a working sensor changes at least one.
    const HITS: usize = 3;

    /// Whether the vehicle has moved while the sensor kept reporting the same obstacles.
    fn has_frozen(&mut self, scan: &Scan) -> bool {
        let pose = self.motion.pose;
        match &self.last_scan {
            Some((last, at)) if last == scan => {
                let turn = wrap(pose.yaw - at.yaw).abs();
                let has_moved = pose.distance(at.x, at.y).max(turn) > Self::CHANGES;
                has_moved && scan.hits(pose).count() >= Self::HITS
            }
            _ => {
                self.last_scan = Some((scan.clone(), pose));
                false
            }
        }
    }

    /// Takes a pose, unless it does not count after a jump.
    fn accept_pose(&mut self, now: Instant, stamp: Option<SampleStamp>, pose: Pose) {
        let sampled_at = self.pose.handle(now, stamp);
        let jump = self.jumps.handle_pose(sampled_at.unwrap_or(now), &pose);
        if let Some(jump) = jump.filter(|_| self.order.is_some() && self.distrust.is_none()) {
            tracing::error!("{jump}: it does not count for now");
            self.distrust = Some((now + RemotePlatform::DISTRUST, jump.to_string()));
        }
        if self.distrust.as_ref().is_some_and(|(end, _)| now < *end) {
            self.pose.forget();
            return;
        }
        self.distrust = None;
        self.motion.pose = pose;
    }

    fn lack(&self, now: Instant) -> Option<Lack> {
        if let Some((_, why)) = self.distrust.as_ref().filter(|(end, _)| now < *end) {
            return Some(Lack {
                why: why.clone(),
                lasts: Duration::MAX,
            });
        }
        let needs = [
            (&self.pose, "pose", true),
            (&self.velocity, "velocity", !self.settings.by_heading),
            (&self.scan, "range sensor's scan", self.needs_scan),
        ];
        let mut needs = needs.into_iter().filter(|&(_, _, needed)| needed);
        needs.find_map(|(sensor, what, _)| match sensor.age(now) {
            None => Some(Lack::now(format!("no {what} is known"))),
            Some(age) if age > self.settings.stale => Some(Lack {
                why: format!("the {what} is {:.1} s old", age.as_secs_f64()),
                lasts: age,
            }),
            Some(_) => None,
        })
    }
}

impl Platform for RemotePlatform {
    /// An order holds as long as the pilot keeps controlling this platform.
    fn handle_time(&mut self, now: Instant) {
        self.lock().deadline.restart(Some(now));
    }

    fn motion(&self) -> Motion {
        self.lock().motion
    }

    fn set_pose(&mut self, _: Pose) {
        // The sensor determines the pose.
    }

    fn drive(&mut self, command: Drive) {
        let mut state = self.lock();
        let by_heading = state.settings.by_heading;
        let heading = state.motion.pose.yaw;
        state.order = match command.or_stop() {
            Drive::Velocity(velocity) if by_heading => Some(Order::Heading {
                heading,
                speed: velocity.x.max(0.0),
            }),
            Drive::Velocity(velocity) => Some(Order::Velocity(velocity)),
            // Only the primitive driver accepts efforts.
            Drive::Stop | Drive::Effort(_) => None,
        };
    }

    fn head(&mut self, heading: f64, speed: f64) -> bool {
        let mut state = self.lock();
        if !state.settings.by_heading {
            return false;
        }
        let is_known = heading.is_finite() && speed.is_finite();
        state.order = is_known.then(|| Order::Heading {
            heading: wrap(heading),
            speed: speed.clamp(0.0, state.limits.speed),
        });
        true
    }

    fn limits(&self) -> Limits {
        self.lock().settings.limits
    }

    fn set_limits(&mut self, limits: Limits) {
        let mut state = self.lock();
        state.limits = limits.and(&state.settings.limits);
    }
}

#[cfg(test)]
#[expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]
mod tests {
    use super::*;
    use crate::sensing::Ray;

    fn remote_platform(by_heading: bool) -> RemotePlatform {
        RemotePlatform::new(RemotePlatformSettings {
            limits: Limits::default(),
            noise: JumpCheck::RECKONED,
            stale: Duration::from_millis(600),
            by_heading,
            needs_scan: false,
        })
    }

    fn wait(plan: &Plan) -> &str {
        match plan {
            Plan::Wait(lack) => &lack.why,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn an_order_is_carried_out_only_with_fresh_reports() {
        let mut remote_platform = remote_platform(false);
        let start = Instant::now();
        assert_eq!(remote_platform.plan(start), Plan::Rest);
        let order = Velocity::forward(1.0, 0.1);
        remote_platform.drive(Drive::Velocity(order));
        assert_eq!(wait(&remote_platform.plan(start)), "no pose is known");
        remote_platform.handle_pose(start, None, Some((1.0, 2.0, 0.5)));
        assert_eq!(wait(&remote_platform.plan(start)), "no velocity is known");
        remote_platform.handle_velocity(start, None, Some((0.5, 0.0)));
        let Plan::Go(Order::Velocity(velocity), motion) = remote_platform.plan(start) else {
            panic!("it can go");
        };
        assert_eq!((velocity, motion.pose.y), (order, 2.0));
        let later = start + Duration::from_millis(800);
        remote_platform.handle_time(later);
        remote_platform.handle_velocity(later, None, Some((0.5, 0.0)));
        assert_eq!(wait(&remote_platform.plan(later)), "the pose is 0.8 s old");
        remote_platform.handle_pose(later, None, Some((1.0, 2.0, 0.5)));
        assert!(matches!(remote_platform.plan(later), Plan::Go(..)));
        remote_platform.handle_pose(later, None, None);
        assert_eq!(wait(&remote_platform.plan(later)), "no pose is known");
        remote_platform.drive(Drive::Stop);
        assert_eq!(remote_platform.plan(later), Plan::Rest);
    }

    #[test]
    fn a_pose_that_jumps_stops_a_vehicle_under_way_and_counts_later() {
        for (x, yaw) in [(4.0, 0.5), (1.08, 2.0)] {
            let mut remote_platform = remote_platform(true);
            let mut now = Instant::now();
            let mut plan = |x: f64, yaw: f64| {
                now += Duration::from_millis(40);
                remote_platform.handle_time(now);
                remote_platform.head(0.0, 1.0);
                remote_platform.handle_pose(now, None, Some((x, 2.0, yaw)));
                remote_platform.plan(now)
            };
            assert!(matches!(plan(1.0, 0.5), Plan::Go(..)));
            assert!(matches!(plan(1.04, 0.5), Plan::Go(..)));
            assert!(wait(&plan(x, yaw)).starts_with("the pose jumped by"));
            let plans: Vec<_> = (0..80).map(|_| plan(x, yaw)).collect();
            assert!(wait(&plans[70]).starts_with("the pose jumped by"));
            assert!(matches!(plans[76], Plan::Go(..)), "then it counts");
        }
    }

    #[test]
    fn a_vehicle_without_an_order_may_be_put_anywhere() {
        let mut remote_platform = remote_platform(true);
        let now = Instant::now();
        remote_platform.handle_pose(now, None, Some((0.0, 0.0, 0.0)));
        remote_platform.handle_pose(now, None, Some((9.0, 0.0, 0.0)));
        remote_platform.head(0.0, 1.0);
        assert!(matches!(remote_platform.plan(now), Plan::Go(..)));
    }

    #[test]
    fn a_heading_is_left_to_a_driver_that_keeps_headings() {
        let mut remote_platform = remote_platform(true);
        let now = Instant::now();
        remote_platform.handle_pose(now, None, Some((0.0, 0.0, 0.0)));
        assert!(remote_platform.head(4.0, 9.0));
        let Plan::Go(Order::Heading { heading, speed }, _) = remote_platform.plan(now) else {
            panic!("it can go");
        };
        assert!((heading - (4.0 - std::f64::consts::TAU)).abs() < 1e-9);
        assert_eq!(speed, 2.0, "as fast as the vehicle can");
    }

    #[test]
    fn a_frozen_pose_is_no_pose_within_the_limit() {
        let mut remote_platform = remote_platform(true);
        let start = Instant::now();
        let period = Duration::from_millis(40);
        let mut plan = |count: u32, stamp: u32| {
            let now = start + period * count;
            remote_platform.handle_time(now);
            remote_platform.head(0.0, 1.0);
            let stamp = Duration::from_secs(3600) + period * stamp;
            remote_platform.handle_pose(now, Some(stamp.into()), Some((1.0, 2.0, 0.5)));
            remote_platform.plan(now)
        };
        for count in 0..10 {
            let goes = matches!(plan(count, count), Plan::Go(..));
            assert_eq!(goes, count > 0, "{count}");
        }
        // Reports continue, but with the pose of the same moment.
        let plans: Vec<_> = (10..30).map(|count| plan(count, 9)).collect();
        assert!(matches!(plans[14], Plan::Go(..)), "0.6 s old");
        assert_eq!(wait(&plans[15]), "the pose is 0.6 s old");
    }

    #[test]
    fn once_there_was_a_scan_a_silent_or_frozen_range_sensor_is_a_fault() {
        let mut remote_platform = remote_platform(true);
        let start = Instant::now();
        let period = Duration::from_millis(100);
        let mut plan = |count: u32, stamp: Option<u32>| {
            let now = start + period * count;
            remote_platform.handle_time(now);
            remote_platform.handle_pose(now, None, Some((1.0, 2.0, 0.5)));
            remote_platform.head(0.0, 1.0);
            let scan = Scan::default();
            let at = stamp.map(|stamp| Duration::from_secs(3600) + period * stamp);
            let places = remote_platform.handle_scan(now, at.map(Into::into), at.map(|_| &scan));
            assert!(places.is_none_or(|it| it.is_empty()));
            remote_platform.plan(now)
        };
        assert!(matches!(plan(0, None), Plan::Go(..)), "no range sensor");
        for count in 1..10 {
            assert_eq!(
                matches!(plan(count, Some(count)), Plan::Go(..)),
                count > 1,
                "{count}"
            );
        }
        let frozen: Vec<_> = (10..20).map(|count| plan(count, Some(9))).collect();
        assert!(matches!(frozen[5], Plan::Go(..)), "0.6 s old");
        assert_eq!(wait(&frozen[6]), "the range sensor's scan is 0.7 s old");
        assert_eq!(wait(&plan(20, None)), "no range sensor's scan is known");
        for count in 21..23 {
            plan(count, Some(count));
        }
        assert!(matches!(plan(23, Some(23)), Plan::Go(..)), "it is back");
    }

    #[test]
    fn an_obstacle_is_where_it_was_seen_while_the_vehicle_drives_on() {
        let remote_platform = remote_platform(false);
        let now = Instant::now();
        remote_platform.handle_pose(now, None, Some((3.0, 1.0, std::f64::consts::FRAC_PI_2)));
        remote_platform.handle_velocity(now, None, Some((2.0, 0.0)));
        let ahead = Ray {
            bearing: 0.0,
            range: 4.0,
        };
        let places = remote_platform.handle_scan(now, None, Some(&Scan::new([ahead])));
        let Some([(x, y)]) = places.as_deref() else {
            panic!("{places:?}");
        };
        assert!((x - 3.0).abs() < 1e-9 && (y - 4.8).abs() < 1e-9, "{x}, {y}");
    }

    #[test]
    fn a_report_with_nothing_new_moves_no_obstacle() {
        let remote_platform = remote_platform(true);
        let start = Instant::now();
        let ahead = [0.0, 0.1, 0.2].map(|bearing| Ray {
            bearing,
            range: 4.0,
        });
        // Report, time stamp and X of the vehicle.
        let places = |count: u32, stamp: u32, x: f64| {
            let now = start + Duration::from_millis(100) * count;
            let stamp = Duration::from_secs(3600) + Duration::from_millis(100) * stamp;
            remote_platform.handle_pose(now, None, Some((x, 0.0, 0.0)));
            let seen =
                remote_platform.handle_scan(now, Some(stamp.into()), Some(&Scan::new(ahead)));
            seen.map(|places| places[0].0)
        };
        places(0, 0, 0.0);
        assert_eq!(places(1, 1, 0.0), Some(4.0));
        assert_eq!(places(2, 1, 0.04), None, "the same time stamp");
        assert_eq!(places(3, 3, 0.04), Some(4.04), "it may be a coincidence");
        for (count, x) in [(4, 0.06), (5, 0.06), (6, 0.0)] {
            let expected = (x < 0.05).then_some(4.0);
            assert_eq!(places(count, count, x), expected, "the same distances");
        }
        assert!(remote_platform.handle_scan(start, None, None).is_none());
    }

    #[test]
    fn an_order_ends_when_the_control_loop_hangs() {
        let mut remote_platform = remote_platform(true);
        let start = Instant::now();
        remote_platform.handle_time(start);
        remote_platform.head(0.0, 1.0);
        let later = start + CommandDeadline::DEFAULT;
        remote_platform.handle_pose(later, None, Some((0.0, 0.0, 0.0)));
        assert!(matches!(remote_platform.plan(later), Plan::Go(..)));
        let too_late = later + Duration::from_millis(1);
        assert!(wait(&remote_platform.plan(too_late)).contains("control loop"));
    }

    #[test]
    fn a_heading_that_is_no_number_is_no_order() {
        for by_heading in [true, false] {
            let mut remote_platform = remote_platform(by_heading);
            assert_eq!(remote_platform.head(f64::NAN, 1.0), by_heading);
            assert_eq!(remote_platform.plan(Instant::now()), Plan::Rest);
        }
    }
}
