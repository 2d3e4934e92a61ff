//! The primitive driver: wrench efforts for the drives of a vehicle and its steering, and wheel
//! odometry.
#![expect(
    clippy::disallowed_methods,
    reason = "supervises the motors in real time"
)]

use std::convert::Infallible;
use std::hash::{BuildHasher, Hasher, RandomState};
use std::time::{Duration, Instant};

use tokio::time::{MissedTickBehavior, interval};

use super::drivers::{FaultMonitor, Sense, Watchman, guard, shut_down};
use super::stop_line::StopLine;
use super::{Part, PartError, Slot};
#[cfg(feature = "serial")]
use crate::actuator::SabertoothMotor;
use crate::actuator::{
    Actuator, Interlock, MotorConfig, Odometer, PwmServo, ServoConfig, SimulatedMotor,
    SimulatedServo, Steering, StopFile, StopInput, Wheels, WheelsConfig,
};
use crate::ground::{StageBoard, StageReport, StageState, WheelOdometry};
use crate::handoff::Handoff;
use crate::messages::ground::QueryStage;
use crate::mobility::Vehicle;
use crate::motion::{Ackermann, Fence, FenceConfig, Frame, Pilot};
use jaus::component::{Component, Condition, State};
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

/// The motors of both sides.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Motors {
    /// Simulated motors. The right one uses the seed after the left one's.
    Simulated(MotorConfig),
    /// The two motors of a Sabertooth motor controller on a serial line.
    #[cfg(feature = "serial")]
    Sabertooth(Sabertooth),
    /// Stepper motors on lines of a GPIO chip.
    #[cfg(all(feature = "gpio", target_os = "linux"))]
    Gpio(GpioMotors),
}

/// Steered front wheels.
#[derive(Debug, Clone, PartialEq)]
pub struct SteeringGear {
    /// Wheelbase and largest steering angle.
    pub geometry: Ackermann,
    /// What turns the wheels.
    pub servo: Servo,
}

/// A steering servo.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Servo {
    /// A simulated servo with this rate in radians per second.
    Simulated(f64),
    /// A servo on a PWM output.
    Pwm {
        /// The chip, such as `/sys/class/pwm/pwmchip0`.
        chip: std::path::PathBuf,
        /// The output of the chip.
        channel: u32,
        /// Pulse lengths and rate.
        config: ServoConfig,
    },
}

/// A motor controller on a serial line.
#[cfg(feature = "serial")]
#[derive(Debug, Clone, PartialEq)]
pub struct Sabertooth {
    /// The serial line, such as `/dev/ttyUSB0`.
    pub device: String,
    /// Bits per second of the line.
    pub baud: u32,
    /// The controller's address, 128 to 135.
    pub address: u8,
    /// Top speed and lag of the motors, from which the travel is estimated, and their deadline.
    pub motor: MotorConfig,
}

#[cfg(feature = "serial")]
impl Sabertooth {
    fn start(&self) -> Result<[Box<dyn Actuator>; 2], PartError> {
        let started = serial2::SerialPort::open(&self.device, self.baud)
            .and_then(|line| SabertoothMotor::start(line, self.address, self.motor));
        let motors = started.map_err(|error| {
            PartError::Broken(format!(
                "cannot use the motor controller on {}: {error}; check the device and the group of \
                 its file, usually dialout",
                self.device
            ))
        })?;
        Ok(motors.map(|motor| Box::new(motor) as _))
    }
}

impl SteeringGear {
    /// Simulated steering.
    #[must_use]
    pub const fn simulated(geometry: Ackermann) -> Self {
        Self {
            geometry,
            servo: Servo::Simulated(SimulatedServo::RATE),
        }
    }
}

impl Servo {
    fn start(&self) -> Result<Box<dyn Steering>, PartError> {
        match self {
            Self::Simulated(rate) => Ok(Box::new(SimulatedServo::new(*rate))),
            Self::Pwm {
                chip,
                channel,
                config,
            } => match PwmServo::open(chip, *channel, *config) {
                Ok(servo) => Ok(Box::new(servo)),
                Err(error) => Err(PartError::Broken(error.to_string())),
            },
        }
    }
}

/// The stop input on the vehicle.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Stop {
    /// A simulated input, pressed while a file exists.
    File(std::path::PathBuf),
    /// A normally closed contact between a line of a GPIO chip and ground.
    #[cfg(all(feature = "gpio", target_os = "linux"))]
    Gpio {
        /// The chip, such as `/dev/gpiochip0`.
        chip: std::path::PathBuf,
        /// The line.
        line: u32,
    },
}

impl Stop {
    fn open(&self) -> Result<Box<dyn StopInput>, PartError> {
        match self {
            Self::File(path) => Ok(Box::new(StopFile(path.clone()))),
            #[cfg(all(feature = "gpio", target_os = "linux"))]
            Self::Gpio { chip, line } => match crate::actuator::GpioStop::open(chip, *line) {
                Ok(input) => Ok(Box::new(input)),
                Err(error) => Err(PartError::Broken(error.to_string())),
            },
        }
    }
}

/// The hardware of a primitive driver.
pub struct Hardware {
    /// The drives, and the steering if the vehicle has one.
    pub drives: Drives,
    /// The stop input, if there is one.
    pub stop: Option<Box<dyn StopInput>>,
}

/// The drives of a vehicle.
pub enum Drives {
    /// A drive on each side.
    Sides {
        /// The drive of the left side.
        left: Box<dyn Actuator>,
        /// The drive of the right side.
        right: Box<dyn Actuator>,
    },
    /// One drive and steered front wheels.
    Steered {
        /// The drive of the rear axle.
        drive: Box<dyn Actuator>,
        /// The steering of the front axle.
        steering: Box<dyn Steering>,
        /// Wheelbase and largest steering angle.
        geometry: Ackermann,
    },
}

impl Drives {
    /// A pilot for these drives.
    fn pilot(self, config: WheelsConfig, odometer: Odometer, interlock: Interlock) -> Pilot {
        let frame = Frame::default();
        match self {
            Self::Sides { left, right } => {
                let wheels = Wheels::new(left, right, config, odometer);
                Pilot::new(wheels.with_interlock(interlock), frame)
            }
            Self::Steered {
                drive,
                steering,
                geometry,
            } => {
                let wheels = Wheels::steered(drive, steering, config, geometry, odometer);
                Pilot::new(wheels.with_interlock(interlock), frame)
            }
        }
    }
}

impl std::fmt::Debug for Hardware {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Hardware")
            .field("has_stop", &self.stop.is_some())
            .finish_non_exhaustive()
    }
}

/// Two stepper motors on a GPIO chip.
#[cfg(all(feature = "gpio", target_os = "linux"))]
#[derive(Debug, Clone, PartialEq)]
pub struct GpioMotors {
    /// The chip, such as `/dev/gpiochip0`.
    pub chip: std::path::PathBuf,
    /// Parameters of both motors and their wheels.
    pub stepper: crate::actuator::StepperConfig,
    /// The lines of the left motor: pulses and direction.
    pub left: (u32, u32),
    /// The lines of the right motor, which is mounted in reverse.
    pub right: (u32, u32),
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

impl Motors {
    /// Starts the motors of both sides.
    fn start_both(&self) -> Result<[Box<dyn Actuator>; 2], PartError> {
        match self {
            #[cfg(feature = "serial")]
            Self::Sabertooth(controller) => controller.start(),
            _ => Ok([self.start(Side::Left)?, self.start(Side::Right)?]),
        }
    }

    /// Starts the motor of a side. The left one is the first of a controller.
    fn start(&self, side: Side) -> Result<Box<dyn Actuator>, PartError> {
        match self {
            Self::Simulated(config) => {
                let seed = config.seed.wrapping_add(u64::from(side == Side::Right));
                Ok(Box::new(SimulatedMotor::new(MotorConfig {
                    seed,
                    ..*config
                })))
            }
            #[cfg(feature = "serial")]
            Self::Sabertooth(controller) => {
                let [left, right] = controller.start()?;
                Ok(if side == Side::Left { left } else { right })
            }
            #[cfg(all(feature = "gpio", target_os = "linux"))]
            Self::Gpio(motors) => motors.start(side),
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Side {
    Left,
    Right,
}

#[cfg(all(feature = "gpio", target_os = "linux"))]
impl GpioMotors {
    fn start(&self, side: Side) -> Result<Box<dyn Actuator>, PartError> {
        let broken = |why: String| PartError::Broken(why);
        let is_right = side == Side::Right;
        let (step, direction) = if is_right { self.right } else { self.left };
        let lines = crate::actuator::GpioLines::open(&self.chip, step, direction, is_right);
        let lines = lines.map_err(|error| broken(error.to_string()))?;
        let motor = crate::actuator::PulseMotor::start(self.stepper, lines);
        let motor =
            motor.map_err(|error| broken(format!("cannot start the pulse thread: {error}")))?;
        Ok(Box::new(motor))
    }
}

impl Part for PrimitiveDriver {
    async fn run(self, slot: Slot) -> Result<Infallible, PartError> {
        let drives = match &self.steering {
            None => {
                let [left, right] = self.motors.start_both()?;
                Drives::Sides { left, right }
            }
            Some(SteeringGear { geometry, servo }) => Drives::Steered {
                drive: self.motors.start(Side::Left)?,
                steering: servo.start()?,
                geometry: *geometry,
            },
        };
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
        let fence = Fence::located_elsewhere(self.fence);
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
        let poses = Sense::pose(&component, Self::HZ)?;
        let zones = Sense::zones(&component)?;
        let driver = Running {
            component,
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
            end = poses.locate(&fence) => end,
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
            if self.board.tell(self.stage(&watchman)) {
                self.component.changed::<QueryStage>().await;
            }
            tokio::select! {
                changed = standings.changed() => changed.map_err(|_| PartError::NodeStopped)?,
                () = pressed(&mut self.stop) => {}
                _ = looks.tick() => {}
            }
        }
    }

    /// Keeps the component in emergency while the stop input is open, and clears all emergencies
    /// when it is closed.
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
        }
        if !self.stopped {
            return;
        }
        if self.component.standing().state != State::Emergency {
            self.vehicle.stop();
            if let Err(error) = self.component.set_emergency(self.component.id()).await {
                tracing::warn!("cannot set the emergency, will retry: {error}");
            }
        } else if open.is_none() {
            tracing::warn!("the stop input is closed again: all emergencies are cleared");
            self.component.set_condition(Condition::Safe).await;
            self.stopped = false;
            // The component must be resumed before anything moves.
            self.interlock.close();
        }
    }

    /// A motor fault is a failure as long as it lasts.
    async fn check_motors(&self, faults: &mut FaultMonitor) {
        // Also at rest, when nothing else reads the motors.
        self.vehicle.handle_time(Instant::now());
        let condition = match self.odometer.fault() {
            Some(fault) => faults.lacks(Instant::now(), &fault, Duration::ZERO),
            None => faults.is_over(),
        };
        if let Some(condition) = condition {
            self.component.set_condition(condition).await;
        }
    }

    fn stage(&self, watchman: &Watchman) -> StageReport {
        let told = |state, reason: String| StageReport {
            state,
            reason,
            ..StageReport::default()
        };
        if let Some(fault) = self.odometer.fault() {
            return told(StageState::Blocked, fault);
        }
        if let Some(reason) = watchman.emergency() {
            return told(StageState::Blocked, reason.to_owned());
        }
        if let Some(StopCause::Fault(fault)) = self.vehicle.last_stop() {
            return told(StageState::Blocked, fault);
        }
        if let Some(cause) = self.vehicle.last_stop() {
            let reason = format!("stopped: {cause}");
            return told(StageState::Idle, reason);
        }
        match self.vehicle.is_under_way() {
            // Not blocked: the driver above it would stand down, but it may steer away.
            true => told(StageState::Active, self.fence.held().unwrap_or_default()),
            false => told(StageState::Idle, String::new()),
        }
    }
}
