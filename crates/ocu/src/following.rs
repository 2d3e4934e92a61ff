//! The station's subscriptions to the reports of a vehicle's parts, renewed for as long as the part
//! exists: all of the selected vehicle, and the few of the others that the list of vehicles shows.

use std::collections::BTreeMap;
use std::time::Duration;

use tokio::sync::mpsc;
use tokio::task::JoinSet;
use tokio::time::sleep;

use crate::picture::{Depth, Picture};
use crate::report::Report;
use crate::role;
use jaus::address::JausId;
use jaus::codec::Query;
use jaus::component::{Component, SubscribeError, Update, When};
use jaus::messages::core::{QueryControl, QueryStatus, access_control};
use jaus::messages::mobility::{
    QueryGlobalPose, QueryLocalOperatingZone, QueryLocalPose, QueryVelocityState,
    local_operating_zone,
};
use jaus::node::now;
use jaus::service::ComponentEntry;
use jaus_vehicle::messages::environment_sensing::query_range_sensor_data::{
    QueryRangeSensorDataRec, ReportCoordinateSystem,
};
use jaus_vehicle::messages::environment_sensing::{QueryRangeSensorData, range_sensor};
use jaus_vehicle::messages::ground::{
    QueryMission, QueryPlannedPath, QueryRasterMaps, QueryStage, mission_planner, raster_maps,
};

/// A report with its sender.
pub(super) type Sighting = (JausId, Report);

/// The subscriptions to the parts of one vehicle.
pub(super) struct Following {
    component: Component,
    sighted: mpsc::Sender<Sighting>,
    parts: BTreeMap<JausId, Followed>,
}

/// The subscriptions to one part. Dropping this ends them.
struct Followed {
    topics: Topics,
    _tasks: JoinSet<()>,
}

/// The reports that a part offers.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Topics {
    status: Option<When>,
    control: bool,
    stage: bool,
    pose: bool,
    global_pose: bool,
    velocity: Option<When>,
    mission: bool,
    path: bool,
    maps: bool,
    zones: bool,
    scan: bool,
}

/// Rate of pose and velocity reports.
const MOTION: When = When::hz(10.0);
/// Rate of global pose reports.
const GLOBAL_POSE: When = When::hz(5.0);
/// Rate of status reports.
const STATUS: When = When::hz(4.0);
/// Rate of status reports of a vehicle that is only in the list.
const BRIEF_STATUS: When = When::hz(1.0);
/// Rate of velocity reports of a vehicle that is only in the list.
const BRIEF_VELOCITY: When = When::hz(1.0);
/// Rate of reports of the operating zones.
const ZONES: When = When::hz(1.0);
/// Least time between two scans.
const SCAN: Duration = Duration::from_millis(500);
/// A scan takes up the link for at most one part in this many of the time.
const SCAN_SHARE: u32 = 4;
/// Delay before a failed subscription is retried.
const PAUSE: Duration = Duration::from_secs(1);

impl Topics {
    fn of(part: &ComponentEntry, picture: &Picture) -> Self {
        match picture.depth() {
            Depth::Brief => Self::brief(part, picture.principal()),
            Depth::Full => Self::full(part),
        }
    }

    fn brief(part: &ComponentEntry, principal: Option<JausId>) -> Self {
        Self {
            status: (principal == Some(part.id)).then_some(BRIEF_STATUS),
            control: principal == Some(part.id) || part.offers(mission_planner::URN),
            velocity: role::reports_velocity(part).then_some(BRIEF_VELOCITY),
            mission: part.offers(mission_planner::URN),
            ..Self::default()
        }
    }

    fn full(part: &ComponentEntry) -> Self {
        Self {
            status: role::is_managed(part).then_some(STATUS),
            control: role::is_managed(part) || part.offers(access_control::URN),
            stage: role::tells_stage(part),
            pose: role::reports_pose(part),
            global_pose: role::reports_global_pose(part),
            velocity: role::reports_velocity(part).then_some(MOTION),
            mission: part.offers(mission_planner::URN),
            path: part.offers(mission_planner::URN),
            maps: part.offers(raster_maps::URN),
            zones: part.offers(local_operating_zone::URN),
            scan: part.offers(range_sensor::URN),
        }
    }
}

impl Following {
    pub(super) const fn new(component: Component, sighted: mpsc::Sender<Sighting>) -> Self {
        Self {
            component,
            sighted,
            parts: BTreeMap::new(),
        }
    }

    /// Updates the subscriptions to match the current parts of the vehicle.
    pub(super) fn follow(&mut self, picture: &Picture) {
        self.parts.retain(|id, _| picture.parts().contains_key(id));
        for id in picture.parts().keys() {
            let Some(part) = picture.directory().component(*id) else {
                continue;
            };
            let topics = Topics::of(part, picture);
            if self.parts.get(id).is_none_or(|it| it.topics != topics) {
                let _tasks = self.start(*id, topics);
                self.parts.insert(*id, Followed { topics, _tasks });
            }
        }
    }

    fn start(&self, peer: JausId, topics: Topics) -> JoinSet<()> {
        let mut tasks = JoinSet::new();
        if let Some(rate) = topics.status {
            tasks.spawn(self.ask(peer, QueryStatus {}, rate));
        }
        if topics.control {
            let rate = topics.status.unwrap_or(BRIEF_STATUS);
            tasks.spawn(self.ask(peer, QueryControl {}, rate));
        }
        if topics.stage {
            tasks.spawn(self.ask(peer, QueryStage {}, STATUS));
        }
        if topics.pose {
            let query = QueryLocalPose::all();
            tasks.spawn(self.ask(peer, query, MOTION));
        }
        if topics.global_pose {
            let query = QueryGlobalPose::all();
            tasks.spawn(self.ask(peer, query, GLOBAL_POSE));
        }
        if let Some(rate) = topics.velocity {
            let query = QueryVelocityState::all();
            tasks.spawn(self.ask(peer, query, rate));
        }
        if topics.mission {
            let rate = topics.status.unwrap_or(BRIEF_STATUS);
            tasks.spawn(self.ask(peer, QueryMission {}, rate));
        }
        if topics.path {
            let path = QueryPlannedPath {};
            tasks.spawn(self.ask(peer, path, When::OnChange));
        }
        if topics.maps {
            let maps = QueryRasterMaps {};
            tasks.spawn(self.ask(peer, maps, When::OnChange));
        }
        if topics.zones {
            let zones = QueryLocalOperatingZone::default();
            tasks.spawn(self.ask(peer, zones, ZONES));
        }
        if topics.scan {
            tasks.spawn(self.poll_scan(peer));
        }
        tasks
    }

    /// Queries scans until the future is dropped. A scan has thousands of octets: on a slow link the
    /// next one is queried later, so that the reports by which the operator drives are not delayed.
    fn poll_scan(&self, peer: JausId) -> impl Future<Output = ()> + Send + use<> {
        let (component, sighted) = (self.component.clone(), self.sighted.clone());
        let query = QueryRangeSensorData {
            query_range_sensor_data_list: vec![QueryRangeSensorDataRec {
                report_coordinate_system: ReportCoordinateSystem::VEHICLE_COORDINATE_SYSTEM,
                ..QueryRangeSensorDataRec::default()
            }],
        };
        async move {
            loop {
                let asked = now();
                match component.query(peer, &query).await {
                    Ok(report) => {
                        if sighted.send((peer, report.into())).await.is_err() {
                            return;
                        }
                    }
                    Err(error) => tracing::debug!(%peer, %error, "no scan"),
                }
                sleep(SCAN.max((now() - asked) * SCAN_SHARE)).await;
            }
        }
    }

    /// Maintains one subscription until the future is dropped.
    fn ask<Q: Query>(
        &self,
        peer: JausId,
        query: Q,
        when: When,
    ) -> impl Future<Output = ()> + Send + use<Q>
    where
        Q::Report: Into<Report>,
    {
        let (component, sighted) = (self.component.clone(), self.sighted.clone());
        async move {
            loop {
                match component.subscribe(peer, &query, when).await {
                    Ok(mut reports) => {
                        while let Some(update) = reports.next().await {
                            let report = match update {
                                Update::Report(report) => report.into(),
                                Update::Up => Report::Subscription { is_up: true },
                                Update::Down { .. } => Report::Subscription { is_up: false },
                            };
                            if sighted.send((peer, report)).await.is_err() {
                                return;
                            }
                        }
                    }
                    Err(SubscribeError::Stopped) => return,
                    Err(error) => tracing::debug!(%peer, %error, "not subscribed"),
                }
                sleep(PAUSE).await;
            }
        }
    }
}
