//! Monitoring of the driver chain: when a stage has succeeded, and when to give up on a driver.

use std::time::Instant;

use super::{Link, LinkState, Settings, Stage};

/// The last reported states of the drivers.
#[derive(Debug, Default)]
pub(super) struct Links {
    states: [LinkState; 3],
    /// Start of the current unsuccessful state of each driver.
    since: [Option<Instant>; 3],
    /// When the stage started.
    begun: Option<Instant>,
    /// Whether the drivers have been commanded to drive.
    is_open: bool,
}

impl Links {
    /// Starts monitoring: the drivers have been commanded to drive. Earlier reports are discarded.
    pub(super) fn open(&mut self) {
        *self = Self {
            begun: self.begun,
            is_open: true,
            ..Self::default()
        };
    }

    /// Stops monitoring: the drivers are not involved in the mission.
    pub(super) const fn close(&mut self) {
        self.is_open = false;
    }

    /// Records the start of a stage.
    pub(super) const fn begin(&mut self, now: Instant) {
        self.begun = Some(now);
    }

    pub(super) fn note(&mut self, now: Instant, link: Link, state: LinkState) {
        let index = link as usize;
        let is_same = std::mem::discriminant(&self.states[index]) == std::mem::discriminant(&state);
        if state.is_success() {
            self.since[index] = None;
        } else if !is_same || self.since[index].is_none() {
            self.since[index] = Some(now);
        }
        self.states[index] = state;
    }

    /// The next stage, if the current one has succeeded.
    pub(super) fn next(&self, stage: Stage) -> Option<Stage> {
        if !self.is_open {
            return None;
        }
        let [path, vector, primitive] = &self.states;
        match stage {
            stage if stage.is_handed_over() && *path == LinkState::Done => Some(Stage::Arrived),
            Stage::Path if path.is_success() => Some(Stage::Vector),
            Stage::Vector if vector.is_success() => Some(Stage::Primitive),
            Stage::Primitive if primitive.is_success() => Some(Stage::Driving),
            _ => None,
        }
    }

    /// When to give up on the first of the drivers whose stage has started, and why.
    pub(super) fn give_up_at(
        &self,
        stage: Stage,
        settings: &Settings,
    ) -> Option<(Instant, String)> {
        if !self.is_open || !stage.is_handed_over() {
            return None;
        }
        let begun = Link::ALL.into_iter().filter(|link| link.stage() <= stage);
        let given_up = begun.filter_map(|link| self.give_up_link_at(link, stage, settings));
        given_up.min_by_key(|&(at, _)| at)
    }

    fn give_up_link_at(
        &self,
        link: Link,
        stage: Stage,
        settings: &Settings,
    ) -> Option<(Instant, String)> {
        let index = link as usize;
        let state = &self.states[index];
        if state.is_success() {
            return None;
        }
        let (patience, reason) = match state {
            LinkState::Blocked(reason) => (settings.settling, format!("the {link}: {reason}")),
            state => (settings.patience, waiting(link, state, settings)),
        };
        let since = self.since[index];
        // Time before the start of the driver's own stage does not count.
        let since = if link.stage() == stage {
            since.max(self.begun)
        } else {
            since
        };
        Some((since?.checked_add(patience)?, reason))
    }
}

fn waiting(link: Link, state: &LinkState, settings: &Settings) -> String {
    let what = match state {
        LinkState::Silent => "has not reported",
        LinkState::Engaging => "has not got control of the next driver",
        _ => "has been idle",
    };
    format!("the {link} {what} for {} s", settings.patience.as_secs())
}
