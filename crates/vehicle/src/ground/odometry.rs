//! Wheel Odometry: reports the distance travelled by the wheels of each side.

use std::time::Instant;

use crate::actuator::Odometer;
use crate::messages::ground::{QueryWheelOdometry, ReportWheelOdometry, wheel_odometry};
use crate::mobility::Vehicle;
use crate::motion::WheelCount;
use jaus::codec::{Message, ServiceId};
use jaus::endpoint::Received;
use jaus::service::{Context, Handled, Service, code_of};

/// Reports the count of an odometer to any client.
#[derive(Debug)]
pub struct WheelOdometry {
    odometer: Odometer,
    vehicle: Vehicle,
    /// The distances of the last change event.
    announced: (f64, f64),
}

impl WheelOdometry {
    /// Creates the service. The vehicle is updated before each reading.
    #[must_use]
    pub const fn new(odometer: Odometer, vehicle: Vehicle) -> Self {
        Self {
            odometer,
            vehicle,
            announced: (0.0, 0.0),
        }
    }
}

impl Service for WheelOdometry {
    fn offers(&self) -> Vec<ServiceId> {
        vec![wheel_odometry::LATEST]
    }

    fn handle_message(
        &mut self,
        now: Instant,
        message: &Received,
        context: &mut Context<'_>,
    ) -> Handled {
        if code_of(&message.payload) != Some(QueryWheelOdometry::CODE) {
            return Handled::No;
        }
        self.vehicle.handle_time(now);
        context.reply(message, &report(&self.odometer.count()));
        Handled::Yes
    }

    fn handle_timeout(&mut self, _: Instant, context: &mut Context<'_>) {
        let count = self.odometer.count();
        let travelled = (count.left, count.right);
        if travelled != self.announced {
            self.announced = travelled;
            context.changed::<QueryWheelOdometry>();
        }
    }
}

fn report(count: &WheelCount) -> ReportWheelOdometry {
    ReportWheelOdometry {
        start: count.start,
        time: count.time_ms,
        left: count.left,
        right: count.right,
        track: count.track as f32,
    }
}

impl From<&ReportWheelOdometry> for WheelCount {
    fn from(report: &ReportWheelOdometry) -> Self {
        Self {
            start: report.start,
            time_ms: report.time,
            left: report.left,
            right: report.right,
            track: report.track.into(),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;
    use crate::actuator::{MotorConfig, SimulatedMotor, Wheels, WheelsConfig};
    use crate::motion::{Frame, Pilot};
    use jaus::messages::mobility::SetWrenchEffort;
    use jaus::service::MotionPolicy;
    use jaus::service::rig::{CLIENT, Rig};

    #[test]
    fn it_counts_what_the_primitive_driver_drives() {
        let odometer = Odometer::new(77);
        let motor = || SimulatedMotor::new(MotorConfig::default());
        let wheels = Wheels::new(motor(), motor(), WheelsConfig::default(), odometer.clone());
        let pilot = Pilot::new(wheels, Frame::default());
        let vehicle = Vehicle::new(pilot).motion_policy(MotionPolicy::Hold);
        let odometry = WheelOdometry::new(odometer, vehicle.clone());
        let driver = vehicle.primitive_driver();
        let mut rig = Rig::new(vec![Box::new(driver), Box::new(odometry)]);
        let before: ReportWheelOdometry = rig.ask(&QueryWheelOdometry {}).unwrap();
        assert_eq!((before.start, before.left), (77, 0.0));
        let mut effort = SetWrenchEffort::default();
        effort
            .set_propulsive_linear_effort_x_percent(100.0)
            .unwrap();
        rig.send(CLIENT, &effort);
        rig.run(Duration::from_secs(1));
        let after: ReportWheelOdometry = rig.ask(&QueryWheelOdometry {}).unwrap();
        assert!(after.left > 1.4 && (after.left - after.right).abs() < 1e-9);
        assert!((900..=1100).contains(&(after.time - before.time)));
        assert!(rig.changed().contains(&QueryWheelOdometry::CODE));
    }
}
