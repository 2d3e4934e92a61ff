//! Maps are kept in square tiles, so that a change writes what it changes and little else, and cells
//! that nobody has set take no room.

use super::raster::Window;

/// Cells in a row of a tile, and rows in it.
pub(super) const SIDE: u16 = 32;
/// Cells of a tile.
pub(super) const CELLS: usize = SIDE as usize * SIDE as usize;

/// A tile's row and column among the tiles of a map.
pub(super) type TileId = (u16, u16);

/// What a window and a tile have in common, row by row.
pub(super) struct Overlap {
    /// Which tile.
    pub(super) tile: TileId,
    window: Window,
    common: Window,
}

/// All tiles that a window touches, in the order in which they are kept.
pub(super) fn overlaps(window: Window) -> impl Iterator<Item = Overlap> {
    let tiles = |first: u16, count: u16| {
        let last = first + count.saturating_sub(1);
        first / SIDE..=last / SIDE
    };
    let columns = tiles(window.column, window.columns);
    let rows = tiles(window.row, window.rows);
    rows.flat_map(move |row| columns.clone().map(move |column| (row, column)))
        .map(move |tile| Overlap::new(tile, window))
}

impl Overlap {
    fn new(tile: TileId, window: Window) -> Self {
        let span = |tile: u16, first: u16, count: u16| {
            let begin = first.max(tile * SIDE);
            let end = (first + count).min((tile + 1) * SIDE);
            (begin, end - begin)
        };
        let (row, rows) = span(tile.0, window.row, window.rows);
        let (column, columns) = span(tile.1, window.column, window.columns);
        let common = Window {
            row,
            column,
            rows,
            columns,
        };
        Self {
            tile,
            window,
            common,
        }
    }

    /// Copies the common cells from the window's into the tile's.
    pub(super) fn put(&self, cells: &[u8], tile: &mut [u8]) {
        for (in_tile, in_window) in self.runs() {
            tile[in_tile].copy_from_slice(&cells[in_window]);
        }
    }

    /// Copies the common cells from the tile's into the window's.
    pub(super) fn take(&self, tile: &[u8], cells: &mut [u8]) {
        for (in_tile, in_window) in self.runs() {
            cells[in_window].copy_from_slice(&tile[in_tile]);
        }
    }

    /// The common cells of each row: where they are in the tile, and where in the window.
    fn runs(&self) -> impl Iterator<Item = (std::ops::Range<usize>, std::ops::Range<usize>)> {
        let (common, window) = (self.common, self.window);
        let length = usize::from(common.columns);
        (common.row..common.row + common.rows).map(move |row| {
            let in_tile =
                usize::from(row % SIDE) * usize::from(SIDE) + usize::from(common.column % SIDE);
            let in_window = usize::from(row - window.row) * usize::from(window.columns)
                + usize::from(common.column - window.column);
            (in_tile..in_tile + length, in_window..in_window + length)
        })
    }
}
