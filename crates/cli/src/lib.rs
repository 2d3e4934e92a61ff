//! Shared parts of the project's programs: flags, settings files, output, exit statuses, and the
//! [`launch`] of a ready component. Other programs may use it for convenience, but it changes with
//! the needs of ours.
#![forbid(unsafe_code)]
#![warn(
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "they panic when the reader is gone; see `output`"
)]

pub mod audit;
pub mod exposure;
pub mod failure;
mod fence;
pub mod folders;
#[cfg(feature = "https")]
pub mod https;
mod identity;
mod launch;
pub mod log_level;
pub mod logging;
pub mod metrics;
pub mod network;
pub mod output;
pub mod permissions;
pub mod reference;
pub mod runtime;
#[cfg(feature = "secure")]
pub mod secure;
pub mod settings;
pub mod statistics;
mod systemd;

pub use failure::{Failure, Outcome};
pub use fence::FenceFlags;
pub use launch::{Ready, launch};

pub use jaus_view::tree;
