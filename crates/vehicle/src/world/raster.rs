//! Raster maps and windows of their cells.

use std::fmt;

/// The number of a map in the store, starting at 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct MapId(pub u16);

impl fmt::Display for MapId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "map {}", self.0)
    }
}

/// A rectangle of the local frame divided into equal square cells of one octet each: 0 is
/// impassable, 255 free.
///
/// Rows grow with X, to the north; columns with Y, to the east.
#[derive(Debug, Clone, PartialEq)]
pub struct Raster {
    /// Name, at most 255 octets.
    pub name: String,
    /// Number of rows from south to north, 1 to [`MOST_SIDE`](Self::MOST_SIDE).
    pub rows: u16,
    /// Number of columns from west to east, 1 to [`MOST_SIDE`](Self::MOST_SIDE).
    pub columns: u16,
    /// Side of a cell in metres, 0.001 to 1000.
    pub cell: f32,
    /// X of the south-west corner in metres.
    pub x: f64,
    /// Y of the south-west corner in metres.
    pub y: f64,
    /// Value of cells that were never set.
    pub fill: u8,
    /// Number of the current revision, starting at 1.
    pub revision: u32,
}

impl Raster {
    /// Maximum number of rows and of columns.
    pub const MOST_SIDE: u16 = 4096;
    /// Maximum length of a name in octets.
    pub const MOST_NAME: usize = 255;

    /// Number of cells.
    #[must_use]
    pub fn cells(&self) -> usize {
        usize::from(self.rows) * usize::from(self.columns)
    }

    /// The window that covers the whole map.
    #[must_use]
    pub const fn whole(&self) -> Window {
        Window {
            row: 0,
            column: 0,
            rows: self.rows,
            columns: self.columns,
        }
    }

    /// Describes what is invalid, if anything.
    pub(super) fn fault(&self) -> Option<String> {
        let side = 1..=Self::MOST_SIDE;
        if !side.contains(&self.rows) || !side.contains(&self.columns) {
            return Some(format!(
                "cannot store a map of {} x {} cells: use 1 to {} rows and columns",
                self.rows,
                self.columns,
                Self::MOST_SIDE
            ));
        }
        if !(0.001..=1000.0).contains(&self.cell) {
            return Some(format!(
                "cannot store cells of {} m: use 0.001 to 1000 m",
                self.cell
            ));
        }
        if !self.x.is_finite() || !self.y.is_finite() {
            return Some(format!(
                "x {} m, y {} m is not a position in the local frame",
                self.x, self.y
            ));
        }
        (self.name.len() > Self::MOST_NAME).then(|| "the name is longer than 255 octets".to_owned())
    }

    /// Resolves a window, where 0 rows or columns mean all that follow. `None` if it extends beyond
    /// the map.
    #[must_use]
    pub fn window(&self, asked: Window) -> Option<Window> {
        let span = |first: u16, count: u16, all: u16| match count {
            0 => all.checked_sub(first).filter(|&rest| rest > 0),
            _ => (u32::from(first) + u32::from(count) <= u32::from(all)).then_some(count),
        };
        Some(Window {
            rows: span(asked.row, asked.rows, self.rows)?,
            columns: span(asked.column, asked.columns, self.columns)?,
            ..asked
        })
    }
}

/// A rectangle of cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Window {
    /// The southernmost row.
    pub row: u16,
    /// The westernmost column.
    pub column: u16,
    /// Number of rows.
    pub rows: u16,
    /// Number of columns.
    pub columns: u16,
}

impl Window {
    /// Number of cells.
    #[must_use]
    pub fn cells(&self) -> usize {
        usize::from(self.rows) * usize::from(self.columns)
    }
}

impl fmt::Display for Window {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (rows, columns) = (self.rows, self.columns);
        let (row, column) = (self.row, self.column);
        write!(
            f,
            "{rows} x {columns} cells from row {row}, column {column}"
        )
    }
}
