//! The service Incarnation, which every component offers: a random number per start, so that peers
//! notice a restart however fast it was.

use std::hash::{BuildHasher, Hasher, RandomState};
use std::num::NonZeroU64;
use std::time::Instant;

use bytes::Bytes;

use super::{Context, Directory, Handled, Service, code_of, read};
use crate::address::JausId;
use crate::codec::{Message, ServiceId};
use crate::endpoint::Received;
use crate::messages::core::{QueryIncarnation, ReportIncarnation, incarnation};

/// The number of one start of a component.
///
/// Query Incarnation (E130h) carries that of the sender and Report Incarnation (F130h) answers with
/// that of the receiver, so one exchange shows a restart to both sides.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Incarnation(NonZeroU64);

impl Incarnation {
    /// A new number.
    #[must_use]
    pub fn random() -> Self {
        // The keys of `RandomState` come from the operating system.
        let number = RandomState::new().build_hasher().finish();
        Self(NonZeroU64::new(number).unwrap_or(NonZeroU64::MIN))
    }

    /// The number on the wire; never 0.
    #[must_use]
    pub const fn number(self) -> u64 {
        self.0.get()
    }

    /// The incarnation that the sender of this message tells in it.
    #[must_use]
    pub fn told_in(payload: &Bytes) -> Option<Self> {
        let number = match code_of(payload)? {
            QueryIncarnation::CODE => QueryIncarnation::decode(payload).ok()?.sender_incarnation,
            ReportIncarnation::CODE => ReportIncarnation::decode(payload).ok()?.incarnation,
            _ => return None,
        };
        NonZeroU64::new(number).map(Self)
    }

    /// Whether a component offers the service; `None` if its services are not known.
    #[must_use]
    pub fn is_offered_by(directory: &Directory, id: JausId) -> Option<bool> {
        let component = directory.component(id)?;
        component.services.as_ref()?;
        Some(component.offers(incarnation::URN))
    }

    /// The query of a component of this incarnation, with a stamp that the answer echoes; 0 where that does not
    /// matter.
    pub(in crate::service) const fn query(self, stamp: u32) -> QueryIncarnation {
        QueryIncarnation {
            sender_incarnation: self.number(),
            stamp,
        }
    }
}

/// Answers Query Incarnation.
impl Service for Incarnation {
    fn offers(&self) -> Vec<ServiceId> {
        vec![incarnation::LATEST]
    }

    fn handle_message(
        &mut self,
        _: Instant,
        message: &Received,
        context: &mut Context<'_>,
    ) -> Handled {
        match code_of(&message.payload) {
            Some(QueryIncarnation::CODE) => {
                if let Some(query) = read::<QueryIncarnation>(message) {
                    let report = ReportIncarnation {
                        incarnation: self.number(),
                        stamp: query.stamp,
                    };
                    context.reply(message, &report);
                }
                Handled::Yes
            }
            // The stack has read it already.
            Some(ReportIncarnation::CODE) => Handled::Yes,
            _ => Handled::No,
        }
    }
}
