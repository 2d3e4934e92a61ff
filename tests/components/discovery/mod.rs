//! Discovery between components in virtual time: results, timing and packet counts.

mod answers;
mod finding;
mod profiles;
mod rubbish;
mod traffic;
mod world;
