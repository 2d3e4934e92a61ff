//! Straight lines over the ground, and simplification of a path to few of them.

use super::ground::{Cell, Ground};

/// A point in rows and columns.
type Point = (f64, f64);

/// Maximum cost of a straight line relative to the path section it replaces.
const DEARER: f64 = 1.02;

/// The corners of a path from `start` to `end`, which lie in its first and last cell.
///
/// Straight lines between corners cross open cells only and cost no more than the path they
/// replace, within [`DEARER`]. They never cross bad ground that the path avoids.
pub(super) fn straighten(ground: &Ground, way: &[Cell], start: Point, end: Point) -> Vec<Point> {
    let last = way.len().saturating_sub(1);
    let point = |index: usize| match index {
        0 => start,
        index if index == last => end,
        index => way.get(index).map_or(end, |&cell| ground.middle(cell)),
    };
    let costs = costs(ground, way.len(), point);
    let may_skip = |from: usize, to: usize| {
        to <= from + 1
            || cost(ground, point(from), point(to))
                .is_some_and(|cost| cost <= (costs[to] - costs[from]) * DEARER)
    };
    let mut corners = vec![start];
    let mut from = 0;
    while from < last {
        let to = farthest(from, last, may_skip);
        corners.push(point(to));
        from = to;
    }
    if last == 0 {
        corners.push(end);
    }
    corners
}

/// The accumulated cost at each point of the path.
fn costs(ground: &Ground, len: usize, point: impl Fn(usize) -> Point) -> Vec<f64> {
    let mut sum = 0.0;
    let mut costs = vec![sum];
    for index in 1..len {
        // Neighbouring cells always have a line of sight.
        sum += cost(ground, point(index - 1), point(index)).unwrap_or_default();
        costs.push(sum);
    }
    costs
}

/// A far point of the path that can be reached in a straight line. The stride doubles until a line
/// fails, then bisection narrows the gap between the longest success and the shortest failure.
fn farthest(from: usize, last: usize, may_skip: impl Fn(usize, usize) -> bool) -> usize {
    let mut good = from + 1;
    let mut stride = 2;
    let mut bad = loop {
        let to = (from + stride).min(last);
        if !may_skip(from, to) {
            break to;
        }
        good = to;
        if to == last {
            return last;
        }
        stride *= 2;
    };
    while bad - good > 1 {
        let middle = good + (bad - good) / 2;
        if may_skip(from, middle) {
            good = middle;
        } else {
            bad = middle;
        }
    }
    good
}

/// The cost of a straight line; `None` if it touches a closed cell.
pub(super) fn cost(ground: &Ground, from: Point, to: Point) -> Option<f64> {
    let (rise, run) = (to.0 - from.0, to.1 - from.1);
    let length = rise.hypot(run);
    let mut rows = Axis::new(from.0, rise);
    let mut columns = Axis::new(from.1, run);
    let weight = |row: isize, column: isize| {
        let row = usize::try_from(row).ok().filter(|&it| it < ground.rows())?;
        let column = usize::try_from(column)
            .ok()
            .filter(|&it| it < ground.columns())?;
        ground.weight(row, column).map(|weight| weight as f64)
    };
    let mut here = 0.0;
    let mut sum = 0.0;
    loop {
        let next = rows.next.min(columns.next).min(1.0);
        sum += weight(rows.cell, columns.cell)? * (next - here) * length;
        if next >= 1.0 {
            return Some(sum);
        }
        here = next;
        if (rows.next - columns.next).abs() < CORNER {
            // Crossing a corner also touches both cells beside it.
            weight(rows.cell + rows.step, columns.cell)?;
            weight(rows.cell, columns.cell + columns.step)?;
            rows.advance();
            columns.advance();
        } else if rows.next < columns.next {
            rows.advance();
        } else {
            columns.advance();
        }
    }
}

/// A line crosses a corner if it passes within this fraction of its length.
const CORNER: f64 = 1e-9;

/// Traversal of rows or columns along a line.
struct Axis {
    cell: isize,
    step: isize,
    /// Fraction of the line at which the next cell begins.
    next: f64,
    /// Fraction of the line per cell.
    each: f64,
}

impl Axis {
    fn new(from: f64, way: f64) -> Self {
        let cell = from.floor();
        let (step, to_next) = if way > 0.0 {
            (1, cell + 1.0 - from)
        } else {
            (-1, from - cell)
        };
        let each = 1.0 / way.abs();
        Self {
            cell: cell as isize,
            step,
            next: if way == 0.0 {
                f64::INFINITY
            } else {
                to_next * each
            },
            each,
        }
    }

    fn advance(&mut self) {
        self.cell += self.step;
        self.next += self.each;
    }
}
