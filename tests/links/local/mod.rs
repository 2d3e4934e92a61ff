//! Components of other processes on a host's node: attachment, and failures on either side. Each
//! test has its own directory for sockets; no network is needed.
#![cfg(unix)]

mod attaching;
mod listener;
mod place;
mod processes;
mod raw;
mod records;
