//! What an endpoint has seen, done and thrown away: one number for each, for people and for tests.

use crate::counters::counters;

counters! {
    /// The numbers of an endpoint. They only grow.
    pub struct Counters;

    /// Datagrams handed in.
    DatagramsReceived = "datagrams received",
    /// Datagrams handed out.
    DatagramsSent = "datagrams sent",
    /// Messages found in datagrams.
    MessagesReceived = "messages received",
    /// Messages delivered; one for several local components counts for each.
    MessagesDelivered = "messages delivered",
    /// Messages accepted for sending; one in several fragments or on several links counts once.
    MessagesSent = "messages sent",
    /// Acknowledgements sent.
    AcknowledgementsSent = "acknowledgements sent",
    /// Acknowledgements received that no component waits for, among them those to the first
    /// messages for unknown ids, which only teach the address.
    UnawaitedAcknowledgement = "acknowledgements that nobody waits for",
    /// Packets sent again for want of an acknowledgement.
    Retransmissions = "retransmissions",
    /// Messages that wanted an acknowledgement and were given up.
    MessagesGivenUp = "messages given up, not acknowledged",
    /// Peers forgotten because more were heard than the table holds.
    PeersEvicted = "peers forgotten, table full",
    /// Octets behind the last message of a datagram, left by a peer that does not shorten its
    /// buffer.
    StaleOctets = "stale octets behind messages",
    /// Messages of others that were sent on.
    MessagesForwarded = "messages forwarded",
    /// Dropped: a datagram from a link that the endpoint does not have.
    UnknownLink = "dropped: unknown link",
    /// Dropped: a datagram that no JAUS transport wrote.
    NotJaus = "dropped: not JAUS",
    /// Dropped: a datagram whose first message does not fit its own sizes.
    Malformed = "dropped: malformed",
    /// Dropped: an AS5669A message of a reserved type.
    ReservedType = "dropped: reserved message type",
    /// Dropped: a compressed header, which nobody negotiated with us.
    CompressedHeader = "dropped: compressed header",
    /// Dropped: a message with all flags set, which Junior makes of priority 0 and which could be any
    /// part of one.
    PriorityFault = "dropped: all flags set, as Junior does for priority 0",
    /// Dropped: the reserved value of the broadcast field.
    ReservedBroadcast = "dropped: reserved broadcast value",
    /// Dropped: a source id with a wildcard or a zero.
    InvalidSource = "dropped: source is not one component",
    /// Dropped: our own multicast, come back.
    OwnEcho = "dropped: own multicast",
    /// Dropped: somebody else sends with the id of a component of ours.
    IdConflict = "dropped: id conflict",
    /// Dropped: for nobody here.
    NotForUs = "dropped: not for us",
    /// Dropped: a local broadcast from another subsystem.
    OutOfScope = "dropped: local broadcast of another subsystem",
    /// Dropped: an acknowledgement with a message in it.
    AcknowledgementWithPayload = "dropped: acknowledgement with payload",
    /// Dropped: the same message within a short time.
    Duplicate = "dropped: duplicate",
    /// Dropped: from a network that is denied or not among the allowed.
    NetworkDenied = "dropped: network not allowed",
    /// Dropped: from or for a subsystem that is denied or not among the allowed.
    SubsystemDenied = "dropped: subsystem not allowed",
    /// Dropped: more messages from one address or id than configured.
    MessageRate = "dropped: too many messages from one source",
    /// Dropped: a message from an id that was not known, of which too many come from one address.
    NewIdRate = "dropped: too many new ids from one address",
    /// Dropped: a message from an id that was not known, while the table is full of peers in
    /// conversation with us.
    PeersFull = "dropped: no room for another peer",
    /// Dropped, and not acknowledged: a message for a component that has no room for it, which its
    /// sender will repeat.
    ReceiverBusy = "dropped: receiver busy, not acknowledged",
    /// Challenges sent to paths that are to be proven.
    ChallengesSent = "challenges sent",
    /// Challenges that have shown an id on two paths to be where it was.
    PeerConflicts = "ids heard at two addresses",
    /// Not sent: a datagram to an address that is not proven and had its share.
    UnverifiedBudget = "not sent: too much for an unproven address",
    /// Dropped: a message with the id of a configured peer from another network address.
    PinnedElsewhere = "dropped: id configured to be elsewhere",
    /// Not forwarded: a broadcast that did not come by the way that leads to its sender.
    NotTheWayBack = "not forwarded: did not come from where its sender is",
    /// Not forwarded: more broadcasts than are allowed to go on.
    ForwardRate = "not forwarded: too many broadcasts",
    /// Not forwarded: a message that the next header or framing cannot carry.
    CannotForward = "not forwarded: next header cannot carry it",
    /// Dropped: a message too short for a message code.
    NoMessageCode = "dropped: no message code",
    /// Dropped: a large message that is longer than the limit.
    MessageTooLong = "dropped: large message above the limit",
    /// Dropped: a part of a large message of which the rest did not come in time, or for which
    /// there is no room.
    FragmentsForgotten = "dropped: unfinished large message",
    /// Dropped, and not acknowledged: a part of a large message from elsewhere than where its sender has
    /// proven to be.
    PartFromElsewhere = "dropped: part of a message from elsewhere",
    /// Not sent: a fragment that its header cannot carry.
    CannotSend = "not sent: its header cannot carry it",
    /// Not sent: a datagram for a link that was removed.
    LinkGone = "not sent: the link is gone",
    /// Dropped: a datagram to send, because too many wait to be sent.
    TransmitQueueFull = "dropped: transmit queue full",
    /// Dropped: an event, because too many wait.
    NewsQueueFull = "dropped: event queue full",
}
