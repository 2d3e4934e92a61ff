//! A passively observed vehicle, for sensor services that report measured motion.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use super::{Drive, GlobalPose, Limits, Motion, Platform, Pose};

/// Externally measured motion of a vehicle. Cheap to clone; all clones share one state.
///
/// It implements [`Platform`] but ignores drive commands. Unknown components of the motion are NaN
/// and are omitted from reports.
#[derive(Debug, Clone, Default)]
pub struct Observed(Arc<Mutex<Observation>>);

#[derive(Debug, Default)]
struct Observation {
    motion: Motion,
    /// The pose set by a client.
    set_pose: Option<Pose>,
    /// The pose on the globe set by a client.
    set_global_pose: Option<GlobalPose>,
}

impl Observed {
    /// Creates a vehicle with this motion.
    #[must_use]
    pub fn new(motion: Motion) -> Self {
        let observed = Self::default();
        observed.set(motion);
        observed
    }

    /// Replaces the motion. [`Motion::sampled_at`] determines its age.
    pub fn set(&self, motion: Motion) {
        self.lock().motion = motion;
    }

    /// Takes the pose set by a client, if there is a new one.
    #[must_use]
    pub fn take_set_pose(&self) -> Option<Pose> {
        self.lock().set_pose.take()
    }

    /// Takes the pose on the globe set by a client, if there is a new one.
    #[must_use]
    pub fn take_set_global_pose(&self) -> Option<GlobalPose> {
        self.lock().set_global_pose.take()
    }

    fn lock(&self) -> MutexGuard<'_, Observation> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Platform for Observed {
    fn handle_time(&mut self, _: Instant) {}

    fn motion(&self) -> Motion {
        self.lock().motion
    }

    fn set_pose(&mut self, pose: Pose) {
        let mut observation = self.lock();
        observation.motion.pose = pose;
        observation.set_pose = Some(pose);
    }

    fn set_global_pose(&mut self, pose: GlobalPose) {
        self.lock().set_global_pose = Some(pose);
    }

    fn drive(&mut self, _: Drive) {}

    fn limits(&self) -> Limits {
        Limits::default()
    }

    fn set_limits(&mut self, _: Limits) {}
}
