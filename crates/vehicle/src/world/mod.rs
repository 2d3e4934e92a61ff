//! World model: objects on the globe, raster maps and operating zones, stored in a file that survives power cuts.
//!
//! A [`World`] is opened from a file and changed by [`Change`]s, several at a time if several wait.
//! A change is on disk when [`World::apply`] returns. If the power fails before that, the change
//! has no effect. Nothing here handles messages or time.
//!
//! | module | contents |
//! |---|---|
//! | `object` | points, lines and polygons, and their feature classes |
//! | `shape` | whether two shapes meet |
//! | `selection` | conditions that select objects |
//! | `collection` | all objects, with a spatial index |
//! | `raster` | maps of cells, their windows and tiles |
//! | `traversability` | the cells of a map as objects |
//! | `zone` | outlines of operating zones and keep-out zones |
//! | `import` | maps from images and text |
//! | `file` | the file and its format |

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
mod zone;

pub use change::{Change, Describe, Done, Refusal};
pub use collection::Collection;
pub use file::{KeepError, OpenError};
pub use import::{ImportError, Picture};
pub use model::World;
pub use object::{Attribute, FeatureClass, Geometry, Object, ObjectId, Place};
pub use raster::{MapId, Raster, Window};
pub use selection::{Region, Selection};
pub use traversability::as_objects;
pub use zone::{Outline, OutlineError};

/// For tests, and for stores on other backends than a file.
pub use redb::StorageBackend;
