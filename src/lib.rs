//! A node stack for SAE JAUS.
#![forbid(unsafe_code)]

#[cfg(feature = "node")]
pub mod link;
#[cfg(feature = "view")]
pub mod view;
