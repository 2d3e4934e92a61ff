//! Square tiles in which map cells are stored. A change writes little beyond the changed cells, and
//! cells that were never set take no space.

use super::raster::Window;

/// Number of rows and columns of a tile.
pub(super) const SIDE: u16 = 32;
/// Number of cells of a tile.
pub(super) const CELLS: usize = SIDE as usize * SIDE as usize;

/// Row and column of a tile within its map.
pub(super) type TileId = (u16, u16);

/// The intersection of a window and a tile, row by row.
pub(super) struct Overlap {
    /// The tile.
    pub(super) tile: TileId,
    window: Window,
    common: Window,
}

/// All tiles that a window touches, in storage order.
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

    /// Copies the common cells from the window to the tile.
    pub(super) fn put(&self, cells: &[u8], tile: &mut [u8]) {
        for (in_tile, in_window) in self.runs() {
            tile[in_tile].copy_from_slice(&cells[in_window]);
        }
    }

    /// Copies the common cells from the tile to the window.
    pub(super) fn take(&self, tile: &[u8], cells: &mut [u8]) {
        for (in_tile, in_window) in self.runs() {
            cells[in_window].copy_from_slice(&tile[in_tile]);
        }
    }

    /// The index ranges of the common cells of each row, in the tile and in the window.
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
