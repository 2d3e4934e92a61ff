//! The protocol core of a node, without I/O: peer table, routing, reliable delivery, and dispatch
//! to local components.
//!
//! An [`Endpoint`] does no I/O and reads no clock. Its owner passes in input
//! ([`Endpoint::handle_datagram`] or, for links that read frames themselves,
//! [`Endpoint::handle_frame`]; [`Endpoint::handle_timeout`]), requests ([`Endpoint::attach`],
//! [`Endpoint::send`]) and a [`Sink`] that takes messages for local components. Then it polls until
//! there is no more output: [`Endpoint::poll_transmit`] for datagrams to send,
//! [`Endpoint::poll_event`] for events, [`Endpoint::poll_timeout`] for when to call
//! `handle_timeout`.
//!
//! Malformed input is never an error here: it is counted ([`Counters`]), traced and dropped. Every
//! table and queue has a bound in [`Config`]; what a bound drops is counted too.
//!
//! ```
//! use std::time::Instant;
//!
//! use bytes::Bytes;
//! use jaus::address::JausId;
//! use jaus::endpoint::{Config, Endpoint, Outgoing, Received};
//!
//! let (driver, sensor) = (JausId::new(101, 1, 33), JausId::new(101, 1, 41));
//! let mut endpoint = Endpoint::new(Config::default());
//! endpoint.attach(driver)?;
//! endpoint.attach(sensor)?;
//! # #[expect(clippy::disallowed_methods, reason = "an example of an owner, who has the clock")]
//! let now = Instant::now();
//! let query_identification = Bytes::from_static(b"\x00\x2B\x02");
//! let mut received = Vec::<Received>::new();
//! endpoint.send(now, Outgoing::new(driver, sensor, query_identification), &mut received)?;
//! assert_eq!((received[0].source, received[0].to), (driver, sensor));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod access;
mod acknowledge;
mod arrival;
mod bridged;
mod config;
mod counters;
mod decided;
mod delivery;
mod duplicates;
mod egress;
mod event;
mod forward;
mod large;
mod link;
mod peers;
mod rate;
mod receive;
mod recent;
mod restricted;
mod send;
mod share;
mod sink;
#[cfg(test)]
mod tests;
mod verify;

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::hash::RandomState;
use std::sync::Arc;
use std::time::Instant;

pub use crate::peer::Pacing;
pub use access::{Access, AccessEntry, AccessError, Binding, Network, Subsystems};
pub use bridged::ID_HELD;
pub use config::{Config, PAYLOAD_LIMITS, StaticPeer, first_sequence_at};
pub use counters::{Counter, Counters};
pub use decided::Decided;
pub use delivery::FlowStatus;
#[cfg(feature = "node")]
pub(crate) use egress::MOST_OCTETS;
pub use egress::Packing;
pub use event::{AttachError, Event, MessageHandle, Outgoing, Received, Shortfall, Unacknowledged};
pub use forward::Routing;
pub use link::{LinkId, LinkProfile, Path, Remote, SessionId, To, Transmit};
pub use peers::{Peer, RouteState, Traffic};

pub use rate::{Bucket, Buckets, Limits, Rate, quota_address};
pub use send::SendError;
pub use sink::{Ingress, Sink};

use crate::address::JausId;
use crate::rights::Rules;
use crate::wire::Priority;
use acknowledge::Calls;
use decided::Decisions;
use delivery::Deliveries;
use egress::{Egress, Level};
use large::{Numbers, Reassembly};
use peers::{CHALLENGE_FLAGS, Peers};
use rate::{Gate, Origin};
use recent::Recent;
use verify::Warnings;

/// The ids for which the remote ends of each link alone may speak.
type Reserved = BTreeMap<LinkId, Vec<JausId>>;

/// The protocol core of a node. See the [module](self).
#[derive(Debug)]
pub struct Endpoint {
    config: Arc<Config>,
    /// The attached components.
    components: BTreeSet<JausId>,
    /// The rights of those that may not send everything.
    restricted: BTreeMap<JausId, Rules>,
    reserved: Reserved,
    peers: Peers,
    numbers: Numbers,
    gate: Gate,
    /// Limits traffic to each unverified address.
    unverified: Buckets<Origin>,
    /// Limits traffic to all unverified addresses.
    unverified_total: Buckets<()>,
    warnings: Warnings,
    /// Challenges created so far.
    probes: u64,
    /// Limits forwarded broadcasts.
    broadcasts: Bucket,
    heard: Recent,
    calls: Calls,
    reassembly: Reassembly,
    deliveries: Deliveries,
    conflicts: BTreeMap<JausId, Instant>,
    egress: Egress,
    events: VecDeque<Event>,
    /// How many of the events are results of messages.
    results: usize,
    decisions: Decisions,
    counters: Counters,
}

/// Whether only sessions may speak for this id, and this is none.
fn is_reserved(reserved: &Reserved, access: &Access, id: JausId, from: Remote) -> bool {
    let mut ids = reserved.values().flatten();
    !from.is_session() && ids.any(|ids| ids.matches(id)) && !access.binds(id)
}

impl Endpoint {
    /// Creates an endpoint without components and links.
    #[must_use]
    pub fn new(mut config: Config) -> Self {
        config.payload_limit = config
            .payload_limit
            .clamp(*PAYLOAD_LIMITS.start(), *PAYLOAD_LIMITS.end());
        let config = Arc::new(config);
        let keys = RandomState::new();
        let longest = config.retransmission_window;
        Self {
            components: BTreeSet::new(),
            restricted: BTreeMap::new(),
            reserved: BTreeMap::new(),
            peers: Peers::new(config.clone()),
            numbers: Numbers::after(config.first_sequence),
            gate: Gate::new(&config.limits),
            unverified: Buckets::new(config.unverified_address, config.limits.max_peers),
            unverified_total: Buckets::new(config.unverified_total, 1),
            warnings: Warnings::default(),
            probes: 0,
            broadcasts: Bucket::default(),
            heard: Recent::new(config.max_recent, longest, keys.clone()),
            calls: Calls::default(),
            reassembly: Reassembly::new(config.clone()),
            deliveries: Deliveries::new(config.clone()),
            conflicts: BTreeMap::new(),
            egress: Egress::new(config.clone(), keys),
            events: VecDeque::new(),
            results: 0,
            decisions: Decisions::default(),
            counters: Counters::default(),
            config,
        }
    }

    /// Attaches a local component: from now on it receives messages to `id` and may send.
    ///
    /// # Errors
    /// The id does not name one component, is attached already, or would exceed
    /// [`Config::max_components`].
    pub fn attach(&mut self, id: JausId) -> Result<(), AttachError> {
        let limit = self.config.max_components;
        if !id.is_unicast() {
            return Err(AttachError::NotOneComponent(id));
        }
        if self.components.contains(&id) {
            return Err(AttachError::AlreadyAttached(id));
        }
        if self.components.len() >= limit {
            return Err(AttachError::TooMany { limit });
        }
        self.components.insert(id);
        self.peers.remove(id);
        Ok(())
    }

    /// Detaches a local component and gives up its unacknowledged messages.
    pub fn detach(&mut self, id: JausId) {
        self.components.remove(&id);
        self.restricted.remove(&id);
        let given_up = self.deliveries.forget_source(id);
        self.counters.add_many(Counter::MessagesGivenUp, given_up);
        self.conflicts.remove(&id);
    }

    /// The attached components, sorted by id.
    pub fn components(&self) -> impl Iterator<Item = JausId> + '_ {
        self.components.iter().copied()
    }

    /// Adds a link or updates its profile.
    pub fn add_link(&mut self, link: LinkId, profile: LinkProfile) {
        self.egress.links.insert(link, profile);
    }

    /// Believes messages from these ids, with wildcards, only if they come by sessions, such as those of
    /// this link, which prove who sends; or from where [`Access::bind`] binds the id to. Replaces what was
    /// reserved for the link before.
    pub fn reserve(&mut self, link: LinkId, ids: Vec<JausId>) {
        self.reserved.insert(link, ids);
        let (reserved, access) = (&self.reserved, &self.config.access);
        self.peers
            .forget_paths(|id, path| is_reserved(reserved, access, id, path.peer));
    }

    /// Removes a link, the routes learned through it and the datagrams queued on it, which are
    /// counted.
    pub fn remove_link(&mut self, link: LinkId) {
        self.reserved.remove(&link);
        self.peers.forget_paths(|_, path| path.link == link);
        let lost = self.egress.remove_link(link);
        self.counters.add_many(Counter::LinkGone, lost);
    }

    /// Reports that a connection has closed: the routes learned through it are forgotten.
    pub fn forget_path(&mut self, path: Path) {
        self.peers.forget_paths(|_, known| known == path);
    }

    /// Replaces the static peers, for instance because links were added or removed.
    pub fn set_static_peers(&mut self, peers: Vec<StaticPeer>) {
        self.peers.configured = peers;
    }

    /// The peers whose addresses are known, sorted by id.
    pub fn peers(&self) -> impl Iterator<Item = Peer> + '_ {
        self.peers.iter().map(|peer| Peer {
            round_trip: self.flow(peer.id).and_then(|flow| flow.round_trip),
            ..peer
        })
    }

    /// The octets buffered for unfinished large messages, bookkeeping included: at most
    /// [`Config::max_reassembly`].
    #[must_use]
    pub fn unfinished(&self) -> usize {
        self.reassembly.cost()
    }

    /// Handles timeouts. Call it when [`poll_timeout`](Self::poll_timeout) is reached; early calls
    /// are harmless.
    pub fn handle_timeout(&mut self, now: Instant) {
        self.retry_unacknowledged(now);
        self.handle_challenges(now);
        self.egress.handle_timeout(now);
        self.reassembly.expire(now, &mut self.counters);
    }

    /// The next datagram to send, or a batch of several for links that support it; the most urgent
    /// first. Within a priority, whole messages go first, then messages that want an
    /// acknowledgement, then fragments of other large messages.
    pub fn poll_transmit(&mut self, now: Instant) -> Option<Transmit> {
        let mut most_urgent_first = Priority::ALL.into_iter().rev();
        let next = most_urgent_first.find_map(|priority| {
            loop {
                let whole = self.dequeue(now, Level::whole(priority));
                if whole.is_some() || !self.send_deliveries(now, priority) {
                    break whole.or_else(|| self.dequeue(now, Level::fragments(priority)));
                }
            }
        });
        // A datagram held back for an unverified address may have queued a challenge instead.
        next.or_else(|| self.dequeue(now, Level::whole(CHALLENGE_FLAGS.priority())))
    }

    fn dequeue(&mut self, now: Instant, level: Level) -> Option<Transmit> {
        self.egress.dequeue(now, level, &mut self.counters)
    }

    /// The next event.
    pub fn poll_event(&mut self) -> Option<Event> {
        let event = self.events.pop_front()?;
        if let Event::Acknowledged { .. } | Event::NotAcknowledged { .. } = event {
            self.results -= 1;
        }
        Some(event)
    }

    /// When to call [`handle_timeout`](Self::handle_timeout); `None` if no timer runs.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        [
            self.deliveries.next_deadline(),
            self.peers.next_deadline(),
            self.egress.next_deadline(),
            self.reassembly.next_expiry(),
        ]
        .into_iter()
        .flatten()
        .min()
    }

    /// Counts of what was received, sent and dropped, and why.
    #[must_use]
    pub fn counters(&self) -> &Counters {
        &self.counters
    }

    /// Queues an event; an overflow is counted.
    fn announce(&mut self, event: Event) {
        if self.events.len() - self.results < self.config.queue_limit {
            self.events.push_back(event);
        } else {
            self.counters.add(Counter::NewsQueueFull);
        }
    }

    /// Queues the result of a message. There is always room: as long as it is not polled, it counts
    /// as a message that waits for its acknowledgement.
    fn announce_result(&mut self, result: Event) {
        self.results += 1;
        self.events.push_back(result);
    }
}
