//! A part of the vehicle: what Discovery and its own reports tell of it.

use std::time::{Duration, Instant};

use super::Sample;
use crate::role::{self, Role};
use crate::state;
use jaus::address::JausId;
use jaus::service::{ComponentEntry, SampleAge, State};

/// Which reports of the vehicle's parts are expected.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Depth {
    /// What the list of vehicles shows: the state of the principal part, control, and the mission.
    Brief,
    /// All reports of all parts.
    Full,
}

impl Depth {
    /// A part with periodic reports is silent after this time without a report.
    pub(super) const fn silent(self) -> Duration {
        match self {
            Self::Brief => Duration::from_secs(4),
            Self::Full => Duration::from_millis(1500),
        }
    }

    /// An emergency that was reported earlier is checked again.
    pub(super) const fn fresh(self) -> Duration {
        match self {
            Self::Brief => Duration::from_secs(5),
            Self::Full => Duration::from_secs(2),
        }
    }

    /// An older velocity does not say whether the vehicle is at rest.
    pub(super) const fn velocity_counts(self) -> Duration {
        match self {
            Self::Brief => Duration::from_millis(2500),
            Self::Full => Duration::from_secs(1),
        }
    }
}

/// A component of the vehicle.
#[derive(Debug, Clone)]
pub(crate) struct Part {
    pub(crate) role: Role,
    /// Whether the part offers Management.
    pub(crate) managed: bool,
    pub(super) status: Option<Sample<u8>>,
    /// The client in control, with its authority.
    pub(super) controller: Option<Sample<Option<(JausId, u8)>>>,
    pub(super) stage: Option<state::Stage>,
    /// Name of the part.
    pub(super) name: String,
    pub(super) reports_pose: bool,
    pub(super) reports_global_pose: bool,
    pub(super) reports_velocity: bool,
    pub(super) pose_age: SampleAge,
    pub(super) velocity_age: SampleAge,
    pub(super) velocity: Option<Sample<state::Velocity>>,
    /// Time of its last report.
    pub(super) heard: Option<Instant>,
    /// Whether the last subscription event was a loss of reports.
    pub(super) is_down: bool,
    /// Whether it has answered the last stop of this station: an emergency that it reports before may be another
    /// one, which may be over by now.
    pub(super) has_answered_stop: bool,
}

impl Part {
    /// A part whose subscription is down is silent after this time without a report.
    const DOWN: Duration = Duration::from_secs(1);

    pub(super) fn new(role: Role) -> Self {
        Self {
            role,
            managed: false,
            status: None,
            controller: None,
            stage: None,
            name: String::new(),
            reports_pose: false,
            reports_global_pose: false,
            reports_velocity: false,
            pose_age: SampleAge::default(),
            velocity_age: SampleAge::default(),
            velocity: None,
            heard: None,
            is_down: false,
            has_answered_stop: false,
        }
    }

    /// Updates the part from discovery data.
    pub(super) fn describe(&mut self, component: &ComponentEntry, role: Role) {
        self.role = role;
        self.managed = role::is_managed(component);
        self.reports_pose = role::reports_pose(component);
        self.reports_global_pose = role::reports_global_pose(component);
        self.reports_velocity = role::reports_velocity(component);
        let own_name = component.identification.as_ref().map(|it| it.name.clone());
        let own_name = own_name.filter(|it| !it.is_empty());
        self.name = role.title().map_or_else(
            || own_name.unwrap_or_else(|| "Component".to_owned()),
            str::to_owned,
        );
    }

    /// Forgets its reports.
    pub(super) fn forget(&mut self) {
        (self.status, self.controller, self.stage) = (None, None, None);
        self.pose_age.forget();
        self.velocity_age.forget();
        self.velocity = None;
        (self.heard, self.is_down) = (None, false);
    }

    /// Whether its reports have ceased.
    pub(super) fn is_silent(&self, now: Instant, limit: Duration) -> bool {
        let is_periodic =
            self.managed || self.reports_pose || self.reports_global_pose || self.reports_velocity;
        self.heard.is_some_and(|heard| {
            let silence = now.saturating_duration_since(heard);
            (is_periodic && silence >= limit) || (self.is_down && silence >= Self::DOWN)
        })
    }

    /// Why it holds the vehicle, by its latest report.
    pub(super) fn hold_reason(&self, now: Instant) -> Option<&str> {
        let stage = self.stage.as_ref().filter(|_| self.role.is_driver())?;
        let holds = matches!(stage.state, "active" | "blocked") && !stage.reason.is_empty();
        let is_current = self.was_heard_within(Depth::Full.silent(), now);
        (holds && is_current).then_some(&*stage.reason)
    }

    pub(super) fn was_heard_within(&self, limit: Duration, now: Instant) -> bool {
        self.heard
            .is_some_and(|heard| now.saturating_duration_since(heard) < limit)
    }

    pub(crate) fn is(&self, state: State) -> bool {
        self.status.is_some_and(|it| it.what == state as u8)
    }

    pub(crate) fn controller(&self) -> Option<JausId> {
        self.reported_controller()?
    }

    /// The reported client in control, which may be none; `None` before a report.
    pub(crate) fn reported_controller(&self) -> Option<Option<JausId>> {
        Some(self.controller?.what.map(|(id, _)| id))
    }
}
