//! A node stack for SAE JAUS.
#![forbid(unsafe_code)]

pub mod address;
pub mod codec;
#[cfg(feature = "node")]
pub mod component;
pub mod endpoint;
#[cfg(feature = "node")]
pub mod link;
pub mod messages;
#[cfg(feature = "node")]
pub mod node;
pub mod service;
#[cfg(feature = "view")]
pub mod view;
pub mod wire;
