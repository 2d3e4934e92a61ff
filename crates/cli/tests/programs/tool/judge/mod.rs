//! `jaus judge` against correct, faulty, slow and silent peers.

mod examples;
mod hazard;
mod outputs;
pub(super) mod peer;
mod replay;
mod right;
mod safety;
mod vehicle;
mod wrong;
