//! Sensor input: subscriptions to a service of the own subsystem, with rediscovery after loss.

use std::convert::Infallible;
use std::time::Duration;

use super::{GlobalPoses, RemotePlatform};
use crate::ground::{reported_scan, reported_zones};
use crate::messages::environment_sensing::query_range_sensor_data::{
    QueryRangeSensorDataRec, ReportCoordinateSystem,
};
use crate::messages::environment_sensing::{
    QueryRangeSensorData, ReportRangeSensorData, range_sensor,
};
use crate::motion::{Fence, Freshness, Pose};
use crate::parts::PartError;
use crate::sensing::Scan;
use crate::zones::Zones;
use jaus::address::JausId;
use jaus::codec::{Message, Query};
use jaus::component::{Audience, Component, GroupSubscription, GroupUpdate, When};
use jaus::messages::mobility::report_local_pose::TimeStamp;
use jaus::messages::mobility::{
    QueryGlobalPose, QueryLocalOperatingZone, QueryLocalPose, QueryVelocityState, ReportGlobalPose,
    ReportLocalOperatingZone, ReportLocalPose, ReportVelocityState, global_pose_sensor,
    local_operating_zone, local_pose_sensor, velocity_state_sensor,
};
use jaus::node::now;

/// The reports of one sensor of the own subsystem, whichever provides them at the time.
///
/// If there are several providers, the first one to report is used until it falls silent.
pub(in crate::parts) struct Sense<R> {
    reports: GroupSubscription<R>,
    /// Whether a report has what is wanted of a source.
    is_suitable: fn(&R) -> bool,
    source: Option<JausId>,
    /// Whether the source was lost since the last report.
    was_lost: bool,
    what: &'static str,
}

impl<R: Message> Sense<R> {
    /// Starts discovery of providers and subscribes to them. `what` names the data in log messages.
    pub(in crate::parts) fn of<Q: Query<Report = R>>(
        component: &Component,
        urn: &'static str,
        query: &Q,
        hz: f64,
        what: &'static str,
    ) -> Result<Self, PartError> {
        let providers = Audience::providers(urn).in_subsystem(component.id().subsystem());
        let reports = component.subscribe_all(providers, query, When::hz(hz));
        Ok(Self {
            reports: reports.map_err(|error| PartError::Broken(error.to_string()))?,
            is_suitable: |_| true,
            source: None,
            was_lost: false,
            what,
        })
    }

    /// Waits for the next report. The returned future is cancel safe.
    pub(in crate::parts) async fn next(&mut self) -> Result<R, PartError> {
        loop {
            let next = self.reports.next().await;
            let (source, update) = next.ok_or(PartError::NodeStopped)?;
            match update {
                GroupUpdate::Report(report) => {
                    if self.source.is_none() && (self.is_suitable)(&report) {
                        tracing::info!("{} from {source}", self.what);
                        self.source = Some(source);
                    }
                    if self.source == Some(source) {
                        return Ok(report);
                    }
                }
                GroupUpdate::Down { why, .. } if self.source == Some(source) => {
                    tracing::info!("no {} from {source}: {why}", self.what);
                    self.source = None;
                    self.was_lost = true;
                }
                GroupUpdate::Gone if self.source == Some(source) => {
                    tracing::info!("no {} from {source}: it is lost", self.what);
                    self.source = None;
                    self.was_lost = true;
                }
                _ => {}
            }
        }
    }
}

impl<R: Message> Sense<R> {
    /// Takes the flag that the source was lost. The next report may come from another source with
    /// another clock.
    pub(in crate::parts) const fn take_loss(&mut self) -> bool {
        std::mem::replace(&mut self.was_lost, false)
    }
}

/// The pose in a report; `None` if the sensor does not know it.
pub(in crate::parts) fn reported_pose(report: &ReportLocalPose) -> Option<Pose> {
    let place = report.x_m().zip(report.y_m()).zip(report.yaw_rad());
    place.map(|((x, y), yaw)| Pose {
        yaw,
        ..Pose::at(x, y)
    })
}

impl Sense<ReportLocalPose> {
    /// The pose in the local frame.
    pub(in crate::parts) fn pose(component: &Component, hz: f64) -> Result<Self, PartError> {
        let query = QueryLocalPose::none()
            .with_x()
            .with_y()
            .with_yaw()
            .with_time_stamp();
        Self::of(component, local_pose_sensor::URN, &query, hz, "pose")
    }

    /// Passes all reports to a remote platform.
    pub(in crate::parts) async fn steer(
        mut self,
        remote_platform: &RemotePlatform,
    ) -> Result<Infallible, PartError> {
        loop {
            let report = self.next().await?;
            let now = now();
            if self.take_loss() {
                remote_platform.handle_pose(now, None, None);
            }
            let pose = reported_pose(&report).map(|it| (it.x, it.y, it.yaw));
            let stamp = report.time_stamp.and_then(time_in_month);
            remote_platform.handle_pose(now, stamp, pose);
        }
    }
}

impl Sense<ReportLocalPose> {
    /// Passes all reports to a fence whose platform does not know its pose in the zones' frame. Who
    /// takes control of `driver` confirms a pose that has jumped.
    pub(in crate::parts) async fn locate(
        mut self,
        fence: &Fence,
        driver: &Component,
    ) -> Result<Infallible, PartError> {
        let mut freshness = Freshness::default();
        let mut controller = None;
        loop {
            let report = self.next().await?;
            let now_in_control = driver.standing().controller.map(|client| client.id);
            if std::mem::replace(&mut controller, now_in_control) != now_in_control {
                fence.confirm_pose();
            }
            let pose = reported_pose(&report);
            let stamp = report.time_stamp.and_then(time_in_month);
            if self.take_loss() || pose.is_none() {
                freshness.forget();
                fence.handle_pose(None);
            }
            let sampled_at = freshness.handle(now(), stamp);
            if let Some(located) = pose.zip(sampled_at) {
                fence.handle_pose(Some(located));
            }
        }
    }
}

impl Sense<ReportRangeSensorData> {
    /// Scans of the range sensor in the vehicle's coordinates.
    pub(in crate::parts) fn scans(component: &Component, hz: f64) -> Result<Self, PartError> {
        let query = QueryRangeSensorData {
            query_range_sensor_data_list: vec![QueryRangeSensorDataRec {
                report_coordinate_system: ReportCoordinateSystem::VEHICLE_COORDINATE_SYSTEM,
                ..QueryRangeSensorDataRec::default()
            }],
        };
        Self::of(component, range_sensor::URN, &query, hz, "scans")
    }

    /// Waits for the next report of a sensor: its scan and time stamp, or `None` while it does not
    /// measure.
    pub(in crate::parts) async fn next_scan(
        &mut self,
    ) -> Result<Option<(Option<Duration>, Scan)>, PartError> {
        let report = self.next().await?;
        let scan = reported_scan(&report);
        Ok(scan.map(|(stamp, scan)| (time_in_month(TimeStamp(stamp.0)), scan)))
    }

    /// Passes all scans to a remote platform, and the obstacles to a fence.
    pub(in crate::parts) async fn watch(
        mut self,
        remote_platform: &RemotePlatform,
        fence: &Fence,
    ) -> Result<Infallible, PartError> {
        loop {
            let scan = self.next_scan().await?;
            let now = now();
            if self.take_loss() {
                remote_platform.handle_scan(now, None, None);
            }
            let stamp = scan.as_ref().and_then(|(stamp, _)| *stamp);
            let scan = scan.as_ref().map(|(_, scan)| scan);
            if let Some(obstacles) = remote_platform.handle_scan(now, stamp, scan) {
                fence.set_obstacles(obstacles);
            }
        }
    }
}

impl Sense<ReportLocalOperatingZone> {
    /// Report rate, in hertz. A new zone takes effect within its period.
    const HZ: f64 = 2.0;

    /// The zones of the vehicle.
    pub(in crate::parts) fn zones(component: &Component) -> Result<Self, PartError> {
        let urn = local_operating_zone::URN;
        let query = QueryLocalOperatingZone::default();
        Self::of(component, urn, &query, Self::HZ, "operating zones")
    }

    /// Waits for the next valid zones. While their store is lost the last ones hold, and invalid
    /// zones leave the previous ones in force.
    pub(in crate::parts) async fn next_zones(&mut self) -> Result<Zones, PartError> {
        loop {
            match reported_zones(&self.next().await?) {
                Ok(zones) => return Ok(zones),
                Err(why) => tracing::error!("unusable operating zones, the last ones hold: {why}"),
            }
        }
    }

    /// Passes all zones to a fence.
    pub(in crate::parts) async fn enclose(
        mut self,
        fence: &Fence,
    ) -> Result<Infallible, PartError> {
        loop {
            fence.set_zones(self.next_zones().await?);
        }
    }
}

impl Sense<ReportGlobalPose> {
    /// The pose on the globe, with its standard error.
    pub(in crate::parts) fn global_pose(component: &Component, hz: f64) -> Result<Self, PartError> {
        let query = QueryGlobalPose::none()
            .with_latitude()
            .with_longitude()
            .with_yaw()
            .with_position_rms()
            .with_time_stamp();
        Self::of(
            component,
            global_pose_sensor::URN,
            &query,
            hz,
            "global pose",
        )
    }

    /// Passes all reports on.
    pub(in crate::parts) async fn steer(
        mut self,
        poses: GlobalPoses,
    ) -> Result<Infallible, PartError> {
        loop {
            let report = self.next().await?;
            let now = now();
            if self.take_loss() {
                poses.handle_loss(now);
            }
            poses.handle_report(now, &report);
        }
    }
}

impl Sense<ReportVelocityState> {
    /// The velocity along and about the vehicle's own axes, of a source that knows the speed: an
    /// inertial measurement unit does not.
    pub(in crate::parts) fn velocity(component: &Component, hz: f64) -> Result<Self, PartError> {
        let query = QueryVelocityState::none()
            .with_velocity_x()
            .with_yaw_rate()
            .with_time_stamp();
        let urn = velocity_state_sensor::URN;
        let sense = Self::of(component, urn, &query, hz, "velocity")?;
        Ok(Self {
            is_suitable: |report| report.velocity_x.is_some(),
            ..sense
        })
    }

    /// The yaw rate about the vehicle's own axis, of a source that does not know the speed: an
    /// inertial measurement unit.
    pub(in crate::parts) fn yaw_rate(component: &Component, hz: f64) -> Result<Self, PartError> {
        let sense = Self::velocity(component, hz)?;
        Ok(Self {
            is_suitable: |report| report.velocity_x.is_none() && report.yaw_rate.is_some(),
            what: "turn rate",
            ..sense
        })
    }

    /// Passes all reports to a remote platform.
    pub(in crate::parts) async fn steer(
        mut self,
        remote_platform: &RemotePlatform,
    ) -> Result<Infallible, PartError> {
        loop {
            let report = self.next().await?;
            let now = now();
            if self.take_loss() {
                remote_platform.handle_velocity(now, None, None);
            }
            let velocity = report.velocity_x_m_per_s().zip(report.yaw_rate_rad_per_s());
            let stamp = report.time_stamp.and_then(time_in_month);
            remote_platform.handle_velocity(now, stamp, velocity);
        }
    }
}

/// Converts a stamp of version 1.0 reports to the time since the start of its month; `None` for
/// stamp 0, which sensors without a clock send.
pub(in crate::parts) fn time_in_month(stamp: TimeStamp) -> Option<Duration> {
    let hours = u64::from(stamp.day()) * 24 + u64::from(stamp.hour());
    let seconds = (hours * 60 + u64::from(stamp.minutes())) * 60 + u64::from(stamp.seconds());
    let time = Duration::from_millis(seconds * 1000 + u64::from(stamp.milliseconds()));
    Some(time).filter(|time| !time.is_zero())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_stamp_0_is_none() {
        assert_eq!(time_in_month(TimeStamp::default()), None);
        let stamp = TimeStamp::default().with_day(2).unwrap();
        let stamp = stamp.with_milliseconds(7).unwrap();
        let time = Duration::from_millis(2 * 86_400_000 + 7);
        assert_eq!(time_in_month(stamp), Some(time));
    }
}
