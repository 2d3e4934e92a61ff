//! The global pose sensor: position and heading on the globe from a GNSS receiver, a gyroscope and
//! wheel travel.
#![expect(
    clippy::disallowed_methods,
    reason = "gives the sensor its clock and timer"
)]

use std::convert::Infallible;
use std::time::{Duration, Instant};

use tokio::sync::mpsc;
use tokio::time::{MissedTickBehavior, interval};

use super::drivers::{Freshness, Sense};
use super::navigation_inputs::{self, Gyro};
use super::{Part, PartError, Slot};
use crate::messages::ground::{QueryWheelOdometry, ReportWheelOdometry, wheel_odometry};
use crate::mobility::Vehicle;
use crate::motion::{DeadReckoning, Frame, GlobalPose, Motion, Observed, Pilot, Pose, WheelCount};
use crate::navigation::{Estimator, Navigation, Receiver};
use jaus::component::{AccessControl, Component};
use jaus::messages::mobility::{QueryGlobalPose, QueryGlobalPoseExt};

/// Reports the pose on the globe, with its standard errors.
///
/// It offers Global Pose Sensor. A client in control may set the heading, which is otherwise unknown
/// until the vehicle has moved; the position is always measured. It finds Wheel Odometry in its
/// subsystem; without it, the pose is that of the receiver alone. A pose that is older than
/// `silence`, or less certain than `max_rms`, is omitted from the reports.
#[derive(Debug, Clone, PartialEq)]
pub struct GlobalPoseSensor {
    /// The serial line of the receiver (NMEA 0183), such as `/dev/ttyUSB0`.
    pub receiver: String,
    /// Bits per second of the line.
    pub baud: u32,
    /// The gyroscope, if there is one.
    pub gyro: Option<Gyro>,
    /// The heading at the start in radians from north, if it is known.
    pub heading: Option<f64>,
    /// Report rate requested for the wheels, in hertz.
    pub hz: f64,
    /// The pose becomes unknown without position or wheel travel for this time.
    pub silence: Duration,
    /// The pose becomes unknown at this standard error of the position, in metres.
    pub max_rms: f64,
}

/// What a global pose sensor reads.
#[derive(Debug)]
pub struct NavigationInputs {
    /// Octets of the receiver, in any portions.
    pub receiver: mpsc::Receiver<Vec<u8>>,
    /// Turn rates in radians per second, right positive.
    pub gyro: Option<mpsc::Receiver<f64>>,
}

impl Default for GlobalPoseSensor {
    fn default() -> Self {
        Self {
            receiver: "/dev/ttyACM0".to_owned(),
            baud: 9600,
            gyro: None,
            heading: None,
            hz: 25.0,
            silence: Duration::from_millis(1500),
            max_rms: 10.0,
        }
    }
}

impl Part for GlobalPoseSensor {
    async fn run(self, slot: Slot) -> Result<Infallible, PartError> {
        let (line, receiver) = navigation_inputs::receiver(&self.receiver, self.baud)?;
        let gyro = self.gyro.as_ref().map(Gyro::start).transpose()?;
        let inputs = NavigationInputs { receiver, gyro };
        tokio::select! {
            end = self.run_on(inputs, slot) => end,
            end = line => end,
        }
    }
}

impl GlobalPoseSensor {
    /// Runs on custom inputs in place of [`receiver`](Self::receiver) and [`gyro`](Self::gyro).
    ///
    /// # Errors
    /// Why the component cannot continue.
    pub async fn run_on(
        self,
        inputs: NavigationInputs,
        slot: Slot,
    ) -> Result<Infallible, PartError> {
        let observed = Observed::new(unknown(None));
        let vehicle = Vehicle::new(Pilot::new(observed.clone(), Frame::default()))
            .with_clock(super::host_clock());
        let component = slot
            .component("Global Pose Sensor")
            .access_control(AccessControl::new())
            .offer(vehicle.global_pose_sensor())
            .live_on(slot.port)?;
        let query = QueryWheelOdometry {};
        let urn = wheel_odometry::URN;
        let counts = Sense::of(&component, urn, &query, self.hz, "wheel travel")?;
        let sensor = Running {
            heading: self.heading,
            settings: self,
            component,
            vehicle,
            observed,
            estimator: Estimator::default(),
            decoder: Receiver::default(),
            fixes: Freshness::default(),
            wheels: Wheels::default(),
        };
        sensor.work(inputs, counts).await
    }
}

/// Wheel counts, and when the last one was read.
#[derive(Default)]
struct Wheels {
    reckoning: DeadReckoning,
    freshness: Freshness,
    read_at: Option<Instant>,
}

struct Running {
    settings: GlobalPoseSensor,
    component: Component,
    vehicle: Vehicle,
    observed: Observed,
    estimator: Estimator,
    decoder: Receiver,
    /// Age of the positions, by the receiver's clock.
    fixes: Freshness,
    wheels: Wheels,
    /// The heading to begin with.
    heading: Option<f64>,
}

impl Running {
    /// Interval between two checks of the pose's age.
    const LOOK: Duration = Duration::from_millis(100);

    async fn work(
        mut self,
        mut inputs: NavigationInputs,
        mut counts: Sense<ReportWheelOdometry>,
    ) -> Result<Infallible, PartError> {
        let mut looks = interval(Self::LOOK);
        looks.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            tokio::select! {
                octets = inputs.receiver.recv() => match octets {
                    Some(octets) => self.handle_octets(&octets),
                    None => return Err(PartError::Broken(
                        "the GNSS receiver's input has ended".to_owned(),
                    )),
                },
                rate = next(&mut inputs.gyro) => {
                    self.estimator.handle_rate(Instant::now(), rate);
                    continue;
                }
                count = counts.next() => {
                    let was_lost = counts.take_loss();
                    self.handle_count(&count?, was_lost);
                }
                _ = looks.tick() => {}
            }
            if let Some(pose) = self.observed.take_told_global() {
                self.estimator.set_heading(pose.yaw);
            }
            self.publish().await;
        }
    }

    fn handle_octets(&mut self, octets: &[u8]) {
        let now = Instant::now();
        for news in self.decoder.handle_octets(octets) {
            match news {
                Navigation::Fix(fix) => {
                    // A report that waited in a buffer is as old as its fix.
                    if let Some(at) = self.fixes.handle(now, Some(fix.time)) {
                        self.estimator.handle_fix(at, &fix);
                    }
                    if self.estimator.estimate().is_some()
                        && let Some(heading) = self.heading.take()
                    {
                        self.estimator.set_heading(heading);
                    }
                }
                Navigation::Course(course) => self.estimator.handle_course(now, &course),
                Navigation::NoFix => tracing::debug!("the receiver has no fix"),
            }
        }
    }

    fn handle_count(&mut self, report: &ReportWheelOdometry, was_lost: bool) {
        let count = WheelCount::from(report);
        let wheels = &mut self.wheels;
        if was_lost {
            wheels.freshness = Freshness::default();
        }
        let read_at = Duration::from_millis(count.time_ms.into());
        let at = wheels.freshness.handle(Instant::now(), Some(read_at));
        let gone = wheels.reckoning.handle_count(count);
        // Travel counts, even if it is not known when the count was read.
        wheels.read_at = at.or(wheels.read_at);
        if let Some(at) = wheels.read_at {
            self.estimator.handle_travel(at, gone);
        }
    }

    async fn publish(&self) {
        let now = Instant::now();
        let is_usable = |it: &crate::navigation::Estimate| {
            now.saturating_duration_since(it.sampled_at) <= self.settings.silence
                && it.position_rms <= self.settings.max_rms
        };
        let motion = match self.estimator.estimate().filter(is_usable) {
            Some(estimate) => {
                let GlobalPose {
                    latitude,
                    longitude,
                    altitude,
                    yaw,
                    ..
                } = estimate.pose;
                // The local frame moves along with the vehicle.
                self.vehicle.set_frame(Frame {
                    altitude,
                    ..Frame::at(latitude, longitude)
                });
                Motion {
                    pose: Pose {
                        x: 0.0,
                        y: 0.0,
                        z: 0.0,
                        yaw,
                        // Roll and pitch are not measured.
                        ..Pose::UNKNOWN
                    },
                    position_rms: Some(estimate.position_rms),
                    attitude_rms: Some(estimate.heading_rms),
                    sampled_at: Some(estimate.sampled_at),
                    ..Motion::default()
                }
            }
            None => unknown(Some(now)),
        };
        self.observed.set(motion);
        self.component.changed::<QueryGlobalPose>().await;
        self.component.changed::<QueryGlobalPoseExt>().await;
    }
}

/// Waits for the next turn rate; forever without a gyroscope.
async fn next(gyro: &mut Option<mpsc::Receiver<f64>>) -> f64 {
    if let Some(rates) = gyro
        && let Some(rate) = rates.recv().await
    {
        return rate;
    }
    std::future::pending().await
}

fn unknown(sampled_at: Option<Instant>) -> Motion {
    Motion {
        pose: Pose::UNKNOWN,
        sampled_at,
        ..Motion::default()
    }
}
