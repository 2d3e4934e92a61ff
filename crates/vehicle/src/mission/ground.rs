//! The cells open to the centre of a vehicle, and the cost of driving over them.

use super::Terrain;

/// The cells of a [`Terrain`] that the vehicle's centre may occupy.
pub(super) struct Ground {
    rows: usize,
    columns: usize,
    /// 0 for closed cells, otherwise the traversability.
    cells: Vec<u8>,
    /// Weight of the best cell, as returned by [`Ground::weight`].
    least: u64,
}

/// Cell number, counted row by row.
pub(super) type Cell = u32;

/// Cost of a step across a side per unit of weight; below it, the cost across a corner.
const SIDE: u64 = 10;
const CORNER: u64 = 14;

impl Ground {
    /// Creates the ground for a vehicle whose centre keeps `clearance` metres from everything that
    /// is not traversable. The edge of the map is no obstacle.
    ///
    /// A vehicle already closer than that to an obstacle may leave: around `start`, in rows and
    /// columns, only cells that are not traversable are closed.
    pub(super) fn new(terrain: &Terrain, clearance: f64, start: (f64, f64)) -> Self {
        let (rows, columns) = (terrain.rows().into(), terrain.columns().into());
        let radius = clearance / terrain.cell();
        let mut ground = Self {
            rows,
            columns,
            cells: terrain.open_cells(),
            least: 0,
        };
        if radius > 0.5 {
            ground.keep_away(radius);
        }
        if radius > 0.5 || terrain.is_restricted() {
            ground.open_around(start, radius, terrain);
        }
        let best = ground.cells.iter().max().copied().unwrap_or_default();
        ground.least = weight_of(best);
        ground
    }

    /// Closes all cells whose centre is closer than `radius` cells to a closed cell.
    fn keep_away(&mut self, radius: f64) {
        let widths = widths(radius);
        let aside = self.distances_in_rows(widths[0]);
        let columns = self.columns;
        for row in 0..self.rows {
            let open = &mut self.cells[row * columns..][..columns];
            for (rise, &width) in widths.iter().enumerate() {
                let below = row.checked_sub(rise);
                let above = Some(row + rise).filter(|&above| above < self.rows);
                for other in below.into_iter().chain(above) {
                    let aside = &aside[other * columns..][..columns];
                    for (cell, &aside) in open.iter_mut().zip(aside) {
                        *cell = if aside <= width { 0 } else { *cell };
                    }
                }
            }
        }
    }

    /// For each cell, the distance in columns to the nearest closed cell of its row, limited to
    /// `most` + 1.
    fn distances_in_rows(&self, most: u8) -> Vec<u8> {
        let far = most.saturating_add(1);
        let mut aside = vec![far; self.cells.len()];
        let rows = self.cells.chunks(self.columns);
        for (cells, aside) in rows.zip(aside.chunks_mut(self.columns)) {
            measure(cells.iter().zip(aside.iter_mut()), far);
            measure(cells.iter().zip(aside.iter_mut()).rev(), far);
        }
        aside
    }

    /// Opens all traversable cells near a point, so that a vehicle standing there can leave.
    fn open_around(&mut self, (row, column): (f64, f64), radius: f64, terrain: &Terrain) {
        let reach = radius + 1.0;
        let span = |middle: f64, side: usize| {
            let first = (middle - reach).floor().max(0.0) as usize;
            let last = (middle + reach).ceil().max(0.0) as usize;
            first..last.min(side)
        };
        for at_row in span(row, self.rows) {
            for at_column in span(column, self.columns) {
                let middle = (at_row as f64 + 0.5, at_column as f64 + 0.5);
                let is_near = (middle.0 - row).hypot(middle.1 - column) <= reach;
                let at = at_row * self.columns + at_column;
                let is_own = (at_row, at_column) == (row as usize, column as usize);
                if is_near && self.cells[at] == 0 && (is_own || terrain.admits(middle)) {
                    // Worst traversability, so that the path leads away from here.
                    self.cells[at] = terrain.cells()[at].min(1);
                }
            }
        }
    }

    pub(super) const fn rows(&self) -> usize {
        self.rows
    }

    pub(super) const fn columns(&self) -> usize {
        self.columns
    }

    /// Number of cells, open or closed.
    pub(super) const fn len(&self) -> usize {
        self.cells.len()
    }

    pub(super) fn is_open(&self, row: usize, column: usize) -> bool {
        self.cells[row * self.columns + column] != 0
    }

    /// The cell that contains a point of the map, given in rows and columns.
    pub(super) fn cell_at(&self, (row, column): (f64, f64)) -> Cell {
        let row = (row as usize).min(self.rows - 1);
        let column = (column as usize).min(self.columns - 1);
        self.cell(row, column)
    }

    pub(super) const fn cell(&self, row: usize, column: usize) -> Cell {
        // A terrain has at most 2^24 cells.
        (row * self.columns + column) as Cell
    }

    /// The row and column of a cell.
    pub(super) const fn place(&self, cell: Cell) -> (usize, usize) {
        let cell = cell as usize;
        (cell / self.columns, cell % self.columns)
    }

    /// The centre of a cell in rows and columns.
    pub(super) fn middle(&self, cell: Cell) -> (f64, f64) {
        let (row, column) = self.place(cell);
        (row as f64 + 0.5, column as f64 + 0.5)
    }

    /// The cost of a cell per unit of distance; `None` if it is closed.
    pub(super) fn weight(&self, row: usize, column: usize) -> Option<u64> {
        match self.cells[row * self.columns + column] {
            0 => None,
            open => Some(weight_of(open)),
        }
    }

    /// The open neighbours of a cell and the cost of moving there. Diagonal moves require both
    /// adjacent cells to be open.
    pub(super) fn neighbours(&self, cell: Cell) -> impl Iterator<Item = (Cell, u64)> {
        let (row, column) = self.place(cell);
        let own = self.weight(row, column).unwrap_or_default();
        let step = move |(up, aside): (isize, isize)| {
            let row_there = row.checked_add_signed(up).filter(|&it| it < self.rows)?;
            let column_there = column
                .checked_add_signed(aside)
                .filter(|&it| it < self.columns)?;
            let there = self.weight(row_there, column_there)?;
            let over_corner = up != 0 && aside != 0;
            if over_corner && !(self.is_open(row, column_there) && self.is_open(row_there, column))
            {
                return None;
            }
            let length = if over_corner { CORNER } else { SIDE };
            Some((
                self.cell(row_there, column_there),
                length * (own + there) / 2,
            ))
        };
        STEPS.into_iter().filter_map(step)
    }

    /// Lower bound of the cost of a displacement in rows and columns.
    pub(super) fn at_least(&self, rows: usize, columns: usize) -> u64 {
        let (short, long) = (rows.min(columns) as u64, rows.max(columns) as u64);
        (CORNER * short + SIDE * (long - short)) * self.least
    }
}

/// Counts the distance from closed cells in iteration order, and keeps the minimum.
fn measure<'a>(row: impl Iterator<Item = (&'a u8, &'a mut u8)>, far: u8) {
    let mut distance = far;
    for (&cell, aside) in row {
        distance = match cell {
            0 => 0,
            _ => distance.saturating_add(1).min(far),
        };
        *aside = distance.min(*aside);
    }
}

const STEPS: [(isize, isize); 8] = [
    (1, 0),
    (0, 1),
    (-1, 0),
    (0, -1),
    (1, 1),
    (-1, 1),
    (-1, -1),
    (1, -1),
];

/// Cost of the best ground per unit of distance, and the additional cost of the worst.
const BEST: u64 = 64;
const WORSE: u64 = 4 * BEST;

/// Cost per unit of distance of ground with traversability `open`.
fn weight_of(open: u8) -> u64 {
    BEST + WORSE * u64::from(u8::MAX - open) / u64::from(u8::MAX - 1)
}

/// For each distance in rows, the largest distance in columns at which a closed cell is closer than
/// `radius` cells to the centre of a cell. Distances are to the nearest side or corner.
fn widths(radius: f64) -> Vec<u8> {
    let rows = (0..).map(|row: u8| (f64::from(row) - 0.5).max(0.0));
    rows.take_while(|&rise| rise < radius)
        .take(usize::from(u8::MAX))
        .map(|rise| {
            let width = (radius * radius - rise * rise).sqrt() + 0.5;
            (width.ceil() - 1.0).clamp(0.0, f64::from(u8::MAX - 1)) as u8
        })
        .collect()
}
