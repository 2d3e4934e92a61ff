//! A node stack for SAE JAUS.
#![forbid(unsafe_code)]

pub mod address;
pub mod codec;
pub mod endpoint;
#[cfg(feature = "node")]
pub mod link;
pub mod messages;
#[cfg(feature = "node")]
pub mod node;
#[cfg(feature = "view")]
pub mod view;
pub mod wire;
