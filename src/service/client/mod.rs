//! The client side of Events and Access Control: subscriptions that survive a peer's restart,
//! control that renews itself, and sessions, which take control again after restarts.
//!
//! All are tables of small state machines, one per subscription, controlled peer or session. They
//! see the component's incoming messages and send on its behalf. A [`Stack`](super::Stack) owns them.

mod control;
mod introduction;
mod news;
mod rejection;
mod session;
mod subscription;
mod subscriptions;
#[cfg(test)]
mod tests;
mod topic;

pub use control::ControlId;
pub(super) use control::Controls;
pub(super) use introduction::Introduction;
pub use news::{
    ControlLost, ControlNews, ControlRefused, Outage, SubscriptionEnd, SubscriptionNews,
};
pub use rejection::Rejection;
pub use session::{
    Retake, SessionId, SessionLoss, SessionOrder, SessionSettings, SessionState, TargetState,
};
pub(super) use session::{Sessions, Surroundings};
#[cfg(feature = "node")]
pub(crate) use subscriptions::OWN_REQUESTS;
pub use subscriptions::SubscriptionId;
pub(super) use subscriptions::Subscriptions;
pub use topic::{CannotSubscribe, Topic, When};
