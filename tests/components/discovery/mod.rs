//! Discovery between components in virtual time: who finds whom, when, and with how many packets.

mod answers;
mod finding;
mod profiles;
mod rubbish;
mod traffic;
mod world;
