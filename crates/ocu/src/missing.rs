//! Tracking of vehicle parts that have disappeared or fallen silent.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use super::role::Role;
use jaus::address::JausId;

/// The kind of absence.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Absence {
    /// Discovery has lost it.
    Gone,
    /// Its reports have stopped.
    Silent,
    /// It has restarted, and knows nothing of what it did before.
    Restarted,
}

impl Absence {
    /// Name in the page protocol.
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Gone => "gone",
            Self::Silent => "silent",
            Self::Restarted => "restarted",
        }
    }

    /// The same after its name, for people.
    pub(super) const fn words(self) -> &'static str {
        match self {
            Self::Gone => "is gone",
            Self::Silent => "is silent",
            Self::Restarted => "has restarted",
        }
    }
}

/// A part that discovery has lost.
#[derive(Debug, Clone)]
pub(super) struct GonePart {
    pub(super) role: Role,
    pub(super) name: String,
    /// Time of its last report.
    pub(super) heard: Option<Instant>,
    /// Time when discovery lost it.
    pub(super) at: Instant,
}

/// The parts that discovery has lost, until they return or are replaced.
#[derive(Debug, Default)]
pub(super) struct GoneParts {
    parts: BTreeMap<JausId, GonePart>,
}

impl GoneParts {
    /// A part that does not return is dropped after this time.
    const KEPT: Duration = Duration::from_secs(300);
    /// Maximum number of parts. The oldest is dropped first.
    const MOST: usize = 32;

    pub(super) fn get(&self, id: JausId) -> Option<&GonePart> {
        self.parts.get(&id)
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = (JausId, &GonePart)> {
        self.parts.iter().map(|(id, part)| (*id, part))
    }

    pub(super) fn insert(&mut self, id: JausId, part: GonePart) {
        self.parts.insert(id, part);
        if self.parts.len() > Self::MOST {
            let oldest = self.parts.iter().min_by_key(|(_, part)| part.at);
            if let Some(oldest) = oldest.map(|(id, _)| *id) {
                self.parts.remove(&oldest);
            }
        }
    }

    /// Drops parts that have returned or were replaced by a part with the same role.
    pub(super) fn handle_present(&mut self, present: &[(JausId, Role)]) {
        self.parts.retain(|gone, part| {
            let replaces = |role: Role| part.role != Role::Other && role == part.role;
            !present
                .iter()
                .any(|(id, role)| id == gone || replaces(*role))
        });
    }

    /// Drops parts whose retention time is over.
    pub(super) fn handle_time(&mut self, now: Instant) {
        self.parts
            .retain(|_, part| now.saturating_duration_since(part.at) < Self::KEPT);
    }
}
