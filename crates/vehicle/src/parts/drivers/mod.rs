//! What the drivers of the chain have in common: how they stand, what they sense, and how each
//! commands the next.

mod fault_monitor;
mod freshness;
mod helm;
mod next;
mod senses;
mod standing;
mod verdict;

pub(super) use fault_monitor::FaultMonitor;
pub(super) use freshness::Freshness;
pub(super) use helm::{Helm, HelmSettings, Order};
pub(super) use next::{Language, Next};
pub(super) use senses::Sense;
pub(super) use standing::{Watchman, guard, shut_down};
