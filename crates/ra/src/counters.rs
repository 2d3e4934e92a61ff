//! Counters of an RA node: traffic, drops and refusals.

use jaus::counters;

counters! {
    /// Counters of a node. They only grow.
    pub struct Counters;

    /// Datagrams handed in.
    DatagramsReceived = "datagrams received",
    /// Datagrams handed out.
    DatagramsSent = "datagrams sent",
    /// Whole messages received.
    MessagesReceived = "messages received",
    /// Complete messages sent; a multicast or multi-part message counts once.
    MessagesSent = "messages sent",
    /// Acknowledgements sent.
    AcknowledgementsSent = "acknowledgements sent",
    /// Acknowledgements received; they are not evaluated.
    AcknowledgementsReceived = "acknowledgements received",
    /// A subsystem moved to another address.
    AddressMoved = "subsystems that moved to another address",
    /// Dropped: a datagram without a known JAUS transport header.
    NotJaus = "dropped: not JAUS",
    /// Dropped: a datagram of AS5669A, which is not RA.
    As5669a = "dropped: AS5669A, not RA",
    /// Dropped: shorter than a header.
    TooShort = "dropped: shorter than a header",
    /// Dropped: the stated data size does not match the datagram.
    WrongSize = "dropped: data size differs from the datagram's",
    /// Dropped: header compression without negotiation.
    CompressedHeader = "dropped: compressed header",
    /// Dropped: version bits of RA 2.x, 3.0, 3.1 or undefined.
    WrongVersion = "dropped: header version not accepted",
    /// Dropped: an undefined data flag.
    UnknownDataFlag = "dropped: unknown data flag",
    /// Dropped: a source with a field of 0 or 255.
    InvalidSource = "dropped: source is not a single component",
    /// Dropped: a destination with a field of 0.
    InvalidDestination = "dropped: invalid destination",
    /// Dropped: our own multicast.
    OwnEcho = "dropped: own multicast",
    /// Dropped: a peer uses the number of one of our subsystems.
    SubsystemConflict = "dropped: another system uses our subsystem number",
    /// Dropped: the destination is not one of our components.
    NotForUs = "dropped: no local receiver",
    /// Dropped: more messages from one address than allowed.
    MessageRate = "dropped: too many messages from one address",
    /// Dropped: an unknown subsystem, as the table is full.
    SubsystemsFull = "dropped: subsystem table full",
    /// Dropped: an unknown subsystem, as too many come from one address.
    NewSubsystemRate = "dropped: too many new subsystems from one address",
    /// Dropped: a known subsystem from another address while its known address is alive.
    AddressConflict = "dropped: subsystem heard at another address",
    /// Dropped: a part of a large message out of sequence.
    PartOutOfOrder = "dropped: large message with a missing part",
    /// Dropped: an incomplete large message after a timeout.
    PartsTimedOut = "dropped: large message timed out",
    /// Dropped: an incomplete large message, for lack of room.
    PartsForgotten = "dropped: no room for unfinished large message",
    /// Dropped: a large message above the size limit.
    MessageTooLong = "dropped: large message over the limit",
    /// Dropped: a query or request with a malformed body.
    Malformed = "dropped: malformed body",
    /// Not answered: too many queries from one subsystem.
    AnswerRate = "not answered: too many queries from one subsystem",
    /// Not sent: too many queries to one subsystem.
    QuestionRate = "postponed: too many queries to one subsystem",
    /// Refused: a subscription to an unsupported event, or above the limit.
    EventRefused = "events refused",
    /// Refused: a service connection.
    ConnectionRefused = "service connections refused",
    /// Dropped: a report of an unknown service connection.
    UnwantedReport = "dropped: report for an unknown service connection",
    /// Left out: components, services or names of a subsystem above the limits.
    ConfigurationTooLong = "truncated: configuration over the limits",
    /// Dropped: an outgoing datagram, as the transmit queue is full.
    TransmitQueueFull = "dropped: transmit queue full",
    /// Dropped: an event for the owner, as the event queue is full.
    EventQueueFull = "dropped: event queue full",
}
