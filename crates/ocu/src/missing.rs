//! Parts of the vehicle that have disappeared or fallen silent.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use super::role::Role;
use jaus::address::JausId;

/// How a part is missing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Absence {
    /// Discovery has lost it.
    Gone,
    /// Its reports have stopped.
    Silent,
}

impl Absence {
    /// As pages know it.
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Gone => "gone",
            Self::Silent => "silent",
        }
    }
}

/// A part that Discovery has lost.
#[derive(Debug, Clone)]
pub(super) struct GonePart {
    pub(super) role: Role,
    pub(super) name: String,
    /// Its last report.
    pub(super) heard: Option<Instant>,
    /// When Discovery lost it.
    pub(super) at: Instant,
}

/// The parts that Discovery has lost, until they are back or replaced.
#[derive(Debug, Default)]
pub(super) struct GoneParts {
    parts: BTreeMap<JausId, GonePart>,
}

impl GoneParts {
    /// A part that does not come back is forgotten after this time.
    const KEPT: Duration = Duration::from_secs(300);
    /// The oldest goes when there are more.
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

    /// Forgets those that are back or replaced by a part with the same role.
    pub(super) fn handle_present(&mut self, present: &[(JausId, Role)]) {
        self.parts.retain(|gone, part| {
            let replaces = |role: Role| part.role != Role::Other && role == part.role;
            !present
                .iter()
                .any(|(id, role)| id == gone || replaces(*role))
        });
    }

    /// Forgets those that have been gone for a long time.
    pub(super) fn handle_time(&mut self, now: Instant) {
        self.parts
            .retain(|_, part| now.saturating_duration_since(part.at) < Self::KEPT);
    }
}
