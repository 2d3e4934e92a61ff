//! The local pose sensor: where the vehicle is, reckoned from the travel of its wheels.
#![expect(
    clippy::disallowed_methods,
    reason = "here the sensor gets its time, and waits for it"
)]

use std::convert::Infallible;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use tokio::time::timeout;

use super::drivers::Sense;
use super::pose_file::{self, Kept};
use super::{Part, PartError, Seat};
use crate::component::{AccessControl, Component};
use crate::messages::ground::{QueryWheelOdometry, ReportWheelOdometry, wheel_odometry};
use crate::messages::mobility::{QueryLocalPose, QueryLocalPoseExt};
use crate::service::mobility::Vehicle;
use crate::vehicle::{DeadReckoning, Frame, Motion, Observed, Pilot, Pose, WheelCount};

/// Reckons where the vehicle is from where it was and what its wheels have travelled since.
///
/// It offers Local Pose Sensor; a client in control may tell it the pose. While the wheels can not
/// be heard its reports leave the pose out. What it knows it keeps in a small file, so that it goes
/// on from there when it is started again, as if it had been there all the time.
#[derive(Debug, Clone, PartialEq)]
pub struct PoseSensor {
    /// The file; without one it begins at `start` whenever it is started.
    pub file: Option<PathBuf>,
    /// Where it begins if nothing is kept.
    pub start: Pose,
    /// How often the wheels are asked for, in hertz.
    pub hz: f64,
    /// The pose is not known any more when the wheels have not been heard for so long.
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
    async fn run(self, seat: Seat) -> Result<Infallible, PartError> {
        let reckoning = self.begin().await?;
        let observed = Observed::new(standing(unknown()));
        let vehicle = Vehicle::new(Pilot::new(observed.clone(), Frame::default()))
            .with_time(Instant::now(), super::time_of_day());
        let component = seat
            .component("Local Pose Sensor")
            .access_control(AccessControl::new())
            .offer(vehicle.local_pose_sensor())
            .live_on(seat.port)?;
        let query = QueryWheelOdometry {};
        let counts = Sense::of(
            &component,
            wheel_odometry::URN,
            &query,
            self.hz,
            "wheel travel",
        )?;
        let sensor = Running {
            component,
            observed,
            reckoning,
            file: self.file,
            kept: None,
            kept_at: None,
        };
        sensor.reckon(counts, self.silence).await
    }
}

impl PoseSensor {
    async fn begin(&self) -> Result<DeadReckoning, PartError> {
        let kept = match &self.file {
            Some(file) => pose_file::read(file).await?,
            None => None,
        };
        let Some(Kept { pose, count }) = kept else {
            return Ok(DeadReckoning::at(self.start));
        };
        tracing::info!("goes on at x {:.2} m, y {:.2} m", pose.x, pose.y);
        Ok(DeadReckoning::resume(pose, count))
    }
}

struct Running {
    component: Component,
    observed: Observed,
    reckoning: DeadReckoning,
    file: Option<PathBuf>,
    /// What the file holds, and since when.
    kept: Option<Kept>,
    kept_at: Option<Instant>,
}

impl Running {
    /// The file is written at most so often: what is driven meanwhile is in the wheels' counts.
    const PAUSE: Duration = Duration::from_millis(500);

    async fn reckon(
        mut self,
        mut counts: Sense<ReportWheelOdometry>,
        silence: Duration,
    ) -> Result<Infallible, PartError> {
        loop {
            let heard = timeout(silence, counts.next()).await;
            let was_told = self.take_told();
            let pose = match heard {
                Ok(report) => {
                    self.reckoning.handle_count(WheelCount::from(&report?));
                    self.reckoning.pose()
                }
                Err(_) => unknown(),
            };
            self.observed.set(standing(pose));
            self.component.changed::<QueryLocalPose>().await;
            self.component.changed::<QueryLocalPoseExt>().await;
            self.keep(was_told).await;
        }
    }

    /// Takes the pose that a client has set, if one has.
    fn take_told(&mut self) -> bool {
        let told = self.observed.take_told();
        if let Some(pose) = told {
            self.reckoning.set_pose(pose);
            let pose = self.reckoning.pose();
            tracing::info!("was told to be at x {:.2} m, y {:.2} m", pose.x, pose.y);
        }
        told.is_some()
    }

    /// Writes the file if there is something new to keep and it is time. That it can not be written
    /// is told and tried again: a vehicle must not lose its pose for a full disk.
    async fn keep(&mut self, at_once: bool) {
        let (Some(file), Some(count)) = (&self.file, self.reckoning.count()) else {
            return;
        };
        let kept = Kept {
            pose: self.reckoning.pose(),
            count,
        };
        let is_news = self
            .kept
            .as_ref()
            .is_none_or(|before| before.differs(&kept));
        let is_time = self.kept_at.is_none_or(|at| at.elapsed() >= Self::PAUSE);
        if is_news && (is_time || at_once) {
            match pose_file::write(file, &kept).await {
                Ok(()) => self.kept = Some(kept),
                Err(error) => tracing::warn!("{error}"),
            }
            self.kept_at = Some(Instant::now());
        }
    }
}

fn standing(pose: Pose) -> Motion {
    Motion {
        pose,
        ..Motion::default()
    }
}

/// What is not known is not reported.
fn unknown() -> Pose {
    Pose {
        x: f64::NAN,
        y: f64::NAN,
        z: f64::NAN,
        roll: f64::NAN,
        pitch: f64::NAN,
        yaw: f64::NAN,
    }
}
