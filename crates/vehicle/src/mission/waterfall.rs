//! The mission state machine: stages that start in sequence as each one succeeds. Until the path is
//! handed over, a blocked stage restarts from the first. After that a block stops the vehicle, and
//! the mission waits for the operator, unless [`Settings::retries`] allows a restart of motion.

mod refusal;
mod settings;
mod stage;
mod watch;

use std::sync::Arc;
use std::time::Instant;

use jaus::address::JausId;

pub use refusal::{NotPlanned, Refusal};
pub use settings::{Destination, Settings};
pub use stage::{Link, LinkState, Stage};
use watch::Links;

use super::lost_link::Trail;
use super::{LostLink, Path, Point};

/// One attempt of one mission. Results of earlier attempts are ignored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Run {
    /// The mission, counted from 1.
    pub mission: u32,
    /// The attempt, counted from 1.
    pub attempt: u8,
}

/// An action that the owner of a [`Mission`] carries out.
#[derive(Debug, Clone, PartialEq)]
pub enum Action {
    /// Stop the vehicle, release controlled components and cancel all earlier actions.
    Halt,
    /// Fetch the map and [report the result](Mission::handle_map).
    FetchMap(Run),
    /// Plan a path to the destination and [report the result](Mission::handle_path).
    Plan(Run, Destination),
    /// Take control of the path segment driver, hand over the path, start it at this speed in
    /// metres per second, and [report the result](Mission::handle_handed_over).
    HandOver(Run, Arc<Path>, f64),
    /// Check whether the client that lost control is still alive, and [report the
    /// result](Mission::handle_lost_client).
    CheckClient(Run, JausId),
}

/// Progress of a mission.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Report {
    /// The current attempt and mission. Mission 0 before the first.
    pub run: Run,
    /// Maximum number of attempts.
    pub attempts: u8,
    /// The current stage.
    pub stage: Stage,
    /// Completed part of the path, from 0 to 100 %.
    pub progress: u8,
    /// The destination.
    pub destination: Destination,
    /// Remaining length of the path in metres.
    pub remaining: f64,
    /// Why the mission is blocked or was restarted; may be empty.
    pub reason: String,
}

/// The current mission of a planner: the last one requested.
#[derive(Debug)]
pub struct Mission {
    settings: Settings,
    report: Report,
    approved: bool,
    /// Whether the mission waits for a new lease after a lost link.
    held: bool,
    /// Whether the path has been handed over, so that the vehicle may have moved.
    has_driven: bool,
    /// Whether the vehicle returns after a lost link.
    returns: bool,
    /// Whether the reason is that of an earlier attempt.
    is_reason_past: bool,
    /// Number of restarts by itself.
    retried: u8,
    /// Number of new paths in this attempt.
    detours: u8,
    /// The path driven from its start.
    trail: Trail,
    path: Arc<Path>,
    links: Links,
    /// When the next attempt starts.
    again: Option<Instant>,
    /// When the stage times out.
    deadline: Option<Instant>,
    halts: bool,
    action: Option<Action>,
}

impl Mission {
    /// Creates an idle planner.
    #[must_use]
    pub fn new(settings: Settings) -> Self {
        let settings = Settings {
            attempts: settings.attempts.max(1),
            ..settings
        };
        Self {
            settings,
            report: Report {
                attempts: settings.attempts,
                ..Report::default()
            },
            approved: false,
            held: false,
            has_driven: false,
            returns: false,
            is_reason_past: false,
            retried: 0,
            detours: 0,
            trail: Trail::default(),
            path: Arc::default(),
            links: Links::default(),
            again: None,
            deadline: None,
            halts: false,
            action: None,
        }
    }

    /// The progress report.
    #[must_use]
    pub const fn report(&self) -> &Report {
        &self.report
    }

    /// The last planned path; empty before planning.
    #[must_use]
    pub const fn path(&self) -> &Arc<Path> {
        &self.path
    }

    /// Starts a new mission in place of any current one, and returns its number. With `approved` it
    /// drives as soon as a path exists. With an invalid destination or speed it fails immediately.
    pub fn go_to(&mut self, now: Instant, destination: Destination, approved: bool) -> u32 {
        self.halt();
        let mission = self.report.run.mission.wrapping_add(1).max(1);
        self.report = Report {
            run: Run {
                mission,
                attempt: 1,
            },
            attempts: self.settings.attempts,
            destination,
            ..Report::default()
        };
        self.approved = approved;
        (self.has_driven, self.returns, self.retried) = (false, false, 0);
        self.is_reason_past = false;
        self.trail = Trail::default();
        self.path = Arc::default();
        match destination.mistake() {
            Some(mistake) => self.end(Stage::Failed, &mistake),
            None => self.begin(now),
        }
        mission
    }

    /// Records the operator's approval of the path, or of the mission before a path exists.
    ///
    /// # Errors
    /// If the mission is over, was replaced, or waits to be [continued](Self::resume).
    pub fn approve(&mut self, now: Instant, mission: u32) -> Result<(), Refusal> {
        let stage = self.current(mission)?;
        if stage == Stage::Waiting {
            return Err(Refusal::Waiting { mission });
        }
        self.approved = true;
        if self.held {
            // The vehicle is no longer at the start of the path.
            self.held = false;
            self.begin(now);
        } else if stage == Stage::AwaitingApproval {
            self.hand_over(now);
        }
        Ok(())
    }

    /// Continues a mission that a fault has stopped, on behalf of the operator: plans from where the
    /// vehicle is, and drives.
    ///
    /// # Errors
    /// If the mission is over, was replaced, or does not wait.
    pub fn resume(&mut self, now: Instant, mission: u32) -> Result<(), Refusal> {
        let stage = self.current(mission)?;
        if stage != Stage::Waiting {
            return Err(Refusal::NotWaiting { mission, stage });
        }
        self.next_attempt();
        self.report.reason.clear();
        self.retried = 0;
        self.approved = true;
        self.begin(now);
        Ok(())
    }

    /// The stage of a mission that is neither over nor replaced.
    fn current(&self, mission: u32) -> Result<Stage, Refusal> {
        let (current, stage) = (self.report.run.mission, self.report.stage);
        if mission != current {
            return Err(Refusal::Replaced {
                wanted: mission,
                current,
            });
        }
        if !stage.is_under_way() {
            return Err(Refusal::Over { mission, stage });
        }
        Ok(stage)
    }

    /// Ends an active mission with a reason: a request of the operator, a takeover or an emergency.
    /// The vehicle drives again only after a new destination.
    pub fn stop(&mut self, reason: &str) {
        if self.report.stage.is_under_way() {
            self.end(Stage::Stopped, reason);
        }
    }

    /// Handles a new client in control: ends the mission, unless it is held for a new lease.
    pub fn handle_new_client(&mut self, reason: &str) {
        if !self.held || self.settings.lost_link != LostLink::Hold {
            self.stop(reason);
        }
    }

    /// Handles the end of control by `client` without a takeover: stops the vehicle and proceeds
    /// according to [`Settings::lost_link`].
    pub fn lose_client(&mut self, client: JausId, reason: &str) {
        if !self.report.stage.is_under_way() {
            return;
        }
        let drives = self.report.stage.is_handed_over();
        match self.settings.lost_link {
            LostLink::Hold => self.hold(&format!("held until approved again: {reason}")),
            LostLink::Return if drives && self.trail.back().is_some() => {
                self.hold(reason);
                self.action = Some(Action::CheckClient(self.report.run, client));
            }
            LostLink::Stop | LostLink::Return => self.end(Stage::Stopped, reason),
        }
    }

    /// Stops the vehicle and holds the mission.
    fn hold(&mut self, reason: &str) {
        self.halt();
        self.held = true;
        self.approved = false;
        self.report.stage = Stage::AwaitingApproval;
        reason.clone_into(&mut self.report.reason);
    }

    /// Handles the liveness of the client that lost control. A live client has released control, so
    /// the mission ends. Otherwise the vehicle returns.
    pub fn handle_lost_client(&mut self, now: Instant, run: Run, is_alive: bool) {
        if self.report.run != run || !self.held || self.settings.lost_link != LostLink::Return {
            return;
        }
        let reason = std::mem::take(&mut self.report.reason);
        let Some(back) = self.trail.back().filter(|_| !is_alive) else {
            return self.end(Stage::Stopped, &reason);
        };
        self.held = false;
        self.returns = true;
        self.next_attempt();
        self.report.progress = 0;
        self.report.remaining = back.length();
        if let Some(&(x, y)) = back.points().last() {
            self.report.destination = Destination {
                x,
                y,
                ..self.report.destination
            };
        }
        self.report.reason = format!("returns: {reason}");
        self.path = Arc::new(back);
        self.hand_over(now);
    }

    /// Records the vehicle's position in the local frame.
    pub fn handle_pose(&mut self, point: Point) {
        if self.report.stage.is_handed_over() {
            self.trail.note(point);
        }
    }

    /// Handles the fetched map or the failure to fetch it.
    pub fn handle_map(&mut self, now: Instant, run: Run, result: Result<(), String>) {
        if !self.is_in(run, Stage::Map) {
            return;
        }
        match result {
            Ok(()) => {
                self.enter(now, Stage::Planning);
                self.action = Some(Action::Plan(run, self.report.destination));
            }
            Err(reason) => self.set_back(now, &reason),
        }
    }

    /// Handles the planned path or the failure to plan. A `hopeless` failure is not retried.
    pub fn handle_path(&mut self, now: Instant, run: Run, result: Result<Path, NotPlanned>) {
        if !self.is_in(run, Stage::Planning) {
            return;
        }
        match result {
            Ok(path) => {
                self.report.remaining = path.length();
                self.path = Arc::new(path);
                self.enter(now, Stage::AwaitingApproval);
                if self.approved {
                    self.hand_over(now);
                }
            }
            Err(why) if why.hopeless => self.end(Stage::Failed, &why.reason),
            Err(why) => self.set_back(now, &why.reason),
        }
    }

    /// Handles the result of the hand-over to the path segment driver.
    pub fn handle_handed_over(&mut self, now: Instant, run: Run, result: Result<(), String>) {
        if !self.is_in(run, Stage::Path) {
            return;
        }
        match result {
            Ok(()) => {
                self.links.open();
                // From here on the drivers are monitored individually.
                self.deadline = None;
                self.go_on(now);
            }
            Err(reason) => self.set_back(now, &reason),
        }
    }

    /// Handles a change of the map that blocks the path under way: stops the vehicle and plans another
    /// path. After [`Settings::detours`] of them the attempt has failed.
    pub fn handle_blocked_path(&mut self, now: Instant, run: Run, reason: &str) {
        if self.report.run != run || !self.report.stage.is_handed_over() {
            return;
        }
        if self.detours >= self.settings.detours {
            let count = self.settings.detours;
            return self.set_back(now, &format!("{reason}, after {count} other paths"));
        }
        self.detours += 1;
        self.halt();
        self.is_reason_past = false;
        reason.clone_into(&mut self.report.reason);
        self.report.progress = 0;
        self.enter(now, Stage::Planning);
        self.action = Some(Action::Plan(run, self.report.destination));
    }

    /// Handles a state report of a driver of the chain.
    pub fn handle_link(&mut self, now: Instant, link: Link, state: LinkState) {
        self.links.note(now, link, state);
        self.go_on(now);
    }

    /// Handles progress along the path: completed part from 0 to 100 %, remaining length in metres.
    pub fn handle_progress(&mut self, now: Instant, run: Run, progress: u8, remaining: f64) {
        if self.report.run != run || !self.report.stage.is_handed_over() {
            return;
        }
        let progress = progress.min(100);
        if self.report.stage == Stage::Driving && progress != self.report.progress {
            self.deadline = now.checked_add(self.settings.stall);
        }
        self.report.progress = progress;
        self.report.remaining = remaining;
    }

    /// Fails the attempt for a reason that no driver has reported.
    pub fn handle_setback(&mut self, now: Instant, run: Run, reason: &str) {
        let stage = self.report.stage;
        let is_active = stage.is_under_way() && stage != Stage::Waiting;
        if self.report.run == run && self.again.is_none() && is_active {
            self.set_back(now, reason);
        }
    }

    /// Advances to time `now`.
    pub fn handle_time(&mut self, now: Instant) {
        if self.again.is_some_and(|again| again <= now) {
            self.begin(now);
        }
        self.go_on(now);
        if self.deadline.is_some_and(|deadline| deadline <= now) {
            let reason = self.too_long();
            self.set_back(now, &reason);
        }
    }

    /// When [`handle_time`](Self::handle_time) must be called next.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        let stage = self.report.stage;
        let lost = self.links.give_up_at(stage, &self.settings);
        let times = [self.again, self.deadline, lost.map(|(at, _)| at)];
        times.into_iter().flatten().min()
    }

    /// Takes the next action.
    pub fn poll_action(&mut self) -> Option<Action> {
        if std::mem::take(&mut self.halts) {
            return Some(Action::Halt);
        }
        self.action.take()
    }

    /// Whether an attempt is in a stage and not waiting to restart.
    fn is_in(&self, run: Run, stage: Stage) -> bool {
        self.report.run == run && self.report.stage == stage && self.again.is_none()
    }

    /// Starts an attempt.
    fn begin(&mut self, now: Instant) {
        self.again = None;
        self.detours = 0;
        self.links.close();
        self.enter(now, Stage::Map);
        self.action = Some(Action::FetchMap(self.report.run));
    }

    fn enter(&mut self, now: Instant, stage: Stage) {
        self.report.stage = stage;
        self.links.begin(now);
        let patience = match stage {
            Stage::Map | Stage::Planning | Stage::Path => Some(self.settings.patience),
            Stage::Driving => Some(self.settings.stall),
            // The operator has no time limit, and drivers are monitored individually.
            _ => None,
        };
        self.deadline = patience.and_then(|patience| now.checked_add(patience));
    }

    fn hand_over(&mut self, now: Instant) {
        self.has_driven = true;
        self.enter(now, Stage::Path);
        let speed = self.report.destination.speed.unwrap_or(self.settings.speed);
        self.action = Some(Action::HandOver(
            self.report.run,
            Arc::clone(&self.path),
            speed,
        ));
    }

    /// Advances through the stages of the chain that have succeeded.
    fn go_on(&mut self, now: Instant) {
        while let Some(next) = self.links.next(self.report.stage) {
            if next == Stage::Arrived {
                self.report.progress = 100;
                self.report.remaining = 0.0;
                return self.end(Stage::Arrived, "");
            }
            self.enter(now, next);
            if next == Stage::Driving && std::mem::take(&mut self.is_reason_past) {
                // Why the earlier attempt has failed no longer matters.
                self.report.reason.clear();
            }
        }
        let lost = self.links.give_up_at(self.report.stage, &self.settings);
        if let Some((_, reason)) = lost.filter(|&(at, _)| at <= now) {
            self.set_back(now, &reason);
        }
    }

    /// Handles a failed attempt: schedules another one if nothing has moved yet, and waits for the
    /// operator otherwise.
    fn set_back(&mut self, now: Instant, reason: &str) {
        let Report { run, attempts, .. } = self.report;
        let may_retry = match self.has_driven {
            true => self.retried < self.settings.retries,
            false => run.attempt < attempts,
        };
        if self.returns || (!self.has_driven && !may_retry) {
            // The return has no operator who could continue it.
            return self.end(Stage::Failed, reason);
        }
        self.halt();
        self.report.progress = 0;
        reason.clone_into(&mut self.report.reason);
        if !may_retry {
            self.report.stage = Stage::Waiting;
            return;
        }
        self.is_reason_past = true;
        self.retried += u8::from(self.has_driven);
        self.next_attempt();
        self.report.stage = Stage::Map;
        self.again = now.checked_add(self.settings.pause);
    }

    /// Counts an attempt, so that results of the one before are ignored.
    fn next_attempt(&mut self) {
        let report = &mut self.report;
        report.run.attempt = report.run.attempt.wrapping_add(1).max(1);
        report.attempts = report.attempts.max(report.run.attempt);
    }

    fn end(&mut self, stage: Stage, reason: &str) {
        self.halt();
        self.report.stage = stage;
        reason.clone_into(&mut self.report.reason);
    }

    /// Cancels everything that is under way.
    fn halt(&mut self) {
        self.halts |= self.report.stage.is_under_way();
        self.held = false;
        self.action = None;
        self.again = None;
        self.deadline = None;
        self.links.close();
    }

    fn too_long(&self) -> String {
        match self.report.stage {
            Stage::Driving => format!(
                "the vehicle made no progress for {} s at {} % of the path",
                self.settings.stall.as_secs(),
                self.report.progress
            ),
            stage => format!(
                "the stage \"{stage}\" took longer than {} s",
                self.settings.patience.as_secs()
            ),
        }
    }
}
