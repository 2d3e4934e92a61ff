//! Straight lines over the ground, and the simplification of a way to as few of them as will do.

use super::ground::{Cell, Ground};

/// A point counted in rows and columns.
type Point = (f64, f64);

/// How much dearer a straight line may be than the way that it replaces.
const DEARER: f64 = 1.02;

/// The corners of a way from `start` to `end`, which lie in its first and its last cell.
///
/// Between two corners the straight line leads over open cells only, and costs no more than the
/// way did but for rounding: it does not lead over bad ground that the way went around.
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

/// What it has cost to come to each point of the way.
fn costs(ground: &Ground, len: usize, point: impl Fn(usize) -> Point) -> Vec<f64> {
    let mut sum = 0.0;
    let mut costs = vec![sum];
    for index in 1..len {
        // Neighbours are in sight of each other.
        sum += cost(ground, point(index - 1), point(index)).unwrap_or_default();
        costs.push(sum);
    }
    costs
}

/// A point far along the way that may be gone to straight: strides that double until one is too
/// long, and then the middle between the longest good and the shortest bad one, and so on.
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

/// What a straight line costs; `None` if it touches a closed cell.
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
            // Over a corner: what lies beside it is touched, too.
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

/// Lines that pass a corner closer than this share of their length go over it.
const CORNER: f64 = 1e-9;

/// Where a line goes from one row, or one column, to the next.
struct Axis {
    cell: isize,
    step: isize,
    /// At which share of the line the next one begins.
    next: f64,
    /// How much of the line one takes.
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
