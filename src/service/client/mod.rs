//! The client side of Events and Access Control: subscriptions that survive a peer's restart, and
//! control that renews itself.
//!
//! Both are tables of small state machines, one per subscription or controlled peer. They see the
//! component's incoming messages and send on its behalf. A [`Stack`](super::Stack) owns them.

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
