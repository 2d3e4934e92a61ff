//! One run of the benchmark, identified in all its processes by a number.

use std::env;
use std::fs;
use std::path::PathBuf;

/// Environment variable that gives the run to child processes.
pub(crate) const VARIABLE: &str = "JAUS_BENCH_RUN";

/// The number of this run: the id of the process that the user started.
pub(crate) fn number() -> u32 {
    let given = env::var(VARIABLE)
        .ok()
        .and_then(|number| number.parse().ok());
    given.unwrap_or_else(std::process::id)
}

/// A folder of this run for sockets, shared by all its processes.
pub(crate) fn folder() -> PathBuf {
    let folder = env::temp_dir().join(format!("jaus-bench-{}", number()));
    fs::create_dir_all(&folder).expect("a folder for sockets");
    folder
}
