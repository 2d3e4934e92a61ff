//! Mission Planner: the operator sets a destination, approves the path and follows the progress.
//!
//! The service passes commands to a [`Mission`] and reports its state. The mission's executor holds
//! the same [`Missions`] and is woken when there is work to do.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use crate::messages::ground::report_planned_path::{MissionRec, PointRec};
use crate::messages::ground::set_destination::Approved;
use crate::messages::ground::{
    ApproveMission, ContinueMission, QueryMission, QueryPlannedPath, ReportMission,
    ReportPlannedPath, SetDestination, StopMission, mission_planner, report_mission,
};
use crate::mission::{Destination, Mission, Path, Report, Settings};
use jaus::address::JausId;
use jaus::codec::{Message, ServiceId, Text};
use jaus::endpoint::Received;
use jaus::service::{
    Context, Handled, Hazards, Service, Standing, State, StopCause, Validity, code_of, read,
};

/// A planner's mission, shared by the service and the executor.
#[derive(Clone)]
pub struct Missions {
    mission: Arc<Mutex<Mission>>,
    wake: Arc<dyn Fn() + Send + Sync>,
}

/// Changes of a mission that subscribers receive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct News {
    /// Whether Report Mission has changed.
    pub mission: bool,
    /// Whether Report Planned Path has changed.
    pub path: bool,
}

impl Missions {
    /// Creates an idle planner. `wake` is called after operator input that requires action. It must
    /// not block.
    #[must_use]
    pub fn new(settings: Settings, wake: impl Fn() + Send + Sync + 'static) -> Self {
        Self {
            mission: Arc::new(Mutex::new(Mission::new(settings))),
            wake: Arc::new(wake),
        }
    }

    /// Runs `words` on the mission and returns its result with the resulting changes.
    pub fn tell<T>(&self, words: impl FnOnce(&mut Mission) -> T) -> (T, News) {
        let mut mission = self.mission.lock().unwrap_or_else(PoisonError::into_inner);
        let before = (mission.report().clone(), Arc::clone(mission.path()));
        let answer = words(&mut mission);
        let news = News {
            mission: before.0 != *mission.report(),
            path: !Arc::ptr_eq(&before.1, mission.path()),
        };
        (answer, news)
    }

    /// Creates the service for the mission.
    #[must_use]
    pub fn service(&self) -> MissionPlanner {
        MissionPlanner {
            missions: self.clone(),
        }
    }
}

impl std::fmt::Debug for Missions {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Missions").finish_non_exhaustive()
    }
}

/// Accepts commands from the client in control while the component is ready, and reports the
/// mission to any client. The mission stops when the component may no longer act or another client
/// takes control. It does not resume on its own.
#[derive(Debug)]
pub struct MissionPlanner {
    missions: Missions,
}

impl MissionPlanner {
    fn command<M: Message>(
        &self,
        message: &Received,
        context: &mut Context<'_>,
        carry_out: impl FnOnce(M, &mut Mission),
    ) {
        if !context.standing().acts_for(message.source) {
            tracing::debug!(source = %message.source, command = M::NAME, "ignored: sender not in \
                control");
        } else if let Some(command) = read(message) {
            self.tell(context, |mission| carry_out(command, mission));
        }
    }

    fn tell(&self, context: &mut Context<'_>, words: impl FnOnce(&mut Mission)) {
        let ((), news) = self.missions.tell(words);
        if news.mission {
            context.changed::<QueryMission>();
        }
        if news.path {
            context.changed::<QueryPlannedPath>();
        }
        (self.missions.wake)();
    }
}

impl Service for MissionPlanner {
    fn offers(&self) -> Vec<ServiceId> {
        vec![mission_planner::LATEST]
    }

    fn handle_message(
        &mut self,
        now: Instant,
        message: &Received,
        context: &mut Context<'_>,
    ) -> Handled {
        match code_of(&message.payload) {
            // In the order in which the client has sent them: a retransmitted destination must not
            // start a mission that was stopped since.
            Some(SetDestination::CODE)
                if context.standing().acts_for(message.source)
                    && !context.admits_setpoint(now, message, Validity::UntilDone) => {}
            Some(SetDestination::CODE) => self.command(message, context, |command, mission| {
                let (destination, approved) = wanted(&command);
                mission.go_to(now, destination, approved);
            }),
            Some(ApproveMission::CODE) => {
                self.command(message, context, |command: ApproveMission, mission| {
                    if let Err(refusal) = mission.approve(now, command.mission) {
                        tracing::info!(%refusal, "approval refused");
                    }
                });
            }
            Some(ContinueMission::CODE) => {
                self.command(message, context, |command: ContinueMission, mission| {
                    if let Err(refusal) = mission.resume(now, command.mission) {
                        tracing::info!(%refusal, "not continued");
                    }
                });
            }
            Some(StopMission::CODE) => {
                context.note_stop(now, message);
                let reason = format!("{} has stopped the mission", message.source);
                self.command(message, context, |_: StopMission, mission| {
                    mission.stop(&reason);
                });
            }
            Some(QueryMission::CODE) => {
                let (answer, _) = self.missions.tell(|mission| report(mission.report()));
                context.reply(message, &answer);
            }
            Some(QueryPlannedPath::CODE) => {
                let (answer, _) = self.missions.tell(|mission| {
                    let run = mission.report().run;
                    report_path(run.mission, mission.path())
                });
                context.reply(message, &answer);
            }
            _ => return Handled::No,
        }
        Handled::Yes
    }

    fn hazards(&self) -> Hazards {
        Hazards {
            acts_on: Some(SetDestination::NAME),
            stops: true,
            ..Hazards::default()
        }
    }

    fn handle_stop(&mut self, cause: &StopCause, context: &mut Context<'_>) {
        // The other causes are changes of the standing, which carry more detail.
        if *cause == StopCause::Ended {
            self.tell(context, |mission| mission.stop("the planner has shut down"));
        }
    }

    fn handle_standing(&mut self, _: Instant, before: &Standing, context: &mut Context<'_>) {
        let now = *context.standing();
        if now.stops(before) {
            let reason = why_stopped(before, &now);
            match (lost_client(before, &now), now.controller) {
                (Some(client), _) => {
                    self.tell(context, |mission| mission.lose_client(client, &reason));
                }
                (None, Some(_)) if before.controller.is_none() => {
                    self.tell(context, |mission| mission.handle_new_client(&reason));
                }
                _ => self.tell(context, |mission| mission.stop(&reason)),
            }
        }
    }
}

fn wanted(command: &SetDestination) -> (Destination, bool) {
    let destination = Destination {
        x: command.x,
        y: command.y,
        speed: command.speed.map(f64::from),
    };
    (destination, command.approved == Approved::YES)
}

/// The client whose control ended, if nothing else stops the planner.
fn lost_client(before: &Standing, now: &Standing) -> Option<JausId> {
    let is_well = matches!(now.state, State::Ready | State::Standby);
    let client = before.controller.filter(|_| is_well)?;
    now.controller.is_none().then_some(client.id)
}

/// Why the planner must abandon its current mission.
fn why_stopped(before: &Standing, now: &Standing) -> String {
    let client = |standing: &Standing| standing.controller.map(|controller| controller.id);
    match (now.state, client(now)) {
        (State::Emergency, _) => "an emergency stopped the planner".to_owned(),
        (_, Some(id)) if client(before) != Some(id) => {
            format!("{id} has taken control of the planner")
        }
        (State::Ready | State::Standby, None) if before.controller.is_some() => {
            "the control of the planner's client has ended".to_owned()
        }
        (state, _) => format!("the planner went to the state {state}"),
    }
}

fn report(report: &Report) -> ReportMission {
    ReportMission {
        mission: report.run.mission,
        stage: report_mission::Stage(report.stage as u8),
        attempt: report.run.attempt,
        attempts: report.attempts,
        progress: report.progress,
        destination_x: report.destination.x,
        destination_y: report.destination.y,
        remaining: report.remaining as f32,
        reason: Text::prefix(&report.reason, MAX_REASON).into(),
    }
}

/// Maximum length of a reason in octets.
const MAX_REASON: usize = 255;

fn report_path(mission: u32, path: &Path) -> ReportPlannedPath {
    let points = path.points().iter();
    ReportPlannedPath {
        mission_rec: MissionRec { mission },
        point_list: points.map(|&(x, y)| PointRec { x, y }).collect(),
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicU32, Ordering};

    use super::*;
    use crate::mission::{Action, LostLink, Stage};
    use jaus::service::rig::{CLIENT, Rig, STRANGER};

    struct Bench {
        rig: Rig,
        missions: Missions,
        woken: Arc<AtomicU32>,
    }

    impl Bench {
        fn new() -> Self {
            Self::with(Settings::default())
        }

        fn with(settings: Settings) -> Self {
            let woken = Arc::new(AtomicU32::new(0));
            let count = Arc::clone(&woken);
            let wake = move || _ = count.fetch_add(1, Ordering::Relaxed);
            let missions = Missions::new(settings, wake);
            Self {
                rig: Rig::new(vec![Box::new(missions.service())]),
                missions,
                woken,
            }
        }

        fn go(&mut self, x: f64) {
            let to = SetDestination {
                x,
                y: 2.0,
                speed: Some(0.5),
                ..SetDestination::default()
            };
            self.rig.send(CLIENT, &to);
        }

        fn report(&mut self) -> ReportMission {
            self.rig.ask(&QueryMission {}).unwrap()
        }

        /// Advances to a path that awaits approval.
        fn plan(&mut self, points: Vec<(f64, f64)>) {
            let now = self.rig.now;
            let _ = self.missions.tell(|mission| {
                let run = mission.report().run;
                mission.handle_map(now, run, Ok(()));
                mission.handle_path(now, run, Ok(Path::new(points)));
            });
        }
    }

    #[test]
    fn a_destination_from_the_client_in_control_begins_a_mission() {
        let mut bench = Bench::new();
        let woken = bench.woken.load(Ordering::Relaxed);
        bench.go(1.0);
        assert!(bench.woken.load(Ordering::Relaxed) > woken);
        let report = bench.report();
        assert_eq!(report.stage, report_mission::Stage::MAP);
        assert_eq!((report.mission, report.attempt), (1, 1));
        assert_eq!((report.destination_x, report.destination_y), (1.0, 2.0));
        let changed = &bench.rig.changed();
        assert!(changed.contains(&QueryMission::CODE));
        let (action, _) = bench.missions.tell(Mission::poll_action);
        assert!(matches!(action, Some(Action::FetchMap(_))));
    }

    #[test]
    fn commands_of_others_are_ignored_and_all_while_not_ready() {
        let mut bench = Bench::new();
        let to = SetDestination::default();
        bench.rig.send(STRANGER, &to);
        assert_eq!(bench.report().stage, report_mission::Stage::IDLE);
        bench.rig.stand(State::Standby, Some(CLIENT));
        bench.rig.send(CLIENT, &to);
        assert_eq!(bench.report().stage, report_mission::Stage::IDLE);
    }

    #[test]
    fn the_path_is_told_and_driven_once_it_is_approved() {
        let mut bench = Bench::new();
        bench.go(3.0);
        bench.plan(vec![(0.0, 0.0), (3.0, 2.0)]);
        let path: ReportPlannedPath = bench.rig.ask(&QueryPlannedPath {}).unwrap();
        assert_eq!(path.mission_rec.mission, 1);
        assert_eq!(path.point_list[1], PointRec { x: 3.0, y: 2.0 });
        bench.rig.send(CLIENT, &ApproveMission { mission: 2 });
        assert_eq!(
            bench.report().stage,
            report_mission::Stage::AWAITING_APPROVAL
        );
        bench.rig.send(CLIENT, &ApproveMission { mission: 1 });
        assert_eq!(bench.report().stage, report_mission::Stage::PATH);
    }

    #[test]
    fn it_stops_with_a_reason_when_it_may_not_go_on() {
        for (state, client, reason) in [
            (
                State::Emergency,
                Some(CLIENT),
                "an emergency stopped the planner",
            ),
            (
                State::Standby,
                Some(CLIENT),
                "the planner went to the state standby",
            ),
            (
                State::Ready,
                Some(STRANGER),
                "42.2.1 has taken control of the planner",
            ),
            (
                State::Ready,
                None,
                "the control of the planner's client has ended",
            ),
        ] {
            let mut bench = Bench::new();
            bench.go(3.0);
            bench.rig.stand(state, client);
            let report = bench.report();
            assert_eq!(report.stage, report_mission::Stage::STOPPED);
            assert_eq!(report.reason, reason);
            bench.rig.stand(State::Ready, Some(CLIENT));
            assert_eq!(bench.report().stage, report_mission::Stage::STOPPED);
        }
    }

    /// A planner that is driving, with the given lost-link behaviour.
    fn driving(lost_link: LostLink) -> Bench {
        let mut bench = Bench::with(Settings {
            lost_link,
            ..Settings::default()
        });
        bench.go(3.0);
        bench.rig.send(CLIENT, &ApproveMission { mission: 1 });
        bench.plan(vec![(0.0, 0.0), (3.0, 2.0)]);
        assert_eq!(bench.report().stage, report_mission::Stage::PATH);
        let _ = bench.missions.tell(|mission| {
            mission.handle_pose((0.0, 0.0));
            mission.handle_pose((1.0, 0.0));
        });
        bench
    }

    #[test]
    fn a_held_mission_goes_on_only_by_a_new_client_that_approves_it() {
        let mut bench = driving(LostLink::Hold);
        bench.rig.stand(State::Standby, None);
        let report = bench.report();
        assert_eq!(report.stage, report_mission::Stage::AWAITING_APPROVAL);
        bench.rig.stand(State::Standby, Some(STRANGER));
        bench.rig.stand(State::Ready, Some(STRANGER));
        assert_eq!(
            bench.report().stage,
            report_mission::Stage::AWAITING_APPROVAL,
            "not by itself"
        );
        bench.rig.send(STRANGER, &ApproveMission { mission: 1 });
        assert_eq!(bench.report().stage, report_mission::Stage::MAP);
    }

    #[test]
    fn an_emergency_ends_a_held_mission() {
        let mut bench = driving(LostLink::Hold);
        bench.rig.stand(State::Standby, None);
        bench.rig.stand(State::Emergency, None);
        assert_eq!(bench.report().stage, report_mission::Stage::STOPPED);
    }

    #[test]
    fn a_new_lease_or_an_emergency_ends_the_way_back() {
        for (state, client) in [
            (State::Standby, Some(STRANGER)),
            (State::Standby, Some(CLIENT)),
            (State::Emergency, None),
        ] {
            let mut bench = driving(LostLink::Return);
            bench.rig.stand(State::Standby, None);
            let now = bench.rig.now;
            let _ = bench.missions.tell(|mission| {
                let run = mission.report().run;
                mission.handle_lost_client(now, run, false);
            });
            assert_eq!(bench.report().stage, report_mission::Stage::PATH);
            bench.rig.stand(state, client);
            assert_eq!(bench.report().stage, report_mission::Stage::STOPPED);
        }
    }

    #[test]
    fn only_the_client_in_control_continues_a_mission_that_a_fault_has_stopped() {
        let mut bench = driving(LostLink::Stop);
        let now = bench.rig.now;
        let _ = bench.missions.tell(|mission| {
            let run = mission.report().run;
            mission.handle_setback(now, run, "the pose is 0.8 s old");
        });
        let report = bench.report();
        assert_eq!(report.stage, report_mission::Stage::WAITING);
        assert_eq!(report.reason.as_str(), Some("the pose is 0.8 s old"));
        bench.rig.send(CLIENT, &ApproveMission { mission: 1 });
        bench.rig.send(STRANGER, &ContinueMission { mission: 1 });
        bench.rig.send(CLIENT, &ContinueMission { mission: 2 });
        assert_eq!(bench.report().stage, report_mission::Stage::WAITING);
        bench.rig.send(CLIENT, &ContinueMission { mission: 1 });
        let report = bench.report();
        assert_eq!(
            (report.stage, report.attempt),
            (report_mission::Stage::MAP, 2)
        );
        assert_eq!(report.reason.as_str(), Some(""));
    }

    #[test]
    fn the_operator_stops_it() {
        let mut bench = Bench::new();
        bench.go(3.0);
        bench.rig.send(CLIENT, &StopMission {});
        let report = bench.report();
        assert_eq!(report.stage, report_mission::Stage::STOPPED);
        assert_eq!(report.reason, "42.1.1 has stopped the mission");
    }

    #[test]
    fn a_destination_from_before_the_stop_starts_nothing() {
        let mut bench = Bench::new();
        let destination = SetDestination::default();
        bench.rig.send_as(Some(7), CLIENT, &StopMission {});
        bench.rig.send_as(Some(6), CLIENT, &destination);
        assert_eq!(bench.report().stage, report_mission::Stage::IDLE);
        bench.rig.send_as(Some(8), CLIENT, &destination);
        assert_ne!(bench.report().stage, report_mission::Stage::IDLE);
    }

    #[test]
    fn a_long_reason_is_told_as_far_as_it_fits() {
        let mut bench = Bench::new();
        bench.go(3.0);
        let reason = format!("x{}", "ä".repeat(200));
        let _ = bench.missions.tell(|mission| mission.stop(&reason));
        let told = bench.report().reason;
        assert_eq!(told.len(), 255);
        assert!(told.as_str().is_some_and(|told| reason.starts_with(told)));
    }

    #[test]
    fn the_stages_have_the_numbers_of_the_report() {
        for (stage, number) in [
            (Stage::Idle, report_mission::Stage::IDLE),
            (Stage::Map, report_mission::Stage::MAP),
            (Stage::Planning, report_mission::Stage::PLANNING),
            (
                Stage::AwaitingApproval,
                report_mission::Stage::AWAITING_APPROVAL,
            ),
            (Stage::Path, report_mission::Stage::PATH),
            (Stage::Vector, report_mission::Stage::VECTOR),
            (Stage::Primitive, report_mission::Stage::PRIMITIVE),
            (Stage::Driving, report_mission::Stage::DRIVING),
            (Stage::Arrived, report_mission::Stage::ARRIVED),
            (Stage::Failed, report_mission::Stage::FAILED),
            (Stage::Stopped, report_mission::Stage::STOPPED),
            (Stage::Waiting, report_mission::Stage::WAITING),
        ] {
            assert_eq!(report_mission::Stage(stage as u8), number);
        }
    }
}
