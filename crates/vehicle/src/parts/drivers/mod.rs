//! Common parts of the drivers of the chain: standing, sensor input, and the commands to the next
//! driver.

mod chain_control;
mod fault_monitor;
mod global_poses;
mod next;
#[cfg(test)]
mod range_faults;
mod remote_platform;
mod senses;
mod standing;

pub(super) use chain_control::{ChainControl, ChainGuard};
pub(super) use fault_monitor::FaultMonitor;
pub(super) use global_poses::GlobalPoses;
pub(super) use next::{Language, Next};
pub(super) use remote_platform::{Order, RemotePlatform, RemotePlatformSettings};
pub(super) use senses::{Sense, reported_pose};
pub(super) use standing::{Watchman, guard, lent_authority, shut_down};
