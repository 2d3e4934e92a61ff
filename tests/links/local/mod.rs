//! Components of other processes on a host's node: attaching, and everything that can happen to
//! either side. Sockets lie in a directory of each test's own; no network is needed.
#![cfg(unix)]

mod attaching;
mod listener;
mod place;
mod processes;
mod raw;
mod records;
