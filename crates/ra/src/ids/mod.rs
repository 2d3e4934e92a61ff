//! Who is who across the two networks: [`IdTable`].
//!
//! An RA id has four octets (subsystem, node, component type, instance), ours has a 16-bit
//! subsystem, node and component. Without any settings
//!
//! * RA component `s.n.c.i` is seen by ours as `s.n.(c + 64·(i-1))`, for types 1 to 63 and instances
//!   1 to 3: the second primitive driver `20.1.33.2` is `20.1.97`. Others need an entry.
//! * our component `s.n.c` is seen by RA systems once for each type `T` whose services it offers, as
//!   `s.n.T.c`: the instance is our component number. Subsystems above 254 need an offset or an
//!   entry.
//!
//! Offsets and entries come from [`Settings`]. An id's counterpart follows from the settings alone:
//! it is the same in every run, and whoever appears first. What depends on who is there is only
//! whether two subsystems meet in one number; [`IdTable::claim`] tells.

mod component;
mod error;
mod settings;
mod subsystems;
mod table;

#[cfg(test)]
mod tests;

pub use self::component::RaComponent;
pub use self::error::{Collision, InvalidIds, Side, Unmapped};
pub use self::settings::{ComponentEntry, Settings, SubsystemEntry};
pub use self::table::IdTable;
use super::RaId;
