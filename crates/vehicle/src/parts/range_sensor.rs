//! The range sensor (component 51), simulated: measures round obstacles around the vehicle's pose.
#![expect(
    clippy::disallowed_methods,
    reason = "gives the sensor its clock and timer"
)]

use std::convert::Infallible;
use std::time::Duration;

use tokio::time::timeout;

use super::drivers::{Sense, reported_pose};
use super::{Part, PartError, Slot};
use crate::ground;
use crate::messages::environment_sensing::QueryRangeSensorData;
use crate::sensing::{RangerConfig, Scenery, SimulatedRanger};
use jaus::node::now;

/// Measures the distances to the obstacles of a simulation, as seen from the vehicle's pose.
///
/// It offers Range Sensor, with Access Control. It finds the pose sensor in its own subsystem,
/// measures with each of its reports, and does not measure without a pose.
#[derive(Debug, Clone)]
pub struct RangeSensor {
    /// Parameters of the sensor.
    pub ranger: RangerConfig,
    /// The obstacles.
    pub scenery: Scenery,
    /// Measurements per second.
    pub hz: f64,
}

impl Default for RangeSensor {
    fn default() -> Self {
        Self {
            ranger: RangerConfig::default(),
            scenery: Scenery::default(),
            hz: 10.0,
        }
    }
}

/// How long a pose counts without a new one.
const PATIENCE: Duration = Duration::from_millis(500);

impl Part for RangeSensor {
    async fn run(self, slot: Slot) -> Result<Infallible, PartError> {
        let sensor = ground::RangeSensor::new(self.ranger, self.hz);
        let mut ranger = SimulatedRanger::new(self.ranger, self.scenery);
        let component = slot
            .timed_component("Range Sensor")
            .offer(sensor.service())
            .live_on(slot.port)?;
        slot.telemetry.attach(&component);
        let mut poses = Sense::pose(&component, self.hz)?;
        loop {
            let pose = match timeout(PATIENCE, poses.next()).await {
                Ok(report) => reported_pose(&report?),
                Err(_) => None,
            };
            let scan = pose.map(|pose| ranger.scan(&pose));
            if scan.is_some() {
                slot.telemetry.set_sampled("scan", now());
            }
            sensor.publish(scan.as_ref(), slot.time.system_time());
            _ = component.changed::<QueryRangeSensorData>().await;
        }
    }
}
