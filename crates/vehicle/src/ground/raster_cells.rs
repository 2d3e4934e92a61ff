//! The client's side of Raster Maps: fetches the cells of a map in blocks of rows.

use crate::messages::ground::QueryRasterCells;
use jaus::address::JausId;
use jaus::component::{Component, QueryError};

/// Cells per request: a store answers this many well within the timeout of a query.
const BLOCK: usize = 1 << 16;

/// A revision of a map in a knowledge store, and its size.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RasterEdition {
    /// The map's number in its store.
    pub map: u16,
    /// Its revision, raised by every change.
    pub revision: u32,
    /// Number of cells along X.
    pub rows: u16,
    /// Number of cells along Y.
    pub columns: u16,
}

/// Fetches all cells of a map, row by row from the south. `None` if the map changes meanwhile.
///
/// # Errors
/// If a query is not answered.
pub async fn fetch_cells(
    component: &Component,
    store: JausId,
    edition: RasterEdition,
) -> Result<Option<Vec<u8>>, QueryError> {
    let RasterEdition { map, columns, .. } = edition;
    let width = usize::from(columns);
    let step = u16::try_from((BLOCK / width.max(1)).max(1)).unwrap_or(u16::MAX);
    let mut cells = Vec::new();
    let mut row = 0;
    while row < edition.rows {
        let query = QueryRasterCells {
            map,
            row,
            column: 0,
            maximum_rows: step.min(edition.rows - row),
            maximum_columns: columns,
        };
        let block = component.query(store, &query).await?;
        let is_asked = (block.map, block.row, block.rows, block.columns)
            == (query.map, query.row, query.maximum_rows, columns);
        let is_full = block.cells.len() == usize::from(block.rows) * width;
        if !is_asked || !is_full || block.revision != edition.revision {
            return Ok(None);
        }
        cells.extend_from_slice(&block.cells);
        row += query.maximum_rows;
    }
    Ok(Some(cells))
}
