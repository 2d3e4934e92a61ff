//! Tokens: which bridge speaks for which component, and who else uses its id.

use std::time::Instant;

use jaus::address::JausId;

use super::Exchange;
use crate::counters::Counter;
use crate::key::{BridgeId, Key};
use crate::queue::Command;
use crate::remotes::Withdrawn;

impl Exchange {
    /// A liveliness token was declared, or undeclared.
    pub fn handle_token(&mut self, now: Instant, key: &str, is_alive: bool) {
        let Some(Key::Live { component, from }) = self.prefix.parse(key) else {
            self.counters.add(Counter::UnknownKey);
            return;
        };
        if from == self.id {
            return;
        }
        if is_alive {
            self.handle_declared(now, key, component, from);
        } else {
            self.handle_withdrawn(now, component, from);
        }
        self.repeat_calls(now);
    }

    fn handle_declared(&mut self, now: Instant, key: &str, component: JausId, from: BridgeId) {
        let outcome = if !self.accept.accepts(component) {
            Err(Counter::NotAccepted)
        } else if self.is_held(now, component) {
            self.remotes.claim(from, component);
            Err(Counter::OwnId)
        } else {
            let is_new = self.remotes.owner(component) != Some(from);
            let announced = self.remotes.announce(from, component);
            announced.map(|_| {
                if is_new && self.accept.trusts(component) {
                    self.note_owner(now, component, from);
                }
            })
        };
        if let Err(counter) = outcome {
            self.counters.add(counter);
            if counter != Counter::NotAccepted {
                self.note_intruder(now, key, component, from);
            }
        }
    }

    fn handle_withdrawn(&mut self, now: Instant, component: JausId, from: BridgeId) {
        let was_owner = self.remotes.owner(component) == Some(from);
        let Withdrawn { closed, next } = self.remotes.withdraw(from, component);
        if let Some(session) = closed {
            self.arrivals.close(session);
        }
        if was_owner {
            // The one who has claimed it meanwhile may be another owner's intruder now.
            self.intruders.end(|(id, _)| *id == component);
            self.owners.end(|(id, _)| *id == component);
        } else {
            self.intruders.end(|it| *it == (component, from));
        }
        if let Some(next) = next {
            self.note_owner(now, component, next);
        }
    }

    /// A component of this side uses an id for which a bridge speaks: the bridge loses it.
    pub(super) fn take_back(&mut self, now: Instant, component: JausId) {
        let Some((owner, closed)) = self.remotes.take_back(component) else {
            return;
        };
        if let Some(session) = closed {
            self.arrivals.close(session);
        }
        self.owners.end(|(id, _)| *id == component);
        let key = self.token_of(component, owner);
        self.note_intruder(now, &key, component, owner);
    }

    /// A component is no longer one of this side. It belongs to a bridge that has declared its token.
    pub(super) fn release(&mut self, now: Instant, component: JausId) {
        if let Some(next) = self.remotes.release(component) {
            self.note_owner(now, component, next);
        }
    }

    /// Logs which bridge speaks from now on for a component that has rights, or belonged to another one or
    /// to this side.
    fn note_owner(&mut self, now: Instant, component: JausId, owner: BridgeId) {
        if self.owners.is_due(now, (component, owner)) {
            let token = self.token_of(component, owner);
            tracing::info!("{component} belongs to bridge {owner} by its token {token}");
            self.queue.declare(Command::Identify(token));
        }
    }

    /// Logs once that a component is heard on this side, but belongs to a bridge: either another bridge joins
    /// the same networks, or somebody has its id.
    pub(super) fn note_hidden(&mut self, now: Instant, component: JausId, owner: BridgeId) {
        if self.owners.is_due(now, (component, owner)) {
            let token = self.token_of(component, owner);
            tracing::info!(
                "{component} is heard on this side, but not announced: it belongs to bridge {owner} by \
                 its token {token}"
            );
            self.queue.declare(Command::Identify(token));
        }
    }

    /// Logs once which bridge uses the id of a component for which it does not speak, and which bridge
    /// does.
    pub(super) fn note_intruder(
        &mut self,
        now: Instant,
        key: &str,
        component: JausId,
        from: BridgeId,
    ) {
        if !self.intruders.is_due(now, (component, from)) {
            return;
        }
        let token = self.token_of(component, from);
        match self.remotes.owner(component) {
            Some(owner) => {
                let valid = self.token_of(component, owner);
                tracing::warn!(
                    "{component} belongs to bridge {owner} by its token {valid}: {key} of bridge \
                     {from} is refused while that is there"
                );
                self.queue.declare(Command::Identify(valid));
            }
            None if self.is_held(now, component) => {
                tracing::warn!("{component} is a component of this side: {key} is refused");
            }
            None => {
                tracing::warn!("{key} is refused: bridge {from} has not declared {token}");
            }
        }
        self.queue.declare(Command::Identify(token));
    }

    /// The key of the token by which a bridge speaks for a component.
    fn token_of(&self, component: JausId, from: BridgeId) -> String {
        self.prefix.key(&Key::Live { component, from })
    }
}
