//! A node stack for SAE JAUS.
#![forbid(unsafe_code)]

pub mod address;
pub mod endpoint;
#[cfg(feature = "node")]
pub mod link;
#[cfg(feature = "node")]
pub mod node;
#[cfg(feature = "view")]
pub mod view;
pub mod wire;
