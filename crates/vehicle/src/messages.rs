//! The messages of the ground vehicle's own services, generated from their definitions.

use jaus::codec::{Registry, ServiceSet};

/// World model, missions, stages, odometry.
#[allow(missing_docs, reason = "the definitions lack descriptions")]
pub mod ground {
    include!(concat!(env!("OUT_DIR"), "/ground.rs"));
}

/// All services and messages that the vehicle speaks: these, and those of the stack.
#[must_use]
pub const fn registry() -> Registry {
    static STACK: Registry = jaus::messages::registry();
    static GROUND: &[ServiceSet] = &[ServiceSet {
        services: ground::SERVICES,
        messages: ground::MESSAGES,
    }];
    Registry::extending(&STACK, GROUND)
}
