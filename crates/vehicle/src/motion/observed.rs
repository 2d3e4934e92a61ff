//! A vehicle that is watched and not driven: what sensors report about.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use super::{Drive, Limits, Motion, Platform, Pose};

/// The motion of a vehicle as somebody has measured it. Cheap to clone; the clones are one vehicle.
///
/// It is a [`Platform`] that can not be driven: what it is told to do it does not do. What is not
/// known of its motion is NaN, and is left out of reports.
#[derive(Debug, Clone, Default)]
pub struct Observed(Arc<Mutex<Observation>>);

#[derive(Debug, Default)]
struct Observation {
    motion: Motion,
    /// The pose that a client has said it has.
    told: Option<Pose>,
}

impl Observed {
    /// A vehicle that moves like this.
    #[must_use]
    pub fn new(motion: Motion) -> Self {
        let observed = Self::default();
        observed.set(motion);
        observed
    }

    /// Replaces the motion; its age is judged by [`Motion::sampled_at`].
    pub fn set(&self, motion: Motion) {
        self.lock().motion = motion;
    }

    /// The pose that a client has said that it has, once.
    #[must_use]
    pub fn take_told(&self) -> Option<Pose> {
        self.lock().told.take()
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
        observation.told = Some(pose);
    }

    fn drive(&mut self, _: Drive) {}

    fn limits(&self) -> Limits {
        Limits::default()
    }

    fn set_limits(&mut self, _: Limits) {}
}
