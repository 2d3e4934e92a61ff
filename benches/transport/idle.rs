//! The cost of an idle node: CPU time and memory.

use std::fs;
use std::thread::sleep;
use std::time::Duration;

use jaus::address::JausId;
use jaus::component::{Component, Kind};
use jaus::node::Node;
use jaus_test_kit::figures::Figures;

use crate::Effort;
use crate::child::Process;
use crate::place;
use crate::placement::{Placement, Side};
use crate::roles::Role;

/// The number of idle components of each measured node.
const COMPONENTS: [usize; 3] = [1, 11, 101];

/// A child process: a node with `components` idle components that offer the core services.
pub(crate) async fn stay(components: usize) {
    let node = Node::start(place::settings(JausId::new(101, 1, 1))).expect("a node");
    let alive: Vec<_> = (1..=components)
        .map(|number| {
            Component::builder(Kind::Component, format!("idle {number}"))
                .attach(&node, number as u8)
                .expect("a free number")
        })
        .collect();
    println!("ready");
    std::future::pending::<()>().await;
    drop(alive);
}

pub(crate) fn measure(effort: Effort, figures: &mut Figures) {
    let watch = |components| {
        let process = Process::start(&Role::Idle(components), &Placement::Free.of(Side::Theirs));
        // Discovery sends more at the start.
        sleep(Duration::from_secs(3));
        let (before, time) = (process.processor_time().as_secs_f64(), effort.idle_seconds);
        sleep(Duration::from_secs_f64(time));
        let share = 100.0 * (process.processor_time().as_secs_f64() - before) / time;
        (share, resident(process.id()))
    };
    figures.table(
        "Idle node",
        [
            "components",
            "processor",
            "resident",
            "each further component",
        ],
    );
    let mut fewer = None;
    for components in COMPONENTS {
        let (share, kib) = watch(components);
        let each = fewer.map_or(String::new(), |(count, before): (usize, f64)| {
            format!("{:.1} KiB", (kib - before) / (components - count) as f64)
        });
        figures.row([
            &components.to_string(),
            &format!("{share:.2} %"),
            &format!("{kib:.0} KiB"),
            &each,
        ]);
        fewer = Some((components, kib));
    }
}

/// Resident memory of a process in KiB, including the pages of the program itself.
fn resident(process: u32) -> f64 {
    let status = fs::read_to_string(format!("/proc/{process}/status")).expect("Linux");
    status
        .lines()
        .find_map(|line| line.strip_prefix("VmRSS:"))
        .and_then(|rest| rest.trim().strip_suffix(" kB")?.parse().ok())
        .expect("a size")
}
