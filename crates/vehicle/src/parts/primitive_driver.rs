//! The primitive driver: wrench efforts for the drives of a vehicle and its steering, and wheel
//! odometry.

use std::convert::Infallible;
use std::hash::{BuildHasher, Hasher, RandomState};
use std::time::Duration;

use tokio::time::{MissedTickBehavior, interval};

use super::drivers::{FaultMonitor, Sense, Watchman, guard, shut_down};
use super::hardware::{Drives, Hardware, Motors, SteeringGear, Stop};
use super::stop_line::StopLine;
use super::{Part, PartError, Slot, Telemetry};
use crate::actuator::{Interlock, MotorConfig, Odometer, WheelsConfig};
use crate::ground::{StageBoard, StageReport, StageState, WheelOdometry};
use crate::handoff::Handoff;
use crate::messages::ground::QueryStage;
use crate::mobility::Vehicle;
use crate::motion::{Fence, FenceConfig};
use jaus::component::{Component, Condition, State};
use jaus::node::now;
use jaus::service::{MotionPolicy, StopCause};

/// Drives the wheels of a vehicle as commanded, and stops them when commands cease. While a motor
/// or the steering has a fault, all wheels stand still and the component is in Failure.
///
/// With a stop input, an open line stops the motors immediately and sets the component's emergency.
/// Closing the line clears all emergencies, on the assumption that the operator on site has dealt
/// with them. The component is then in Standby, and nothing moves before it is resumed.
///
/// While operating zones are set, it drives only with a pose of the pose sensor, and stops before it
/// crosses an edge, whatever its client commands.
///
/// It offers Primitive Driver, Wheel Odometry and Stage, with Management and Access Control.
///
/// ```
/// use std::time::Duration;
///
/// use jaus_vehicle::parts::{Motors, PrimitiveDriver};
///
/// let driver = PrimitiveDriver {
///     silence: Duration::from_millis(300),
///     ..PrimitiveDriver::default()
/// };
/// assert!(matches!(driver.motors, Motors::Simulated(_)));
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct PrimitiveDriver {
    /// The motors.
    pub motors: Motors,
    /// The steering of the front wheels. Without it, the vehicle has a motor on each side; with it,
    /// only the left motor is used, and drives the rear axle.
    pub steering: Option<SteeringGear>,
    /// The stop input, if there is one.
    pub stop: Option<Stop>,
    /// Parameters of the platform.
    pub wheels: WheelsConfig,
    /// Dimensions and delays by which it keeps to the operating zones.
    pub fence: FenceConfig,
    /// The motors stop without an effort command for this time.
    pub silence: Duration,
    /// Control timeout in seconds unless the client renews control; 0 disables it.
    pub control_timeout: u8,
}

impl Default for PrimitiveDriver {
    fn default() -> Self {
        Self {
            motors: Motors::Simulated(MotorConfig::default()),
            steering: None,
            stop: None,
            wheels: WheelsConfig::default(),
            fence: FenceConfig::default(),
            silence: Duration::from_millis(500),
            control_timeout: 3,
        }
    }
}

impl Part for PrimitiveDriver {
    async fn run(self, slot: Slot) -> Result<Infallible, PartError> {
        let drives = Drives::start(&self.motors, self.steering.as_ref())?;
        let stop = self.stop.as_ref().map(Stop::open).transpose()?;
        self.run_on(Hardware { drives, stop }, slot).await
    }
}

impl PrimitiveDriver {
    /// Report rate requested from the pose sensor, in hertz.
    const HZ: f64 = 10.0;

    /// Sets the steering of the front wheels.
    #[must_use]
    pub fn steering(mut self, gear: Option<SteeringGear>) -> Self {
        self.steering = gear;
        self
    }

    /// Runs on custom hardware in place of [`motors`](Self::motors), [`steering`](Self::steering)
    /// and [`stop`](Self::stop).
    ///
    /// # Errors
    /// Why the component cannot continue.
    pub async fn run_on(self, hardware: Hardware, slot: Slot) -> Result<Infallible, PartError> {
        let Hardware { drives, stop } = hardware;
        let interlock = Interlock::default();
        let stop = stop.map(|input| StopLine::start(input, interlock.clone()));
        let stop = stop.transpose().map_err(|error| {
            PartError::Broken(format!("cannot start the stop input thread: {error}"))
        })?;
        let odometer = Odometer::new(random());
        let fence = Fence::located_elsewhere(self.fence, &self.wheels.limits);
        let pilot = drives.pilot(self.wheels, odometer.clone(), interlock.clone());
        let pilot = pilot.with_fence(fence.clone());
        let policy = MotionPolicy::Expire(self.silence);
        let vehicle = Vehicle::new(pilot).motion_policy(policy);
        let board = StageBoard::default();
        let component = slot
            .component("Primitive Driver")
            .management(guard(self.control_timeout))
            .offer(vehicle.primitive_driver())
            .offer(WheelOdometry::new(odometer.clone(), vehicle.clone()))
            .offer(board.service())
            .offer(Handoff::new())
            .live_on(slot.port)?;
        slot.telemetry.attach(&component);
        let poses = Sense::pose(&component, Self::HZ)?;
        let zones = Sense::zones(&component)?;
        let driver = Running {
            component,
            telemetry: slot.telemetry,
            fence: fence.clone(),
            vehicle,
            odometer,
            board,
            interlock,
            stop,
            stopped: false,
        };
        let component = driver.component.clone();
        tokio::select! {
            end = driver.watch() => end,
            end = poses.locate(&fence, &component) => end,
            end = zones.enclose(&fence) => end,
            end = shut_down(&component) => end,
        }
    }
}

/// A random identifier for an odometer run.
fn random() -> u32 {
    // Hasher keys are random, which suffices to distinguish restarts.
    RandomState::new().build_hasher().finish() as u32
}

/// Waits until the stop input changes, if there is one.
async fn pressed(stop: &mut Option<StopLine>) {
    match stop {
        Some(stop) => stop.changed().await,
        None => std::future::pending().await,
    }
}

struct Running {
    component: Component,
    telemetry: Telemetry,
    vehicle: Vehicle,
    fence: Fence,
    odometer: Odometer,
    board: StageBoard,
    interlock: Interlock,
    stop: Option<StopLine>,
    /// Whether an emergency set by the stop input is in effect.
    stopped: bool,
}

impl Running {
    /// Interval between two status checks.
    const LOOK: Duration = Duration::from_millis(100);

    async fn watch(mut self) -> Result<Infallible, PartError> {
        let mut standings = self.component.watch_standing();
        let mut watchman = Watchman::default();
        let mut faults = FaultMonitor::default();
        let mut looks = interval(Self::LOOK);
        looks.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            watchman.note(*standings.borrow_and_update());
            self.check_stop().await;
            self.check_motors(&mut faults).await;
            self.telemetry.set_speed(self.vehicle.motion().velocity.x);
            if self.board.tell(self.stage(&watchman)) {
                _ = self.component.changed::<QueryStage>().await;
            }
            tokio::select! {
                changed = standings.changed() => changed.map_err(|_| PartError::NodeStopped)?,
                () = pressed(&mut self.stop) => {}
                _ = looks.tick() => {}
            }
        }
    }

    /// Keeps the component in an emergency of its own while the stop input is open. Emergencies of
    /// clients remain when it is closed.
    async fn check_stop(&mut self) {
        let Some(stop) = &mut self.stop else {
            return;
        };
        let open = stop.pressed();
        // The interlock also latches presses shorter than the check interval.
        if self.interlock.is_open() && !self.stopped {
            let why = open.as_deref().unwrap_or("the stop input was pressed");
            tracing::warn!("emergency: {why}");
            self.stopped = true;
            self.vehicle.stop();
            _ = self.component.set_condition(Condition::Stopped).await;
            return;
        }
        if !self.stopped {
            return;
        }
        if self.component.standing().state != State::Emergency {
            // The application has declared it safe, or the state is not reported yet.
            self.vehicle.stop();
            _ = self.component.set_condition(Condition::Stopped).await;
        } else if open.is_none() {
            tracing::warn!("the stop input is closed again: its emergency ends");
            _ = self.component.set_condition(Condition::StopReleased).await;
            self.stopped = false;
            // The component must be resumed before anything moves.
            self.interlock.close();
        }
    }

    /// A motor fault is a failure as long as it lasts.
    async fn check_motors(&self, faults: &mut FaultMonitor) {
        // Also at rest, when nothing else reads the motors.
        self.vehicle.handle_time(now());
        let condition = match self.odometer.fault() {
            Some(fault) => faults.lacks(now(), &fault, Duration::ZERO),
            None => faults.is_over(),
        };
        if let Some(condition) = condition {
            _ = self.component.set_condition(condition).await;
        }
    }

    fn stage(&self, watchman: &Watchman) -> StageReport {
        let report = |state, reason: String| StageReport {
            state,
            reason,
            ..StageReport::default()
        };
        if let Some(fault) = self.odometer.fault() {
            return report(StageState::Halted, fault);
        }
        if let Some(reason) = watchman.emergency() {
            return report(StageState::Blocked, reason.to_owned());
        }
        if let Some(StopCause::Fault(fault)) = self.vehicle.last_stop() {
            return report(StageState::Halted, fault);
        }
        if let Some(cause) = self.vehicle.last_stop() {
            let reason = format!("stopped: {cause}");
            return report(StageState::Idle, reason);
        }
        match self.vehicle.is_under_way() {
            // Not blocked: the driver above it would stand down, but it may steer away.
            true => report(StageState::Active, self.fence.held().unwrap_or_default()),
            false => report(StageState::Idle, String::new()),
        }
    }
}
