//! The log of events for operators: what happened to each vehicle, when, and by whom.
//!
//! Events are the differences between successive observations of a vehicle, and the requests for
//! emergencies. The log is bounded, and so is the rate of each vehicle. When the log is full, the
//! vehicle with the most events loses its oldest one, so that one that flaps does not push out the
//! events of the others.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;
use std::time::{Duration, Instant};

use jaus::address::JausId;
use jaus_limits::{Bucket, Rate};
use jaus_text::shortened;
use jaus_view::Timestamp;

use super::missing::Absence;
use super::picture::Picture;
use super::state::{self, age};

/// The events of all vehicles of the station.
#[derive(Debug, Default)]
pub(super) struct EventLog {
    events: VecDeque<Entry>,
    /// Number of the latest event. The first has number 1.
    latest: u64,
    vehicles: BTreeMap<u16, Observed>,
}

#[derive(Debug)]
struct Entry {
    number: u64,
    /// Time of day, as time since 1970.
    time: Duration,
    at: Instant,
    vehicle: u16,
    kind: EventKind,
    level: Level,
    text: String,
}

/// What an event concerns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum EventKind {
    Control,
    Drive,
    Mission,
    Emergency,
    Fault,
    Missing,
    Hold,
    Setpoint,
    Log,
}

impl EventKind {
    /// Name in the page protocol.
    const fn name(self) -> &'static str {
        match self {
            Self::Control => "control",
            Self::Drive => "drive",
            Self::Mission => "mission",
            Self::Emergency => "emergency",
            Self::Fault => "fault",
            Self::Missing => "missing",
            Self::Hold => "hold",
            Self::Setpoint => "setpoint",
            Self::Log => "log",
        }
    }
}

/// How much an event matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Level {
    Info,
    Warn,
    Bad,
}

impl Level {
    const fn name(self) -> &'static str {
        match self {
            Self::Info => "info",
            Self::Warn => "warn",
            Self::Bad => "bad",
        }
    }
}

/// Time of an event: by the clock that never steps, and as time since 1970 for people.
#[derive(Debug, Clone, Copy)]
pub(super) struct EventTime {
    pub(super) at: Instant,
    pub(super) since_1970: Duration,
}

/// What the log observes of a vehicle besides its picture.
pub(super) struct EventInputs<'a> {
    pub(super) picture: &'a Picture,
    pub(super) control: &'a state::Control,
    pub(super) drive: &'a state::Drive,
    /// The user of this station who drives or controls it.
    pub(super) user: Option<&'a str>,
}

/// The last observation of a vehicle.
#[derive(Debug, Default)]
struct Observed {
    facts: Facts,
    bucket: Bucket,
    /// Events left out because of the rate.
    omitted: u32,
    /// The last request for an emergency or its end.
    requested: Option<Requested>,
    /// When a hold or a refused setpoint was logged last.
    held_at: Option<Instant>,
    refused_at: Option<Instant>,
}

#[derive(Debug)]
struct Requested {
    on: bool,
    user: Arc<str>,
    at: Instant,
}

/// What events are derived from.
#[derive(Debug, Default, PartialEq)]
struct Facts {
    /// Who is in control, with whether that is this station.
    holder: Option<(String, bool)>,
    handover: String,
    driver: Option<String>,
    drive_reason: String,
    mission: Option<(u32, &'static str)>,
    mission_reason: String,
    emergency: bool,
    runaway: bool,
    lost_planner: bool,
    missing: BTreeMap<JausId, (String, Absence)>,
    faults: BTreeMap<JausId, String>,
    hold: Option<String>,
}

impl EventLog {
    /// Limit of events.
    const MOST: usize = 500;
    /// Limit of events in an answer to a page. The oldest are left out.
    const MOST_SENT: usize = 200;
    /// Limit of the length of a text, in characters.
    const MOST_TEXT: usize = 240;
    /// Events of one vehicle: 20 at once, and one each 2 s.
    const RATE: Rate = Rate::new(1, 40);
    /// Tokens of a vehicle for each.
    const EVENT: u32 = 2;
    /// A change of the emergency within this time after a request for it is its effect.
    const EFFECT: Duration = Duration::from_secs(10);
    /// Minimum interval between refused setpoints, and between holds, of one vehicle in the log.
    const REPEAT: Duration = Duration::from_secs(10);

    /// Number of the latest event; 0 if there is none.
    pub(super) const fn latest(&self) -> u64 {
        self.latest
    }

    /// The events after the one with this number, oldest first.
    pub(super) fn state(&self, now: Instant, after: u64) -> state::Events {
        let new = self.events.iter().filter(|it| it.number > after);
        let mut new: Vec<_> = new.rev().take(Self::MOST_SENT).collect();
        new.reverse();
        state::Events {
            latest: self.latest,
            events: new.into_iter().map(|it| it.state(now)).collect(),
        }
    }

    /// Handles a request for an emergency, or for its end if not `on`, of these vehicles. Other
    /// requests show in what they change.
    pub(super) fn handle_request(
        &mut self,
        now: EventTime,
        vehicles: &[u16],
        user: &Arc<str>,
        on: bool,
    ) {
        for &vehicle in vehicles {
            let observed = self.observed(vehicle);
            let last = observed.requested.replace(Requested {
                on,
                user: Arc::clone(user),
                at: now.at,
            });
            // A page repeats the request until the vehicle confirms it.
            let is_repeated = last.is_some_and(|it| {
                it.on == on
                    && it.user == *user
                    && now.at.saturating_duration_since(it.at) < Self::EFFECT
            });
            if !is_repeated {
                let what = if on {
                    "emergency stop"
                } else {
                    "end of the emergency"
                };
                let text = format!("{what} requested by {user}");
                let level = if on { Level::Bad } else { Level::Warn };
                self.log(now, vehicle, EventKind::Emergency, level, &text);
            }
        }
    }

    /// Observes a vehicle.
    pub(super) fn observe(&mut self, now: EventTime, inputs: &EventInputs<'_>) {
        let new = Facts::of(now.at, inputs);
        self.handle_facts(now, inputs.picture.vehicle(), new);
    }

    fn handle_facts(&mut self, now: EventTime, vehicle: u16, new: Facts) {
        let observed = self.observed(vehicle);
        if observed.facts == new {
            return;
        }
        let old = std::mem::take(&mut observed.facts);
        let mut found = Vec::new();
        control_events(&old, &new, &mut found);
        let is_stopped = new.emergency || observed.is_stop_requested(now.at);
        drive_events(&old, &new, is_stopped, &mut found);
        mission_events(&old, &new, &mut found);
        part_events(&old, &new, &mut found);
        observed.emergency_events(now.at, &old, &new, &mut found);
        observed.repeating_events(now.at, &old, &new, &mut found);
        observed.facts = new;
        for (kind, level, text) in found {
            self.log(now, vehicle, kind, level, &text);
        }
    }

    /// Forgets the observations of vehicles that are not listed any more. Their events remain.
    pub(super) fn retain(&mut self, is_listed: impl Fn(u16) -> bool) {
        self.vehicles.retain(|&vehicle, _| is_listed(vehicle));
    }

    fn observed(&mut self, vehicle: u16) -> &mut Observed {
        self.vehicles.entry(vehicle).or_default()
    }

    fn log(&mut self, now: EventTime, vehicle: u16, kind: EventKind, level: Level, text: &str) {
        let observed = self.observed(vehicle);
        if observed
            .bucket
            .take(now.at, Self::RATE, Self::EVENT)
            .is_err()
        {
            observed.omitted += 1;
            return;
        }
        let omitted = std::mem::take(&mut observed.omitted);
        if omitted > 0 {
            let words = format!("{omitted} further events came too fast and are not listed");
            self.push(now, vehicle, EventKind::Log, Level::Warn, &words);
        }
        self.push(now, vehicle, kind, level, text);
    }

    fn push(&mut self, now: EventTime, vehicle: u16, kind: EventKind, level: Level, text: &str) {
        self.latest += 1;
        self.events.push_back(Entry {
            number: self.latest,
            time: now.since_1970,
            at: now.at,
            vehicle,
            kind,
            level,
            text: shortened(text, Self::MOST_TEXT - 1).into_owned(),
        });
        if self.events.len() > Self::MOST {
            self.drop_one();
        }
    }

    /// Drops the oldest event of the vehicle that has the most.
    fn drop_one(&mut self) {
        let mut counts = BTreeMap::<u16, usize>::new();
        for entry in &self.events {
            *counts.entry(entry.vehicle).or_default() += 1;
        }
        let busiest = counts.into_iter().max_by_key(|(_, count)| *count);
        let is_its = |entry: &Entry| busiest.is_some_and(|(vehicle, _)| entry.vehicle == vehicle);
        if let Some(index) = self.events.iter().position(is_its) {
            self.events.remove(index);
        }
    }
}

impl Entry {
    fn state(&self, now: Instant) -> state::LoggedEvent {
        state::LoggedEvent {
            number: self.number,
            time: Timestamp::since_1970(self.time, 1).to_string(),
            age_ms: age(now, self.at),
            vehicle: self.vehicle,
            kind: self.kind.name(),
            level: self.level.name(),
            text: self.text.clone(),
        }
    }
}

impl Facts {
    fn of(now: Instant, inputs: &EventInputs<'_>) -> Self {
        let EventInputs {
            picture,
            control,
            drive,
            user,
        } = *inputs;
        let user = || user.unwrap_or("this station").to_owned();
        let holder = picture.holder();
        let mission = picture.mission();
        let missing = picture.missing(now);
        Self {
            holder: match holder {
                _ if control.held => Some((user(), true)),
                // Held, although not all that is wanted: in an emergency, for example.
                Some((id, _)) if id == picture.own() => Some((user(), true)),
                Some((id, authority)) => Some((format!("{id} (authority {authority})"), false)),
                None => None,
            },
            handover: control.handover.clone(),
            driver: drive.active.then(user),
            drive_reason: drive.reason.clone(),
            mission: mission.map(|it| (it.number, it.stage.name())),
            mission_reason: mission.map_or_else(String::new, |it| it.reason().to_owned()),
            emergency: picture.in_emergency().next().is_some(),
            runaway: picture.is_runaway(now),
            lost_planner: picture.lost_planner(now).is_some(),
            missing: missing
                .map(|(id, name, how)| (id, (name.to_owned(), how)))
                .collect(),
            faults: picture.faults().collect(),
            hold: picture.hold_reason(now).map(|it| it.reason),
        }
    }
}

/// An event that was found: its kind, level and text.
type Found = (EventKind, Level, String);

fn control_events(old: &Facts, new: &Facts, found: &mut Vec<Found>) {
    if old.holder == new.holder {
        return;
    }
    let lost = old.holder.as_ref().filter(|(_, ours)| *ours);
    if let Some((who, _)) = lost
        && !new.handover.is_empty()
        && new.handover != old.handover
    {
        let text = format!("control of {who} ended: {}", new.handover);
        found.push((EventKind::Control, Level::Warn, text));
    } else if let Some((who, _)) = &old.holder
        && new.holder.is_none()
    {
        let text = format!("control of {who} ended: nobody has control");
        found.push((EventKind::Control, Level::Info, text));
    }
    if let Some((who, _)) = &new.holder {
        let text = format!("{who} has control");
        found.push((EventKind::Control, Level::Info, text));
    }
}

fn drive_events(old: &Facts, new: &Facts, is_stopped: bool, found: &mut Vec<Found>) {
    match (&old.driver, &new.driver) {
        (Some(before), after) if after.as_ref() != Some(before) => {
            let (level, why) = match &*new.drive_reason {
                "" if is_stopped => (Level::Info, "emergency stop"),
                "" => (Level::Info, "let go"),
                why => (Level::Bad, why),
            };
            let text = format!("{before} has stopped driving: {why}");
            found.push((EventKind::Drive, level, text));
        }
        _ => {}
    }
    if let Some(driver) = &new.driver
        && old.driver.as_ref() != Some(driver)
    {
        found.push((EventKind::Drive, Level::Info, format!("{driver} drives")));
    }
}

fn mission_events(old: &Facts, new: &Facts, found: &mut Vec<Found>) {
    if new.lost_planner && !old.lost_planner {
        let text = "the planner was lost while it drove".to_owned();
        found.push((EventKind::Mission, Level::Bad, text));
    }
    let Some((number, stage)) = new.mission.filter(|it| old.mission != Some(*it)) else {
        return;
    };
    let level = match stage {
        "idle" => return,
        "failed" => Level::Bad,
        "stopped" => Level::Warn,
        _ => Level::Info,
    };
    let ends = matches!(stage, "failed" | "stopped") && !new.mission_reason.is_empty();
    let why = if ends {
        format!(": {}", new.mission_reason)
    } else {
        String::new()
    };
    let stage = stage.replace('_', " ");
    found.push((
        EventKind::Mission,
        level,
        format!("mission {number}: {stage}{why}"),
    ));
}

fn part_events(old: &Facts, new: &Facts, found: &mut Vec<Found>) {
    for (id, (name, how)) in &new.missing {
        if old.missing.get(id).is_none_or(|(_, before)| before != how) {
            let text = format!("{name} {id} is {}", how.name());
            found.push((EventKind::Missing, Level::Bad, text));
        }
    }
    for (id, (name, _)) in &old.missing {
        if !new.missing.contains_key(id) {
            let text = format!("{name} {id} is not missing any more");
            found.push((EventKind::Missing, Level::Info, text));
        }
    }
    for (id, fault) in &new.faults {
        if !old.faults.contains_key(id) {
            found.push((EventKind::Fault, Level::Bad, fault.clone()));
        }
    }
    for id in old.faults.keys() {
        if !new.faults.contains_key(id) {
            let text = format!("{id} reports no failure any more");
            found.push((EventKind::Fault, Level::Info, text));
        }
    }
}

impl Observed {
    fn is_stop_requested(&self, now: Instant) -> bool {
        let requested = self.requested.as_ref();
        requested.is_some_and(|it| it.on && now.saturating_duration_since(it.at) < EventLog::EFFECT)
    }

    fn emergency_events(&self, now: Instant, old: &Facts, new: &Facts, found: &mut Vec<Found>) {
        if new.runaway && !old.runaway {
            let text = "the vehicle moves although it is in emergency".to_owned();
            found.push((EventKind::Emergency, Level::Bad, text));
        }
        if new.emergency == old.emergency {
            return;
        }
        let requested = self.requested.as_ref().filter(|it| {
            it.on == new.emergency && now.saturating_duration_since(it.at) < EventLog::EFFECT
        });
        let by = requested.map_or_else(
            || "not requested at this station".to_owned(),
            |it| format!("requested by {}", it.user),
        );
        found.push(match new.emergency {
            true => (
                EventKind::Emergency,
                Level::Bad,
                format!("emergency reported, {by}"),
            ),
            false => (
                EventKind::Emergency,
                Level::Warn,
                format!("emergency is over, {by}"),
            ),
        });
    }

    /// Events that repeat while one thing lasts: their texts contain numbers that change.
    fn repeating_events(&mut self, now: Instant, old: &Facts, new: &Facts, found: &mut Vec<Found>) {
        let is_due = |last: &mut Option<Instant>| {
            let is_due =
                last.is_none_or(|at| now.saturating_duration_since(at) >= EventLog::REPEAT);
            if is_due {
                *last = Some(now);
            }
            is_due
        };
        if let Some(reason) = &new.hold
            && old.hold.is_none()
            && is_due(&mut self.held_at)
        {
            found.push((EventKind::Hold, Level::Warn, format!("held: {reason}")));
        }
        let is_refused = new.driver.is_none() && old.driver.is_none();
        if is_refused
            && !new.drive_reason.is_empty()
            && new.drive_reason != old.drive_reason
            && is_due(&mut self.refused_at)
        {
            let text = format!("setpoint refused: {}", new.drive_reason);
            found.push((EventKind::Setpoint, Level::Warn, text));
        }
    }
}

#[cfg(test)]
#[expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]
mod tests;
