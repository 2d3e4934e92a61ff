//! The planner's main task: executes the actions of the mission one by one and reports their
//! results to it.
#![expect(
    clippy::disallowed_methods,
    reason = "gives the mission its clock, and planning a thread"
)]

use std::future::Future;
use std::pin::Pin;
use std::sync::Arc;
use std::time::{Duration, Instant};

use tokio::sync::{Notify, mpsc};

use super::chain::{self, News};
use super::map::{self, Map};
use super::survey::{self, Survey, UnderWay};
use super::{PATIENCE, Planner, find_soon, hand_over};
use crate::ground::Missions;
use crate::messages::ground::{QueryMission, QueryPlannedPath, QueryStage, ReportStage};
use crate::mission::{
    self, Action, Destination, Link, LinkState, Mission, NotPlanned, Path, Run, Stage, Terrain,
};
use crate::parts::Telemetry;
use crate::parts::drivers::lent_authority;
use crate::sensing::Lookout;
use crate::zones::Zones;
use jaus::address::JausId;
use jaus::component::{
    Component, Retake, Session, SessionLoss, SessionSettings, SessionState, State,
};
use jaus::messages::core::QueryHeartbeatPulse;
use jaus::node::{now, sleep_until};

/// Time limit for stopping the driver and releasing control.
const HALT: Duration = Duration::from_secs(2);

type Job = Pin<Box<dyn Future<Output = Done> + Send>>;

/// Result of a job.
enum Done {
    Map(Run, Result<(Map, Option<Zones>), String>),
    Planned(Run, Result<Path, NotPlanned>),
    HandedOver(Run, Result<(Session, Vec<(Link, LinkState)>), String>),
    /// Whether the client that lost control is alive.
    Checked(Run, bool),
    Surveyed(Run, Survey),
}

/// State of the planner's task.
pub(super) struct PlannerTask<'a> {
    settings: &'a Planner,
    component: &'a Component,
    missions: Missions,
    wake: &'a Notify,
    map: Option<Map>,
    zones: Arc<Zones>,
    /// The session with the path segment driver during a mission.
    session: Option<Session>,
    job: Option<Job>,
    /// The vehicle's pose, and the obstacles around it.
    lookout: Lookout,
    /// The survey under way, and when the next one begins.
    survey: Option<Job>,
    survey_at: Option<Instant>,
    /// The drivers, indexed by link.
    peers: [Option<JausId>; 3],
    controllers: [Option<JausId>; 3],
    /// The last logged stage.
    logged: Option<(Run, Stage)>,
    telemetry: Telemetry,
}

impl<'a> PlannerTask<'a> {
    /// Capacity of the event queue.
    pub(super) const NEWS: usize = 64;

    pub(super) fn new(
        settings: &'a Planner,
        component: &'a Component,
        missions: Missions,
        wake: &'a Notify,
        telemetry: Telemetry,
    ) -> Self {
        telemetry.set_stage(Stage::default());
        Self {
            settings,
            component,
            missions,
            wake,
            map: None,
            zones: Arc::default(),
            session: None,
            job: None,
            lookout: Lookout::default(),
            survey: None,
            survey_at: None,
            peers: [None; 3],
            controllers: [None; 3],
            logged: None,
            telemetry,
        }
    }

    /// Runs until the component has stopped.
    pub(super) async fn work(mut self, mut news: mpsc::Receiver<News>) {
        loop {
            self.act().await;
            self.schedule_survey();
            let (timeout, _) = self.missions.tell(|mission| mission.poll_timeout());
            tokio::select! {
                () = self.wake.notified() => {}
                done = working(&mut self.job) => {
                    self.job = None;
                    self.handle(done).await;
                }
                done = working(&mut self.survey) => {
                    self.survey = None;
                    self.handle(done).await;
                }
                () = sleep_until(self.survey_at) => {
                    self.survey_at = None;
                    self.survey = self.survey();
                    self.check_obstacles().await;
                }
                news = news.recv() => match news {
                    Some(news) => self.hear(news).await,
                    None => return,
                },
                () = sleep_until(timeout) => {
                    self.tell(|mission, now| mission.handle_time(now)).await;
                }
                why = lost(&mut self.session) => self.handle_lost(why).await,
            }
        }
    }

    /// Updates the mission, and announces the resulting changes.
    async fn tell<T>(&mut self, words: impl FnOnce(&mut Mission, Instant) -> T) -> T {
        let now = now();
        let (answer, news) = self.missions.tell(|mission| words(mission, now));
        if news.mission {
            _ = self.component.changed::<QueryMission>().await;
        }
        if news.path {
            _ = self.component.changed::<QueryPlannedPath>().await;
        }
        self.log();
        answer
    }

    /// Logs the start of a stage.
    fn log(&mut self) {
        let (report, _) = self.missions.tell(|mission| mission.report().clone());
        let now = Some((report.run, report.stage));
        if self.logged == now || report.stage == Stage::Idle {
            return;
        }
        self.logged = now;
        self.telemetry.set_stage(report.stage);
        let Run { mission, attempt } = report.run;
        let reason = match report.reason.as_str() {
            "" => String::new(),
            reason => format!(" ({reason})"),
        };
        tracing::info!(
            "mission {mission} to x {:.2} m, y {:.2} m, attempt {attempt} of {}: {}{reason}",
            report.destination.x,
            report.destination.y,
            report.attempts,
            report.stage
        );
    }

    /// Starts the actions that the mission requests. Nothing else starts while the vehicle is being
    /// stopped.
    async fn act(&mut self) {
        self.log();
        loop {
            let (action, _) = self.missions.tell(Mission::poll_action);
            match action {
                None => return,
                Some(Action::Halt) => {
                    self.job = None;
                    if let Some(session) = self.session.take() {
                        // Bounded, and before anything else.
                        let _ = tokio::time::timeout(HALT, halt(session)).await;
                    }
                }
                Some(Action::FetchMap(run)) => self.job = Some(self.fetch_map(run)),
                Some(Action::Plan(run, to)) => self.job = Some(self.plan(run, to)),
                Some(Action::CheckClient(run, client)) => {
                    let component = self.component.clone();
                    self.job = Some(Box::pin(async move {
                        let query = QueryHeartbeatPulse {};
                        let answer = component.query(client, &query);
                        Done::Checked(run, answer.await.is_ok())
                    }));
                }
                Some(Action::HandOver(run, path, speed)) => {
                    self.job = Some(self.hand_over(run, path, speed));
                }
            }
        }
    }

    fn fetch_map(&self, run: Run) -> Job {
        let (component, name) = (self.component.clone(), self.settings.map.clone());
        let known = self.map.clone();
        Box::pin(async move {
            let fetched = async {
                let map = map::fetch(&component, &name, known).await?;
                Ok((map, map::fetch_zones(&component).await?))
            };
            Done::Map(run, fetched.await)
        })
    }

    fn plan(&self, run: Run, to: Destination) -> Job {
        let component = self.component.clone();
        let vehicle = self.settings.vehicle;
        let terrain = self.map.as_ref().map(|map| Arc::clone(&map.terrain));
        let zones = Arc::clone(&self.zones);
        let obstacles = self.lookout.obstacles();
        Box::pin(async move {
            let passing = |reason| NotPlanned {
                reason,
                hopeless: false,
            };
            let start = match map::fetch_pose(&component).await {
                Ok(start) => start,
                Err(reason) => return Done::Planned(run, Err(passing(reason))),
            };
            let plan = move || {
                let terrain = terrain.ok_or_else(|| passing("there is no map".to_owned()))?;
                let terrain = Terrain::clone(&terrain)
                    .within(zones)
                    .with_obstacles(obstacles, vehicle.clearance());
                Ok(mission::plan(&terrain, &vehicle, start, (to.x, to.y))?)
            };
            let planned = tokio::task::spawn_blocking(plan).await;
            Done::Planned(
                run,
                planned.unwrap_or_else(|error| Err(passing(error.to_string()))),
            )
        })
    }

    fn hand_over(&self, run: Run, path: Arc<Path>, speed: f64) -> Job {
        let component = self.component.clone();
        let Planner {
            authority,
            tolerance,
            ..
        } = *self.settings;
        Box::pin(async move {
            let given = async {
                let drivers = chain::drivers(Link::Path, component.id().subsystem());
                let driver = find_soon(&component, drivers, "local path segment driver").await?;
                let authority = lent_authority(&component.standing(), authority);
                let session = engage(&component, driver, authority).await?;
                hand_over::hand_over(&component, &session, &path, speed, tolerance).await?;
                Ok((session, look(&component).await))
            };
            Done::HandedOver(run, given.await)
        })
    }

    /// Surveys the path as long as the vehicle drives it.
    fn schedule_survey(&mut self) {
        let (report, _) = self.missions.tell(|mission| mission.report().stage);
        if !report.is_handed_over() {
            (self.survey, self.survey_at) = (None, None);
            self.lookout.begin();
        } else if self.survey.is_none() && self.survey_at.is_none() {
            self.survey_at = now().checked_add(survey::PERIOD);
        }
    }

    fn survey(&self) -> Option<Job> {
        let known = Survey {
            map: self.map.clone()?,
            zones: Arc::clone(&self.zones),
            blocked: None,
        };
        let ((run, progress, path), _) = self.missions.tell(|mission| {
            let report = mission.report();
            (report.run, report.progress, Arc::clone(mission.path()))
        });
        let way = UnderWay {
            vehicle: self.settings.vehicle,
            here: self.lookout.here()?,
            segment: UnderWay::segment(&path, progress),
            path,
        };
        let (component, name) = (self.component.clone(), self.settings.map.clone());
        Some(Box::pin(async move {
            Done::Surveyed(run, known.make(&component, &name, way).await)
        }))
    }

    /// Has another path planned when there is an obstacle on this one. The drivers stop before it in
    /// any case.
    async fn check_obstacles(&mut self) {
        let ((report, path), _) = self
            .missions
            .tell(|mission| (mission.report().clone(), Arc::clone(mission.path())));
        let segment = UnderWay::segment(&path, report.progress);
        let ahead = path.points().iter().skip(segment + 1).copied();
        let radius = self.settings.vehicle.width / 2.0;
        if self.lookout.sees_blocked(ahead, radius) {
            let why = "the range sensor sees an obstacle on the path";
            self.tell(|mission, now| mission.handle_blocked_path(now, report.run, why))
                .await;
        }
    }

    async fn handle(&mut self, done: Done) {
        match done {
            Done::Map(run, result) => {
                let result = result.map(|(map, zones)| {
                    self.map = Some(map);
                    if let Some(zones) = zones {
                        self.zones = Arc::new(zones);
                    }
                });
                self.tell(|mission, now| mission.handle_map(now, run, result))
                    .await;
            }
            Done::Planned(run, result) => {
                self.tell(|mission, now| mission.handle_path(now, run, result))
                    .await;
            }
            Done::HandedOver(run, Ok((session, states))) => {
                self.session = Some(session);
                self.tell(|mission, now| {
                    mission.handle_handed_over(now, run, Ok(()));
                    for (link, state) in states {
                        mission.handle_link(now, link, state);
                    }
                })
                .await;
            }
            Done::HandedOver(run, Err(reason)) => {
                self.tell(|mission, now| mission.handle_handed_over(now, run, Err(reason)))
                    .await;
            }
            Done::Surveyed(run, survey) => {
                self.map = Some(survey.map);
                self.zones = survey.zones;
                if let Some(why) = survey.blocked {
                    self.tell(|mission, now| mission.handle_blocked_path(now, run, &why))
                        .await;
                }
            }
            Done::Checked(run, is_alive) => {
                self.tell(|mission, now| mission.handle_lost_client(now, run, is_alive))
                    .await;
            }
        }
    }

    async fn hear(&mut self, news: News) {
        match news {
            News::Pose(pose) => {
                self.lookout.handle_pose(pose);
                self.tell(|mission, _| mission.handle_pose((pose.x, pose.y)))
                    .await;
            }
            News::Scan(scan) => self.lookout.handle_scan(now(), &scan),
            News::Found(link, peer) => self.peers[link as usize] = peer,
            News::Stage(link, state, progress) => {
                self.tell(|mission, now| {
                    if link == Link::Path {
                        let run = mission.report().run;
                        let length = mission.path().length();
                        let ahead = length * (1.0 - f64::from(progress.min(100)) / 100.0);
                        mission.handle_progress(now, run, progress, ahead);
                    }
                    mission.handle_link(now, link, state);
                })
                .await;
            }
            News::Controller(link, controller) => {
                let before = std::mem::replace(&mut self.controllers[link as usize], controller);
                if let Some(client) = controller.filter(|_| controller != before) {
                    self.check_controller(link, client).await;
                }
            }
            News::StoodDown(link, reason) => {
                let reason = format!("the {link}{} suspended motion: {reason}", self.named(link));
                self.stop_if_driving(&reason).await;
            }
            News::Emergency(link) => {
                let reason = format!("an emergency stopped the {link}{}", self.named(link));
                self.tell(|mission, _| {
                    let stage = mission.report().stage;
                    if stage.is_handed_over() || stage == Stage::Waiting {
                        mission.stop(&reason);
                    }
                })
                .await;
            }
        }
    }

    /// Stops the mission if a client outside the chain has taken control of a driver.
    async fn check_controller(&mut self, link: Link, client: JausId) {
        let before = match link {
            Link::Path => Some(self.component.id()),
            Link::Vector => self.peers[Link::Path as usize],
            Link::Primitive => self.peers[Link::Vector as usize],
        };
        // The driver before may not have been found yet, but its control of this one has.
        let may_be_before =
            before.is_none() && client.subsystem() == self.component.id().subsystem();
        if before != Some(client) && !may_be_before {
            let reason = format!(
                "{client} has taken control of the {link}{}",
                self.named(link)
            );
            self.stop_if_driving(&reason).await;
        }
    }

    async fn stop_if_driving(&mut self, reason: &str) {
        self.tell(|mission, _| {
            if mission.report().stage.is_handed_over() {
                mission.stop(reason);
            }
        })
        .await;
    }

    fn named(&self, link: Link) -> String {
        self.peers[link as usize].map_or_else(String::new, |id| format!(" ({id})"))
    }

    /// Handles the loss of the path segment driver, which may be tried again, or ends the mission.
    async fn handle_lost(&mut self, why: Result<String, String>) {
        self.session = None;
        self.tell(|mission, now| match why {
            Ok(setback) => mission.handle_setback(now, mission.report().run, &setback),
            Err(stop) => mission.stop(&stop),
        })
        .await;
    }
}

/// Begins a session with a driver and waits until it is ready. After a loss the mission decides
/// whether to try again, with a new path.
async fn engage(component: &Component, driver: JausId, authority: u8) -> Result<Session, String> {
    let settings = SessionSettings::new(authority).retake(Retake::Never);
    let session = component.session(driver, settings).await;
    let session = session.map_err(hand_over::in_words)?;
    match tokio::time::timeout(PATIENCE, session.ready()).await {
        Ok(Ok(_)) => Ok(session),
        Ok(Err(error)) => Err(error.to_string()),
        Err(_) => Err(session.state().to_string()),
    }
}

/// The current states of the drivers that respond.
async fn look(component: &Component) -> Vec<(Link, LinkState)> {
    let mut states = Vec::new();
    for link in Link::ALL {
        let drivers = chain::drivers(link, component.id().subsystem());
        if let Ok(peer) = component.find_within(drivers, PATIENCE).await {
            let report = component.query(peer, &QueryStage {}).await;
            let state = report.map_or(LinkState::Silent, |it: ReportStage| chain::state(&it));
            states.push((link, state));
        }
    }
    states
}

/// Stops a driver and releases control.
async fn halt(session: Session) {
    if let Err(error) = session.standby().await {
        tracing::debug!(%error, "not stopped; releasing control will stop it");
    }
    session.release().await;
}

/// Waits for the job, if there is one.
async fn working(job: &mut Option<Job>) -> Done {
    match job {
        Some(job) => job.await,
        None => std::future::pending().await,
    }
}

/// Waits until a session, if there is one, loses its driver. `Err` after a takeover or an emergency,
/// which end the mission.
async fn lost(session: &mut Option<Session>) -> Result<String, String> {
    let Some(session) = session else {
        return std::future::pending().await;
    };
    loop {
        let state = session.state();
        match state {
            SessionState::Lost {
                peer,
                why: SessionLoss::Taken(client),
                ..
            } => {
                return Err(format!(
                    "{client} has taken control of the {} ({peer})",
                    Link::Path
                ));
            }
            SessionState::Disabled { peer, state: code }
            | SessionState::Lost {
                peer,
                why: SessionLoss::State(code),
                ..
            } if code == State::Emergency as u8 => {
                return Err(format!("the {} ({peer}) is in emergency", Link::Path));
            }
            SessionState::Lost { .. } | SessionState::Disabled { .. } => {
                return Ok(state.to_string());
            }
            _ => {}
        }
        if let Err(error) = session.changed().await {
            return Ok(error.to_string());
        }
    }
}
