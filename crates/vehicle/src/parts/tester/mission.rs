//! A mission test of the whole chain, step by step: planner, store, path segment driver, vector
//! driver, primitive driver, and back.
#![expect(
    clippy::disallowed_methods,
    reason = "gives the steps their clock and timeouts"
)]

use std::time::Duration;

use super::steps::{Step, Verdict};
use crate::messages::ground::report_mission::Stage;
use crate::messages::ground::set_destination::Approved;
use crate::messages::ground::{
    ApproveMission, QueryMission, QueryPlannedPath, QueryRasterMaps, QueryStage, ReportMission,
    SetDestination, mission_planner, raster_maps,
};
use crate::mission::{Footprint, Link, Path, Point, plan};
use crate::parts::planner::{chain, map};
use jaus::address::JausId;
use jaus::codec::Query;
use jaus::component::{Audience, Component, Control, Subscription, When};
use jaus::messages::core::QueryControl;
use jaus::messages::mobility::{
    QueryLocalPose, QueryVelocityState, local_pose_sensor, velocity_state_sensor,
};
use jaus::node::now;

/// Settings of a mission test.
#[derive(Debug, Clone, PartialEq)]
pub struct MissionTest {
    /// The vehicle's subsystem.
    pub subsystem: u16,
    /// The destination in the local frame. `None` chooses one about four metres away.
    pub to: Option<Point>,
    /// Speed limit in metres per second.
    pub speed: f32,
    /// The authority used to control the planner.
    pub authority: u8,
    /// Timeout of each step except the drive.
    pub patience: Duration,
    /// Timeout of the drive.
    pub drive: Duration,
}

impl Default for MissionTest {
    fn default() -> Self {
        Self {
            subsystem: 101,
            to: None,
            speed: 1.0,
            authority: 200,
            patience: Duration::from_secs(15),
            drive: Duration::from_secs(120),
        }
    }
}

/// The steps in order.
const STEPS: [&str; 17] = [
    "found the knowledge store",
    "found the local pose sensor",
    "found the velocity state sensor",
    "found the path segment driver",
    "found the vector driver",
    "found the primitive driver",
    "found the planner",
    "the store reports its maps",
    "the sensors report pose and velocity",
    "each driver reports its stage",
    "the planner grants control and becomes ready",
    "the destination is acknowledged and a path planned",
    "the planner reports the path",
    "approval starts the chain, stage by stage",
    "each driver is commanded by the one before it",
    "the vehicle arrives at its destination",
    "control is released down the chain",
];

/// A test in progress.
struct Running<'a, T> {
    test: &'a MissionTest,
    component: &'a Component,
    tell: T,
    steps: Vec<Step>,
}

/// The components involved.
struct Cast {
    store: JausId,
    pose: JausId,
    velocity: JausId,
    drivers: [JausId; 3],
    planner: JausId,
}

impl MissionTest {
    /// Runs the mission. `tell` receives each step when it ends; the result contains all of them.
    pub async fn run(&self, component: &Component, tell: impl FnMut(&Step)) -> Vec<Step> {
        let mut running = Running {
            test: self,
            component,
            tell,
            steps: Vec::new(),
        };
        // An absent component fails its step, and the remaining steps are skipped.
        let _ = running.all().await;
        running.skip_rest();
        running.steps
    }
}

impl<T: FnMut(&Step)> Running<'_, T> {
    async fn all(&mut self) -> Option<()> {
        let cast = self.find_all().await?;
        self.ask_sensors(&cast).await?;
        let (component, test) = (self.component, self.test);
        let control = self.step(take_control(component, test, &cast)).await?;
        let mut reports = Reports::of(component, test, cast.planner).await;
        let to = self.step(set_out(component, test, &cast, &control, &mut reports));
        let (to, mission) = to.await?;
        self.step(look_at_path(component, &cast, to)).await?;
        self.step(approve(mission, &control, &mut reports)).await?;
        self.step(look_at_chain(component, &cast)).await?;
        self.step(arrive(component, test, &cast, to, &mut reports))
            .await?;
        self.step(give_back(component, &cast, control)).await
    }

    async fn find_all(&mut self) -> Option<Cast> {
        let (component, test) = (self.component, self.test);
        let find = |audience: Audience| find(component, test, audience);
        let provider = |urn: &str| find(urn.into());
        let driver = |link| find(chain::drivers(link, test.subsystem));
        Some(Cast {
            store: self.step(provider(raster_maps::URN)).await?,
            pose: self.step(provider(local_pose_sensor::URN)).await?,
            velocity: self.step(provider(velocity_state_sensor::URN)).await?,
            drivers: [
                self.step(driver(Link::Path)).await?,
                self.step(driver(Link::Vector)).await?,
                self.step(driver(Link::Primitive)).await?,
            ],
            planner: self.step(provider(mission_planner::URN)).await?,
        })
    }

    async fn ask_sensors(&mut self, cast: &Cast) -> Option<()> {
        let (component, test) = (self.component, self.test);
        self.step(async {
            let report = ask(component, cast.store, &QueryRasterMaps {}).await?;
            let maps = report.map_list.iter();
            let maps: Vec<_> = maps
                .map(|map| {
                    format!(
                        "{:?} {} x {}",
                        map.name.to_string_lossy(),
                        map.rows,
                        map.columns
                    )
                })
                .collect();
            match maps.is_empty() {
                true => Err(format!("{} has no map: create one", cast.store)),
                false => Ok(((), maps.join(", "))),
            }
        })
        .await?;
        self.step(async {
            let (x, y) = patiently(test, || pose(component, cast.pose)).await?;
            let speed = patiently(test, || speed(component, cast.velocity)).await?;
            Ok(((), format!("x {x:.2} m, y {y:.2} m, {speed:.2} m/s")))
        })
        .await?;
        self.step(async {
            let mut shown = Vec::new();
            for driver in cast.drivers {
                let report = ask(component, driver, &QueryStage {}).await?;
                shown.push(format!("{driver} {:?}", report.state));
            }
            Ok(((), shown.join(", ")))
        })
        .await
    }

    /// Runs the next step. Returns its value and records the observation.
    async fn step<V>(
        &mut self,
        check: impl Future<Output = Result<(V, String), String>>,
    ) -> Option<V> {
        let begin = now();
        let limit = self.test.patience + self.test.drive;
        let result = match tokio::time::timeout(limit, check).await {
            Ok(result) => result,
            Err(_) => Err(format!("not within {} s", limit.as_secs())),
        };
        let (value, verdict) = match result {
            Ok((value, seen)) => (Some(value), Verdict::Pass(seen)),
            Err(wrong) => (None, Verdict::Fail(wrong)),
        };
        self.note(verdict, now() - begin);
        value
    }

    fn note(&mut self, verdict: Verdict, took: Duration) {
        let name = STEPS.get(self.steps.len()).copied().unwrap_or_default();
        let step = Step {
            name: name.to_owned(),
            verdict,
            took,
        };
        (self.tell)(&step);
        self.steps.push(step);
    }

    fn skip_rest(&mut self) {
        while self.steps.len() < STEPS.len() {
            self.note(Verdict::Skipped, Duration::ZERO);
        }
    }
}

/// The planner's reports, from events and queries.
struct Reports<'a> {
    component: &'a Component,
    planner: JausId,
    events: Option<Subscription<ReportMission>>,
    patience: Duration,
}

/// Polling interval without events.
const LOOK: Duration = Duration::from_millis(250);

impl<'a> Reports<'a> {
    async fn of(component: &'a Component, test: &MissionTest, planner: JausId) -> Self {
        let events = component.subscribe(planner, &QueryMission {}, When::OnChange);
        Self {
            component,
            planner,
            events: events.await.ok(),
            patience: test.patience,
        }
    }

    /// The current report. Discards queued events, which are older.
    async fn now(&mut self) -> Result<ReportMission, String> {
        let report = ask(self.component, self.planner, &QueryMission {}).await?;
        if let Some(events) = &mut self.events {
            while let Ok(Some(_)) = tokio::time::timeout(Duration::ZERO, events.report()).await {}
        }
        Ok(report)
    }

    /// The next report from an event, or from a query if no event arrives.
    async fn next(&mut self) -> Result<ReportMission, String> {
        let event = async {
            match &mut self.events {
                Some(events) => events.report().await,
                None => None,
            }
        };
        match tokio::time::timeout(LOOK, event).await {
            Ok(Some(report)) => Ok(report),
            Ok(None) => {
                tokio::time::sleep(LOOK).await;
                self.now().await
            }
            Err(_) => self.now().await,
        }
    }

    /// Collects reports until a stage is reached. An earlier end of the mission is an error.
    async fn until(&mut self, stage: Stage, limit: Duration) -> Result<Vec<ReportMission>, String> {
        let deadline = now() + limit;
        let mut seen = vec![self.now().await?];
        loop {
            if let Some(last) = seen.last() {
                if last.stage == stage || (last.stage > stage && last.stage <= Stage::ARRIVED) {
                    return Ok(seen);
                }
                if last.stage > Stage::ARRIVED {
                    return Err(format!(
                        "{}: {:?}",
                        name(last.stage),
                        last.reason.to_string_lossy()
                    ));
                }
                if now() > deadline {
                    return Err(format!(
                        "still {} after {} s {:?}",
                        name(last.stage),
                        limit.as_secs(),
                        last.reason.to_string_lossy()
                    ));
                }
            }
            let next = self.next().await?;
            if seen.last() != Some(&next) {
                seen.push(next);
            }
        }
    }
}

fn name(stage: Stage) -> String {
    format!("{stage:?}")
}

async fn ask<Q: Query>(
    component: &Component,
    peer: JausId,
    query: &Q,
) -> Result<Q::Report, String> {
    component
        .query(peer, query)
        .await
        .map_err(|error| error.to_string())
}

async fn find(
    component: &Component,
    test: &MissionTest,
    audience: Audience,
) -> Result<(JausId, String), String> {
    let audience = audience.in_subsystem(test.subsystem);
    match component.find_within(audience, test.patience).await {
        Ok(id) => Ok((id, id.to_string())),
        Err(error) => Err(format!("{error}: start one, or choose another subsystem")),
    }
}

async fn pose(component: &Component, sensor: JausId) -> Result<Point, String> {
    let query = QueryLocalPose::none().with_x().with_y();
    let report = ask(component, sensor, &query).await?;
    let place = report.x_m().zip(report.y_m());
    place.ok_or_else(|| format!("{sensor} reports no pose: set the vehicle's pose"))
}

async fn speed(component: &Component, sensor: JausId) -> Result<f64, String> {
    let query = QueryVelocityState::none().with_velocity_x();
    let report = ask(component, sensor, &query).await?;
    let speed = report.velocity_x_m_per_s();
    speed.ok_or_else(|| format!("{sensor} reports no velocity"))
}

/// Retries a query until it succeeds, because a sensor that has just started has no data yet.
async fn patiently<V, F: Future<Output = Result<V, String>>>(
    test: &MissionTest,
    ask: impl Fn() -> F,
) -> Result<V, String> {
    let begin = now();
    loop {
        match ask().await {
            Err(_) if now() - begin < test.patience => tokio::time::sleep(LOOK).await,
            answer => return answer,
        }
    }
}

async fn take_control(
    component: &Component,
    test: &MissionTest,
    cast: &Cast,
) -> Result<(Control, String), String> {
    let control = component.control(cast.planner, test.authority).await;
    let control = control.map_err(|error| error.to_string())?;
    control.resume().await.map_err(|error| error.to_string())?;
    Ok((
        control,
        format!("{} obeys {}", cast.planner, component.id()),
    ))
}

/// Sets the destination and waits for the path.
async fn set_out(
    component: &Component,
    test: &MissionTest,
    cast: &Cast,
    control: &Control,
    reports: &mut Reports<'_>,
) -> Result<((Point, u32), String), String> {
    let to = match test.to {
        Some(to) => to,
        None => choose(component, cast.store, pose(component, cast.pose).await?).await?,
    };
    let before = reports.now().await?.mission;
    let command = SetDestination {
        x: to.0,
        y: to.1,
        approved: Approved::NO,
        speed: Some(test.speed),
    };
    let delivered = control.deliver(&command).await;
    delivered.map_err(|error| error.to_string())?;
    let seen = reports
        .until(Stage::AWAITING_APPROVAL, reports.patience)
        .await?;
    match seen.last() {
        Some(last) if last.mission != before => Ok((
            (to, last.mission),
            format!(
                "mission {} to x {:.2} m, y {:.2} m, {:.2} m",
                last.mission, to.0, to.1, last.remaining
            ),
        )),
        _ => Err("the planner has not started another mission".to_owned()),
    }
}

/// Chooses a reachable destination some metres away.
async fn choose(component: &Component, store: JausId, from: Point) -> Result<Point, String> {
    const AWAY: f64 = 4.0;
    let map = map::fetch_from(component, store, "traversability", None).await?;
    let room = Footprint {
        margin: 0.3,
        ..Footprint::default()
    };
    let directions = (0..16).map(|turn| std::f64::consts::TAU * f64::from(turn) / 16.0);
    let places = [AWAY, AWAY / 2.0, AWAY * 2.0].map(|away| {
        let around = directions.clone();
        around.map(move |turn| (from.0 + away * turn.cos(), from.1 + away * turn.sin()))
    });
    let mut places = places.into_iter().flatten();
    let good = places.find(|&to| plan(&map.terrain, &room, from, to).is_ok());
    good.ok_or_else(|| {
        format!(
            "no destination about {AWAY} m from x {:.2} m, y {:.2} m is reachable: choose one \
             with --to",
            from.0, from.1
        )
    })
}

async fn look_at_path(
    component: &Component,
    cast: &Cast,
    to: Point,
) -> Result<((), String), String> {
    let report = ask(component, cast.planner, &QueryPlannedPath {}).await?;
    let points = report.point_list.iter().map(|point| (point.x, point.y));
    let path = Path::new(points.collect());
    match path.points().last() {
        Some(&end) if end == to => {
            let (segments, length) = (path.segments().len(), path.length());
            Ok(((), format!("{segments} segments, {length:.2} m")))
        }
        end => Err(format!("it ends at {end:?} instead of {to:?}")),
    }
}

async fn approve(
    mission: u32,
    control: &Control,
    reports: &mut Reports<'_>,
) -> Result<((), String), String> {
    let delivered = control.deliver(&ApproveMission { mission }).await;
    delivered.map_err(|error| error.to_string())?;
    let seen = reports.until(Stage::DRIVING, reports.patience * 3).await?;
    let mut stages: Vec<_> = seen.iter().map(|report| report.stage).collect();
    stages.dedup();
    let shown: Vec<_> = stages.iter().map(|&stage| name(stage)).collect();
    let attempts = seen.last().map_or(0, |last| last.attempt);
    if attempts == 1 && !stages.is_sorted() {
        return Err(format!("out of order: {}", shown.join(", ")));
    }
    Ok(((), format!("{} (attempt {attempts})", shown.join(", "))))
}

async fn look_at_chain(component: &Component, cast: &Cast) -> Result<((), String), String> {
    let [path, vector, primitive] = cast.drivers;
    let mut shown = Vec::new();
    for (driver, commander) in [(path, cast.planner), (vector, path), (primitive, vector)] {
        let report = ask(component, driver, &QueryControl {}).await?;
        match chain::controller(&report) {
            Some(client) if client == commander => shown.push(format!("{client} → {driver}")),
            Some(client) => {
                return Err(format!(
                    "{driver} is controlled by {client}, not by {commander}"
                ));
            }
            None => return Err(format!("{driver} is not controlled")),
        }
    }
    Ok(((), shown.join(", ")))
}

async fn arrive(
    component: &Component,
    test: &MissionTest,
    cast: &Cast,
    to: Point,
    reports: &mut Reports<'_>,
) -> Result<((), String), String> {
    reports.until(Stage::ARRIVED, test.drive).await?;
    let (x, y) = pose(component, cast.pose).await?;
    let off = (x - to.0).hypot(y - to.1);
    let seen = format!("x {x:.2} m, y {y:.2} m, {off:.2} m off");
    match off {
        off if off <= NEAR => Ok(((), seen)),
        _ => Err(format!("{seen}; at most {NEAR} m is allowed")),
    }
}

/// Maximum distance from the destination on arrival, in metres.
const NEAR: f64 = 0.75;

async fn give_back(
    component: &Component,
    cast: &Cast,
    control: Control,
) -> Result<((), String), String> {
    control.release().await;
    let begin = now();
    loop {
        let mut held = Vec::new();
        for part in [cast.planner].into_iter().chain(cast.drivers) {
            let report = ask(component, part, &QueryControl {}).await?;
            if let Some(client) = chain::controller(&report) {
                held.push(format!("{part} by {client}"));
            }
        }
        if held.is_empty() {
            return Ok(((), "all drivers are released".to_owned()));
        }
        if now() - begin > Duration::from_secs(10) {
            return Err(format!("still controlled: {}", held.join(", ")));
        }
        tokio::time::sleep(LOOK).await;
    }
}
