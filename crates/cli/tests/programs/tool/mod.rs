//! The tool `jaus`, run as a process.

mod captures;
mod control;
mod damage;
mod doctor;
#[cfg(target_os = "linux")]
mod drive;
mod escaping;
mod events;
mod examine;
mod golden;
mod interoperability;
mod jsidl;
mod jsidl_explain;
mod jsidl_make;
mod judge;
mod keys;
mod list;
mod manual;
mod monitor;
mod network;
mod ping;
mod record;
mod secrets;
mod send;
mod subscribe;
mod texts;
mod users;
mod vehicle;
mod viewers;
mod watch;
