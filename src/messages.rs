//! The messages of the service sets, generated from their definitions.
//!
//! One module per set. The types inside a message are in a module of the message's name, for
//! example `core::report_services::NodeSeq`.

use crate::codec::{MessageInfo, Registry, ServiceInfo};

/// The core set (AS5710): what every component speaks.
#[allow(missing_docs, reason = "what the definitions do not describe")]
pub mod core {
    include!(concat!(env!("OUT_DIR"), "/core.rs"));
}

/// The mobility set (AS6009): sensing and commanding how a platform moves.
#[cfg(feature = "mobility")]
#[allow(missing_docs, reason = "what the definitions do not describe")]
pub mod mobility {
    include!(concat!(env!("OUT_DIR"), "/mobility.rs"));
}

/// Our own set for a ground vehicle: world model, mission, stages, odometry.
#[cfg(feature = "ground")]
#[allow(missing_docs, reason = "what the definitions do not describe")]
pub mod ground {
    include!(concat!(env!("OUT_DIR"), "/ground.rs"));
}

static MESSAGES: &[&[MessageInfo]] = &[
    core::MESSAGES,
    #[cfg(feature = "mobility")]
    mobility::MESSAGES,
    #[cfg(feature = "ground")]
    ground::MESSAGES,
];

static SERVICES: &[&[ServiceInfo]] = &[
    core::SERVICES,
    #[cfg(feature = "mobility")]
    mobility::SERVICES,
    #[cfg(feature = "ground")]
    ground::SERVICES,
];

/// All messages of the service sets that are switched on.
pub const fn registry() -> Registry {
    Registry::new(MESSAGES)
}

/// All services of the service sets that are switched on.
pub fn services() -> impl Iterator<Item = &'static ServiceInfo> {
    SERVICES.iter().copied().flatten()
}
