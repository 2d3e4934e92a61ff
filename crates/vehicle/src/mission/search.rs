//! The way over the ground: A* over its cells, and on a large map first over blocks of cells, so
//! that neither time nor memory grow out of hand.

use pathfinding::directed::astar::astar;

use super::blocks::{Blocks, Node};
use super::ground::{Cell, Ground};

/// How many cells are searched at once. A cell that is looked at takes some 60 octets.
const AT_ONCE: usize = 512 * 512;
/// How many blocks of the way are searched cell by cell at once.
const STRETCH: usize = 48;

/// The cheapest way from an open cell to another, both included; on a map with more than
/// [`AT_ONCE`] cells one that is not much dearer. `None` if there is none.
pub(super) fn find(ground: &Ground, start: Cell, end: Cell) -> Option<Vec<Cell>> {
    if ground.len() <= AT_ONCE {
        return find_in(ground, start, |_| true, |cell| cell == end, end);
    }
    find_by_blocks(ground, start, end)
}

/// The same for a map of any size, over blocks.
pub(super) fn find_by_blocks(ground: &Ground, start: Cell, end: Cell) -> Option<Vec<Cell>> {
    let blocks = Blocks::new(ground);
    let way = over_blocks(&blocks, blocks.node_of(start)?, blocks.node_of(end)?)?;
    over_cells(ground, &blocks, &way, start, end)
}

/// A* over those cells that are `allowed`, towards the cell `target`. If another one counts as
/// reached before, the way there is a little dearer than it must be.
fn find_in(
    ground: &Ground,
    start: Cell,
    allowed: impl Fn(Cell) -> bool,
    reached: impl Fn(Cell) -> bool,
    target: Cell,
) -> Option<Vec<Cell>> {
    let (row, column) = ground.place(target);
    let at_least = |&cell: &Cell| {
        let (at_row, at_column) = ground.place(cell);
        ground.at_least(row.abs_diff(at_row), column.abs_diff(at_column))
    };
    let neighbours = |&cell: &Cell| {
        let allowed = &allowed;
        ground
            .neighbours(cell)
            .filter(move |&(next, _)| allowed(next))
    };
    let found = astar(&start, neighbours, at_least, |&cell| reached(cell));
    found.map(|(way, _)| way)
}

fn over_blocks(blocks: &Blocks<'_>, start: Node, end: Node) -> Option<Vec<Node>> {
    let found = astar(
        &start,
        |&node| blocks.neighbours(node),
        |&node| blocks.at_least(node, end),
        |&node| node == end,
    );
    found.map(|(way, _)| way)
}

/// Goes the way over blocks cell by cell, one stretch after the other: through the blocks of the
/// stretch and those around them, which always hold a way.
fn over_cells(
    ground: &Ground,
    blocks: &Blocks<'_>,
    way: &[Node],
    start: Cell,
    end: Cell,
) -> Option<Vec<Cell>> {
    let mut cells = vec![start];
    let mut from = 0;
    let mut allowed = vec![0_u32; blocks.len()];
    for stretch in 1.. {
        let to = (from + STRETCH).min(way.len() - 1);
        for &node in &way[from..=to] {
            blocks.around(node, |block| allowed[block] = stretch);
        }
        let last = to == way.len() - 1;
        let target = if last { end } else { blocks.middle(way[to]) };
        let reached = |cell| match last {
            true => cell == end,
            false => blocks.node_of(cell) == Some(way[to]),
        };
        let inside = |cell| allowed[blocks.block_of(cell)] == stretch;
        let here = *cells.last()?;
        let found = find_in(ground, here, inside, reached, target)?;
        cells.extend(found.into_iter().skip(1));
        if last {
            break;
        }
        from = to;
    }
    Some(cells)
}
