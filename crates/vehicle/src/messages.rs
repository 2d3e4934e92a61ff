//! The messages of the ground vehicle's own services, generated from their definitions.

use jaus::codec::{MessageInfo, Registry, ServiceInfo};

/// World model, missions, stages, odometry.
#[allow(missing_docs, reason = "the definitions lack descriptions")]
pub mod ground {
    include!(concat!(env!("OUT_DIR"), "/ground.rs"));
}

/// All messages of these services.
#[must_use]
pub const fn registry() -> Registry {
    static MESSAGES: &[&[MessageInfo]] = &[ground::MESSAGES];
    Registry::new(MESSAGES)
}

/// All of these services.
pub fn services() -> impl Iterator<Item = &'static ServiceInfo> {
    ground::SERVICES.iter()
}
