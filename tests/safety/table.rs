//! Results by cell: number of trials, observed motion, and the worst case.

use std::collections::BTreeMap;
use std::sync::Mutex;
use std::time::Duration;

use crate::cell::{Cell, Driver, Fault};
use crate::sim::seeds;
use crate::trial::Outcome;

/// The outcomes of many trials.
pub(crate) struct Table {
    cells: Vec<Cell>,
    rows: Mutex<BTreeMap<Cell, Row>>,
}

#[derive(Clone, Default)]
struct Row {
    runs: u32,
    moved: u32,
    tried_again: u32,
    revived: u32,
    stop: Duration,
    distance: f64,
    /// The first failing seed, and its broken promise.
    broken: Option<(u64, String)>,
}

impl Table {
    /// A table of these cells.
    pub(crate) fn new(cells: Vec<Cell>) -> Self {
        let rows = Mutex::default();
        Self { cells, rows }
    }

    pub(crate) fn cells(&self) -> &[Cell] {
        &self.cells
    }

    pub(crate) fn note(&self, cell: Cell, seed: u64, outcome: &Outcome) {
        let mut rows = self.rows.lock().expect("no panic");
        let row = rows.entry(cell).or_default();
        row.runs += 1;
        row.moved += u32::from(outcome.moved);
        row.tried_again += u32::from(outcome.revived.is_some());
        row.revived += u32::from(outcome.revived == Some(true));
        row.stop = row.stop.max(outcome.stop);
        row.distance = row.distance.max(outcome.distance);
        if let Some(what) = outcome.broken.first() {
            row.broken.get_or_insert((seed, what.clone()));
        }
    }

    pub(crate) fn print(&self, title: &str) {
        let rows = self.rows.lock().expect("no panic");
        seeds::announce(&format!(
            "\n{title}\n{:28}{:16}{:>6}{:>7}{:>15}{:>9}{:>10}",
            "fault", "driver", "runs", "moved", "moved again", "stop/s", "way/m"
        ));
        for fault in Fault::ALL {
            for driver in Driver::ALL {
                if let Some(row) = rows.get(&Cell { driver, fault }) {
                    seeds::announce(&format!("{fault:28}{driver:16}{}", row.line()));
                }
            }
        }
        let sum = |of: fn(&Row) -> u32| rows.values().map(of).sum::<u32>();
        let (runs, moved) = (sum(|row| row.runs), sum(|row| row.moved));
        let broken = rows.values().filter(|row| row.broken.is_some()).count();
        let worst = rows.values().map(|row| row.stop).max().unwrap_or_default();
        seeds::announce(&format!(
            "{} cells, {runs} runs, {moved} moved before the fault, {broken} cells broken, longest \
             order to move {worst:.3?} after the fault\n",
            rows.len()
        ));
    }

    /// Whether every cell was run, and moved before the fault in every run.
    pub(crate) fn is_complete(&self) -> bool {
        let rows = self.rows.lock().expect("no panic");
        let has_moved = |cell: &Cell| rows.get(cell).is_some_and(|row| row.moved == row.runs);
        self.cells.iter().all(has_moved)
    }

    /// Broken promises, one line per cell.
    pub(crate) fn broken(&self) -> Vec<String> {
        let rows = self.rows.lock().expect("no panic");
        let broken = rows.iter().filter_map(|(cell, row)| {
            let (seed, what) = row.broken.as_ref()?;
            Some(format!("{cell} (seed {seed}): {what}"))
        });
        broken.collect()
    }
}

impl Row {
    fn line(&self) -> String {
        let broken = self.broken.as_ref();
        let broken = broken.map_or_else(String::new, |(seed, _)| format!("  BROKEN by {seed}"));
        let revived = format!("{} of {}", self.revived, self.tried_again);
        format!(
            "{:>6}{:>7}{revived:>15}{:>9.2}{:>10.2}{broken}",
            self.runs,
            self.moved,
            self.stop.as_secs_f64(),
            self.distance,
        )
    }
}
