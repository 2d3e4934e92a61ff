//! What a node costs that has nothing to do: processor time and memory.

use std::fs;
use std::thread::sleep;
use std::time::Duration;

use jaus::address::JausId;
use jaus::component::{Component, Kind};
use jaus::node::Node;

use crate::Effort;
use crate::child::Process;
use crate::place;
use crate::report;
use crate::roles::Role;

/// Idle components of each node that is watched.
const COMPONENTS: [usize; 3] = [1, 11, 101];

/// A child: a node with so many components, each with the core services, and nothing to do.
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

pub(crate) fn measure(effort: Effort) {
    let watch = |components| {
        let process = Process::start(&Role::Idle(components));
        // Discovery has more to say in the beginning.
        sleep(Duration::from_secs(3));
        let (before, time) = (processor_time(process.id()), effort.idle_seconds);
        sleep(Duration::from_secs_f64(time));
        let share = 100.0 * (processor_time(process.id()) - before) / time;
        (share, resident(process.id()))
    };
    report::head(
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
        report::row([
            &components.to_string(),
            &format!("{share:.2} %"),
            &format!("{kib:.0} KiB"),
            &each,
        ]);
        fewer = Some((components, kib));
    }
}

/// Seconds of processor time that a process has had.
fn processor_time(process: u32) -> f64 {
    let stat = fs::read_to_string(format!("/proc/{process}/schedstat")).expect("Linux");
    let nanoseconds: f64 = stat
        .split(' ')
        .next()
        .and_then(|word| word.parse().ok())
        .expect("nanoseconds");
    nanoseconds / 1e9
}

/// Resident memory of a process, in KiB; the pages of the program itself are part of it.
fn resident(process: u32) -> f64 {
    let status = fs::read_to_string(format!("/proc/{process}/status")).expect("Linux");
    status
        .lines()
        .find_map(|line| line.strip_prefix("VmRSS:"))
        .and_then(|rest| rest.trim().strip_suffix(" kB")?.parse().ok())
        .expect("a size")
}
