//! Recorded exchanges with other stacks, with components of ours in the place of one party.

mod asked;
mod challenged;
mod drivable;
mod jauspp;
mod judge_discovery;
mod junior;
mod recognised;
mod recorded;
mod stand_in;
mod tcp;
