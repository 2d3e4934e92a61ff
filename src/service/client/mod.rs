//! The client's half of Events and Access Control: subscriptions that outlive a peer's restart, and
//! control that renews itself.
//!
//! Both are tables of small state machines, one for each thing that the application holds. They
//! hear what the component hears, and send in its name; a [`Stack`](super::Stack) owns them.

mod control;
mod news;
mod rejection;
mod subscription;
mod subscriptions;
#[cfg(test)]
mod tests;
mod topic;

pub(super) use control::Controls;
pub use control::{ControlId, ControlLost, ControlNews, ControlRefused};
pub use news::{Outage, SubscriptionEnd, SubscriptionNews};
pub use rejection::Rejection;
pub use subscriptions::SubscriptionId;
pub(super) use subscriptions::Subscriptions;
pub use topic::{CannotSubscribe, Topic, When};
