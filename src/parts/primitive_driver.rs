//! The primitive driver: wrench efforts to two wheel drives, and how far the wheels have travelled.
#![expect(
    clippy::disallowed_methods,
    reason = "here the motors are looked after in real time"
)]

use std::convert::Infallible;
use std::hash::{BuildHasher, Hasher, RandomState};
use std::time::{Duration, Instant};

use tokio::time::{MissedTickBehavior, interval};

use super::drivers::{FaultMonitor, Watchman, guard};
use super::{Part, PartError, Seat};
use crate::actuator::{Actuator, MotorConfig, Odometer, SimulatedMotor, Wheels, WheelsConfig};
use crate::component::Component;
use crate::messages::ground::QueryStage;
use crate::service::ground::{StageBoard, StageReport, StageState, WheelOdometry};
use crate::service::mobility::Vehicle;
use crate::vehicle::{Frame, Pilot};

/// Drives the wheels of a vehicle as it is told, and stops them when it is not told any more. While a
/// motor has a fault both sides stand still and the component is in Failure.
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
        let [left, right] = self.motors.start()?;
        self.run_with(left, right, seat).await
    }
}

impl PrimitiveDriver {
    /// The same with drives of your own in place of [`motors`](Self::motors).
    ///
    /// # Errors
    /// Why it cannot go on.
    pub async fn run_with(
        self,
        left: impl Actuator + 'static,
        right: impl Actuator + 'static,
        seat: Seat,
    ) -> Result<Infallible, PartError> {
        let odometer = Odometer::new(random());
        let [left, right]: [Box<dyn Actuator>; 2] = [Box::new(left), Box::new(right)];
        let wheels = Wheels::new(left, right, self.wheels, odometer.clone());
        let pilot = Pilot::new(wheels, Frame::default()).give_up_after(self.silence);
        let vehicle = Vehicle::new(pilot);
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
            silence: self.silence,
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
    silence: Duration,
}

impl Running {
    /// Between two looks at how the driver is.
    const LOOK: Duration = Duration::from_millis(100);

    async fn watch(self) -> Result<Infallible, PartError> {
        let mut standings = self.component.watch_standing();
        let mut watchman = Watchman::default();
        let mut faults = FaultMonitor::default();
        let mut looks = interval(Self::LOOK);
        looks.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            watchman.note(*standings.borrow_and_update());
            self.check_motors(&mut faults).await;
            if self.board.tell(self.stage(&watchman)) {
                self.component.changed::<QueryStage>().await;
            }
            tokio::select! {
                changed = standings.changed() => changed.map_err(|_| PartError::NodeStopped)?,
                _ = looks.tick() => {}
            }
        }
    }

    /// A motor's fault is a failure as long as it lasts.
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
        if self.vehicle.was_left_alone() {
            let seconds = self.silence.as_secs_f64();
            let reason = format!("stopped: no effort was set for {seconds:.1} s");
            return told(StageState::Idle, reason);
        }
        match self.vehicle.is_under_way() {
            true => told(StageState::Active, String::new()),
            false => told(StageState::Idle, String::new()),
        }
    }
}
