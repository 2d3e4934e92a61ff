//! The counters of an endpoint: what it received, sent and dropped, and why.

use crate::counters::counters;

counters! {
    /// The counters of an endpoint. They only grow.
    pub struct Counters;

    DatagramsReceived = "datagrams received",
    DatagramsSent = "datagrams sent",
    MessagesReceived = "messages received",
    /// Messages delivered; one for several local components counts once for each.
    MessagesDelivered = "messages delivered",
    /// Messages accepted for sending; one in several fragments or on several links counts once.
    MessagesSent = "messages sent",
    AcknowledgementsSent = "acknowledgements sent",
    UnawaitedAcknowledgement = "unexpected acknowledgements",
    Retransmissions = "retransmissions",
    MessagesGivenUp = "messages given up, unacknowledged",
    /// Messages whose senders no longer waited for the acknowledgement.
    MessagesCancelled = "messages cancelled, unacknowledged",
    PeersEvicted = "peers evicted, table full",
    /// Octets after the last message of a datagram, left by a peer that does not truncate its
    /// buffer.
    StaleOctets = "stale octets after messages",
    MessagesForwarded = "messages forwarded",
    UnknownLink = "dropped: unknown link",
    NotJaus = "dropped: not JAUS",
    /// Dropped: a datagram whose first message contradicts its own size fields.
    Malformed = "dropped: malformed",
    ReservedType = "dropped: reserved message type",
    /// Dropped: a compressed header, which was never negotiated.
    CompressedHeader = "dropped: compressed header",
    /// Dropped: a message with all flags set, which Junior writes for priority 0 and which could be
    /// any part of a message.
    PriorityFault = "dropped: all flags set (Junior, priority 0)",
    ReservedBroadcast = "dropped: reserved broadcast value",
    InvalidSource = "dropped: source is not a single component",
    OwnEcho = "dropped: own multicast",
    /// Dropped: another sender uses the id of a local component.
    IdConflict = "dropped: id conflict",
    NotForUs = "dropped: no local receiver",
    OutOfScope = "dropped: local broadcast from another subsystem",
    AcknowledgementWithPayload = "dropped: acknowledgement with payload",
    Duplicate = "dropped: duplicate",
    /// Dropped: a message from an id that `access.bind` binds to other networks.
    BoundElsewhere = "dropped: id bound to another network",
    /// Dropped: a message from an id of a peer of the secure link by another link, or from the other side of a
    /// bridge with the id of a component of this side.
    ReservedId = "dropped: id of another link",
    /// Dropped: a message to which `access.grants` gives its sender no right.
    NotGranted = "dropped: sender has no right to it",
    NetworkDenied = "dropped: network not allowed",
    SubsystemDenied = "dropped: subsystem not allowed",
    MessageRate = "dropped: too many messages from one source",
    /// Dropped: a message from an unknown id, because its address has introduced too many.
    NewIdRate = "dropped: too many new ids from one address",
    /// Dropped: a message from an unknown id, because the table is full of peers that we talk to.
    PeersFull = "dropped: peer table full",
    /// Dropped and not acknowledged: a message for a component without room; its sender will repeat
    /// it.
    ReceiverBusy = "dropped: receiver busy, not acknowledged",
    ChallengesSent = "challenges sent",
    /// Challenges of an id heard on two paths after which it kept its known path.
    PeerConflicts = "ids heard at two addresses",
    /// Not sent: a datagram to an unverified address that has used up its budget.
    UnverifiedBudget = "not sent: unverified address over its budget",
    PinnedElsewhere = "dropped: id pinned to another address",
    NotTheWayBack = "not forwarded: not on the route to its sender",
    ForwardRate = "not forwarded: too many broadcasts",
    /// Not forwarded: a message that the next header or framing cannot carry.
    CannotForward = "not forwarded: next hop's header cannot carry it",
    NoMessageCode = "dropped: no message code",
    MessageTooLong = "dropped: large message over the limit",
    /// Dropped: a fragment of a large message that was not completed in time, or for which there is
    /// no room.
    FragmentsForgotten = "dropped: unfinished large message",
    /// Dropped and not acknowledged: a fragment whose sender is verified at another address.
    PartFromElsewhere = "dropped: fragment from another address",
    CannotSend = "not sent: its header cannot carry it",
    LinkGone = "not sent: the link is gone",
    TransmitQueueFull = "dropped: transmit queue full",
    NewsQueueFull = "dropped: event queue full",
    /// Decisions that an audit log lacks, because too many different ones came at once.
    DecisionsLost = "decisions not recorded",
}
