//! Watches the drivers of the chain: when one has succeeded, and when one is to be given up.

use std::time::Instant;

use super::{Link, LinkState, Settings, Stage};

/// What the drivers have said of themselves.
#[derive(Debug, Default)]
pub(super) struct Links {
    states: [LinkState; 3],
    /// Since when each has been in a state that is no success.
    since: [Option<Instant>; 3],
    /// When the stage began.
    begun: Option<Instant>,
    /// Whether they have been told to drive.
    is_open: bool,
}

impl Links {
    /// They have been told to drive. What they said before was not about that.
    pub(super) fn open(&mut self) {
        *self = Self {
            begun: self.begun,
            is_open: true,
            ..Self::default()
        };
    }

    /// They have nothing to do with the mission any more, or not yet.
    pub(super) const fn close(&mut self) {
        self.is_open = false;
    }

    /// Another stage has begun.
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

    /// The stage that begins now, if the one that there is has succeeded.
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

    /// When the first of those drivers whose stage has begun has to be given up, and why.
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
        // What was so before its stage began counts from there on.
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
        LinkState::Silent => "has not been heard",
        LinkState::Engaging => "has not got the next driver under control",
        _ => "has had nothing to do",
    };
    format!("the {link} {what} for {} s", settings.patience.as_secs())
}
