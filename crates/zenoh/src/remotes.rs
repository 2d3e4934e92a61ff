//! The bridges on the other side, and which of them speaks for which component.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use jaus::address::JausId;
use jaus::endpoint::SessionId;

use crate::counters::Counter;
use crate::key::BridgeId;

/// The most remote components, of all bridges together, and the most tokens that wait for theirs.
const MOST_COMPONENTS: usize = 16_384;
/// The most components of one bridge, and the most tokens of one that wait: as many as a bridge may have
/// on its side. A bridge alone cannot fill the tables.
pub(crate) const MOST_OF_BRIDGE: usize = 4096;

/// A bridge that speaks for at least one component.
#[derive(Debug)]
struct Remote {
    session: SessionId,
    components: BTreeSet<JausId>,
}

/// The table of bridges.
///
/// A component belongs to the first bridge that has declared its token, until that bridge withdraws it or
/// is gone. Then it belongs to the next one that has declared its token. Messages without a token count
/// for nothing.
#[derive(Debug, Default)]
pub(crate) struct Remotes {
    bridges: BTreeMap<BridgeId, Remote>,
    sessions: HashMap<SessionId, BridgeId>,
    owners: HashMap<JausId, BridgeId>,
    claims: Claims,
    /// The bridges that were found since the last look.
    found: Vec<BridgeId>,
    /// The number of the latest session.
    latest: u64,
}

/// Tokens of components that belong to another bridge or to this side: those of a bridge that was started
/// again may come before the old ones are gone. The earliest counts first: who chooses the id of a bridge gains
/// nothing by it.
#[derive(Debug, Default)]
struct Claims {
    /// The claims, with their numbers.
    waiting: BTreeMap<(JausId, BridgeId), u64>,
    /// The same by component and number.
    in_order: BTreeMap<(JausId, u64), BridgeId>,
    of_bridge: BTreeMap<BridgeId, usize>,
    /// The number of the latest claim.
    latest: u64,
}

impl Claims {
    fn insert(&mut self, component: JausId, bridge: BridgeId) {
        let of_bridge = self.of_bridge.get(&bridge).copied().unwrap_or(0);
        let has_room = self.waiting.len() < MOST_COMPONENTS && of_bridge < MOST_OF_BRIDGE;
        if !has_room || self.waiting.contains_key(&(component, bridge)) {
            return;
        }
        self.latest += 1;
        self.waiting.insert((component, bridge), self.latest);
        self.in_order.insert((component, self.latest), bridge);
        *self.of_bridge.entry(bridge).or_default() += 1;
    }

    fn remove(&mut self, component: JausId, bridge: BridgeId) {
        let Some(number) = self.waiting.remove(&(component, bridge)) else {
            return;
        };
        self.in_order.remove(&(component, number));
        if let Some(count) = self.of_bridge.get_mut(&bridge) {
            *count -= 1;
            if *count == 0 {
                self.of_bridge.remove(&bridge);
            }
        }
    }

    /// The bridge that was the first to declare the token of this component.
    fn of(&self, component: JausId) -> Option<BridgeId> {
        let claims = (component, 0)..=(component, u64::MAX);
        self.in_order
            .range(claims)
            .next()
            .map(|(_, bridge)| *bridge)
    }
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

    /// The session of a message of a component that has arrived from a bridge.
    pub(crate) fn hear(&self, bridge: BridgeId, component: JausId) -> Result<SessionId, Counter> {
        match self.owners.get(&component) {
            None => Err(Counter::NotAnnounced),
            Some(&owner) if owner != bridge => Err(Counter::OtherBridge),
            Some(_) => {
                let remote = self.bridges.get(&bridge);
                remote.map(|it| it.session).ok_or(Counter::NotAnnounced)
            }
        }
    }

    /// A bridge has declared the token of a component.
    pub(crate) fn announce(
        &mut self,
        bridge: BridgeId,
        component: JausId,
    ) -> Result<SessionId, Counter> {
        let entered = self.enter(bridge, component);
        if entered == Err(Counter::OtherBridge) {
            self.claim(bridge, component);
        }
        entered
    }

    /// A bridge has declared the token of a component that belongs to this side at present.
    pub(crate) fn claim(&mut self, bridge: BridgeId, component: JausId) {
        self.claims.insert(component, bridge);
    }

    /// A component belongs to nobody any more: it goes to a bridge that has declared its token, which is
    /// returned.
    pub(crate) fn release(&mut self, component: JausId) -> Option<BridgeId> {
        let bridge = self.claims.of(component)?;
        self.claims.remove(component, bridge);
        self.enter(bridge, component).is_ok().then_some(bridge)
    }

    fn enter(&mut self, bridge: BridgeId, component: JausId) -> Result<SessionId, Counter> {
        let (sessions, latest) = (&mut self.sessions, &mut self.latest);
        let of_bridge = self
            .bridges
            .get(&bridge)
            .map_or(0, |it| it.components.len());
        match self.owners.get(&component) {
            Some(&owner) if owner != bridge => return Err(Counter::OtherBridge),
            Some(_) => {}
            None if self.owners.len() >= MOST_COMPONENTS => return Err(Counter::RemoteTableFull),
            None if of_bridge >= MOST_OF_BRIDGE => return Err(Counter::RemoteTableFull),
            None => {
                self.owners.insert(component, bridge);
            }
        }
        let found = &mut self.found;
        let remote = self.bridges.entry(bridge).or_insert_with(|| {
            *latest += 1;
            let session = SessionId(*latest);
            sessions.insert(session, bridge);
            found.push(bridge);
            tracing::info!(%bridge, session = session.0, "bridge found");
            Remote {
                session,
                components: BTreeSet::new(),
            }
        });
        remote.components.insert(component);
        Ok(remote.session)
    }

    /// A bridge has withdrawn the token of a component, or is gone itself.
    pub(crate) fn withdraw(&mut self, bridge: BridgeId, component: JausId) -> Withdrawn {
        self.claims.remove(component, bridge);
        if self.owner(component) != Some(bridge) {
            return Withdrawn::default();
        }
        let closed = self.leave(bridge, component);
        let next = self.release(component);
        Withdrawn { closed, next }
    }

    /// A component of this side uses an id: the bridge that speaks for it loses it, and gets it again when that
    /// is gone. Returns this bridge, and its session if that ends.
    pub(crate) fn take_back(&mut self, component: JausId) -> Option<(BridgeId, Option<SessionId>)> {
        let owner = self.owner(component)?;
        let closed = self.leave(owner, component);
        self.claim(owner, component);
        Some((owner, closed))
    }

    /// The owner of a component speaks for it no more. Returns its session if that ends.
    fn leave(&mut self, owner: BridgeId, component: JausId) -> Option<SessionId> {
        self.owners.remove(&component);
        let remote = self.bridges.get_mut(&owner)?;
        remote.components.remove(&component);
        if !remote.components.is_empty() {
            return None;
        }
        let session = remote.session;
        self.bridges.remove(&owner);
        self.sessions.remove(&session);
        tracing::info!(bridge = %owner, session = session.0, "bridge gone");
        Some(session)
    }
}

/// What the withdrawal of a token changes.
#[derive(Debug, Default, PartialEq, Eq)]
pub(crate) struct Withdrawn {
    /// The session that ends, if that was the last token of its bridge.
    pub(crate) closed: Option<SessionId>,
    /// The bridge to which the component belongs now.
    pub(crate) next: Option<BridgeId>,
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROVER: JausId = JausId::new(101, 1, 1);
    const SENSOR: JausId = JausId::new(101, 1, 43);
    const ONE: BridgeId = BridgeId::new(1);
    const TWO: BridgeId = BridgeId::new(2);

    #[test]
    fn a_component_belongs_to_one_bridge_until_that_withdraws_it() {
        let mut remotes = Remotes::default();
        let session = remotes.announce(ONE, ROVER).unwrap();
        assert_eq!(remotes.hear(ONE, ROVER), Ok(session));
        assert_eq!(remotes.bridge(session), Some(ONE));
        assert_eq!(remotes.hear(TWO, ROVER), Err(Counter::OtherBridge));
        assert_eq!(remotes.announce(TWO, ROVER), Err(Counter::OtherBridge));
        let withdrawn = remotes.withdraw(ONE, ROVER);
        assert_eq!(withdrawn.closed, Some(session));
        assert_eq!(withdrawn.next, Some(TWO), "its token was there");
        let next = remotes.hear(TWO, ROVER).unwrap();
        assert_ne!(next, session, "a number is not used twice");
    }

    #[test]
    fn of_several_claims_the_first_counts_whatever_the_id_of_its_bridge() {
        let mut remotes = Remotes::default();
        let [owner, first, smallest] = [9, 8, 0].map(BridgeId::new);
        remotes.announce(owner, ROVER).unwrap();
        for claims in [first, smallest, first] {
            remotes.announce(claims, ROVER).unwrap_err();
        }
        assert_eq!(remotes.withdraw(owner, ROVER).next, Some(first));
        assert_eq!(remotes.withdraw(first, ROVER).next, Some(smallest));
        assert_eq!(remotes.withdraw(smallest, ROVER).next, None);
        assert!(remotes.claims.in_order.is_empty() && remotes.claims.waiting.is_empty());
    }

    #[test]
    fn a_message_without_a_token_counts_for_nothing() {
        let mut remotes = Remotes::default();
        assert_eq!(remotes.hear(ONE, ROVER), Err(Counter::NotAnnounced));
        remotes.announce(ONE, SENSOR).unwrap();
        assert_eq!(remotes.hear(ONE, ROVER), Err(Counter::NotAnnounced));
        assert!(!remotes.contains(ROVER));
        assert!(remotes.announce(TWO, ROVER).is_ok());
    }

    #[test]
    fn a_session_ends_with_the_last_token() {
        let mut remotes = Remotes::default();
        let session = remotes.announce(ONE, ROVER).unwrap();
        remotes.announce(ONE, SENSOR).unwrap();
        let nothing = Withdrawn::default();
        assert_eq!(remotes.withdraw(ONE, ROVER), nothing);
        assert_eq!(remotes.withdraw(ONE, ROVER), nothing, "once more");
        assert_eq!(remotes.withdraw(TWO, SENSOR), nothing, "not its own");
        assert_eq!(remotes.withdraw(ONE, SENSOR).closed, Some(session));
        assert_eq!(remotes.bridge(session), None);
    }

    #[test]
    fn a_withdrawn_claim_gains_nothing() {
        let mut remotes = Remotes::default();
        remotes.announce(ONE, ROVER).unwrap();
        remotes.announce(TWO, ROVER).unwrap_err();
        remotes.withdraw(TWO, ROVER);
        assert_eq!(remotes.withdraw(ONE, ROVER).next, None);
        assert!(!remotes.contains(ROVER));
        assert_eq!(remotes.claims.of_bridge, BTreeMap::new());
    }

    fn component(number: usize) -> JausId {
        let number = u16::try_from(number).unwrap();
        JausId::new(1 + number / 200, 1, 1 + (number % 200) as u8)
    }

    #[test]
    fn a_bridge_has_its_share_of_the_components_and_leaves_the_rest_to_others() {
        let mut remotes = Remotes::default();
        for number in 0..MOST_OF_BRIDGE {
            remotes.announce(ONE, component(number)).unwrap();
        }
        let full = Err(Counter::RemoteTableFull);
        assert_eq!(remotes.announce(ONE, component(MOST_OF_BRIDGE)), full);
        for number in MOST_OF_BRIDGE..MOST_COMPONENTS {
            let bridge = BridgeId::new((number / MOST_OF_BRIDGE) as u64 + 1);
            remotes.announce(bridge, component(number)).unwrap();
        }
        let bridge = BridgeId::new(9);
        assert_eq!(remotes.announce(bridge, component(MOST_COMPONENTS)), full);
    }

    #[test]
    fn a_bridge_has_its_share_of_the_claims_and_leaves_the_rest_to_others() {
        let mut remotes = Remotes::default();
        for number in 0..=MOST_OF_BRIDGE {
            remotes.claim(ONE, component(number));
        }
        let last = component(MOST_OF_BRIDGE);
        assert_eq!(remotes.release(last), None, "one too many");
        remotes.claim(TWO, last);
        assert_eq!(remotes.release(last), Some(TWO));
        assert_eq!(remotes.release(component(0)), Some(ONE));
    }
}
