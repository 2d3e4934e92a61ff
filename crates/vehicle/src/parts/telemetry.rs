//! What a running part shows to monitoring besides its JAUS services.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use crate::mission::Stage;
use jaus::component::Component;

/// The values that a running part shows to monitoring. Cheap to clone; all clones share one state.
///
/// A part sets what it knows. The rest stays unknown, and costs nothing.
#[derive(Clone, Debug, Default)]
pub struct Telemetry(Arc<Mutex<Readout>>);

/// The values of a [`Telemetry`] at one moment.
#[derive(Clone, Debug, Default)]
pub struct Readout {
    /// The component, while the part runs.
    pub component: Option<Component>,
    /// Forward velocity of the vehicle in m/s; negative in reverse.
    pub speed: Option<f64>,
    /// When the newest sample of each sensor value was taken, by the clock of the node.
    pub samples: BTreeMap<&'static str, Instant>,
    /// The missions of a planner.
    pub missions: Option<MissionCounts>,
}

/// The missions of a planner since its start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MissionCounts {
    /// Stage of the current mission.
    pub stage: Stage,
    /// Missions that reached their destination.
    pub arrived: u64,
    /// Missions that were given up.
    pub failed: u64,
    /// Missions that the operator or an emergency ended.
    pub stopped: u64,
}

impl Telemetry {
    /// The values at present.
    #[must_use]
    pub fn readout(&self) -> Readout {
        self.lock().clone()
    }

    /// Sets the component. The telemetry keeps it running until [`release`](Self::release).
    pub fn attach(&self, component: &Component) {
        self.lock().component = Some(component.clone());
    }

    /// Forgets the component, so that it can stop.
    pub fn release(&self) {
        self.lock().component = None;
    }

    /// Sets the forward velocity in m/s; NaN if it is unknown.
    pub fn set_speed(&self, speed: f64) {
        self.lock().speed = (!speed.is_nan()).then_some(speed);
    }

    /// Sets when the newest sample of a value was taken, such as `pose`.
    pub fn set_sampled(&self, value: &'static str, at: Instant) {
        self.lock().samples.insert(value, at);
    }

    /// Sets the stage of the current mission, and counts missions that end with it. Call it once
    /// for each change.
    pub fn set_stage(&self, stage: Stage) {
        let mut readout = self.lock();
        let missions = readout.missions.get_or_insert_default();
        missions.stage = stage;
        match stage {
            Stage::Arrived => missions.arrived += 1,
            Stage::Failed => missions.failed += 1,
            Stage::Stopped => missions.stopped += 1,
            _ => {}
        }
    }

    fn lock(&self) -> MutexGuard<'_, Readout> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn missions_are_counted_by_their_end() {
        let telemetry = Telemetry::default();
        assert_eq!(telemetry.readout().missions, None);
        for stage in [Stage::Planning, Stage::Driving, Stage::Arrived] {
            telemetry.set_stage(stage);
        }
        for stage in [Stage::Planning, Stage::Failed, Stage::Map, Stage::Stopped] {
            telemetry.set_stage(stage);
        }
        let expected = MissionCounts {
            stage: Stage::Stopped,
            arrived: 1,
            failed: 1,
            stopped: 1,
        };
        assert_eq!(telemetry.readout().missions, Some(expected));
    }

    #[test]
    fn an_unknown_speed_is_no_speed() {
        let telemetry = Telemetry::default();
        telemetry.set_speed(1.5);
        assert_eq!(telemetry.readout().speed, Some(1.5));
        telemetry.set_speed(f64::NAN);
        assert_eq!(telemetry.readout().speed, None);
    }
}
