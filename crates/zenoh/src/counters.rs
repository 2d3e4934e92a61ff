//! Counts of what passed between the node and the zenoh network.

jaus::counters! {
    /// Counts of messages in both directions, and of what was dropped, with the reasons.
    pub struct Counters;
    Received = "messages from other bridges for the JAUS system",
    Published = "messages published for other bridges",
    Replaced = "messages held back for a minimum period and replaced by newer ones",
    UnknownKey = "samples with a key that no bridge writes",
    InvalidPayload = "samples whose payload is not one AS5669A message",
    KeyMismatch = "samples whose key and message disagree about source or code",
    OwnId = "messages and tokens from outside with an id of this side",
    OtherBridge = "messages and tokens with an id for which another bridge speaks",
    NotAccepted = "messages and tokens from ids that are not accepted",
    RuleForbids = "messages from outside that the rights of their sender forbid",
    RemoteTableFull = "messages and tokens dropped because the table of remote components is full",
    InboxFull = "messages from outside dropped because the node did not take them in time",
    NotOffered = "messages from ids of this side that are not offered",
    FromOutside = "messages that came from another bridge and do not go back",
    LocalTableFull = "messages dropped because the table of components of this side is full",
    NotAs5669a = "messages to other bridges that are not AS5669A",
    NotPresent = "messages for components that no bridge has announced",
    NoSession = "messages for a bridge that is gone",
    NotConnected = "messages dropped because the zenoh session is not open yet",
    TooLate = "messages dropped because they waited more than a second for the zenoh network",
    QueueFull = "messages dropped because the zenoh network did not take them in time",
    PeriodTableFull = "messages published without their minimum period, because its table is full",
    ViewsRefused = "requests for views that were refused",
}
