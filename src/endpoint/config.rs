//! The settings of an endpoint: bounds and times, with defaults that suit a node on a small board.

use std::ops::RangeInclusive;
use std::time::Duration;

use super::{Access, Pacing, Packing, Path, Rate, Rates};
use crate::address::JausId;
use crate::peer::Assignment;

/// The payloads that packets may be limited to, in octets.
pub const PAYLOAD_LIMITS: RangeInclusive<usize> = 64..=4079;

/// Sequence numbers that a node may use in a millisecond of its life and still be told, when it is
/// started again, from the one before.
const NUMBERS_PER_MILLISECOND: u128 = 5;

/// A [`first_sequence`](Config::first_sequence) for a node that is started at a time, given as the
/// time since 1970, by a clock that goes on while the node does not run.
///
/// Junior takes a message for a duplicate if it has heard that number from that id within 3 s (10 s
/// without its settings file), acknowledges it, and drops it. With numbers by chance, a node that
/// is started again soon after a large message comes upon numbers of before once in some hundred
/// times. These run ahead of what a node uses up, and come again after 13 s only.
///
/// ```
/// use std::time::Duration;
///
/// use jaus::endpoint::first_sequence_at;
///
/// let start = Duration::from_secs(1_795_294_742);
/// let again = start + Duration::from_millis(1500);
/// assert_eq!(first_sequence_at(again).wrapping_sub(first_sequence_at(start)), 7500);
/// ```
#[must_use]
pub const fn first_sequence_at(since_1970: Duration) -> u16 {
    (since_1970.as_millis() * NUMBERS_PER_MILLISECOND) as u16
}

/// The settings of an [`Endpoint`](super::Endpoint).
///
/// Every table and queue is bounded by one of them, so that no peer can make the endpoint grow.
#[derive(Clone, Debug)]
pub struct Config {
    /// The most components that can be attached.
    pub max_components: usize,
    /// The most peers whose address is remembered. When there is one more, a peer of the network
    /// address that holds most is forgotten, else somebody whom we have not spoken to, else whoever
    /// was heard longest ago; messages to it go to the group again until it is heard. Addresses of static peers do not count and are never
    /// forgotten.
    pub max_peers: usize,
    /// Peers whose address is known beforehand and not learned. Messages with their ids from another
    /// network address are refused.
    pub static_peers: Vec<StaticPeer>,
    /// The longest payload, in octets, that is sent in one packet: 64 to 4079, which is Junior's
    /// most; what is outside is taken for the nearest of these. The default fits one Ethernet
    /// frame, and is the most that JAUS++ does not expect to be fragmented in a way of its own.
    pub payload_limit: usize,
    /// The longest message, in octets, that is sent or received. Above
    /// [`payload_limit`](Self::payload_limit) it travels in fragments.
    pub max_message: usize,
    /// What peers are, if that is known beforehand; of those that fit an id the first counts. The
    /// others are [recognised](crate::peer::Recogniser) by what they send.
    pub profiles: Vec<Assignment>,
    /// The most octets that are kept of unfinished messages of one sender, with 64 more for each
    /// fragment and 256 for each gap. The oldest are forgotten first.
    pub max_reassembly_per_sender: usize,
    /// The same for all senders.
    pub max_reassembly: usize,
    /// How long a part of an unfinished message is kept that does not grow. Longer than senders
    /// pause between two tries or try in vain: they do not send again what was acknowledged, and
    /// would take a message for delivered of which the beginning was forgotten.
    pub reassembly_timeout: Duration,
    /// The most entries of each queue (datagrams to send, per priority; news). What comes when a
    /// queue is full is dropped and counted.
    pub queue_limit: usize,
    /// How long the same message (source, destination, sequence number and content) is taken for a
    /// duplicate made by the network. Short, because a restarted peer may well begin with the same
    /// message.
    pub duplicate_window: Duration,
    /// The same for messages that want an acknowledgement, which a peer repeats when ours got lost:
    /// Junior for 0.42 s, an endpoint every 2 s at the latest. Each repetition begins it anew, so it
    /// does not depend on how long the sender goes on.
    pub retransmission_window: Duration,
    /// The same for those that went to everybody because our address was not known: shorter,
    /// because a peer that was restarted begins like that, with the numbers that it began with
    /// before. Endpoints repeat them every 0.4 s.
    pub first_contact_window: Duration,
    /// How long our own multicast is expected to come back to us.
    pub echo_window: Duration,
    /// The most messages remembered to tell duplicates, and likewise echoes: as many of those that
    /// want an acknowledgement and as many others, and a quarter each of strangers' messages. The
    /// oldest is forgotten first.
    pub max_recent: usize,
    /// How long a destination may be silent before a message that waits for its acknowledgement is
    /// given up, and for how long one packet of it is sent again and again at the least. How long
    /// to wait before sending again follows the measured round trip.
    pub acknowledge_patience: Duration,
    /// How often one packet is sent at the least before its message is given up while the
    /// destination acknowledges others.
    pub acknowledge_tries: u32,
    /// The most messages that can wait for their acknowledgement, or for their result to be polled.
    pub max_unacknowledged: usize,
    /// The most octets of messages that can wait for their acknowledgement. A single longer message
    /// is taken when no other waits.
    pub max_unacknowledged_octets: usize,
    /// The most destinations of which round trip and window are remembered. The one idle for
    /// longest is forgotten for a new one.
    pub max_flows: usize,
    /// How many packets may be on their way to one destination at first.
    pub initial_window: usize,
    /// How many packets may ever be on their way to one destination.
    pub max_window: usize,
    /// How fast large messages without acknowledgement leave; `None` for as fast as the link takes
    /// them.
    pub pacing: Option<Pacing>,
    /// The most octets of large messages without acknowledgement that wait to be sent. A single
    /// longer message is taken when no other waits.
    pub max_paced: usize,
    /// Whether small messages share datagrams.
    pub packing: Packing,
    /// Whether messages for others are passed on between the links. Off by default: whoever has two
    /// links is not asked to join two networks by that.
    pub forwarding: bool,
    /// How many broadcasts, and messages for ids that are not known, are passed on in all.
    pub forwarded_broadcasts: Rate,
    /// Who may speak to us.
    pub access: Access,
    /// How much is taken from one source.
    pub rates: Rates,
    /// How many octets of datagrams may go to one network address while nobody there has acknowledged
    /// anything or is configured.
    pub unverified_address: Rate,
    /// The same for all such addresses together.
    pub unverified_total: Rate,
    /// Something that nobody can guess, such as a random number: numbers of challenges come from it.
    pub challenge_key: u64,
    /// The shortest time between two [`Event::IdConflict`](super::Event::IdConflict) about one id.
    pub conflict_interval: Duration,
    /// The number before the first sequence number. A node should take
    /// [`first_sequence_at`], because some peers take a restarted node's messages for duplicates of
    /// earlier ones.
    pub first_sequence: u16,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            max_components: 254,
            max_peers: 1024,
            static_peers: Vec::new(),
            payload_limit: 1425,
            max_message: 16 << 20,
            profiles: Vec::new(),
            max_reassembly_per_sender: 20 << 20,
            max_reassembly: 32 << 20,
            reassembly_timeout: Duration::from_secs(6),
            queue_limit: 1024,
            duplicate_window: Duration::from_millis(100),
            retransmission_window: Duration::from_millis(3500),
            first_contact_window: Duration::from_millis(900),
            echo_window: Duration::from_secs(1),
            max_recent: 16_384,
            acknowledge_patience: Duration::from_secs(3),
            acknowledge_tries: 20,
            max_unacknowledged: 4096,
            max_unacknowledged_octets: 64 << 20,
            max_flows: 256,
            initial_window: 16,
            max_window: 512,
            pacing: Some(Pacing::default()),
            max_paced: 32 << 20,
            packing: Packing::Off,
            forwarding: false,
            forwarded_broadcasts: Rate::new(500, 1000),
            access: Access::default(),
            rates: Rates::default(),
            unverified_address: Rate::new(1 << 10, 4 << 10),
            unverified_total: Rate::new(64 << 10, 64 << 10),
            challenge_key: 0,
            conflict_interval: Duration::from_secs(5),
            first_sequence: 0,
        }
    }
}

/// A peer whose address is configured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StaticPeer {
    /// Its id. With wildcards: everyone who matches and has no address of their own lives behind
    /// this address.
    pub id: JausId,
    /// Its address. What is heard from elsewhere does not change it, and is dropped.
    pub path: Path,
    /// Whether multicast does not reach it, so that it gets a copy of every matching broadcast.
    pub gets_broadcasts: bool,
}
