//! The settings of an endpoint: bounds and times, with defaults that suit a node on a small board.

use std::time::Duration;

use super::Path;
use crate::address::JausId;

/// The settings of an [`Endpoint`](super::Endpoint).
///
/// Every table and queue is bounded by one of them, so that no peer can make the endpoint grow.
#[derive(Clone, Debug)]
pub struct Config {
    /// The most components that can be attached.
    pub max_components: usize,
    /// The most peers whose address is remembered. When there is one more, the one heard longest
    /// ago is forgotten; messages to it go to the group again until it is heard. Static peers do
    /// not count and are never forgotten.
    pub max_peers: usize,
    /// Peers whose address is known beforehand and not learned.
    pub static_peers: Vec<StaticPeer>,
    /// The longest payload, in octets, that is sent in one message. The default fits one
    /// Ethernet frame, and is the most that JAUS++ does not expect to be fragmented in a way of
    /// its own.
    pub payload_limit: usize,
    /// The longest message, in octets, that is sent or received. Above
    /// [`payload_limit`](Self::payload_limit) it travels in fragments. Also the most that is kept
    /// of the unfinished messages of one sender.
    pub max_message: usize,
    /// The most octets that are kept of unfinished messages of all senders. The oldest are
    /// forgotten first.
    pub max_reassembly: usize,
    /// How long an unfinished message is kept after its latest fragment.
    pub reassembly_timeout: Duration,
    /// The most entries of each queue (datagrams to send and messages to deliver, both per
    /// priority; news). What comes when a queue is full is dropped and counted.
    pub queue_limit: usize,
    /// How long the same message (source, destination, sequence number and content) is taken for a
    /// duplicate made by the network. Short, because a restarted peer may well begin with the same
    /// message.
    pub duplicate_window: Duration,
    /// The same for messages that want an acknowledgement, which a peer repeats when ours got lost.
    /// Junior gives up after 0.42 s.
    pub retransmission_window: Duration,
    /// How long our own multicast is expected to come back to us.
    pub echo_window: Duration,
    /// The most messages remembered to tell duplicates, and likewise echoes. The oldest is
    /// forgotten first.
    pub max_recent: usize,
    /// How long to wait for an acknowledgement before sending again.
    pub acknowledge_timeout: Duration,
    /// How often to send again before giving up.
    pub acknowledge_retries: u32,
    /// The most messages, or fragments of one, that can wait for an acknowledgement at a time.
    pub max_unacknowledged: usize,
    /// The shortest time between two [`Event::IdConflict`](super::Event::IdConflict) about one id.
    pub conflict_interval: Duration,
    /// The number before the first sequence number. A node should choose it at random, because some
    /// peers take a restarted node's first messages for duplicates of earlier ones.
    pub first_sequence: u16,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            max_components: 254,
            max_peers: 1024,
            static_peers: Vec::new(),
            payload_limit: 1425,
            max_message: 512 * 1024,
            max_reassembly: 4 * 1024 * 1024,
            reassembly_timeout: Duration::from_secs(2),
            queue_limit: 1024,
            duplicate_window: Duration::from_millis(100),
            retransmission_window: Duration::from_millis(500),
            echo_window: Duration::from_secs(1),
            max_recent: 4096,
            acknowledge_timeout: Duration::from_millis(100),
            acknowledge_retries: 3,
            max_unacknowledged: 512,
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
    /// Its address. What is heard from elsewhere does not change it.
    pub path: Path,
    /// Whether multicast does not reach it, so that it gets a copy of every matching broadcast.
    pub gets_broadcasts: bool,
}
