//! Recorded exchanges with other stacks, with our components in place of one party.

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
