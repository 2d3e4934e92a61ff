//! What a transport reports about itself.

use std::net::SocketAddr;
use std::time::Duration;

use jaus::endpoint::SessionId;

use crate::authority::Rejection;
use crate::trust::Peer;

/// Counts of a transport since it was created.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Counters {
    /// Sessions established.
    pub established: u64,
    /// Handshakes that failed, most often because a side does not trust the key of the other.
    pub handshakes_failed: u64,
    /// Handshakes refused by this side because it does not trust the key.
    pub refused_keys: u64,
    /// Handshakes refused by this side because the certificate has expired or is not valid yet.
    pub refused_times: u64,
    /// Handshakes refused by this side because the certificate is revoked.
    pub refused_revoked: u64,
    /// Handshakes refused by this side for another defect of the certificate, its authority, or
    /// the proof of its key.
    pub refused_certificates: u64,
    /// Warnings that the node's own certificate has expired or expires soon.
    pub reminders: u64,
    /// First packets ignored because too many came from one address, or too many handshakes were
    /// unfinished.
    pub handshakes_dropped: u64,
    /// Messages refused because they came from an id for which the key of their sender may not
    /// speak.
    pub foreign_ids: u64,
    /// Messages refused by the [rules](crate::rules::Rules) of the key of their sender.
    pub refused: u64,
    /// Messages not sent to a peer because the rules separate it from their source.
    pub separated: u64,
    /// Records for an audit log that were not kept, because too many waited.
    pub records_lost: u64,
    /// Notices of peers that they refused a message of this node.
    pub notices: u64,
    /// Datagrams that were no JUDP.
    pub malformed: u64,
    /// Datagrams dropped because the peer or the network was too slow.
    pub send_overflows: u64,
    /// Datagrams dropped because their session had ended.
    pub no_session: u64,
}

impl Counters {
    /// Counts a refused handshake.
    pub(super) const fn count(&mut self, rejection: Option<&Rejection>) {
        match rejection {
            None => {}
            Some(Rejection::UntrustedKey(_) | Rejection::NotEd25519) => {
                self.refused_keys += 1;
            }
            Some(Rejection::Expired { .. } | Rejection::NotYetValid { .. }) => {
                self.refused_times += 1;
            }
            Some(Rejection::Revoked { .. }) => {
                self.refused_revoked += 1;
            }
            Some(_) => {
                self.refused_certificates += 1;
            }
        }
    }
}

/// The current state of a session.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SessionReport {
    /// Its number, as in [`Remote::Session`](jaus::endpoint::Remote::Session).
    pub session: SessionId,
    /// The authenticated peer.
    pub peer: Peer,
    /// The address that the peer sends from at present.
    pub address: SocketAddr,
    /// Whether this node opened it.
    pub dialed: bool,
    /// The estimated round trip.
    pub round_trip: Duration,
    /// JUDP datagrams received on it.
    pub received: u64,
    /// JUDP datagrams sent on it.
    pub sent: u64,
    /// JUDP datagrams that wait for the network.
    pub waiting: usize,
}
