//! Square blocks of cells for path search on large maps. Each connected piece of ground within a
//! block is one node, so a path over nodes exists exactly if one over cells exists.

use super::ground::{Cell, Ground};

/// Side length of a block in cells.
const SIDE: usize = 8;
/// Maximum number of disjoint pieces of ground in a block.
const PIECES: usize = SIDE * SIDE / 2;
/// Label of a cell that belongs to no piece.
const NONE: u8 = u8::MAX;

/// A connected piece of ground in a block: block number times [`PIECES`] plus piece number.
pub(super) type Node = u32;

/// The ground divided into blocks.
pub(super) struct Blocks<'a> {
    ground: &'a Ground,
    rows: usize,
    columns: usize,
    /// For each cell, its piece within its block.
    labels: Vec<u8>,
    /// Average weight of the open cells of each block.
    weights: Vec<u16>,
}

impl<'a> Blocks<'a> {
    pub(super) fn new(ground: &'a Ground) -> Self {
        let (rows, columns) = (
            ground.rows().div_ceil(SIDE),
            ground.columns().div_ceil(SIDE),
        );
        let mut blocks = Self {
            ground,
            rows,
            columns,
            labels: vec![NONE; ground.len()],
            weights: vec![0; rows * columns],
        };
        for block in 0..blocks.len() {
            blocks.label(block);
        }
        blocks
    }

    /// Number of blocks.
    pub(super) const fn len(&self) -> usize {
        self.rows * self.columns
    }

    /// The row and column ranges of a block's cells.
    fn cells(&self, block: usize) -> (std::ops::Range<usize>, std::ops::Range<usize>) {
        let (row, column) = (block / self.columns * SIDE, block % self.columns * SIDE);
        (
            row..(row + SIDE).min(self.ground.rows()),
            column..(column + SIDE).min(self.ground.columns()),
        )
    }

    /// Labels the pieces of a block and computes its weight.
    fn label(&mut self, block: usize) {
        let (rows, columns) = self.cells(block);
        let mut pieces = 0;
        let (mut sum, mut open) = (0, 0);
        let mut found = Vec::new();
        for row in rows.clone() {
            for column in columns.clone() {
                let Some(weight) = self.ground.weight(row, column) else {
                    continue;
                };
                sum += weight;
                open += 1;
                if self.labels[self.ground.cell(row, column) as usize] != NONE {
                    continue;
                }
                found.push((row, column));
                while let Some((row, column)) = found.pop() {
                    let cell = self.ground.cell(row, column) as usize;
                    if self.labels[cell] != NONE || !self.ground.is_open(row, column) {
                        continue;
                    }
                    self.labels[cell] = pieces;
                    // Diagonal moves require both adjacent cells to be open, so checking sides
                    // suffices.
                    let beside = [
                        (row.wrapping_sub(1), column),
                        (row + 1, column),
                        (row, column.wrapping_sub(1)),
                        (row, column + 1),
                    ];
                    found.extend(
                        beside
                            .into_iter()
                            .filter(|(row, column)| rows.contains(row) && columns.contains(column)),
                    );
                }
                pieces += 1;
            }
        }
        self.weights[block] = sum.checked_div(open).unwrap_or_default() as u16;
    }

    /// The block that contains a cell.
    pub(super) const fn block_of(&self, cell: Cell) -> usize {
        let (row, column) = self.ground.place(cell);
        row / SIDE * self.columns + column / SIDE
    }

    /// The node that contains a cell, if the cell is open.
    pub(super) fn node_of(&self, cell: Cell) -> Option<Node> {
        match self.labels[cell as usize] {
            NONE => None,
            piece => Some((self.block_of(cell) * PIECES + usize::from(piece)) as Node),
        }
    }

    const fn block(node: Node) -> usize {
        node as usize / PIECES
    }

    /// A cell in the middle of a node's block.
    pub(super) fn middle(&self, node: Node) -> Cell {
        let (rows, columns) = self.cells(Self::block(node));
        let middle = |cells: std::ops::Range<usize>| cells.start + cells.len() / 2;
        self.ground.cell(middle(rows), middle(columns))
    }

    /// Calls `name` for the block of a node and for the surrounding blocks.
    pub(super) fn around(&self, node: Node, mut name: impl FnMut(usize)) {
        let block = Self::block(node);
        let (row, column) = (block / self.columns, block % self.columns);
        for row in row.saturating_sub(1)..(row + 2).min(self.rows) {
            for column in column.saturating_sub(1)..(column + 2).min(self.columns) {
                name(row * self.columns + column);
            }
        }
    }

    /// The neighbours of a node with the cost of moving there, including diagonal ones reachable
    /// through a common neighbour.
    pub(super) fn neighbours(&self, node: Node) -> Vec<(Node, u64)> {
        let mut found: Vec<(Node, u64)> = Vec::with_capacity(8);
        let beside = self.beside(node);
        for &(next, _) in &beside {
            found.push((next, self.cost(node, next, 10)));
        }
        for &(next, crosses_row) in &beside {
            let over_corner = self.beside(next).into_iter();
            for (corner, _) in over_corner.filter(|&(_, again)| again != crosses_row) {
                if !found.iter().any(|&(known, _)| known == corner) {
                    found.push((corner, self.cost(node, corner, 14)));
                }
            }
        }
        found
    }

    fn cost(&self, from: Node, to: Node, length: u64) -> u64 {
        let weight = |node| u64::from(self.weights[Self::block(node)]);
        length * (weight(from) + weight(to)) / 2 * SIDE as u64
    }

    /// The nodes adjacent to a node across block sides, and whether they are in another row.
    fn beside(&self, node: Node) -> Vec<(Node, bool)> {
        let (rows, columns) = self.cells(Self::block(node));
        let mut found = Vec::with_capacity(4);
        let mut look = |inner: (usize, usize), outer: (usize, usize), in_other_row: bool| {
            if outer.0 >= self.ground.rows() || outer.1 >= self.ground.columns() {
                return;
            }
            let node_at = |(row, column)| self.node_of(self.ground.cell(row, column));
            if node_at(inner) != Some(node) {
                return;
            }
            if let Some(next) = node_at(outer)
                && !found.contains(&(next, in_other_row))
            {
                found.push((next, in_other_row));
            }
        };
        for column in columns.clone() {
            look(
                (rows.start, column),
                (rows.start.wrapping_sub(1), column),
                true,
            );
            look((rows.end - 1, column), (rows.end, column), true);
        }
        for row in rows {
            look(
                (row, columns.start),
                (row, columns.start.wrapping_sub(1)),
                false,
            );
            look((row, columns.end - 1), (row, columns.end), false);
        }
        found
    }

    /// Lower bound of the cost between two nodes, from the distance of their blocks.
    pub(super) fn at_least(&self, from: Node, to: Node) -> u64 {
        let place = |node| {
            let block = Self::block(node);
            (block / self.columns, block % self.columns)
        };
        let (from, to) = (place(from), place(to));
        let blocks = self
            .ground
            .at_least(from.0.abs_diff(to.0), from.1.abs_diff(to.1));
        blocks * SIDE as u64
    }
}
