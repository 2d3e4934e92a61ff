//! `jaus load` with few components: every message is acknowledged, and nothing remains after
//! it ends or is killed.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use jaus_test_kit::program::assert_refused;
use jaus_test_kit::waiting::block_until;
use serde_json::Value;

/// A directory of one test, which is also the temporary directory of its programs.
fn directory(name: &str) -> PathBuf {
    let directory = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    // Left over from an earlier run.
    let _ = fs::remove_dir_all(&directory);
    fs::create_dir_all(&directory).unwrap();
    directory
}

fn load(directory: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_jaus"));
    command
        .args(["load", "--components", "24", "--processes", "2"])
        .args(arguments)
        .env("TMPDIR", directory)
        .current_dir(directory)
        .stdin(Stdio::null())
        .stdout(Stdio::piped());
    command
}

fn sockets(directory: &Path) -> usize {
    let runs = fs::read_dir(directory).unwrap().flatten();
    let runs = runs.filter(|entry| {
        entry
            .file_name()
            .to_string_lossy()
            .starts_with("jaus-load-")
    });
    runs.map(|run| 1 + fs::read_dir(run.path()).map_or(0, Iterator::count))
        .sum()
}

#[test]
fn every_message_is_acknowledged_by_its_receiver() {
    let directory = directory("tester-load");
    for who in ["component", "node"] {
        let schedule = ["--rates", "200,max", "--for", "300ms", "--burst", "2"];
        let output = load(&directory, &schedule)
            .args([
                "--acknowledged-by",
                who,
                "--save",
                "load.json",
                "--svg",
                "load.svg",
            ])
            .output()
            .unwrap();
        let table = String::from_utf8(output.stdout).unwrap();
        assert!(output.status.success(), "{table}");
        let log = String::from_utf8(output.stderr).unwrap();
        assert!(!log.contains("WARN"), "{log}");
        let report = fs::read_to_string(directory.join("load.json")).unwrap();
        let report: Value = serde_json::from_str(&report).unwrap();
        let rows = report["rows"].as_array().unwrap();
        assert_eq!((rows.len(), &rows[1]["wanted"]), (2, &Value::Null));
        for row in rows {
            let count = |what: &str| row[what].as_u64().unwrap();
            assert!(count("sent") > 0, "{row}");
            assert_eq!((count("lost"), count("refused")), (0, 0), "{row}");
            let time = |what: &str| row[what].as_f64().unwrap();
            assert!(time("p50") > 0.0 && time("p50") <= time("max"), "{row}");
        }
        let svg = fs::read_to_string(directory.join("load.svg")).unwrap();
        assert_eq!(svg.matches("<polyline").count(), 2);
        assert_eq!(sockets(&directory), 0, "a directory is left behind");
    }
}

#[test]
fn a_killed_load_leaves_neither_processes_nor_sockets() {
    let directory = directory("tester-load-killed");
    let mut parent = load(&directory, &["--rates", "10", "--for", "60s"])
        .spawn()
        .unwrap();
    // Two of components, four of nodes.
    block_until(|| sockets(&directory) >= 5 && children(&parent).len() == 6);
    let children = children(&parent);
    parent.kill().unwrap();
    parent.wait().unwrap();
    block_until(|| {
        let mut paths = children.iter().map(|id| format!("/proc/{id}/stat"));
        // An ended process stays a zombie until it is reaped.
        paths.all(|path| fs::read_to_string(path).map_or(true, |stat| stat.contains(") Z ")))
    });
    block_until(|| sockets(&directory) == 0);
}

#[test]
fn settings_that_cannot_be_are_refused_with_a_reason() {
    let directory = directory("tester-load-refused");
    for (arguments, reason) in [
        ("--nodes 1 --components 300", "254"),
        (
            "--components 24 --processes 64",
            "more processes than components",
        ),
        ("--rates 0", "from 1 to 10000000, or max"),
        ("--beside missing.json", "missing.json"),
        ("--for 4000s", "write at most one hour"),
    ] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_jaus"));
        command.arg("load").args(arguments.split(' '));
        assert_refused(command.current_dir(&directory), reason);
    }
}

/// The child processes of a process.
fn children(parent: &Child) -> Vec<u32> {
    let id = parent.id();
    let list = fs::read_to_string(format!("/proc/{id}/task/{id}/children")).unwrap_or_default();
    list.split_whitespace().flat_map(str::parse).collect()
}
