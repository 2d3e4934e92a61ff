//! The waterfall: the stages of a mission, of which each begins when the one before it has
//! succeeded, and which begins again from the first when one of them is blocked.

mod stage;
mod watch;

use std::sync::Arc;
use std::time::{Duration, Instant};

use jaus::address::JausId;

pub use stage::{Link, LinkState, Stage};
use watch::Links;

use super::lost_link::Trail;
use super::{LostLink, Path, Point};

/// How patient a mission is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// How often it is begun at most; at least once.
    pub attempts: u8,
    /// Between an attempt that was blocked and the next one.
    pub pause: Duration,
    /// How long a stage may take to begin, or to come back.
    pub patience: Duration,
    /// How long a stage may say that it is blocked until it counts.
    pub settling: Duration,
    /// How long the vehicle may drive without getting on.
    pub stall: Duration,
    /// The greatest speed, in metres per second, for whoever does not choose one.
    pub speed: f64,
    /// What becomes of it when the operator's link is lost.
    pub lost_link: LostLink,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            attempts: 3,
            pause: Duration::from_secs(3),
            patience: Duration::from_secs(15),
            settling: Duration::from_secs(1),
            stall: Duration::from_secs(60),
            speed: 1.0,
            lost_link: LostLink::Stop,
        }
    }
}

/// Where to go.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Destination {
    /// Metres along X of the local frame.
    pub x: f64,
    /// Metres along Y of the local frame.
    pub y: f64,
    /// The greatest speed, in metres per second.
    pub speed: Option<f64>,
}

impl Destination {
    /// The greatest speed that may be asked for, in metres per second.
    pub const MAX_SPEED: f64 = 100.0;

    /// What is wrong with it, and what would do.
    fn mistake(&self) -> Option<String> {
        let Self { x, y, speed } = *self;
        if !x.is_finite() || !y.is_finite() {
            return Some(format!(
                "the destination at x {x} m, y {y} m is no place: set finite numbers of metres"
            ));
        }
        let speed = speed.filter(|&speed| !(speed > 0.0 && speed <= Self::MAX_SPEED))?;
        Some(format!(
            "a speed of {speed} m/s can not be driven: set one above 0 and up to {} m/s",
            Self::MAX_SPEED
        ))
    }
}

/// One attempt of one mission. What is reported of an earlier one does not count any more.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Run {
    /// The mission, counted from 1.
    pub mission: u32,
    /// The attempt, counted from 1.
    pub attempt: u8,
}

/// What the owner of a [`Mission`] has to do for it.
#[derive(Debug, Clone, PartialEq)]
pub enum Action {
    /// Stop the vehicle, give back what is controlled, and give up any earlier action.
    Halt,
    /// Fetch the map, and [say how it went](Mission::handle_map).
    FetchMap(Run),
    /// Plan a path to the destination over it, and [say how it went](Mission::handle_path).
    Plan(Run, Destination),
    /// Take the path segment driver under control, hand the path over, have it driven at this
    /// speed in metres per second, and [say how it went](Mission::handle_handed_over).
    HandOver(Run, Arc<Path>, f64),
    /// Find out whether the client that has lost control is still alive, and
    /// [say so](Mission::handle_lost_client).
    CheckClient(Run, JausId),
}

/// How far a mission is.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Report {
    /// Which attempt of which mission; mission 0 before the first.
    pub run: Run,
    /// How often it is begun at most.
    pub attempts: u8,
    /// The stage that it is in.
    pub stage: Stage,
    /// How much of the path is driven, from 0 to 100 %.
    pub progress: u8,
    /// Where it goes.
    pub destination: Destination,
    /// How much of the path lies ahead, in metres.
    pub remaining: f64,
    /// Why it does not go on, or why it was begun again; may be empty.
    pub reason: String,
}

/// Why a wish was not granted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Refusal {
    /// It is about a mission that is not the last one.
    #[error("mission {wanted} can not be approved: mission {current} has replaced it")]
    Replaced {
        /// The one that was meant.
        wanted: u32,
        /// The last one.
        current: u32,
    },
    /// There is nothing to approve.
    #[error("mission {mission} can not be approved: it is over ({stage})")]
    Over {
        /// The one that was meant.
        mission: u32,
        /// How it ended.
        stage: Stage,
    },
}

/// The mission of a planner: the last one that was asked for.
#[derive(Debug)]
pub struct Mission {
    settings: Settings,
    report: Report,
    approved: bool,
    /// Whether it waits for a new lease after the link was lost.
    held: bool,
    /// The way from where it began.
    trail: Trail,
    path: Arc<Path>,
    links: Links,
    /// When the next attempt begins.
    again: Option<Instant>,
    /// When the stage has taken too long.
    deadline: Option<Instant>,
    halts: bool,
    action: Option<Action>,
}

impl Mission {
    /// No mission yet.
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
            trail: Trail::default(),
            path: Arc::default(),
            links: Links::default(),
            again: None,
            deadline: None,
            halts: false,
            action: None,
        }
    }

    /// How far it is.
    #[must_use]
    pub const fn report(&self) -> &Report {
        &self.report
    }

    /// The path that was planned last for it; empty before.
    #[must_use]
    pub const fn path(&self) -> &Arc<Path> {
        &self.path
    }

    /// Begins another mission, instead of any that is under way; says its number. With `approved`
    /// it drives as soon as there is a path. To a destination that is none, or with a speed that is
    /// none, it has failed at once.
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
        self.trail = Trail::default();
        self.path = Arc::default();
        match destination.mistake() {
            Some(mistake) => self.end(Stage::Failed, &mistake),
            None => self.begin(now),
        }
        mission
    }

    /// The operator approves the path, or the mission before there is one.
    ///
    /// # Errors
    /// If that mission is over or was replaced.
    pub fn approve(&mut self, now: Instant, mission: u32) -> Result<(), Refusal> {
        let current = self.report.run.mission;
        let stage = self.report.stage;
        if mission != current {
            return Err(Refusal::Replaced {
                wanted: mission,
                current,
            });
        }
        if !stage.is_under_way() {
            return Err(Refusal::Over { mission, stage });
        }
        self.approved = true;
        if self.held {
            // The vehicle is no longer where the path began.
            self.held = false;
            self.begin(now);
        } else if stage == Stage::AwaitingApproval {
            self.hand_over(now);
        }
        Ok(())
    }

    /// Ends the mission, if one is under way, and says why: the operator wants it, has taken over,
    /// or there is an emergency. Only another destination makes the vehicle drive again.
    pub fn stop(&mut self, reason: &str) {
        if self.report.stage.is_under_way() {
            self.end(Stage::Stopped, reason);
        }
    }

    /// Another client has taken control: ends the mission, unless it is held for that.
    pub fn handle_new_client(&mut self, reason: &str) {
        if !self.held || self.settings.lost_link != LostLink::Hold {
            self.stop(reason);
        }
    }

    /// Control of `client` has ended without another client's taking it: stops the vehicle, and goes
    /// on as [`Settings::lost_link`] says.
    pub fn lose_client(&mut self, client: JausId, reason: &str) {
        if !self.report.stage.is_under_way() {
            return;
        }
        let drives = self.report.stage.is_handed_over();
        match self.settings.lost_link {
            LostLink::Hold => self.hold(&format!("held until it is approved again: {reason}")),
            LostLink::Return if drives && self.trail.back().is_some() => {
                self.hold(reason);
                self.action = Some(Action::CheckClient(self.report.run, client));
            }
            LostLink::Stop | LostLink::Return => self.end(Stage::Stopped, reason),
        }
    }

    /// Stops the vehicle and keeps the mission.
    fn hold(&mut self, reason: &str) {
        self.halt();
        self.held = true;
        self.approved = false;
        self.report.stage = Stage::AwaitingApproval;
        reason.clone_into(&mut self.report.reason);
    }

    /// Whether the client that has lost control is alive. If it is, it has released control, and the
    /// mission is over; if it is not, the vehicle drives back.
    pub fn handle_lost_client(&mut self, now: Instant, run: Run, is_alive: bool) {
        if self.report.run != run || !self.held || self.settings.lost_link != LostLink::Return {
            return;
        }
        let reason = std::mem::take(&mut self.report.reason);
        let Some(back) = self.trail.back().filter(|_| !is_alive) else {
            return self.end(Stage::Stopped, &reason);
        };
        self.held = false;
        // One attempt: a new one would drive to the destination.
        self.report.run.attempt = self.report.attempts;
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

    /// The vehicle is at a point of the local frame.
    pub fn handle_pose(&mut self, point: Point) {
        if self.report.stage.is_handed_over() {
            self.trail.note(point);
        }
    }

    /// The map is there, or why it is not.
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

    /// There is a path, or why there is none. A mission that is `hopeless` is not begun again.
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

    /// The path segment driver has the path and was told to drive it, or why not.
    pub fn handle_handed_over(&mut self, now: Instant, run: Run, result: Result<(), String>) {
        if !self.is_in(run, Stage::Path) {
            return;
        }
        match result {
            Ok(()) => {
                self.links.open();
                // From here on the drivers are watched one by one.
                self.deadline = None;
                self.go_on(now);
            }
            Err(reason) => self.set_back(now, &reason),
        }
    }

    /// A stage of the chain has told how it is.
    pub fn handle_link(&mut self, now: Instant, link: Link, state: LinkState) {
        self.links.note(now, link, state);
        self.go_on(now);
    }

    /// How much of the path is driven, from 0 to 100 %, and how much lies ahead in metres.
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

    /// The attempt can not go on, for a reason that no stage has told.
    pub fn handle_setback(&mut self, now: Instant, run: Run, reason: &str) {
        if self.report.run == run && self.again.is_none() && self.report.stage.is_under_way() {
            self.set_back(now, reason);
        }
    }

    /// It is `now`.
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

    /// When [`handle_time`](Self::handle_time) must be called.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        let stage = self.report.stage;
        let lost = self.links.give_up_at(stage, &self.settings);
        let times = [self.again, self.deadline, lost.map(|(at, _)| at)];
        times.into_iter().flatten().min()
    }

    /// What is to be done next.
    pub fn poll_action(&mut self) -> Option<Action> {
        if std::mem::take(&mut self.halts) {
            return Some(Action::Halt);
        }
        self.action.take()
    }

    /// Whether an attempt is in a stage, and not waiting for its beginning.
    fn is_in(&self, run: Run, stage: Stage) -> bool {
        self.report.run == run && self.report.stage == stage && self.again.is_none()
    }

    /// Begins an attempt.
    fn begin(&mut self, now: Instant) {
        self.again = None;
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
            // An operator may take as long as they like; drivers are watched one by one.
            _ => None,
        };
        self.deadline = patience.and_then(|patience| now.checked_add(patience));
    }

    fn hand_over(&mut self, now: Instant) {
        self.enter(now, Stage::Path);
        let speed = self.report.destination.speed.unwrap_or(self.settings.speed);
        self.action = Some(Action::HandOver(
            self.report.run,
            Arc::clone(&self.path),
            speed,
        ));
    }

    /// Goes through the stages of the chain as far as they have succeeded.
    fn go_on(&mut self, now: Instant) {
        while let Some(next) = self.links.next(self.report.stage) {
            if next == Stage::Arrived {
                self.report.progress = 100;
                self.report.remaining = 0.0;
                return self.end(Stage::Arrived, "");
            }
            self.enter(now, next);
        }
        let lost = self.links.give_up_at(self.report.stage, &self.settings);
        if let Some((_, reason)) = lost.filter(|&(at, _)| at <= now) {
            self.set_back(now, &reason);
        }
    }

    /// An attempt has failed: another one, unless that was the last.
    fn set_back(&mut self, now: Instant, reason: &str) {
        let Report { run, attempts, .. } = self.report;
        if run.attempt >= attempts {
            return self.end(Stage::Failed, reason);
        }
        self.halt();
        self.report.run.attempt += 1;
        self.report.stage = Stage::Map;
        self.report.progress = 0;
        reason.clone_into(&mut self.report.reason);
        self.again = now.checked_add(self.settings.pause);
    }

    fn end(&mut self, stage: Stage, reason: &str) {
        self.halt();
        self.report.stage = stage;
        reason.clone_into(&mut self.report.reason);
    }

    /// Nothing goes on any more.
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
                "the vehicle has not got on for {} s at {} % of the path",
                self.settings.stall.as_secs(),
                self.report.progress
            ),
            stage => format!(
                "the stage \"{stage}\" has taken longer than {} s",
                self.settings.patience.as_secs()
            ),
        }
    }
}

/// Why there is no path.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NotPlanned {
    /// For people.
    pub reason: String,
    /// Whether another attempt would come to the same end.
    pub hopeless: bool,
}

impl From<super::NoPath> for NotPlanned {
    fn from(error: super::NoPath) -> Self {
        Self {
            reason: error.to_string(),
            hopeless: !error.may_pass(),
        }
    }
}
