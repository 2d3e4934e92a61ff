//! Id mapping between RA systems and JAUS: [`IdTable`].
//!
//! An RA id has four octets (subsystem, node, component type, instance), ours has a 16-bit
//! subsystem, node and component. By default
//!
//! * RA component `s.n.c.i` has the JAUS id `s.n.(c + 64·(i-1))`, for types 1 to 63 and instances 1
//!   to 3: the second primitive driver `20.1.33.2` is `20.1.97`. Others need an entry.
//! * our component `s.n.c` has one RA id for each type `T` whose services it offers, `s.n.T.c`: the
//!   instance is our component number. Subsystems above 254 need an offset or an entry.
//!
//! Offsets and entries come from [`Settings`]. The mapping depends on the settings alone, not on
//! the order in which components appear. Only collisions of subsystem numbers depend on the systems
//! present; [`IdTable::claim`] detects them.

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
