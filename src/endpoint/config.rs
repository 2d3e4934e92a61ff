//! The settings of an endpoint: limits and timeouts, with defaults that suit a node on a small
//! board.

use std::ops::RangeInclusive;
use std::time::Duration;

use super::{Access, Limits, Pacing, Packing, Path, Rate, Routing};
use crate::address::JausId;
use crate::peer::Assignment;

/// The valid range of [`Config::payload_limit`], in octets.
pub const PAYLOAD_LIMITS: RangeInclusive<usize> = 64..=4079;

/// How many sequence numbers per millisecond of uptime a node may use and still not repeat any
/// after a restart.
const NUMBERS_PER_MILLISECOND: u128 = 5;

/// A [`first_sequence`](Config::first_sequence) for a node that starts at the given time since
/// 1970. The clock must keep running while the node does not.
///
/// Junior treats a message as a duplicate if it has seen its number from that id within 3 s (10 s
/// without its settings file): it acknowledges the message and drops it. With random first numbers,
/// a node that restarts soon after a large message repeats recent numbers about once in a hundred
/// restarts. The numbers given here run ahead of what a node uses up, and repeat only after 13 s.
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
/// Every table and queue has a limit here, so that no peer can make the endpoint grow without
/// bound.
#[derive(Clone, Debug)]
pub struct Config {
    /// The most components that can be attached.
    pub max_components: usize,
    /// Peers with a configured address, which is not learned. Messages with their ids from another
    /// network address are refused.
    pub static_peers: Vec<StaticPeer>,
    /// The longest payload of one packet, in octets: 64 to 4079, which is Junior's maximum. Other
    /// values are clamped. The default fits one Ethernet frame, and is the longest that JAUS++ does
    /// not expect to be fragmented in its own way.
    pub payload_limit: usize,
    /// The longest message, in octets, that is sent or received. Messages above
    /// [`payload_limit`](Self::payload_limit) travel in fragments.
    pub max_message: usize,
    /// Profiles of peers, where known in advance; the first entry that matches an id applies. Other
    /// peers are [recognised](crate::peer::Recogniser) by their messages.
    pub profiles: Vec<Assignment>,
    /// The most octets buffered for unfinished messages of one sender, counting an overhead of 64
    /// for each fragment and 256 for each run of consecutive fragments. The oldest runs are dropped
    /// first.
    pub max_reassembly_per_sender: usize,
    /// The same limit for all senders together.
    pub max_reassembly: usize,
    /// The timeout of an unfinished message without progress. It must exceed the senders'
    /// retransmission interval and the time for which they retry: they do not repeat acknowledged
    /// fragments, so a message whose beginning was dropped here would look delivered to them.
    pub reassembly_timeout: Duration,
    /// The most entries of each queue (outgoing datagrams, per priority; events). Entries beyond it
    /// are dropped and counted.
    pub queue_limit: usize,
    /// How long a repeated message (same source, destination, sequence number and content) is taken
    /// for a duplicate made by the network. It is short because a restarted peer may well begin
    /// with the same message.
    pub duplicate_window: Duration,
    /// The same for messages that want an acknowledgement. A peer retransmits them when our
    /// acknowledgement got lost: Junior for 0.42 s, an endpoint at least every 2 s. Each repetition
    /// restarts the window, so its length does not depend on how long the sender keeps trying.
    pub retransmission_window: Duration,
    /// The same for messages that were broadcast because our address was unknown. It is shorter,
    /// because a restarted peer begins with such messages, and with the same numbers as before.
    /// Endpoints repeat them at least every 0.4 s.
    pub first_contact_window: Duration,
    /// How long to expect echoes of our own multicast.
    pub echo_window: Duration,
    /// The most messages remembered for duplicate detection, and likewise echoes. The limit applies
    /// separately to messages with and without acknowledgement request; in each case, a quarter of
    /// it applies to strangers' messages. The oldest are dropped first.
    pub max_recent: usize,
    /// How long a destination may be silent before a message that waits for its acknowledgement is
    /// given up, and the shortest time for which one of its packets is retransmitted. The interval
    /// between retransmissions follows the measured round trip.
    pub acknowledge_patience: Duration,
    /// The fewest attempts for one packet before its message is given up while the destination
    /// acknowledges others.
    pub acknowledge_tries: u32,
    /// The most messages that wait for their acknowledgement, or for their result to be polled.
    pub max_unacknowledged: usize,
    /// The most octets of messages that wait for their acknowledgement. A single longer message is
    /// accepted if no other waits.
    pub max_unacknowledged_octets: usize,
    /// The most destinations whose round trip and window are remembered. A new destination replaces
    /// the one idle for longest.
    pub max_flows: usize,
    /// The initial window: how many packets to one destination may be unacknowledged.
    pub initial_window: usize,
    /// The largest window.
    pub max_window: usize,
    /// The rate at which large messages without acknowledgement leave; `None` sends as fast as the
    /// link accepts them.
    pub pacing: Option<Pacing>,
    /// The most octets of large messages without acknowledgement that wait to be sent. A single
    /// longer message is accepted if no other waits.
    pub max_paced: usize,
    /// Whether small messages share datagrams.
    pub packing: Packing,
    /// Whether and how much to forward between links.
    pub routing: Routing,
    /// Which senders are allowed.
    pub access: Access,
    /// Limits of peers, and rate limits per source.
    pub limits: Limits,
    /// How many octets may go to one network address as long as no peer there is configured or has
    /// acknowledged anything.
    pub unverified_address: Rate,
    /// The same limit for all unverified addresses together.
    pub unverified_total: Rate,
    /// A secret, such as a random number, from which the sequence numbers of challenges are
    /// derived.
    pub challenge_key: u64,
    /// The shortest interval between two [`Event::IdConflict`](super::Event::IdConflict) about one
    /// id.
    pub conflict_interval: Duration,
    /// The number before the first sequence number. A node should use [`first_sequence_at`],
    /// because some peers treat a restarted node's messages as duplicates of earlier ones.
    pub first_sequence: u16,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            max_components: 254,
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
            routing: Routing::default(),
            access: Access::default(),
            limits: Limits::default(),
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
    /// The id. With wildcards, it covers every matching id without an address of its own.
    pub id: JausId,
    /// The address. Messages from elsewhere do not change it, and are dropped.
    pub path: Path,
    /// Whether multicast does not reach the peer, so that it gets a unicast copy of every matching
    /// broadcast.
    pub gets_broadcasts: bool,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn first_numbers_advance_by_five_in_a_millisecond() {
        let numbers = [0, 1, 1500, 13_108].map(Duration::from_millis);
        assert_eq!(numbers.map(first_sequence_at), [0, 5, 7500, 4]);
    }
}
