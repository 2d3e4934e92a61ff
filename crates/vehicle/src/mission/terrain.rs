//! The planning map: a raster with the traversability of each cell, less the cells that zones bar and
//! those with obstacles.

use std::sync::Arc;

use super::barred;
use crate::zones::{Point, Zones};

/// Traversability of the cells of a rectangle in the local frame.
///
/// Rows grow with X, columns with Y; the first cell is at the south-west corner. 0 means not
/// traversable, 255 means unobstructed.
#[derive(Clone, PartialEq)]
pub struct Terrain {
    rows: u16,
    columns: u16,
    cell: f64,
    corner: (f64, f64),
    cells: Vec<u8>,
    /// Whether zones or obstacles touch each cell; empty without either.
    barred: Vec<bool>,
    zones: Arc<Zones>,
    obstacles: Vec<Point>,
}

/// Error: a raster is unsuitable for planning.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TerrainError {
    /// The map has no cells, or too many.
    #[error(
        "cannot plan on a map of {rows} x {columns} cells: give it from 1 to {} rows and columns",
        Terrain::MAX_SIDE
    )]
    Size {
        /// Number of rows.
        rows: u16,
        /// Number of columns.
        columns: u16,
    },
    /// The number of cells does not match the dimensions.
    #[error("the map has {found} cells instead of {rows} x {columns}; query it again")]
    Cells {
        /// Number of rows.
        rows: u16,
        /// Number of columns.
        columns: u16,
        /// Number of cells.
        found: usize,
    },
    /// The cell size or the position is invalid.
    #[error(
        "the map has invalid geometry: cells of {cell} m, origin at x {x} m, y {y} m; create it \
         with cells from 0.001 to 1000 m"
    )]
    Place {
        /// Cell size in metres.
        cell: f64,
        /// X of the corner in metres.
        x: f64,
        /// Y of the corner in metres.
        y: f64,
    },
}

impl Terrain {
    /// The most rows and the most columns.
    pub const MAX_SIDE: u16 = 4096;

    /// Creates a map of `rows` x `columns` cells, each `cell` metres wide, with its south-west
    /// corner at `corner` in the local frame.
    ///
    /// # Errors
    /// If the dimensions, the number of cells, the cell size or the position is invalid.
    pub fn new(
        rows: u16,
        columns: u16,
        cell: f64,
        corner: (f64, f64),
        cells: Vec<u8>,
    ) -> Result<Self, TerrainError> {
        let sides = 1..=Self::MAX_SIDE;
        if !sides.contains(&rows) || !sides.contains(&columns) {
            return Err(TerrainError::Size { rows, columns });
        }
        let (x, y) = corner;
        if !(0.001..=1000.0).contains(&cell) || !x.is_finite() || !y.is_finite() {
            return Err(TerrainError::Place { cell, x, y });
        }
        if cells.len() != usize::from(rows) * usize::from(columns) {
            let found = cells.len();
            return Err(TerrainError::Cells {
                rows,
                columns,
                found,
            });
        }
        Ok(Self {
            rows,
            columns,
            cell,
            corner,
            cells,
            barred: Vec::new(),
            zones: Arc::default(),
            obstacles: Vec::new(),
        })
    }

    /// The same map, on which no path leads through a keep-out zone or out of the operating zone.
    #[must_use]
    pub fn within(mut self, zones: Arc<Zones>) -> Self {
        self.barred = barred::cells(&self, &zones);
        self.zones = zones;
        self
    }

    /// The same map with obstacles that a range sensor has seen, as points of the local frame, for a
    /// vehicle with this clearance in metres.
    #[must_use]
    pub fn with_obstacles(mut self, obstacles: Vec<Point>, clearance: f64) -> Self {
        if obstacles.is_empty() {
            return self;
        }
        self.barred.resize(self.cells.len(), false);
        // Planning keeps the clearance from closed cells, unless a cell is wider than the vehicle.
        let reach = if clearance > self.cell / 2.0 {
            0.0
        } else {
            clearance
        };
        for &(x, y) in &obstacles {
            for (north, east) in [
                (-reach, -reach),
                (-reach, reach),
                (reach, -reach),
                (reach, reach),
            ] {
                if let Some((row, column)) = self.to_grid((x + north, y + east)) {
                    let cell = row as usize * usize::from(self.columns) + column as usize;
                    self.barred[cell] = true;
                }
            }
        }
        self.obstacles = obstacles;
        self
    }

    /// Whether anything but the map itself closes cells.
    pub(super) fn is_restricted(&self) -> bool {
        !self.barred.is_empty()
    }

    /// The zones that bar cells of this map.
    pub(super) fn zones(&self) -> &Zones {
        &self.zones
    }

    /// The traversability of the cells, 0 for those that zones touch.
    pub(super) fn open_cells(&self) -> Vec<u8> {
        let mut cells = self.cells.clone();
        for (cell, _) in cells
            .iter_mut()
            .zip(&self.barred)
            .filter(|(_, barred)| **barred)
        {
            *cell = 0;
        }
        cells
    }

    /// Whether the vehicle's centre may be at a point, in rows and columns, whatever its clearance.
    pub(super) fn admits(&self, at: (f64, f64)) -> bool {
        let point = self.to_local(at);
        let clearance = self.zones.clearance(point);
        let is_free = |it: &Point| (it.0 - point.0).hypot(it.1 - point.1) > self.cell;
        clearance.is_none_or(|it| it.metres >= 0.0) && self.obstacles.iter().all(is_free)
    }

    /// Number of rows.
    #[must_use]
    pub const fn rows(&self) -> u16 {
        self.rows
    }

    /// Number of columns.
    #[must_use]
    pub const fn columns(&self) -> u16 {
        self.columns
    }

    /// Cell size in metres.
    #[must_use]
    pub const fn cell(&self) -> f64 {
        self.cell
    }

    /// The cells, row by row from the south-west.
    #[must_use]
    pub fn cells(&self) -> &[u8] {
        &self.cells
    }

    /// The south-west and the north-east corner, as X and Y in metres.
    #[must_use]
    pub fn corners(&self) -> [(f64, f64); 2] {
        let (x, y) = self.corner;
        let north = x + f64::from(self.rows) * self.cell;
        let east = y + f64::from(self.columns) * self.cell;
        [self.corner, (north, east)]
    }

    /// Converts a point of the local frame to rows and columns; `None` outside the map.
    pub(super) fn to_grid(&self, (x, y): (f64, f64)) -> Option<(f64, f64)> {
        let row = (x - self.corner.0) / self.cell;
        let column = (y - self.corner.1) / self.cell;
        let inside = |at: f64, side: u16| at >= 0.0 && at < f64::from(side);
        (inside(row, self.rows) && inside(column, self.columns)).then_some((row, column))
    }

    /// Converts rows and columns to a point of the local frame.
    pub(super) fn to_local(&self, (row, column): (f64, f64)) -> (f64, f64) {
        let (x, y) = self.corner;
        (x + row * self.cell, y + column * self.cell)
    }
}

impl std::fmt::Debug for Terrain {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Terrain")
            .field("rows", &self.rows)
            .field("columns", &self.columns)
            .field("cell", &self.cell)
            .field("corner", &self.corner)
            .finish_non_exhaustive()
    }
}
