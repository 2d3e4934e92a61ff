//! A node stack for SAE JAUS.
#![forbid(unsafe_code)]
#[cfg(feature = "view")]
pub mod view;
