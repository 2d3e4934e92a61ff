//! What a node among RA systems has seen, done and thrown away: a number for each.

use jaus::counters;

counters! {
    /// The numbers of a node. They only grow.
    pub struct Counters;

    /// Datagrams handed in.
    DatagramsReceived = "datagrams received",
    /// Datagrams handed out.
    DatagramsSent = "datagrams sent",
    /// Whole messages received.
    MessagesReceived = "messages received",
    /// Whole messages sent; one to everybody, or in several parts, counts once.
    MessagesSent = "messages sent",
    /// Acknowledgements sent.
    AcknowledgementsSent = "acknowledgements sent",
    /// Acknowledgements received; nobody waits for them.
    AcknowledgementsReceived = "acknowledgements received",
    /// A subsystem is heard from another address than before.
    AddressMoved = "subsystems that moved to another address",
    /// Dropped: a datagram that begins like no JAUS transport.
    NotJaus = "dropped: not JAUS",
    /// Dropped: a datagram of AS5669A, which is no business of ours.
    As5669a = "dropped: AS5669A, not RA",
    /// Dropped: shorter than a header.
    TooShort = "dropped: shorter than a header",
    /// Dropped: a stated data size that is not what is there.
    WrongSize = "dropped: data size does not fit the datagram",
    /// Dropped: header compression, which nobody negotiated with us.
    CompressedHeader = "dropped: compressed header",
    /// Dropped: the version bits of RA 2.x, 3.0 or 3.1, or of none.
    WrongVersion = "dropped: header version not accepted",
    /// Dropped: a data flag that means nothing.
    UnknownDataFlag = "dropped: unknown data flag",
    /// Dropped: a source with a field of 0 or 255.
    InvalidSource = "dropped: source is not one component",
    /// Dropped: a destination with a field of 0.
    InvalidDestination = "dropped: destination names nobody",
    /// Dropped: our own multicast, come back.
    OwnEcho = "dropped: own multicast",
    /// Dropped: somebody else speaks as a subsystem that we show.
    SubsystemConflict = "dropped: somebody else has our subsystem number",
    /// Dropped: for a component that we do not show.
    NotForUs = "dropped: not for us",
    /// Dropped: more messages from one address than allowed.
    MessageRate = "dropped: too many messages from one address",
    /// Dropped: an unknown subsystem, while the table is full.
    SubsystemsFull = "dropped: no room for another subsystem",
    /// Dropped: an unknown subsystem, of which too many come from one address.
    NewSubsystemRate = "dropped: too many new subsystems from one address",
    /// Dropped: a known subsystem from another address, while it is heard at the one known.
    AddressConflict = "dropped: subsystem is heard from another address",
    /// Dropped: a part of a large message that does not follow the parts before.
    PartOutOfOrder = "dropped: large message with a part missing",
    /// Dropped: an unfinished large message, because the rest did not come in time.
    PartsTimedOut = "dropped: large message not finished in time",
    /// Dropped: an unfinished large message, because there is no room.
    PartsForgotten = "dropped: no room for unfinished large message",
    /// Dropped: a large message above the limit.
    MessageTooLong = "dropped: large message above the limit",
    /// Dropped: a message that we would answer, with a body that is none.
    Malformed = "dropped: malformed body",
    /// Not answered: more questions from one subsystem than we answer.
    AnswerRate = "not answered: too many questions from one subsystem",
    /// Not asked: more questions than we ask of one subsystem.
    QuestionRate = "not asked yet: too many questions to one subsystem",
    /// Refused: an event that we do not offer, or one more than there is room for.
    EventRefused = "events refused",
    /// Refused: a service connection.
    ConnectionRefused = "service connections refused",
    /// Dropped: a report of a service connection that nobody here wants.
    UnwantedReport = "dropped: report of an unknown service connection",
    /// Left out: components, services or names of a subsystem above the limits.
    ConfigurationTooLong = "left out: configuration above the limits",
    /// Dropped: a datagram to send, because too many wait to be sent.
    TransmitQueueFull = "dropped: transmit queue full",
    /// Dropped: an event for the owner, because too many wait.
    EventQueueFull = "dropped: event queue full",
}
