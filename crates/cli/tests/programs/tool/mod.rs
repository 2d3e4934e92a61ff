//! The tool `jaus`, run as a process.

mod captures;
mod damage;
mod doctor;
mod doctor_peer;
mod golden;
mod interoperability;
mod jsidl;
mod jsidl_explain;
mod jsidl_make;
mod judge;
mod monitor;
mod network;
mod ping;
mod record;
mod send;
mod subscribe;
mod vehicle;
mod watch;
