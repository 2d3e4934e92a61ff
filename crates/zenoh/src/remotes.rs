//! The bridges on the other side, and which of them speaks for which component.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::time::{Duration, Instant};

use jaus::address::JausId;
use jaus::endpoint::SessionId;

use crate::counters::Counter;
use crate::key::BridgeId;

/// The most remote components, of all bridges together.
const MOST_COMPONENTS: usize = 16_384;
/// The most tokens that wait for their component.
const MOST_CLAIMS: usize = 4096;
/// How long a bridge without a token is remembered after its last message. Its tokens may arrive
/// after its messages.
const WITHOUT_TOKENS: Duration = Duration::from_secs(10);

/// A bridge that speaks for at least one component.
#[derive(Debug)]
struct Remote {
    session: SessionId,
    /// Its components, and whether each has a token.
    components: BTreeMap<JausId, bool>,
    heard: Instant,
}

impl Remote {
    fn has_tokens(&self) -> bool {
        self.components.values().any(|&has_token| has_token)
    }
}

/// The table of bridges.
///
/// A component belongs to the first bridge that speaks for it, until that bridge withdraws it or is
/// gone. Then it belongs to another one that has declared its token.
#[derive(Debug, Default)]
pub(crate) struct Remotes {
    bridges: BTreeMap<BridgeId, Remote>,
    sessions: HashMap<SessionId, BridgeId>,
    owners: HashMap<JausId, BridgeId>,
    /// Tokens of components that belong to another bridge or to this side: those of a bridge that
    /// was started again may come before the old ones are gone.
    claims: BTreeSet<(JausId, BridgeId)>,
    /// The bridges that were found since the last look.
    found: Vec<BridgeId>,
    /// The number of the latest session.
    latest: u64,
}

impl Remotes {
    /// Whether a bridge speaks for this component.
    pub(crate) fn contains(&self, component: JausId) -> bool {
        self.owners.contains_key(&component)
    }

    /// The bridges that were found since the last call.
    pub(crate) fn take_found(&mut self) -> Vec<BridgeId> {
        std::mem::take(&mut self.found)
    }

    /// The bridge that speaks for a component; `None` for ids with wildcards.
    pub(crate) fn owner(&self, component: JausId) -> Option<BridgeId> {
        self.owners.get(&component).copied()
    }

    /// The bridge of a session.
    pub(crate) fn bridge(&self, session: SessionId) -> Option<BridgeId> {
        self.sessions.get(&session).copied()
    }

    /// A message of a component has arrived from a bridge.
    pub(crate) fn hear(
        &mut self,
        now: Instant,
        bridge: BridgeId,
        component: JausId,
    ) -> Result<SessionId, Counter> {
        self.enter(now, bridge, component, false)
    }

    /// A bridge has declared the token of a component.
    pub(crate) fn announce(
        &mut self,
        now: Instant,
        bridge: BridgeId,
        component: JausId,
    ) -> Result<SessionId, Counter> {
        let entered = self.enter(now, bridge, component, true);
        if entered == Err(Counter::OtherBridge) {
            self.claim(bridge, component);
        }
        entered
    }

    /// A bridge has declared the token of a component that belongs to this side at present.
    pub(crate) fn claim(&mut self, bridge: BridgeId, component: JausId) {
        if self.claims.len() < MOST_CLAIMS {
            self.claims.insert((component, bridge));
        }
    }

    /// A component belongs to nobody any more: it goes to a bridge that has declared its token.
    pub(crate) fn release(&mut self, now: Instant, component: JausId) {
        let first = (component, BridgeId::new(0));
        let claim = self.claims.range(first..).next().copied();
        if let Some((_, bridge)) = claim.filter(|(claimed, _)| *claimed == component) {
            self.claims.remove(&(component, bridge));
            // There is room: the component has just left the table, or this side's.
            let _ = self.enter(now, bridge, component, true);
        }
    }

    fn enter(
        &mut self,
        now: Instant,
        bridge: BridgeId,
        component: JausId,
        has_token: bool,
    ) -> Result<SessionId, Counter> {
        match self.owners.get(&component) {
            Some(&owner) if owner != bridge => return Err(Counter::OtherBridge),
            Some(_) => {}
            None if self.owners.len() >= MOST_COMPONENTS => return Err(Counter::RemoteTableFull),
            None => {
                self.owners.insert(component, bridge);
            }
        }
        let (sessions, latest) = (&mut self.sessions, &mut self.latest);
        let found = &mut self.found;
        let remote = self.bridges.entry(bridge).or_insert_with(|| {
            *latest += 1;
            let session = SessionId(*latest);
            sessions.insert(session, bridge);
            found.push(bridge);
            tracing::info!(%bridge, session = session.0, "bridge found");
            Remote {
                session,
                components: BTreeMap::new(),
                heard: now,
            }
        });
        remote.heard = now;
        *remote.components.entry(component).or_default() |= has_token;
        Ok(remote.session)
    }

    /// A bridge has withdrawn the token of a component, or is gone itself. Returns its session if
    /// that was its last token.
    pub(crate) fn withdraw(
        &mut self,
        now: Instant,
        bridge: BridgeId,
        component: JausId,
    ) -> Option<SessionId> {
        self.claims.remove(&(component, bridge));
        let remote = self.bridges.get_mut(&bridge)?;
        remote.components.remove(&component)?;
        let is_last = !remote.has_tokens();
        self.owners.remove(&component);
        let closed = is_last.then(|| self.remove(now, bridge)).flatten();
        self.release(now, component);
        closed
    }

    /// Forgets the bridges without a token that have been silent; returns their sessions.
    pub(crate) fn expire(&mut self, now: Instant) -> Vec<SessionId> {
        let is_over = |remote: &Remote| {
            !remote.has_tokens() && now.saturating_duration_since(remote.heard) >= WITHOUT_TOKENS
        };
        let gone = self.bridges.iter().filter(|(_, remote)| is_over(remote));
        let gone: Vec<_> = gone.map(|(&bridge, _)| bridge).collect();
        gone.into_iter()
            .filter_map(|bridge| self.remove(now, bridge))
            .collect()
    }

    fn remove(&mut self, now: Instant, bridge: BridgeId) -> Option<SessionId> {
        let remote = self.bridges.remove(&bridge)?;
        self.sessions.remove(&remote.session);
        tracing::info!(%bridge, session = remote.session.0, "bridge gone");
        for component in remote.components.into_keys() {
            self.owners.remove(&component);
            self.release(now, component);
        }
        Some(remote.session)
    }
}

#[cfg(test)]
#[expect(
    clippy::disallowed_methods,
    reason = "the tests start at an arbitrary instant"
)]
mod tests {
    use super::*;

    const ROVER: JausId = JausId::new(101, 1, 1);
    const SENSOR: JausId = JausId::new(101, 1, 43);
    const ONE: BridgeId = BridgeId::new(1);
    const TWO: BridgeId = BridgeId::new(2);

    #[test]
    fn a_component_belongs_to_one_bridge_until_that_withdraws_it() {
        let (now, mut remotes) = (Instant::now(), Remotes::default());
        let session = remotes.announce(now, ONE, ROVER).unwrap();
        assert_eq!(remotes.hear(now, ONE, SENSOR), Ok(session));
        assert_eq!(remotes.bridge(session), Some(ONE));
        for component in [ROVER, SENSOR] {
            let refused = Err(Counter::OtherBridge);
            assert_eq!(remotes.hear(now, TWO, component), refused);
            assert_eq!(remotes.announce(now, TWO, component), refused);
        }
        assert_eq!(remotes.withdraw(now, ONE, ROVER), Some(session));
        let next = remotes.hear(now, TWO, ROVER).unwrap();
        assert_ne!(next, session, "a number is not used twice");
        assert_eq!(remotes.hear(now, TWO, SENSOR), Ok(next));
    }

    #[test]
    fn a_session_ends_with_the_last_token() {
        let (now, mut remotes) = (Instant::now(), Remotes::default());
        let session = remotes.announce(now, ONE, ROVER).unwrap();
        remotes.announce(now, ONE, SENSOR).unwrap();
        assert_eq!(remotes.withdraw(now, ONE, ROVER), None);
        assert_eq!(remotes.withdraw(now, ONE, ROVER), None, "once more");
        assert_eq!(remotes.withdraw(now, TWO, SENSOR), None, "not its own");
        assert_eq!(remotes.withdraw(now, ONE, SENSOR), Some(session));
        assert_eq!(remotes.bridge(session), None);
    }

    #[test]
    fn the_token_of_a_restarted_bridge_counts_when_the_old_one_is_gone() {
        let (now, mut remotes) = (Instant::now(), Remotes::default());
        let before = remotes.announce(now, ONE, ROVER).unwrap();
        let refused = remotes.announce(now, TWO, ROVER);
        assert_eq!(refused, Err(Counter::OtherBridge));
        assert_eq!(remotes.withdraw(now, ONE, ROVER), Some(before));
        assert!(remotes.contains(ROVER));
        let session = remotes.hear(now, TWO, ROVER).unwrap();
        // It has a token, so silence does not end it.
        assert!(remotes.expire(now + 2 * WITHOUT_TOKENS).is_empty());
        assert_eq!(remotes.withdraw(now, TWO, ROVER), Some(session));
        assert!(!remotes.contains(ROVER));
    }

    #[test]
    fn a_bridge_without_tokens_is_forgotten_when_it_is_silent() {
        let (start, mut remotes) = (Instant::now(), Remotes::default());
        let silent = remotes.hear(start, ONE, ROVER).unwrap();
        remotes.announce(start, TWO, SENSOR).unwrap();
        assert!(remotes.expire(start + WITHOUT_TOKENS / 2).is_empty());
        let later = start + 100 * WITHOUT_TOKENS;
        assert_eq!(remotes.expire(later), [silent]);
        assert!(remotes.contains(SENSOR), "it has a token");
    }

    #[test]
    fn the_table_of_components_has_a_bound() {
        let (now, mut remotes) = (Instant::now(), Remotes::default());
        for number in 0..MOST_COMPONENTS {
            let number = u16::try_from(number).unwrap();
            let component = JausId::new(1 + number / 200, 1, 1 + (number % 200) as u8);
            remotes.announce(now, ONE, component).unwrap();
        }
        let refused = remotes.announce(now, ONE, JausId::new(60_000, 1, 1));
        assert_eq!(refused, Err(Counter::RemoteTableFull));
    }
}
