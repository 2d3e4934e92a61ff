//! Counts of what passed between the vehicle and the ROS network.

jaus::counters! {
    /// Counts of messages in both directions, and of what was refused or dropped, with the reasons.
    pub struct Counters;
    Published = "messages published for ROS",
    NotPublished = "samples dropped because ROS did not take them in time",
    Incomplete = "reports without the fields that ROS needs",
    Velocities = "velocities received",
    InvalidVelocity = "velocities refused because they are not finite or above the limits",
    OtherPublisher = "velocities refused because another publisher drives",
    Outdated = "velocities refused because they are late, repeated or of a publisher that is gone",
    Locked = "velocities refused until the publisher stops or pauses",
    Forbidden = "commands refused by the rights of ROS (--rights)",
    Unannounced = "messages refused because their publisher has no liveliness token",
    Goals = "goals received",
    GoalRefused = "goals refused",
    Emergencies = "emergency stops received",
    EmergencyRefused = "emergency stops refused by the rights of ROS (--rights)",
    ClearRefused = "ends of emergencies refused by the rights of ROS (--rights)",
    Malformed = "messages of ROS that could not be read",
    NotTaken = "messages of ROS dropped because the bridge did not take them in time",
    NotSubscribed = "subscriptions to reports not started because there are too many",
}
