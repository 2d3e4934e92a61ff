//! The messages of the SAE service sets, generated from their definitions.
//!
//! One module per set: the core set always, the mobility set with the feature `mobility`, the
//! others with the feature `every-set`. The types inside a message are in a module of the message's
//! name, for example `core::report_services::NodeSeq`.

use crate::codec::{Registry, ServiceSet};

/// The modules of the sets, and the table of those that are switched on.
macro_rules! sets {
    ($($(#[$doc:meta])* $set:ident $(if $feature:literal)?;)*) => {
        $(
            $(#[$doc])*
            $(#[cfg(feature = $feature)])?
            #[allow(missing_docs, reason = "the definitions lack descriptions")]
            #[allow(clippy::module_inception, reason = "a set may contain a service of the same \
                name")]
            pub mod $set {
                include!(concat!(env!("OUT_DIR"), "/", stringify!($set), ".rs"));
            }
        )*

        static SETS: &[ServiceSet] = &[
            $(
                $(#[cfg(feature = $feature)])?
                ServiceSet { services: $set::SERVICES, messages: $set::MESSAGES },
            )*
        ];
    };
}

sets! {
    /// The core set (AS5710): what every component speaks.
    core;
    /// The mobility set (AS6009): sensing and commanding how a platform moves.
    mobility if "mobility";
    /// The environment sensing set (AS6060): cameras, microphones, range and force sensors.
    environment_sensing if "every-set";
    /// The manipulator set (AS6057): arms, pan-tilts and what they hold.
    manipulator if "every-set";
    /// The unmanned ground vehicle set (AS6091): drive train, lights, power, stabilisers.
    ugv if "every-set";
    /// The human-machine interface set (AS6040): pointing devices, keys, drawing.
    hmi if "every-set";
    /// The mission spooling set (AS6062): missions that are kept and worked off.
    mission_spooler if "every-set";
    /// The interoperability profiles' set: cost maps, handoff, platform mode and state, CBRN
    /// sensors.
    iop if "every-set";
}

/// All services and messages of the service sets that are switched on.
pub const fn registry() -> Registry {
    Registry::new(SETS)
}
