//! The demo's operator: an ordinary client that sends the planner a destination and watches. It
//! yields control to an operator on the page, who has a higher authority.

use std::time::Duration;

use jaus::address::JausId;
use jaus::component::{Component, Control, Update, When};
use jaus::messages::mobility::{QueryLocalPose, local_pose_sensor};
use jaus_cli::failure::Failure;
use jaus_text::quoted;
use jaus_vehicle::messages::ground::report_mission::Stage;
use jaus_vehicle::messages::ground::{
    QueryMission, QueryPlannedPath, ReportMission, SetDestination, mission_planner,
};

use super::story::{Story, Who};
use super::surprise::Surprise;

/// Below the page's authority, which is 200, so that a person can always take over.
const AUTHORITY: u8 = 150;
/// Interval of progress lines.
const LOOK: Duration = Duration::from_secs(2);

/// End of a mission.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Ending {
    /// At the destination.
    Arrived,
    /// Elsewhere.
    Stopped,
}

pub(super) struct Operator<'s> {
    component: Component,
    /// The obstacle that has not appeared yet.
    surprise: Option<Surprise>,
    story: &'s mut Story,
}

impl<'s> Operator<'s> {
    pub(super) fn new(component: Component, surprise: Surprise, story: &'s mut Story) -> Self {
        Self {
            component,
            surprise: Some(surprise),
            story,
        }
    }

    /// Has the vehicle drive to a place in its local frame, in metres, and waits for the end.
    pub(super) async fn drive(&mut self, (x, y): (f64, f64)) -> Result<Ending, Failure> {
        let planner = self.find(mission_planner::URN).await?;
        let sensor = self.find(local_pose_sensor::URN).await?;
        let control = self.component.control(planner, AUTHORITY).await;
        let control = control.map_err(Failure::of)?;
        self.tell(
            Who::Operator,
            format!("takes control of the planner {planner} with authority {AUTHORITY}"),
        )?;
        control.resume().await.map_err(Failure::of)?;
        let destination = SetDestination {
            x,
            y,
            approved: jaus_vehicle::messages::ground::set_destination::Approved::YES,
            ..SetDestination::default()
        };
        control.deliver(&destination).await.map_err(Failure::of)?;
        self.tell(
            Who::Operator,
            format!(
                "sets the destination {x} m north and {y} m east of the start, and approves the \
                 planned path"
            ),
        )?;
        let ending = self.watch(planner, sensor).await;
        self.leave(control).await;
        ending
    }

    async fn find(&self, urn: &str) -> Result<JausId, Failure> {
        self.component.find(urn).await.map_err(Failure::of)
    }

    /// Reports the stages and, in between, the vehicle's position.
    async fn watch(&mut self, planner: JausId, sensor: JausId) -> Result<Ending, Failure> {
        let component = self.component.clone();
        let mut missions = component
            .subscribe(planner, &QueryMission {}, When::OnChange)
            .await
            .map_err(Failure::of)?;
        let mut looks = tokio::time::interval(LOOK);
        let mut told = None;
        loop {
            let report = tokio::select! {
                update = missions.next() => match update {
                    Some(Update::Report(report)) => report,
                    Some(Update::Down { why, .. }) => {
                        self.tell(Who::Operator, format!("gets no reports from the planner: \
                            {why}"))?;
                        continue;
                    }
                    Some(Update::Up) => continue,
                    None => return Err(Failure::new("the planner is no longer available")),
                },
                _ = looks.tick() => {
                    if told == Some(Stage::DRIVING) {
                        self.tell_pose(sensor).await?;
                    }
                    continue;
                }
            };
            if told == Some(report.stage) {
                continue;
            }
            told = Some(report.stage);
            self.tell_stage(planner, &report).await?;
            match report.stage {
                Stage::DRIVING => self.put_obstacle(planner, sensor).await?,
                Stage::ARRIVED => {
                    self.tell_pose(sensor).await?;
                    return Ok(Ending::Arrived);
                }
                Stage::FAILED | Stage::STOPPED | Stage::WAITING => return Ok(Ending::Stopped),
                _ => {}
            }
        }
    }

    async fn tell_stage(&mut self, planner: JausId, report: &ReportMission) -> Result<(), Failure> {
        let mut words = match report.stage {
            Stage::MAP => "queries the map from the knowledge store".to_owned(),
            Stage::PLANNING => "plans a path on it".to_owned(),
            Stage::AWAITING_APPROVAL => "has a path, and waits for approval".to_owned(),
            Stage::PATH => format!(
                "sends {} to the path segment driver: {:.1} m",
                self.pieces(planner).await,
                report.remaining
            ),
            Stage::VECTOR => {
                "the path segment driver takes control of the vector driver".to_owned()
            }
            Stage::PRIMITIVE => {
                "the vector driver takes control of the primitive driver".to_owned()
            }
            Stage::DRIVING => "all stages are ready: under way".to_owned(),
            Stage::ARRIVED => "arrived".to_owned(),
            Stage::FAILED => "gives up".to_owned(),
            Stage::STOPPED => "stopped".to_owned(),
            Stage::WAITING => "was stopped by a fault, and waits to be continued".to_owned(),
            _ => return Ok(()),
        };
        let reason = report.reason.to_string();
        if !reason.is_empty() {
            words = format!("{words} ({})", quoted(&reason));
        }
        if report.attempt > 1 {
            words = format!("{words}; attempt {} of {}", report.attempt, report.attempts);
        }
        self.tell(Who::Planner, words)
    }

    /// The number of path segments, as text.
    async fn pieces(&self, planner: JausId) -> String {
        let report = self.component.query(planner, &QueryPlannedPath {}).await;
        match report.map(|path| path.point_list.len().saturating_sub(1)) {
            Ok(1) => "a straight path".to_owned(),
            Ok(pieces) if pieces > 1 => format!("a path of {pieces} pieces"),
            _ => "the path".to_owned(),
        }
    }

    /// Puts the obstacle on the path, if it has not appeared yet.
    async fn put_obstacle(&mut self, planner: JausId, sensor: JausId) -> Result<(), Failure> {
        let Some(surprise) = self.surprise.take() else {
            return Ok(());
        };
        let path = self.component.query(planner, &QueryPlannedPath {}).await;
        let query = QueryLocalPose::none().with_x().with_y();
        let pose = self.component.query(sensor, &query).await;
        let (Ok(path), Ok(pose)) = (path, pose) else {
            return Ok(());
        };
        let path: Vec<_> = path.point_list.iter().map(|it| (it.x, it.y)).collect();
        let here = pose.x_m().zip(pose.y_m());
        let Some(here) = here else {
            return Ok(());
        };
        // It plans many paths; the parts of the vehicle must go on meanwhile.
        let putting = tokio::task::spawn_blocking(move || surprise.put(&path, here));
        let Ok(Some((x, y))) = putting.await else {
            return Ok(());
        };
        self.tell(
            Who::System,
            format!("an obstacle appears on the path, {x:.1} m north and {y:.1} m east"),
        )
    }

    async fn tell_pose(&mut self, sensor: JausId) -> Result<(), Failure> {
        let query = QueryLocalPose::none().with_x().with_y().with_yaw();
        let pose = self.component.query(sensor, &query).await;
        match pose {
            Ok(pose) => self.tell(
                Who::Vehicle,
                format!(
                    "{:.1} m north, {:.1} m east, heading {:.0}°",
                    pose.x_m().unwrap_or_default(),
                    pose.y_m().unwrap_or_default(),
                    pose.yaw_rad()
                        .unwrap_or_default()
                        .to_degrees()
                        .rem_euclid(360.0)
                ),
            ),
            Err(error) => self.tell(Who::Vehicle, format!("does not report its pose: {error}")),
        }
    }

    /// Releases control, unless another client has taken it.
    async fn leave(&mut self, control: Control) {
        if control.is_held() {
            control.release().await;
        }
    }

    fn tell(&mut self, who: Who, words: impl std::fmt::Display) -> Result<(), Failure> {
        self.story.tell(who, words)
    }
}
