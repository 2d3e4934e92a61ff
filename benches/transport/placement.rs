//! Placement of the benchmark's processes on processors. Left to itself, the kernel puts two
//! processes that wake each other sometimes on one processor and sometimes on two, which affects
//! the figures more than the code does.

use std::sync::OnceLock;

/// Environment variable that gives a child process its processors.
pub(crate) const VARIABLE: &str = "JAUS_BENCH_PROCESSORS";

/// Where the two sides of a measurement run. Each side is a component and its own node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Placement {
    /// All processes on one processor.
    OneCore,
    /// The measuring side, with the nodes and relays that both share, on one processor; the other
    /// side on another.
    TwoCores,
    /// The kernel chooses.
    Free,
}

/// The measuring side, or the other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Side {
    Ours,
    Theirs,
}

impl Placement {
    /// The placements that differ on this machine.
    pub(crate) fn all() -> Vec<Self> {
        let mut all = vec![Self::OneCore, Self::TwoCores, Self::Free];
        all.retain(|it| *it == Self::OneCore || usable().len() > 1);
        all
    }

    /// The pinned placements.
    pub(crate) fn pinned() -> Vec<Self> {
        let mut pinned = Self::all();
        pinned.retain(|it| *it != Self::Free);
        pinned
    }

    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::OneCore => "one core",
            Self::TwoCores => "two cores",
            Self::Free => "kernel's choice",
        }
    }

    /// The processors of a side.
    pub(crate) fn of(self, side: Side) -> Vec<usize> {
        let usable = usable();
        match (self, side) {
            (Self::Free, _) => usable.to_vec(),
            (Self::TwoCores, Side::Theirs) => vec![usable[1]],
            (Self::OneCore, _) | (Self::TwoCores, Side::Ours) => vec![usable[0]],
        }
    }

    /// Moves this thread, which is the measuring side, to its processors.
    pub(crate) fn take(self) {
        pin(&self.of(Side::Ours));
    }
}

/// The processors that this process may use when it starts.
fn usable() -> &'static [usize] {
    static USABLE: OnceLock<Vec<usize>> = OnceLock::new();
    USABLE.get_or_init(affinity)
}

/// Moves a child process to its processors, before it starts any thread.
pub(crate) fn settle() {
    let words = std::env::var(VARIABLE).unwrap_or_default();
    let processors: Vec<_> = words.split(',').flat_map(str::parse).collect();
    if !processors.is_empty() {
        pin(&processors);
    }
}

#[cfg(target_os = "linux")]
fn affinity() -> Vec<usize> {
    use nix::sched::{CpuSet, sched_getaffinity};
    let set = sched_getaffinity(nix::unistd::Pid::from_raw(0)).expect("its own processors");
    (0..CpuSet::count())
        .filter(|&processor| set.is_set(processor).unwrap_or(false))
        .collect()
}

#[cfg(target_os = "linux")]
fn pin(processors: &[usize]) {
    use nix::sched::{CpuSet, sched_setaffinity};
    let mut set = CpuSet::new();
    for &processor in processors {
        set.set(processor).expect("a processor");
    }
    sched_setaffinity(nix::unistd::Pid::from_raw(0), &set).expect("one of its processors");
}

#[cfg(not(target_os = "linux"))]
fn affinity() -> Vec<usize> {
    vec![0]
}

#[cfg(not(target_os = "linux"))]
fn pin(_: &[usize]) {}
