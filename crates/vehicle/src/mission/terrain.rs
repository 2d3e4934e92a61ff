//! The map that is planned on: a raster that says how well the ground of each cell can be driven on.

/// How well each cell of a rectangle of the local frame can be driven on.
///
/// Rows grow with X, columns with Y; the first cell is the one in the south-west. A cell is 0 where
/// nothing can drive, and 255 where nothing is in the way.
#[derive(Clone, PartialEq)]
pub struct Terrain {
    rows: u16,
    columns: u16,
    cell: f64,
    corner: (f64, f64),
    cells: Vec<u8>,
}

/// Why a raster is no map to plan on.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TerrainError {
    /// It has no cells, or too many.
    #[error(
        "a map of {rows} x {columns} cells can not be planned on; from 1 to {} rows and columns can",
        Terrain::MAX_SIDE
    )]
    Size {
        /// Its rows.
        rows: u16,
        /// Its columns.
        columns: u16,
    },
    /// The cells do not fill it.
    #[error("the map has {found} cells instead of {rows} x {columns}; ask for it once more")]
    Cells {
        /// Its rows.
        rows: u16,
        /// Its columns.
        columns: u16,
        /// How many cells there are.
        found: usize,
    },
    /// Its cells have no size, or it lies nowhere.
    #[error(
        "the map's cells are {cell} m wide and it begins at x {x} m, y {y} m, which is no place; \
         create it with cells from 0.001 to 1000 m"
    )]
    Place {
        /// Metres.
        cell: f64,
        /// Metres.
        x: f64,
        /// Metres.
        y: f64,
    },
}

impl Terrain {
    /// The most rows, and the most columns.
    pub const MAX_SIDE: u16 = 4096;

    /// A map of `rows` times `columns` cells, each `cell` metres wide, whose south-west corner lies
    /// at `corner` in the local frame.
    ///
    /// # Errors
    /// If there are too few or too many cells, or they lie nowhere.
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
        })
    }

    /// How many rows there are.
    #[must_use]
    pub const fn rows(&self) -> u16 {
        self.rows
    }

    /// How many columns there are.
    #[must_use]
    pub const fn columns(&self) -> u16 {
        self.columns
    }

    /// How wide a cell is, in metres.
    #[must_use]
    pub const fn cell(&self) -> f64 {
        self.cell
    }

    /// The cells, row by row from the south-west.
    #[must_use]
    pub fn cells(&self) -> &[u8] {
        &self.cells
    }

    /// The south-west and the north-east corner: X and Y in metres.
    #[must_use]
    pub fn corners(&self) -> [(f64, f64); 2] {
        let (x, y) = self.corner;
        let north = x + f64::from(self.rows) * self.cell;
        let east = y + f64::from(self.columns) * self.cell;
        [self.corner, (north, east)]
    }

    /// A point of the local frame, counted in rows and columns; `None` outside of the map.
    pub(super) fn to_grid(&self, (x, y): (f64, f64)) -> Option<(f64, f64)> {
        let row = (x - self.corner.0) / self.cell;
        let column = (y - self.corner.1) / self.cell;
        let inside = |at: f64, side: u16| at >= 0.0 && at < f64::from(side);
        (inside(row, self.rows) && inside(column, self.columns)).then_some((row, column))
    }

    /// A point counted in rows and columns, in the local frame.
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
