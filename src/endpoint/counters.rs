//! The counters of an endpoint: what it received, sent and dropped, and why.

use crate::counters::counters;

counters! {
    /// The counters of an endpoint. They only grow.
    pub struct Counters;

    /// Datagrams received from links.
    DatagramsReceived = "datagrams received",
    /// Datagrams handed out to links.
    DatagramsSent = "datagrams sent",
    /// Messages found in datagrams.
    MessagesReceived = "messages received",
    /// Messages delivered; one for several local components counts once for each.
    MessagesDelivered = "messages delivered",
    /// Messages accepted for sending; one in several fragments or on several links counts once.
    MessagesSent = "messages sent",
    /// Acknowledgements sent.
    AcknowledgementsSent = "acknowledgements sent",
    /// Acknowledgements that no component waits for.
    UnawaitedAcknowledgement = "unexpected acknowledgements",
    /// Packets retransmitted because no acknowledgement arrived.
    Retransmissions = "retransmissions",
    /// Messages given up because no acknowledgement arrived.
    MessagesGivenUp = "messages given up, unacknowledged",
    /// Peers forgotten because the table was full.
    PeersEvicted = "peers evicted, table full",
    /// Octets after the last message of a datagram, left by a peer that does not truncate its
    /// buffer.
    StaleOctets = "stale octets after messages",
    /// Messages forwarded for other nodes.
    MessagesForwarded = "messages forwarded",
    /// Dropped: a datagram from a link that the endpoint does not have.
    UnknownLink = "dropped: unknown link",
    /// Dropped: a datagram of no known JAUS transport.
    NotJaus = "dropped: not JAUS",
    /// Dropped: a datagram whose first message contradicts its own size fields.
    Malformed = "dropped: malformed",
    /// Dropped: an AS5669A message of a reserved type.
    ReservedType = "dropped: reserved message type",
    /// Dropped: a compressed header, which was never negotiated.
    CompressedHeader = "dropped: compressed header",
    /// Dropped: a message with all flags set, which Junior writes for priority 0 and which could be
    /// any part of a message.
    PriorityFault = "dropped: all flags set (Junior, priority 0)",
    /// Dropped: the reserved value of the broadcast field.
    ReservedBroadcast = "dropped: reserved broadcast value",
    /// Dropped: a source id with a wildcard or a zero.
    InvalidSource = "dropped: source is not a single component",
    /// Dropped: our own multicast, received back.
    OwnEcho = "dropped: own multicast",
    /// Dropped: another sender uses the id of a local component.
    IdConflict = "dropped: id conflict",
    /// Dropped: no local receiver.
    NotForUs = "dropped: no local receiver",
    /// Dropped: a local broadcast from another subsystem.
    OutOfScope = "dropped: local broadcast from another subsystem",
    /// Dropped: an acknowledgement with a message in it.
    AcknowledgementWithPayload = "dropped: acknowledgement with payload",
    /// Dropped: a repetition of a recent message.
    Duplicate = "dropped: duplicate",
    /// Dropped: from a network that is denied or not on the allow list.
    NetworkDenied = "dropped: network not allowed",
    /// Dropped: from or for a subsystem that is denied or not on the allow list.
    SubsystemDenied = "dropped: subsystem not allowed",
    /// Dropped: more messages from one address or id than the configured rate.
    MessageRate = "dropped: too many messages from one source",
    /// Dropped: a message from an unknown id, because its address has introduced too many.
    NewIdRate = "dropped: too many new ids from one address",
    /// Dropped: a message from an unknown id, because the table is full of peers that we talk to.
    PeersFull = "dropped: peer table full",
    /// Dropped and not acknowledged: a message for a component without room; its sender will repeat
    /// it.
    ReceiverBusy = "dropped: receiver busy, not acknowledged",
    /// Challenges sent to verify paths.
    ChallengesSent = "challenges sent",
    /// Challenges of an id heard on two paths after which it kept its known path.
    PeerConflicts = "ids heard at two addresses",
    /// Not sent: a datagram to an unverified address that has used up its budget.
    UnverifiedBudget = "not sent: unverified address over its budget",
    /// Dropped: a message with the id of a static peer from another network address.
    PinnedElsewhere = "dropped: id pinned to another address",
    /// Not forwarded: a broadcast that did not arrive on the route to its sender.
    NotTheWayBack = "not forwarded: not on the route to its sender",
    /// Not forwarded: broadcasts above the configured rate.
    ForwardRate = "not forwarded: too many broadcasts",
    /// Not forwarded: a message that the next header or framing cannot carry.
    CannotForward = "not forwarded: next hop's header cannot carry it",
    /// Dropped: a message too short for a message code.
    NoMessageCode = "dropped: no message code",
    /// Dropped: a large message that is longer than the limit.
    MessageTooLong = "dropped: large message over the limit",
    /// Dropped: a fragment of a large message that was not completed in time, or for which there is
    /// no room.
    FragmentsForgotten = "dropped: unfinished large message",
    /// Dropped and not acknowledged: a fragment whose sender is verified at another address.
    PartFromElsewhere = "dropped: fragment from another address",
    /// Not sent: a fragment that its header cannot carry.
    CannotSend = "not sent: its header cannot carry it",
    /// Not sent: a datagram for a link that was removed.
    LinkGone = "not sent: the link is gone",
    /// Dropped: a datagram to send, because too many wait to be sent.
    TransmitQueueFull = "dropped: transmit queue full",
    /// Dropped: an event, because too many wait.
    NewsQueueFull = "dropped: event queue full",
}
