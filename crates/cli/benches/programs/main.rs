//! The programs as a user has them: what one of them costs a small board (its size without symbols,
//! its memory when idle, the time from its start until others know its services), and how many
//! messages a thousand components exchange.
//!
//! ```text
//! cargo bench --bench programs
//! cargo bench --bench programs -- load               only the thousand components; a minute
//! cargo bench --bench programs --no-default-features -- programs    without secure links and https
//! JAUS_WRITE_FIGURES=1 cargo bench --bench programs  also writes docs/figures/programs.md and load.md
//! ```
//!
//! Everything stays on loopback. Sizes are those of the profile `bench`, which has the settings of
//! `release` but unwinds.
#![expect(
    clippy::expect_used,
    clippy::disallowed_methods,
    reason = "a benchmark owns the clock and panics on failure"
)]

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use jaus::address::JausId;
use jaus::component::{Change, Component, Kind};
use jaus::node::{Config, Node};
use jaus_test_kit::figures::Figures;

/// Starts of each program.
const STARTS: usize = 7;
/// When a program counts as idle.
const SETTLED: Duration = Duration::from_secs(4);

/// The programs, each with flags that keep its files apart.
const PROGRAMS: &[(&str, &[&str])] = &[
    (env!("CARGO_BIN_EXE_jaus-communicator"), &["--debug", "off"]),
    (env!("CARGO_BIN_EXE_jaus-primitive-driver"), &[]),
    (env!("CARGO_BIN_EXE_jaus-velocity-state-sensor"), &[]),
    (env!("CARGO_BIN_EXE_jaus-local-pose-sensor"), &[]),
    (env!("CARGO_BIN_EXE_jaus-local-vector-driver"), &[]),
    (env!("CARGO_BIN_EXE_jaus-local-path-segment-driver"), &[]),
    (env!("CARGO_BIN_EXE_jaus-vector-knowledge-store"), &[]),
    (env!("CARGO_BIN_EXE_jaus-planner"), &[]),
    (env!("CARGO_BIN_EXE_jaus-ocu"), &[]),
];

/// The tool whose `load` moves the messages.
const TOOL: &str = env!("CARGO_BIN_EXE_jaus");

fn main() {
    // Cargo passes `--bench` to every benchmark.
    let filter = std::env::args().skip(1).find(|it| it != "--bench");
    let is_wanted = |name: &str| filter.as_ref().is_none_or(|filter| name.contains(filter));
    if is_wanted("programs") {
        programs();
    }
    if is_wanted("load") {
        load();
    }
}

/// Measures `jaus load`, which prints a table.
fn load() {
    let mut figures = Figures::new("load", "cargo bench --bench programs -- load");
    let output = Command::new(TOOL).arg("load").output();
    let output = output.expect("the tool runs");
    for line in String::from_utf8_lossy(&output.stdout).lines() {
        figures.line(line);
    }
    figures.finish();
}

#[tokio::main(flavor = "current_thread")]
async fn programs() {
    let (name, flags, features) = match cfg!(feature = "secure") {
        true => ("programs", "", "with secure links and https"),
        false => (
            "programs-plain",
            " --no-default-features",
            "without the features secure and https",
        ),
    };
    let command = format!("cargo bench -p jaus-cli --bench programs{flags} -- programs");
    let mut figures = Figures::new(name, &command);
    figures.table(
        &format!("A program of one component, {features}"),
        [
            "program",
            "without symbols",
            "resident, idle",
            "start to discovered, median",
            "most",
        ],
    );
    let mut is_met = true;
    for (number, (program, flags)) in (1..).zip(PROGRAMS) {
        // A new one for each program: it would go on asking those that were killed before.
        let node = Node::start(Config::loopback(42, 1)).expect("a node");
        let watcher = Component::builder(Kind::OperatorControlUnit, "Watcher").attach(&node, 1);
        let watcher = watcher.expect("a free number");
        let mut starts = Vec::new();
        let mut resident = 0.0;
        for start in 0..STARTS {
            let id = JausId::new(101, number, 1 + start as u8);
            let began = Instant::now();
            let process = Process::start(program, flags, id);
            starts.push(known(&watcher, id).await.duration_since(began));
            if start == 0 {
                tokio::time::sleep(SETTLED).await;
                resident = process.resident();
            }
        }
        starts.sort();
        let name = Path::new(program).file_name().expect("a program");
        let (size, median) = (stripped(program), millis(starts[STARTS / 2]));
        figures.row([
            &name.display().to_string(),
            &format!("{size:.2} MiB"),
            &format!("{resident:.1} MiB"),
            &format!("{median:.0} ms"),
            &format!("{:.0} ms", millis(starts[STARTS - 1])),
        ]);
        is_met &= size < 6.0 && resident < 12.0 && median < 300.0;
    }
    figures.aim(
        "less than 6 MiB, 12 MiB resident and 300 ms for each",
        [("", is_met)],
    );
    figures.finish();
}

fn millis(time: Duration) -> f64 {
    time.as_secs_f64() * 1000.0
}

/// Waits until a component has told its services, and says when that was.
async fn known(watcher: &Component, id: JausId) -> Instant {
    let mut changes = watcher.watch();
    while let Some(change) = changes.next().await {
        if change == Change::Services(id) {
            break;
        }
    }
    Instant::now()
}

/// The size without symbols in MiB, as `strip` (binutils) leaves it.
fn stripped(program: &str) -> f64 {
    let lean = std::env::temp_dir().join(format!("jaus-lean-{}", std::process::id()));
    let mut strip = Command::new("strip");
    let status = strip.arg("-o").arg(&lean).arg(program).status();
    let made = status.is_ok_and(|status| status.success());
    let file = if made {
        lean.as_path()
    } else {
        Path::new(program)
    };
    let octets = fs::metadata(file).expect("a file").len();
    // It may never have been made.
    let _ = fs::remove_file(&lean);
    octets as f64 / f64::from(1 << 20)
}

/// A running program; killed when dropped.
struct Process(Child);

impl Process {
    fn start(program: &str, flags: &[&str], id: JausId) -> Self {
        let mut command = Command::new(program);
        command
            .args(["--loopback", "--id", &id.to_string()])
            .args(flags);
        command.stdout(Stdio::null()).stderr(Stdio::null());
        Self(command.spawn().expect("a program"))
    }

    /// Memory in use in MiB.
    fn resident(&self) -> f64 {
        let status = fs::read_to_string(format!("/proc/{}/status", self.0.id()));
        let status = status.expect("Linux");
        let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
        let kib = line.and_then(|line| line.split_whitespace().next()?.parse::<f64>().ok());
        kib.expect("a number") / 1024.0
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}
