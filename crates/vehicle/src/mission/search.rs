//! Path search over the ground: A* over cells, on large maps preceded by A* over blocks of cells,
//! to bound time and memory.

use pathfinding::directed::astar::astar;

use super::blocks::{Blocks, Node};
use super::ground::{Cell, Ground};

/// The largest number of cells searched directly. Each visited cell takes some 60 octets.
const AT_ONCE: usize = 512 * 512;
/// Number of path blocks refined to cells in one search.
const STRETCH: usize = 48;

/// The cheapest path between two open cells, both included. On maps with more than [`AT_ONCE`]
/// cells it may cost slightly more than the optimum. `None` if no path exists.
pub(super) fn find(ground: &Ground, start: Cell, end: Cell) -> Option<Vec<Cell>> {
    if ground.len() <= AT_ONCE {
        return find_in(ground, start, |_| true, |cell| cell == end, end);
    }
    find_by_blocks(ground, start, end)
}

/// The same for maps of any size, by searching blocks first.
pub(super) fn find_by_blocks(ground: &Ground, start: Cell, end: Cell) -> Option<Vec<Cell>> {
    let blocks = Blocks::new(ground);
    let way = over_blocks(&blocks, blocks.node_of(start)?, blocks.node_of(end)?)?;
    over_cells(ground, &blocks, &way, start, end)
}

/// A* over the `allowed` cells towards `target`. If `reached` accepts another cell earlier, the
/// path may cost slightly more than necessary.
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

/// Refines a path over blocks to cells, section by section. Each search covers the blocks of the
/// section and their neighbours, which always contain a path.
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
