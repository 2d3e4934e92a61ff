//! Pictures for the documentation that do not show the page.

use super::browser::{Browser, Screen};
use super::by_hand::Running;
use super::system::program;

/// The number of this test's multicast group.
const TEST: u8 = 9;

const TERMINAL: Screen = Screen {
    name: "terminal",
    size: (930, 260),
    dark: true,
};

const PROGRAMS: [&str; 6] = [
    "jaus-primitive-driver",
    "jaus-velocity-state-sensor",
    "jaus-local-pose-sensor",
    "jaus-local-vector-driver",
    "jaus-local-path-segment-driver",
    "jaus-planner",
];

/// Shows the table of `jaus monitor` for some components as on a terminal.
pub(crate) fn monitor() {
    let start = |name: &str| Running::start(TEST, name, &["--name", "G-Bat"], ", UDP ").0;
    let _running = PROGRAMS.map(start);
    let group = Running::group(TEST);
    // The first table has no round trips yet.
    let tables = std::process::Command::new(program("jaus"))
        .args([
            "monitor",
            "--probe",
            "--interval",
            "2s",
            "--for",
            "5s",
            "--loopback",
        ])
        .args(["--group", &group])
        .output()
        .unwrap();
    let tables = String::from_utf8(tables.stdout).unwrap();
    let table = tables.rfind("ID ").map(|at| &tables[at..]).unwrap();
    assert!(table.contains("Primitive Driver"), "{tables}");
    let mut page = Browser::start(None);
    page.look_on(TERMINAL);
    page.show_terminal(&format!("$ jaus monitor --probe\n{table}"));
    page.screenshot("monitor");
}
