//! The messages of the service sets, generated from their definitions.
//!
//! One module per set, each but the core set behind the feature of its name. The types inside a
//! message are in a module of the message's name, for example `core::report_services::NodeSeq`.

use crate::codec::{MessageInfo, Registry, ServiceInfo};

#[cfg(feature = "ra33")]
pub mod ra;

/// The modules of the sets.
macro_rules! modules {
    ($($(#[$doc:meta])* $set:ident $(if $feature:literal)?;)*) => {
        $(
            $(#[$doc])*
            $(#[cfg(feature = $feature)])?
            #[allow(missing_docs, reason = "what the definitions do not describe")]
            #[allow(clippy::module_inception, reason = "a set may have a service of its name")]
            pub mod $set {
                include!(concat!(env!("OUT_DIR"), "/", stringify!($set), ".rs"));
            }
        )*
    };
}

/// The modules of the sets, and the tables of those that are switched on.
macro_rules! sets {
    ($($(#[$doc:meta])* $set:ident $(if $feature:literal)?;)*) => {
        modules! { $($(#[$doc])* $set $(if $feature)?;)* }

        static MESSAGES: &[&[MessageInfo]] = &[
            $($(#[cfg(feature = $feature)])? $set::MESSAGES,)*
        ];

        static SERVICES: &[&[ServiceInfo]] = &[
            $($(#[cfg(feature = $feature)])? $set::SERVICES,)*
        ];
    };
}

sets! {
    /// The core set (AS5710): what every component speaks.
    core;
    /// The mobility set (AS6009): sensing and commanding how a platform moves.
    mobility if "mobility";
    /// The environment sensing set (AS6060): cameras, microphones, range and force sensors.
    environment_sensing if "environment-sensing";
    /// The manipulator set (AS6057): arms, pan-tilts and what they hold.
    manipulator if "manipulator";
    /// The unmanned ground vehicle set (AS6091): drive train, lights, power, stabilisers.
    ugv if "ugv";
    /// The human-machine interface set (AS6040): pointing devices, keys, drawing.
    hmi if "hmi";
    /// The mission spooling set (AS6062): missions that are kept and worked off.
    mission_spooler if "mission-spooler";
    /// The interoperability profiles' set: cost maps, handoff, platform mode and state, CBRN
    /// sensors.
    iop if "iop";
    /// Our own set for a ground vehicle: world model, mission, stages, odometry.
    ground if "ground";
}

modules! {
    /// The Reference Architecture 3.3, which came before the standards by SAE.
    ///
    /// Its command codes are those of other layouts in the sets above, so it has a registry of its
    /// own: [`ra_registry`]. A command code is in the header there; here it stands before the data,
    /// as in a [`Frame`](crate::wire::Frame).
    ra33 if "ra33";
}

/// All messages of the service sets that are switched on.
pub const fn registry() -> Registry {
    Registry::new(MESSAGES)
}

/// All services of the service sets that are switched on.
pub fn services() -> impl Iterator<Item = &'static ServiceInfo> {
    SERVICES.iter().copied().flatten()
}

/// All messages of the Reference Architecture.
#[cfg(feature = "ra33")]
pub const fn ra_registry() -> Registry {
    static MESSAGES: &[&[MessageInfo]] = &[ra33::MESSAGES];
    Registry::new(MESSAGES)
}

/// All services of the Reference Architecture.
#[cfg(feature = "ra33")]
pub fn ra_services() -> impl Iterator<Item = &'static ServiceInfo> {
    ra33::SERVICES.iter()
}
