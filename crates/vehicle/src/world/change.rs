//! Changes to a world, and their results.

use bytes::Bytes;

use super::object::{Object, ObjectId};
use super::raster::{MapId, Raster, Window};
use super::selection::Selection;
use super::zone::Outline;
use crate::zones::ZoneId;

/// A requested change.
#[derive(Debug, Clone, PartialEq)]
pub enum Change {
    /// Add objects. Each one that is invalid or does not fit is skipped.
    AddObjects(Vec<Object>),
    /// Remove the selected objects.
    RemoveObjects(Selection),
    /// Change the description of a feature class.
    DescribeClass(u16, Describe),
    /// Add a map with its cells, row by row from the south. Without cells, all have the fill value.
    /// Its revision becomes 1.
    AddRaster(Raster, Bytes),
    /// Set the cells of a window, row by row from the south.
    SetCells(MapId, Window, Bytes),
    /// Remove a map.
    RemoveRaster(MapId),
    /// Add or replace zones; all or none. Their outlines must be valid.
    SetZones(Vec<Outline>),
    /// Remove zones. Those that do not exist do not matter.
    RemoveZones(Vec<ZoneId>),
}

/// How to change the description of a feature class.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Describe {
    /// Append a text.
    Append(String),
    /// Prepend a text.
    Prepend(String),
    /// Replace the description.
    Overwrite(String),
    /// Delete the description.
    Erase,
}

/// Result of a change that is on disk.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Done {
    /// The numbers of the new objects in request order; `None` for skipped ones.
    Added(Vec<Option<ObjectId>>),
    /// Number of objects removed.
    Removed(usize),
    /// The description of the class has changed.
    Described,
    /// A map was added, changed or removed, with its current or last revision.
    Raster(MapId, u32),
    /// The zones have changed.
    Zones,
}

/// Why a change was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Refusal {
    /// The map does not exist.
    #[error("there is no {0}")]
    NoSuchMap(MapId),
    /// The dimensions are invalid, or cells and window do not match. The text includes a remedy.
    #[error("{0}")]
    Size(String),
    /// The window extends beyond the map.
    #[error("{window} extend beyond the map, which has {rows} x {columns}")]
    Outside {
        /// The requested window.
        window: Window,
        /// Number of rows of the map.
        rows: u16,
        /// Number of columns of the map.
        columns: u16,
    },
    /// The store is full.
    #[error("the store is full: {0}")]
    Full(&'static str),
    /// The region has no points or too many, or its buffer is invalid.
    #[error("the store cannot search for this region")]
    Region,
}
