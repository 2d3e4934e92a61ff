//! The platform of a driver that commands another driver: its motion is what sensors report, and what
//! it is to do is an order for the next one.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use crate::vehicle::{Drive, Limits, Motion, Platform, Pose, Velocity};

/// What a driver knows and wants. Cheap to clone; the clones are one.
#[derive(Debug, Clone)]
pub(in crate::parts) struct Helm(Arc<Mutex<State>>);

#[derive(Debug)]
struct State {
    settings: HelmSettings,
    limits: Limits,
    motion: Motion,
    pose_at: Option<Instant>,
    velocity_at: Option<Instant>,
    order: Option<Order>,
}

/// How a driver does its work.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::parts) struct HelmSettings {
    /// What the vehicle can do at most.
    pub(in crate::parts) limits: Limits,
    /// Older reports of the sensors are of no use.
    pub(in crate::parts) stale: Duration,
    /// Whether the next driver keeps headings by itself. Else it needs to be told velocities, and
    /// they need to be measured.
    pub(in crate::parts) by_heading: bool,
}

/// What the next driver is to do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::parts) enum Order {
    /// To move like this.
    Velocity(Velocity),
    /// To keep a heading in radians, from -π to π, and a speed in metres per second.
    Heading { heading: f64, speed: f64 },
}

/// What can be done about an order now.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::parts) enum Plan {
    /// There is none.
    Rest,
    /// It can be carried out, the vehicle moving like this.
    Go(Order, Motion),
    /// It can not, and why.
    Wait(String),
}

impl Helm {
    pub(in crate::parts) fn new(settings: HelmSettings) -> Self {
        Self(Arc::new(Mutex::new(State {
            settings,
            limits: settings.limits,
            motion: Motion::default(),
            pose_at: None,
            velocity_at: None,
            order: None,
        })))
    }

    /// A sensor has reported a pose: X, Y and yaw. If it does not know one, there is none.
    pub(in crate::parts) fn handle_pose(&self, now: Instant, pose: Option<(f64, f64, f64)>) {
        if let Some((x, y, yaw)) = pose {
            let mut state = self.lock();
            state.motion.pose = Pose {
                yaw,
                ..Pose::at(x, y)
            };
            state.pose_at = Some(now);
        }
    }

    /// The same for a velocity: speed forward and yaw rate.
    pub(in crate::parts) fn handle_velocity(&self, now: Instant, velocity: Option<(f64, f64)>) {
        if let Some((x, yaw)) = velocity {
            let mut state = self.lock();
            state.motion.velocity = Velocity::forward(x, yaw);
            state.velocity_at = Some(now);
        }
    }

    /// What is to be done now.
    pub(in crate::parts) fn plan(&self, now: Instant) -> Plan {
        let state = self.lock();
        let Some(order) = state.order else {
            return Plan::Rest;
        };
        let needs = [
            (state.pose_at, "pose", true),
            (state.velocity_at, "velocity", !state.settings.by_heading),
        ];
        let mut lacks = needs.into_iter().filter(|&(_, _, needed)| needed);
        let lack = lacks.find_map(|(at, what, _)| lack(now, at, state.settings.stale, what));
        match lack {
            Some(why) => Plan::Wait(why),
            None => Plan::Go(order, state.motion),
        }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Why a report is of no use, if it is not.
fn lack(now: Instant, at: Option<Instant>, stale: Duration, what: &str) -> Option<String> {
    let Some(at) = at else {
        return Some(format!("no {what} is known yet"));
    };
    let age = now.saturating_duration_since(at);
    (age > stale).then(|| format!("the {what} is {:.1} s old", age.as_secs_f64()))
}

impl Platform for Helm {
    fn handle_time(&mut self, _: Instant) {}

    fn motion(&self) -> Motion {
        self.lock().motion
    }

    fn set_pose(&mut self, _: Pose) {
        // Where it is the sensor says.
    }

    fn drive(&mut self, command: Drive) {
        let mut state = self.lock();
        let by_heading = state.settings.by_heading;
        let heading = state.motion.pose.yaw;
        state.order = match command {
            Drive::Velocity(velocity) if by_heading => Some(Order::Heading {
                heading,
                speed: velocity.x.max(0.0),
            }),
            Drive::Velocity(velocity) => Some(Order::Velocity(velocity)),
            // No driver above the primitive one is told efforts.
            Drive::Stop | Drive::Effort(_) => None,
        };
    }

    fn head(&mut self, heading: f64, speed: f64, limits: &Limits) {
        if !self.lock().settings.by_heading {
            let yaw = self.motion().pose.yaw;
            let velocity = crate::vehicle::along(yaw, heading, speed, limits);
            return self.drive(Drive::Velocity(limits.clamp(velocity)));
        }
        self.lock().order = Some(Order::Heading {
            heading: crate::vehicle::wrap(heading),
            speed: speed.clamp(0.0, limits.speed),
        });
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
    reason = "any moment will do as the beginning of virtual time"
)]
mod tests {
    use super::*;

    fn helm(by_heading: bool) -> Helm {
        Helm::new(HelmSettings {
            limits: Limits::default(),
            stale: Duration::from_millis(600),
            by_heading,
        })
    }

    fn wait(plan: &Plan) -> &str {
        match plan {
            Plan::Wait(why) => why,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn an_order_is_carried_out_only_with_fresh_reports() {
        let mut helm = helm(false);
        let start = Instant::now();
        assert_eq!(helm.plan(start), Plan::Rest);
        let order = Velocity::forward(1.0, 0.1);
        helm.drive(Drive::Velocity(order));
        assert_eq!(wait(&helm.plan(start)), "no pose is known yet");
        helm.handle_pose(start, Some((1.0, 2.0, 0.5)));
        assert_eq!(wait(&helm.plan(start)), "no velocity is known yet");
        helm.handle_velocity(start, Some((0.5, 0.0)));
        let Plan::Go(Order::Velocity(velocity), motion) = helm.plan(start) else {
            panic!("it can go");
        };
        assert_eq!((velocity, motion.pose.y), (order, 2.0));
        let later = start + Duration::from_millis(800);
        helm.handle_velocity(later, Some((0.5, 0.0)));
        helm.handle_pose(later, None);
        assert_eq!(wait(&helm.plan(later)), "the pose is 0.8 s old");
        helm.drive(Drive::Stop);
        assert_eq!(helm.plan(later), Plan::Rest);
    }

    #[test]
    fn a_heading_is_left_to_a_driver_that_keeps_headings() {
        let mut helm = helm(true);
        let now = Instant::now();
        helm.handle_pose(now, Some((0.0, 0.0, 0.0)));
        helm.head(4.0, 9.0, &Limits::default());
        let Plan::Go(Order::Heading { heading, speed }, _) = helm.plan(now) else {
            panic!("it can go");
        };
        assert!((heading - (4.0 - std::f64::consts::TAU)).abs() < 1e-9);
        assert_eq!(speed, 2.0, "as fast as the vehicle can");
    }
}
