//! What the programs of this project share: flags, settings files, output, exit statuses, and the
//! [`launch`] of a ready component. For programs of your own it is a convenience, and changes as
//! ours need it.
#![forbid(unsafe_code)]
#![warn(
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "they panic when the reader has gone; see `output`"
)]

pub mod failure;
mod identity;
pub mod junit;
mod launch;
pub mod logging;
pub mod network;
pub mod output;
pub mod runtime;
pub mod settings;
pub mod statistics;
mod systemd;

pub use failure::{Failure, Outcome};
pub use launch::{Ready, launch};

pub use jaus_view::tree;
