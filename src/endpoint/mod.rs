//! The protocol core of a node: who is here, who is where, what to send and what to deliver.
//!
//! An [`Endpoint`] does no I/O and reads no clock. Its owner says what happened
//! ([`Endpoint::handle_datagram`] or, where a link has read the frames itself,
//! [`Endpoint::handle_frame`]; [`Endpoint::handle_timeout`]), what is wanted ([`Endpoint::attach`],
//! [`Endpoint::send`]), and who takes messages for local components (a [`Sink`]). Then it polls
//! until there is no more: [`Endpoint::poll_transmit`] for datagrams to send,
//! [`Endpoint::poll_event`] for news, [`Endpoint::poll_timeout`] for when to call `handle_timeout`.
//!
//! Received rubbish is never an error here: it is counted ([`Counters`]), traced and forgotten.
//! Every table and queue has a bound in [`Config`]; what is dropped for a bound is counted too.
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
mod config;
mod counters;
mod delivery;
mod duplicates;
mod egress;
mod event;
mod forward;
mod large;
mod link;
mod local;
mod news;
mod occupancy;
mod peers;
mod rate;
mod receive;
mod recent;
mod send;
mod sink;
#[cfg(test)]
mod tests;
mod verify;

use std::collections::BTreeMap;
use std::hash::RandomState;
use std::time::Instant;

pub use access::{Access, AccessError, Network, Subsystems};
pub use config::{Config, PAYLOAD_LIMITS, StaticPeer, first_sequence_at};
pub use counters::{Counter, Counters};
pub use delivery::FlowStatus;
#[cfg(feature = "node")]
pub(crate) use egress::MOST_OCTETS;
pub use egress::{Pacing, Packing};
pub use event::{Event, MessageHandle, Outgoing, Received, Unacknowledged};
pub use link::{LinkId, LinkProfile, Path, Remote, To, Transmit};
pub use local::AttachError;
pub use occupancy::Occupancy;
pub use peers::{Peer, RouteState, Traffic};
pub(crate) use rate::quota_address;
pub use rate::{Buckets, Rate, Rates};
pub use send::SendError;
pub use sink::{Ingress, Sink};

use crate::address::JausId;
use crate::wire::Priority;
use acknowledge::Calls;
use delivery::Deliveries;
use egress::{Egress, Level};
use large::{Numbers, Reassembly};
use local::Components;
use news::News;
use peers::{CHALLENGE_FLAGS, Peers};
use rate::{Bucket, Gate};
use recent::Recent;
use verify::{Budget, Warnings};

/// The protocol core of a node. See the [module](self).
#[derive(Debug)]
pub struct Endpoint {
    config: Config,
    components: Components,
    peers: Peers,
    numbers: Numbers,
    gate: Gate,
    /// What may be sent to whom nobody vouches for.
    budget: Budget,
    warnings: Warnings,
    /// Challenges that were made so far.
    probes: u64,
    /// For what is passed on to many.
    broadcasts: Bucket,
    heard: Recent,
    calls: Calls,
    reassembly: Reassembly,
    deliveries: Deliveries,
    conflicts: BTreeMap<JausId, Instant>,
    egress: Egress,
    news: News,
    counters: Counters,
}

impl Endpoint {
    /// An endpoint without components and links.
    #[must_use]
    pub fn new(mut config: Config) -> Self {
        config.payload_limit = config
            .payload_limit
            .clamp(*PAYLOAD_LIMITS.start(), *PAYLOAD_LIMITS.end());
        let keys = RandomState::new();
        let longest = config.retransmission_window;
        Self {
            components: Components::new(config.max_components),
            peers: Peers::new(&config),
            numbers: Numbers::after(config.first_sequence),
            gate: Gate::new(&config.rates, config.max_peers),
            budget: Budget::new(&config),
            warnings: Warnings::default(),
            probes: 0,
            broadcasts: Bucket::default(),
            heard: Recent::new(config.max_recent, longest, keys.clone()),
            calls: Calls::default(),
            reassembly: Reassembly::new(&config),
            deliveries: Deliveries::new(&config),
            conflicts: BTreeMap::new(),
            egress: Egress::new(&config, keys),
            news: News::new(config.queue_limit),
            counters: Counters::default(),
            config,
        }
    }

    /// Takes in a local component: messages to `id` are delivered from now on, and it may send.
    ///
    /// # Errors
    /// An id that does not name one component or is here already, or more than
    /// [`Config::max_components`].
    pub fn attach(&mut self, id: JausId) -> Result<(), AttachError> {
        self.components.attach(id)?;
        self.peers.forget(id);
        Ok(())
    }

    /// Lets a local component go. Its messages that wait for acknowledgements are given up.
    pub fn detach(&mut self, id: JausId) {
        self.components.detach(id);
        let given_up = self.deliveries.forget_source(id);
        self.counters.add_many(Counter::MessagesGivenUp, given_up);
        self.conflicts.remove(&id);
    }

    /// The attached components, in order of their ids.
    pub fn components(&self) -> impl Iterator<Item = JausId> + '_ {
        self.components.iter()
    }

    /// Takes in a link, or tells that something about it has changed.
    pub fn add_link(&mut self, link: LinkId, profile: LinkProfile) {
        self.egress.add_link(link, profile);
    }

    /// Removes a link, with what was learned through it and what waits to be sent on it, which is
    /// counted.
    pub fn remove_link(&mut self, link: LinkId) {
        self.peers.forget_link(link);
        let lost = self.egress.remove_link(link);
        self.counters.add_many(Counter::LinkGone, lost);
    }

    /// Tells that a connection has closed: what was learned through it is forgotten.
    pub fn forget_path(&mut self, path: Path) {
        self.peers.forget_path(path);
    }

    /// Changes the peers whose address is configured, for instance because links have come or gone.
    pub fn set_static_peers(&mut self, peers: Vec<StaticPeer>) {
        self.peers.configure(peers);
    }

    /// The peers whose addresses are known, in order of their ids.
    pub fn peers(&self) -> impl Iterator<Item = Peer> + '_ {
        self.peers.iter().map(|peer| Peer {
            round_trip: self.flow(peer.id).and_then(|flow| flow.round_trip),
            ..peer
        })
    }

    /// The octets that are kept of unfinished large messages, with what keeping them costs: at most
    /// [`Config::max_reassembly`].
    #[must_use]
    pub fn unfinished(&self) -> usize {
        self.reassembly.cost()
    }

    /// Tells that time has passed. Call it when [`poll_timeout`](Self::poll_timeout) is reached;
    /// early calls are harmless.
    pub fn handle_timeout(&mut self, now: Instant) {
        self.retry_unacknowledged(now);
        self.handle_challenges(now);
        self.egress.handle_timeout(now);
        self.reassembly.expire(now, &mut self.counters);
    }

    /// The next datagram to send, or several for links that take them so; the most urgent first.
    /// At each priority, whole messages go before those that wait for acknowledgements, and these
    /// before the fragments of others.
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
        // What may not leave before its address is proven has queued a challenge instead.
        next.or_else(|| self.dequeue(now, Level::whole(CHALLENGE_FLAGS.priority())))
    }

    fn dequeue(&mut self, now: Instant, level: Level) -> Option<Transmit> {
        self.egress.dequeue(now, level, &mut self.counters)
    }

    /// The next of the news.
    pub fn poll_event(&mut self) -> Option<Event> {
        self.news.pop()
    }

    /// When to call [`handle_timeout`](Self::handle_timeout), if ever.
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

    /// What was received, sent and dropped, and why.
    #[must_use]
    pub fn counters(&self) -> &Counters {
        &self.counters
    }

    /// Queues news; a full queue is counted.
    fn announce(&mut self, event: Event) {
        if !self.news.push(event) {
            self.counters.add(Counter::NewsQueueFull);
        }
    }
}
