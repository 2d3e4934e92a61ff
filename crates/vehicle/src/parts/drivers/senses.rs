//! Sensor input: subscriptions to a service of the own subsystem, with rediscovery after loss.

use std::convert::Infallible;

use super::{GlobalPoses, RemotePlatform};
use crate::ground::{reported_scan, reported_zones};
use crate::messages::environment_sensing::query_range_sensor_data::{
    QueryRangeSensorDataRec, ReportCoordinateSystem,
};
use crate::messages::environment_sensing::{
    QueryRangeSensorData, ReportRangeSensorData, range_sensor,
};
use crate::motion::{Fence, Pose};
use crate::parts::PartError;
use crate::sensing::Scan;
use crate::zones::Zones;
use jaus::address::JausId;
use jaus::codec::{Message, Query};
use jaus::component::{Audience, Component, GroupSubscription, GroupUpdate, PeerClocks, When};
use jaus::messages::core::report_time::TimeStamp;
use jaus::messages::mobility::{
    QueryGlobalPose, QueryLocalOperatingZone, QueryLocalPose, QueryVelocityState, ReportGlobalPose,
    ReportLocalOperatingZone, ReportLocalPose, ReportVelocityState, global_pose_sensor,
    local_operating_zone, local_pose_sensor, velocity_state_sensor,
};
use jaus::node::now;
use jaus::service::{SampleAge, SampleStamp};
use tokio::task::JoinSet;

/// The reports of one sensor of the own subsystem, whichever provides them at the time.
///
/// If there are several providers, the first one to report is used until it falls silent.
pub(in crate::parts) struct Sense<R> {
    reports: GroupSubscription<R>,
    /// Whether a report has what is wanted of a source.
    is_suitable: fn(&R) -> bool,
    source: Option<JausId>,
    /// The clock of the source.
    clocks: PeerClocks,
    /// Measures that clock until it is dropped.
    _measuring: JoinSet<Infallible>,
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
        let clocks = PeerClocks::default();
        let mut measuring = JoinSet::new();
        let (own, measured) = (component.clone(), clocks.clone());
        measuring.spawn(async move { measured.measure_wanted(&own).await });
        Ok(Self {
            reports: reports.map_err(|error| PartError::Broken(error.to_string()))?,
            is_suitable: |_| true,
            source: None,
            clocks,
            _measuring: measuring,
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

    /// What the time stamp of the last report says about the age of its sample; `None` for stamp 0,
    /// which sensors without a clock send.
    pub(in crate::parts) fn stamp(&self, stamp: Option<u32>) -> Option<SampleStamp> {
        let stamp = TimeStamp(stamp?);
        let measured = self.source.and_then(|peer| self.clocks.age(peer, stamp));
        SampleStamp::of_report(stamp, measured)
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
            let stamp = self.stamp(report.time_stamp.map(|it| it.0));
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
        let mut age = SampleAge::default();
        let mut controller = None;
        loop {
            let report = self.next().await?;
            let now_in_control = driver.standing().controller.map(|client| client.id);
            if std::mem::replace(&mut controller, now_in_control) != now_in_control {
                fence.confirm_pose();
            }
            let pose = reported_pose(&report);
            let stamp = self.stamp(report.time_stamp.map(|it| it.0));
            if self.take_loss() || pose.is_none() {
                age.forget();
                fence.handle_pose(None);
            }
            let sampled_at = age.handle(now(), stamp);
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
    ) -> Result<Option<(Option<SampleStamp>, Scan)>, PartError> {
        let report = self.next().await?;
        let scan = reported_scan(&report);
        Ok(scan.map(|(stamp, scan)| (self.stamp(Some(stamp.0)), scan)))
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
            poses.handle_report(now, self.stamp(report.time_stamp.map(|it| it.0)), &report);
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
            let stamp = self.stamp(report.time_stamp.map(|it| it.0));
            remote_platform.handle_velocity(now, stamp, velocity);
        }
    }
}
