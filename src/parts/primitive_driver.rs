//! The primitive driver: wrench efforts to two wheel drives, and how far the wheels have travelled.

use std::convert::Infallible;
use std::hash::{BuildHasher, Hasher, RandomState};
use std::time::Duration;

use tokio::time::{MissedTickBehavior, interval};

use super::drivers::{Watchman, guard};
use super::{Part, PartError, Seat};
use crate::actuator::{Actuator, MotorConfig, Odometer, SimulatedMotor, Wheels, WheelsConfig};
use crate::component::Component;
use crate::messages::ground::QueryStage;
use crate::service::MotionPolicy;
use crate::service::ground::{StageBoard, StageReport, StageState, WheelOdometry};
use crate::service::mobility::Vehicle;
use crate::vehicle::{Frame, Pilot};

/// Drives the wheels of a vehicle as it is told, and stops them when it is not told any more.
///
/// It offers Primitive Driver, Wheel Odometry and Stage, behind Management and Access Control.
#[derive(Debug, Clone, PartialEq)]
pub struct PrimitiveDriver {
    /// What turns the wheels.
    pub motors: Motors,
    /// The vehicle that the wheels carry.
    pub wheels: WheelsConfig,
    /// The motors stop when no effort has come for so long.
    pub silence: Duration,
    /// After how many seconds control ends unless its client asks for it again; 0 for never.
    pub control_timeout: u8,
}

/// What turns the wheels of both sides.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Motors {
    /// Simulated ones, the right one with the next seed after the left one's.
    Simulated(MotorConfig),
    /// Stepper motors on lines of a GPIO chip.
    #[cfg(all(feature = "gpio", target_os = "linux"))]
    Gpio(GpioMotors),
}

/// Two stepper motors on a GPIO chip.
#[cfg(all(feature = "gpio", target_os = "linux"))]
#[derive(Debug, Clone, PartialEq)]
pub struct GpioMotors {
    /// The chip, such as `/dev/gpiochip0`.
    pub chip: std::path::PathBuf,
    /// How both motors drive their wheels.
    pub stepper: crate::actuator::StepperConfig,
    /// The lines of the left motor: pulses and direction.
    pub left: (u32, u32),
    /// The same for the right motor, which is mounted the other way round.
    pub right: (u32, u32),
}

impl Default for PrimitiveDriver {
    fn default() -> Self {
        Self {
            motors: Motors::Simulated(MotorConfig::default()),
            wheels: WheelsConfig::default(),
            silence: Duration::from_millis(500),
            control_timeout: 3,
        }
    }
}

impl Motors {
    fn start(&self) -> Result<[Box<dyn Actuator>; 2], PartError> {
        match self {
            Self::Simulated(config) => {
                let right = MotorConfig {
                    seed: config.seed.wrapping_add(1),
                    ..*config
                };
                Ok([*config, right].map(|config| Box::new(SimulatedMotor::new(config)) as _))
            }
            #[cfg(all(feature = "gpio", target_os = "linux"))]
            Self::Gpio(motors) => motors.start(),
        }
    }
}

#[cfg(all(feature = "gpio", target_os = "linux"))]
impl GpioMotors {
    fn start(&self) -> Result<[Box<dyn Actuator>; 2], PartError> {
        let start = |(step, direction), reversed| -> Result<Box<dyn Actuator>, PartError> {
            let broken = |why: String| PartError::Broken(why);
            let lines = crate::actuator::GpioLines::open(&self.chip, step, direction, reversed);
            let lines = lines.map_err(|error| broken(error.to_string()))?;
            let motor = crate::actuator::PulseMotor::start(self.stepper, lines);
            let motor = motor.map_err(|error| broken(format!("no thread for pulses: {error}")))?;
            Ok(Box::new(motor))
        };
        Ok([start(self.left, false)?, start(self.right, true)?])
    }
}

impl Part for PrimitiveDriver {
    async fn run(self, seat: Seat) -> Result<Infallible, PartError> {
        let odometer = Odometer::new(random());
        let [left, right] = self.motors.start()?;
        let wheels = Wheels::new(left, right, self.wheels, odometer.clone());
        let pilot = Pilot::new(wheels, Frame::default());
        let policy = MotionPolicy::Expire(self.silence);
        let vehicle = Vehicle::new(pilot).motion_policy(policy);
        let board = StageBoard::default();
        let component = seat
            .component("Primitive Driver")
            .management(guard(self.control_timeout))
            .offer(vehicle.primitive_driver())
            .offer(WheelOdometry::new(odometer.clone(), vehicle.clone()))
            .offer(board.service())
            .live_on(seat.port)?;
        let driver = Running {
            component,
            vehicle,
            odometer,
            board,
        };
        driver.watch().await
    }
}

/// Names a counter of wheel travel.
fn random() -> u32 {
    // The keys of a hasher are random, and nothing more is wanted than that restarts differ.
    RandomState::new().build_hasher().finish() as u32
}

struct Running {
    component: Component,
    vehicle: Vehicle,
    odometer: Odometer,
    board: StageBoard,
}

impl Running {
    /// Between two looks at how the driver is.
    const LOOK: Duration = Duration::from_millis(100);

    async fn watch(self) -> Result<Infallible, PartError> {
        let mut standings = self.component.watch_standing();
        let mut watchman = Watchman::default();
        let mut looks = interval(Self::LOOK);
        looks.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            watchman.note(*standings.borrow_and_update());
            if self.board.tell(self.stage(&watchman)) {
                self.component.changed::<QueryStage>().await;
            }
            tokio::select! {
                changed = standings.changed() => changed.map_err(|_| PartError::NodeStopped)?,
                _ = looks.tick() => {}
            }
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
        if let Some(cause) = self.vehicle.last_stop() {
            let reason = format!("stopped: {cause}");
            return told(StageState::Idle, reason);
        }
        match self.vehicle.is_under_way() {
            true => told(StageState::Active, String::new()),
            false => told(StageState::Idle, String::new()),
        }
    }
}
