//! What is known about the surroundings: objects on the globe, and maps of equal cells, kept in a file
//! that survives power cuts.
//!
//! A [`World`] is opened from a file and changed by [`Change`]s, several at a time if several wait. A
//! change is on the disk when [`World::apply`] returns; if the power fails before that, it has not
//! happened. Nothing here knows of messages or of time.
//!
//! | room | what it knows |
//! |---|---|
//! | `object` | points, lines and polygons, and what they are |
//! | `shape` | whether two of them meet |
//! | `selection` | which objects somebody means |
//! | `collection` | all objects, with an index over space |
//! | `raster` | maps of cells, their windows and tiles |
//! | `traversability` | the cells of a map as objects |
//! | `import` | maps from pictures and text |
//! | `file` | what is on the disk and how |

mod change;
mod collection;
mod file;
mod import;
mod model;
mod object;
mod raster;
mod record;
mod selection;
mod shape;
#[cfg(test)]
mod tests;
mod tiles;
mod traversability;

pub use change::{Change, Describe, Done, Refusal};
pub use collection::Collection;
pub use file::{KeepError, OpenError};
pub use import::{ImportError, Picture};
pub use model::World;
pub use object::{Attribute, FeatureClass, Geometry, Object, ObjectId, Place};
pub use raster::{MapId, Raster, Window};
pub use selection::{Region, Selection};
pub use traversability::as_objects;

/// For tests and for other places to keep a world in than a file.
pub use redb::StorageBackend;
