//! The messages of the Reference Architecture, generated from their definitions.
//!
//! A command code is in the header there; here it stands before the data, as in a
//! [`Frame`](jaus::wire::Frame). Some codes are those of other layouts in the SAE sets, so these
//! messages have their own registry.

use jaus::codec::{Registry, ServiceSet};

/// Version 3.3, which OpenJAUS 3.3 speaks.
#[allow(missing_docs, reason = "the definitions lack descriptions")]
pub mod ra33 {
    include!(concat!(env!("OUT_DIR"), "/ra33.rs"));
}

/// All services and messages of the Reference Architecture.
#[must_use]
pub const fn registry() -> Registry {
    static RA33: &[ServiceSet] = &[ServiceSet {
        services: ra33::SERVICES,
        messages: ra33::MESSAGES,
    }];
    Registry::new(RA33)
}
