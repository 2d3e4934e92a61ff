//! What a transport reports about itself.

use std::net::SocketAddr;
use std::time::Duration;

use jaus::endpoint::SessionId;

use crate::authority::Rejection;
use crate::trust::Peer;

jaus::counters! {
    /// Counts of a transport since it was created.
    pub struct Counters;

    SessionsEstablished = "sessions established",
    /// Handshakes that failed, most often because a side does not trust the key of the other.
    HandshakesFailed = "handshakes failed",
    RefusedKeys = "handshakes refused: untrusted key",
    RefusedTimes = "handshakes refused: certificate expired or not valid yet",
    RefusedRevoked = "handshakes refused: certificate revoked",
    /// Handshakes refused by this side for another defect of the certificate, its authority, or
    /// the proof of its key.
    RefusedCertificates = "handshakes refused: certificate or proof of its key not valid",
    RefusedUnusableTrust = "handshakes refused: a file of trust cannot be used",
    /// Handshakes ignored because their address, or all addresses together, began too many.
    HandshakesDropped = "handshakes refused: too many from one address or from all",
    /// Unfinished handshakes that were ended because there were too many.
    HandshakesDisplaced = "handshakes refused: others took their place",
    /// First packets whose sender was asked to prove that it receives at its address.
    Retries = "first packets answered by a Retry packet",
    /// First packets dropped unread, because too many arrived at once.
    FirstPacketsDropped = "handshakes refused: too many first packets",
    ExpiryReminders = "warnings that the own certificate expires",
    /// Messages refused because they came from an id for which the key of their sender may not
    /// speak.
    ForeignIds = "dropped: id that the key of its sender may not use",
    /// Messages refused because another program with the same key uses their id, and is alive.
    DisputedIds = "dropped: id that another program with the same key uses",
    /// Sessions refused because their key had too many.
    TooManyInstances = "sessions refused: too many programs with one key",
    /// Messages refused by the [rules](jaus::rights::Rules) of the key of their sender.
    RuleForbids = "dropped: forbidden by the rules of its sender",
    /// Fragments that continue no message which their session began, and which its rules allow.
    StrayFragments = "dropped: fragment of a message that its session did not begin",
    Malformed = "dropped: not JUDP",
    /// Messages not sent to a peer because the rules separate it from their source.
    Separated = "not sent: rules keep it from the peer",
    /// Datagrams dropped because the peer or the network was too slow.
    SendOverflows = "not sent: peer or network too slow",
    NoSession = "not sent: session has ended",
    /// Records for an audit log that were not kept, because too many waited.
    RecordsLost = "audit records lost",
    NoticesReceived = "notices of peers that refused a message",
}

impl Counters {
    /// Counts a refused handshake.
    pub(super) fn count(&mut self, rejection: &Rejection) {
        self.add(match rejection {
            Rejection::UntrustedKey(_) | Rejection::NotEd25519 => Counter::RefusedKeys,
            Rejection::Expired { .. } | Rejection::NotYetValid { .. } => Counter::RefusedTimes,
            Rejection::UnusableTrust(_) => Counter::RefusedUnusableTrust,
            Rejection::Revoked { .. } => Counter::RefusedRevoked,
            _ => Counter::RefusedCertificates,
        });
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
