//! The receivers of the endpoint's messages: mailboxes and taps.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::mailbox::Mailbox;
use super::tap::Taps;
use crate::address::JausId;
use crate::endpoint::{Received, Sink};
use crate::wire::Priority;

/// The components' mailboxes, and the taps.
pub(super) struct Receivers<'a> {
    pub(super) mailboxes: &'a BTreeMap<JausId, Arc<Mailbox>>,
    pub(super) taps: &'a mut Taps,
}

impl Sink for Receivers<'_> {
    fn has_room(&self, to: JausId, priority: Priority) -> bool {
        let mailbox = self.mailboxes.get(&to);
        mailbox.is_none_or(|mailbox| mailbox.has_reserve(priority))
    }

    fn deliver(&mut self, message: Received) {
        self.taps.message(&message);
        if let Some(mailbox) = self.mailboxes.get(&message.to) {
            mailbox.push(message);
        }
    }
}
