//! Counts of what passed between the node and the zenoh network.

jaus::counters! {
    /// Counts of messages in both directions, and of what was dropped, with the reasons.
    pub struct Counters;
    Received = "messages from other bridges for the JAUS system",
    Published = "messages published for other bridges",
    Replaced = "messages held back for a minimum period and replaced by newer ones",
    UnknownKey = "dropped: key that no bridge writes",
    InvalidPayload = "dropped: payload is not one AS5669A message",
    KeyMismatch = "dropped: key and message disagree about source or code",
    /// Dropped: a message or token from outside with an id of this side.
    OwnId = "dropped: id of this side",
    /// Dropped: a message or token with an id for which another bridge speaks.
    OtherBridge = "dropped: id for which another bridge speaks",
    /// Dropped: a message with an id whose token its bridge has not declared.
    NotAnnounced = "dropped: id without a token",
    /// Dropped: a message or token from an id that is not accepted.
    NotAccepted = "dropped: id that is not accepted",
    RuleForbids = "dropped: forbidden by the rights of its sender",
    /// Dropped: a token, because its bridge or all together have too many components.
    RemoteTableFull = "dropped: table of remote components full",
    /// Dropped: a message from outside that the node did not take in time.
    InboxFull = "dropped: node too slow",
    NotOffered = "not sent: id that is not offered",
    /// Not sent: a message that came from another bridge and does not go back.
    FromOutside = "not sent: from another bridge",
    LocalTableFull = "not sent: table of components of this side full",
    NotAs5669a = "not sent: not AS5669A",
    NotPresent = "not sent: no bridge has announced the receiver",
    NoSession = "not sent: bridge is gone",
    NotConnected = "not sent: zenoh session not open",
    TooLate = "not sent: waited more than a second for the zenoh network",
    QueueFull = "not sent: zenoh network too slow",
    PeriodTableFull = "messages published without their minimum period, because its table is full",
    DecisionsLost = "decisions not recorded",
    ViewsRefused = "requests for views that were refused",
}
