//! The global pose sensor: position and heading on the globe from a GNSS receiver, a gyroscope and
//! wheel travel.

use std::convert::Infallible;
use std::time::{Duration, Instant};

use tokio::sync::mpsc;
use tokio::time::{MissedTickBehavior, interval};

use super::drivers::{ChainControl, Sense};
use super::navigation_inputs;
use super::turn_rates::TurnRates;
use super::{Gyro, IioDevice, Part, PartError, Readings, Slot, Telemetry};
use crate::messages::ground::{QueryWheelOdometry, ReportWheelOdometry, wheel_odometry};
use crate::mobility::Vehicle;
use crate::motion::{Frame, GlobalPose, Motion, Observed, Pilot, Pose, WheelCount};
use crate::navigation::{IioImu, Navigator, NavigatorConfig};
use jaus::codec::Message;
use jaus::component::Component;
use jaus::messages::core::SetTime;
use jaus::messages::mobility::{
    QueryGlobalPose, QueryGlobalPoseExt, SetGeomagneticProperty, SetGlobalPose, SetGlobalPoseExt,
};
use jaus::node::now;

/// Reports the pose on the globe, with its standard errors.
///
/// It offers Global Pose Sensor. A client in control may set the heading, which is otherwise unknown
/// until the vehicle has moved, but while a driver of its subsystem is controlled, only the client at
/// the head of that chain of drivers. The position is always measured. It finds Wheel Odometry in its
/// subsystem; without it, the pose is that of the receiver alone. A pose that is too old or too uncertain
/// (`navigator`) is omitted from the reports.
#[derive(Debug, Clone, PartialEq)]
pub struct GlobalPoseSensor {
    /// The serial line of the receiver (NMEA 0183), such as `/dev/ttyUSB0`.
    pub receiver: String,
    /// Bits per second of the line.
    pub baud: u32,
    /// The gyroscope, if there is one.
    pub gyro: Option<Gyro>,
    /// Report rate requested for the wheels, and for a gyroscope that is a component, in hertz.
    pub hz: f64,
    /// The heading at the start, and when the pose becomes unknown.
    pub navigator: NavigatorConfig,
}

/// What a global pose sensor reads.
#[derive(Debug)]
pub struct NavigationInputs {
    /// Octets of the receiver, in any portions.
    pub receiver: mpsc::Receiver<Vec<u8>>,
    /// Turn rates in radians per second, right positive.
    pub gyro: Option<Readings<f64>>,
}

impl Default for GlobalPoseSensor {
    fn default() -> Self {
        Self {
            receiver: "/dev/ttyACM0".to_owned(),
            baud: 9600,
            gyro: None,
            hz: 25.0,
            navigator: NavigatorConfig::default(),
        }
    }
}

impl Part for GlobalPoseSensor {
    async fn run(self, slot: Slot) -> Result<Infallible, PartError> {
        let (line, receiver) = navigation_inputs::receiver(&self.receiver, self.baud)?;
        let gyro = match &self.gyro {
            Some(Gyro::Device(device)) => {
                Some(IioDevice::start(device.open()?, IioImu::turn_rate)?)
            }
            Some(Gyro::Component) | None => None,
        };
        let inputs = NavigationInputs { receiver, gyro };
        tokio::select! {
            end = self.run_on(inputs, slot) => end,
            end = line => end,
        }
    }
}

impl GlobalPoseSensor {
    /// Runs on custom inputs in place of [`receiver`](Self::receiver) and a device as
    /// [`gyro`](Self::gyro).
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
            .with_clock(slot.time.clone());
        let chain = ChainControl::default();
        let component = slot
            .guarded_component("Global Pose Sensor", chain.guard(GUARDED))
            .offer(vehicle.global_pose_sensor())
            .live_on(slot.port)?;
        slot.telemetry.attach(&component);
        let query = QueryWheelOdometry {};
        let urn = wheel_odometry::URN;
        let counts = Sense::of(&component, urn, &query, self.hz, "wheel travel")?;
        let rates = match (inputs.gyro, self.gyro) {
            (Some(readings), _) => TurnRates::Device(readings),
            (None, Some(Gyro::Component)) => TurnRates::of_component(&component, self.hz)?,
            (None, _) => TurnRates::Absent,
        };
        let own = component.clone();
        let sensor = Running {
            component,
            telemetry: slot.telemetry,
            vehicle,
            observed,
            navigator: Navigator::new(self.navigator),
            is_lost: false,
        };
        tokio::select! {
            end = sensor.work(inputs.receiver, rates, counts) => end,
            end = chain.track(&own) => end,
        }
    }
}

/// What changes the pose that drivers drive by.
const GUARDED: &[u16] = &[
    SetGlobalPose::CODE,
    SetGlobalPoseExt::CODE,
    SetGeomagneticProperty::CODE,
    SetTime::CODE,
];

struct Running {
    component: Component,
    telemetry: Telemetry,
    vehicle: Vehicle,
    observed: Observed,
    navigator: Navigator,
    /// Whether the pose was unknown at the last look.
    is_lost: bool,
}

impl Running {
    /// Interval between two checks of the pose's age.
    const LOOK: Duration = Duration::from_millis(100);

    async fn work(
        mut self,
        mut receiver: mpsc::Receiver<Vec<u8>>,
        mut rates: TurnRates,
        mut counts: Sense<ReportWheelOdometry>,
    ) -> Result<Infallible, PartError> {
        let mut looks = interval(Self::LOOK);
        looks.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            tokio::select! {
                octets = receiver.recv() => match octets {
                    Some(octets) => self.navigator.handle_octets(now(), &octets),
                    None => return Err(PartError::Broken(
                        "the GNSS receiver's input has ended".to_owned(),
                    )),
                },
                rate = rates.next() => {
                    let rate = rate?;
                    self.navigator.handle_rate(rate.at, rate.value);
                    continue;
                }
                count = counts.next() => {
                    if counts.take_loss() {
                        self.navigator.forget_wheels();
                    }
                    self.navigator.handle_count(now(), WheelCount::from(&count?));
                }
                _ = looks.tick() => {}
            }
            if let Some(pose) = self.observed.take_set_global_pose() {
                self.navigator.set_heading(pose.yaw);
            }
            self.publish().await;
        }
    }

    async fn publish(&mut self) {
        let now = now();
        let pose = self.navigator.pose(now);
        let was_lost = std::mem::replace(&mut self.is_lost, pose.is_err());
        match &pose {
            Err(why) if !was_lost => tracing::warn!("the pose is unknown: {why}"),
            Ok(_) if was_lost => tracing::info!("the pose is known again"),
            _ => {}
        }
        let motion = match pose {
            Ok(estimate) => {
                self.telemetry
                    .set_sampled("global pose", estimate.sampled_at);
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
            Err(_) => unknown(Some(now)),
        };
        self.observed.set(motion);
        _ = self.component.changed::<QueryGlobalPose>().await;
        _ = self.component.changed::<QueryGlobalPoseExt>().await;
    }
}

fn unknown(sampled_at: Option<Instant>) -> Motion {
    Motion {
        pose: Pose::UNKNOWN,
        sampled_at,
        ..Motion::default()
    }
}
