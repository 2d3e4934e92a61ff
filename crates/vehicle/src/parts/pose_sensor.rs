//! The local pose sensor: dead reckoning from wheel travel.
#![expect(
    clippy::disallowed_methods,
    reason = "gives the sensor its clock and timer"
)]

use std::convert::Infallible;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use tokio::time::timeout;

use super::drivers::{ChainControl, Sense};
use super::keeper::{Keeper, keeper};
use super::pose_file::{self, Kept};
use super::{Part, PartError, Slot, Telemetry};
use crate::messages::ground::{QueryWheelOdometry, ReportWheelOdometry, wheel_odometry};
use crate::mobility::Vehicle;
use crate::motion::{DeadReckoning, Frame, Motion, Observed, Pilot, Pose, WheelCount};
use jaus::codec::Message;
use jaus::component::Component;
use jaus::messages::core::SetTime;
use jaus::messages::mobility::{QueryLocalPose, QueryLocalPoseExt, SetLocalPose, SetLocalPoseExt};
use jaus::node::now;
use jaus::service::SampleAge;

/// Estimates the pose by dead reckoning from a start pose and the wheel travel since.
///
/// It offers Local Pose Sensor. A client in control may set the pose and the time, but while a driver
/// of its subsystem is controlled, only the client at the head of that chain of drivers. Without wheel reports the
/// pose is omitted from its own reports. It stores pose and counts in a small file, so that after a
/// restart it resumes without losing the travel in between.
#[derive(Debug, Clone, PartialEq)]
pub struct PoseSensor {
    /// The file. Without one, every start begins at `start`.
    pub file: Option<PathBuf>,
    /// The initial pose if none is stored.
    pub start: Pose,
    /// Report rate requested for the wheels, in hertz.
    pub hz: f64,
    /// The pose becomes unknown without wheel reports for this time.
    pub silence: Duration,
}

impl Default for PoseSensor {
    fn default() -> Self {
        Self {
            file: None,
            start: Pose::default(),
            hz: 25.0,
            silence: Duration::from_millis(300),
        }
    }
}

impl Part for PoseSensor {
    async fn run(self, slot: Slot) -> Result<Infallible, PartError> {
        let reckoning = self.begin().await?;
        let observed = Observed::new(standing(Pose::UNKNOWN, None));
        let vehicle = Vehicle::new(Pilot::new(observed.clone(), Frame::default()))
            .with_clock(slot.time.clone());
        let chain = ChainControl::default();
        let component = slot
            .guarded_component("Local Pose Sensor", chain.guard(GUARDED))
            .offer(vehicle.local_pose_sensor())
            .live_on(slot.port)?;
        slot.telemetry.attach(&component);
        let query = QueryWheelOdometry {};
        let counts = Sense::of(
            &component,
            wheel_odometry::URN,
            &query,
            self.hz,
            "wheel travel",
        )?;
        let (keeper, kept) = keeper();
        let own = component.clone();
        let sensor = Running {
            component,
            telemetry: slot.telemetry,
            observed,
            reckoning,
            keeper: self.file.is_some().then_some(keeper),
            kept: None,
        };
        let reckoning = sensor.reckon(counts, self.silence);
        let Some(file) = &self.file else {
            return tokio::select! {
                end = reckoning => end,
                end = chain.track(&own) => end,
            };
        };
        // A stalled disk must not delay the pose.
        let writing = kept.write(PAUSE, async |kept: Kept| {
            pose_file::write(file, &kept).await
        });
        tokio::select! {
            end = reckoning => end,
            end = chain.track(&own) => end,
            () = writing => Err(PartError::NodeStopped),
        }
    }
}

/// What changes the pose that drivers drive by.
const GUARDED: &[u16] = &[SetLocalPose::CODE, SetLocalPoseExt::CODE, SetTime::CODE];

/// Minimum interval between writes. The wheel counts cover the travel in between.
const PAUSE: Duration = Duration::from_millis(500);

impl PoseSensor {
    async fn begin(&self) -> Result<DeadReckoning, PartError> {
        let kept = match &self.file {
            Some(file) => pose_file::read(file).await?,
            None => None,
        };
        let Some(Kept { pose, count }) = kept else {
            return Ok(DeadReckoning::at(self.start));
        };
        tracing::info!("pose restored: x {:.2} m, y {:.2} m", pose.x, pose.y);
        Ok(DeadReckoning::resume(pose, count))
    }
}

struct Running {
    component: Component,
    telemetry: Telemetry,
    observed: Observed,
    reckoning: DeadReckoning,
    keeper: Option<Keeper<Kept>>,
    /// The last content handed over for writing.
    kept: Option<Kept>,
}

impl Running {
    async fn reckon(
        mut self,
        mut counts: Sense<ReportWheelOdometry>,
        silence: Duration,
    ) -> Result<Infallible, PartError> {
        let mut age = SampleAge::default();
        let mut sampled_at = None;
        loop {
            let heard = timeout(silence, counts.next()).await;
            let now = now();
            if counts.take_loss() {
                age.forget();
            }
            self.take_set_pose();
            let pose = match heard {
                Ok(report) => {
                    let count = WheelCount::from(&report?);
                    let read_at = Duration::from_millis(count.time_ms.into());
                    self.reckoning.handle_count(count);
                    if let Some(at) = age.handle(now, Some(read_at.into())) {
                        sampled_at = Some(at);
                        self.telemetry.set_sampled("pose", at);
                    }
                    self.reckoning.pose()
                }
                Err(_) => {
                    sampled_at = Some(now);
                    Pose::UNKNOWN
                }
            };
            self.observed.set(standing(pose, sampled_at));
            _ = self.component.changed::<QueryLocalPose>().await;
            _ = self.component.changed::<QueryLocalPoseExt>().await;
            self.keep();
        }
    }

    /// Applies the pose set by a client, if there is one.
    fn take_set_pose(&mut self) {
        if let Some(pose) = self.observed.take_set_pose() {
            self.reckoning.set_pose(pose);
            let pose = self.reckoning.pose();
            tracing::info!("pose set to x {:.2} m, y {:.2} m", pose.x, pose.y);
        }
    }

    /// Queues the pose for writing if it has changed.
    fn keep(&mut self) {
        let (Some(keeper), Some(count)) = (&self.keeper, self.reckoning.count()) else {
            return;
        };
        let kept = Kept {
            pose: self.reckoning.pose(),
            count,
        };
        if self.kept.is_none_or(|before| before.differs(&kept)) {
            self.kept = Some(kept);
            keeper.keep(kept);
        }
    }
}

fn standing(pose: Pose, sampled_at: Option<Instant>) -> Motion {
    Motion {
        pose,
        sampled_at,
        ..Motion::default()
    }
}
