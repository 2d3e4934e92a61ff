//! What can be changed in a world, and what may come of it.

use bytes::Bytes;

use super::object::{Object, ObjectId};
use super::raster::{MapId, Raster, Window};
use super::selection::Selection;

/// A change that somebody wants.
#[derive(Debug, Clone, PartialEq)]
pub enum Change {
    /// To add objects; each one that is not sound or does not fit is left out.
    AddObjects(Vec<Object>),
    /// To remove the objects that are meant.
    RemoveObjects(Selection),
    /// To change what is known about a feature class.
    DescribeClass(u16, Describe),
    /// To add a map with its cells, row by row from the south; without cells, all have its fill. Its
    /// revision becomes 1.
    AddRaster(Raster, Bytes),
    /// To set the cells of a window, row by row from the south.
    SetCells(MapId, Window, Bytes),
    /// To remove a map.
    RemoveRaster(MapId),
}

/// How to change what is known about a feature class.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Describe {
    /// Put this behind it.
    Append(String),
    /// Put this before it.
    Prepend(String),
    /// Put this in its place.
    Overwrite(String),
    /// Forget it.
    Erase,
}

/// What has come of a change. It is on the disk.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Done {
    /// The numbers of the new objects in the order in which they came; `None` for what was left out.
    Added(Vec<Option<ObjectId>>),
    /// How many objects were removed.
    Removed(usize),
    /// The class has another description now.
    Described,
    /// The map was added, changed or removed, and has or had this revision.
    Raster(MapId, u32),
}

/// Why a change was not made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Refusal {
    /// There is no such map.
    #[error("there is no {0}")]
    NoSuchMap(MapId),
    /// It can not be, or cells and window do not agree: what is wrong and what would do.
    #[error("{0}")]
    Size(String),
    /// The window is not on the map.
    #[error("{window} are not all on the map, which has {rows} x {columns}")]
    Outside {
        /// What was to be changed.
        window: Window,
        /// Of the map.
        rows: u16,
        /// Of the map.
        columns: u16,
    },
    /// There is no room.
    #[error("the store is full: {0}")]
    Full(&'static str),
    /// The region has no points or too many, or its buffer is no distance.
    #[error("the region can not be looked for")]
    Region,
}
