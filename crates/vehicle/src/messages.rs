//! The messages of the ground vehicle's own services, of handing over control and of Range Sensor,
//! generated from their definitions.

use jaus::codec::{Registry, ServiceSet};

/// World model, missions, stages, odometry.
#[allow(missing_docs, reason = "the definitions lack descriptions")]
pub mod ground {
    include!(concat!(env!("OUT_DIR"), "/ground.rs"));
}

/// Handing over control between operators: Enhanced Access Control and Handoff Controller of the
/// interoperability profiles.
pub mod handoff {
    include!(concat!(env!("OUT_DIR"), "/handoff.rs"));
}

/// Environment sensing (AS6060): Range Sensor.
#[allow(missing_docs, reason = "the definitions lack descriptions")]
pub mod environment_sensing {
    include!(concat!(env!("OUT_DIR"), "/environment_sensing.rs"));
}

/// All services and messages that the vehicle speaks: these, and those of the stack.
#[must_use]
pub const fn registry() -> Registry {
    static STACK: Registry = jaus::messages::registry();
    static OWN: &[ServiceSet] = &[
        ServiceSet {
            services: ground::SERVICES,
            messages: ground::MESSAGES,
        },
        ServiceSet {
            services: handoff::SERVICES,
            messages: handoff::MESSAGES,
        },
        ServiceSet {
            services: environment_sensing::SERVICES,
            messages: environment_sensing::MESSAGES,
        },
    ];
    Registry::extending(&STACK, OWN)
}
