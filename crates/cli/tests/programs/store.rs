//! `jaus-vector-knowledge-store`, the real binary, over the loopback interface.

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};

use crate::support::{own_group, run};
use serde_json::json;

/// A test's own directory, removed when dropped.
struct Directory(PathBuf);

impl Directory {
    fn new(test: &str) -> Self {
        let name = format!("jaus-store-{test}-{}", std::process::id());
        let path = std::env::temp_dir().join(name);
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn file(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }
}

impl Drop for Directory {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// A process; killed when dropped.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn store(file: &Path, flags: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_jaus-vector-knowledge-store"));
    command
        .env_remove("JAUS_LOG")
        .arg("--store")
        .arg(file)
        .args(flags);
    command
}

fn ended(file: &Path, flags: &[&str]) -> (Option<i32>, String) {
    let Output { status, stderr, .. } = store(file, flags).output().unwrap();
    (status.code(), String::from_utf8(stderr).unwrap())
}

fn ask(network: &[&str], query: &str, body: &serde_json::Value) -> serde_json::Value {
    let body = body.to_string();
    let arguments = ["query", "101.61.61", query, &body, "--timeout", "30s"];
    let answer = run(&[&arguments, network].concat(), b"");
    assert_eq!(answer.status, 0, "{answer:?}");
    answer.only_line()["body"].take()
}

#[test]
fn what_it_has_told_is_there_after_a_kill_and_the_next_start() {
    let directory = Directory::new("killed");
    let file = directory.file("deep/world.redb");
    let group = own_group();
    let network: Vec<&str> = group.iter().map(String::as_str).collect();
    let start = |flags: &[&str]| {
        let flags = [&network, flags, &["--for", "60s"]].concat();
        let mut command = store(&file, &flags);
        Running(
            command
                .stdout(Stdio::null())
                .stderr(Stdio::null())
                .spawn()
                .unwrap(),
        )
    };
    let maps = |running: &Running| {
        let _ = running;
        ask(&network, "QueryRasterMaps", &json!({}))
    };
    let demo = start(&["--demo-map"]);
    let before = maps(&demo);
    assert_eq!(before[0]["Name"], "traversability");
    assert_eq!(before[0]["Rows"], 16);
    drop(demo);
    let again = start(&[]);
    assert_eq!(maps(&again), before);
    let cells = ask(
        &network,
        "QueryRasterCells",
        &json!({"Map": 1, "Row": 0, "Column": 0, "MaximumRows": 0, "MaximumColumns": 0}),
    );
    assert_eq!(
        (&cells["Rows"], &cells["Columns"]),
        (&json!(16), &json!(16))
    );
}

#[test]
fn a_damaged_file_is_told_of_and_set_aside_only_if_that_is_wanted() {
    let directory = Directory::new("damaged");
    let file = directory.file("world.redb");
    std::fs::write(&file, "no store").unwrap();
    let flags = ["--loopback", "--port", "0", "--for", "200ms"];
    let (status, told) = ended(&file, &flags);
    assert_eq!(status, Some(1), "{told}");
    for part in ["world.redb", "damaged", "--set-broken-aside"] {
        assert!(told.contains(part), "{told}");
    }
    assert_eq!(std::fs::read(&file).unwrap(), b"no store");
    let (status, told) = ended(&file, &[&flags[..], &["--set-broken-aside"]].concat());
    assert_eq!(status, Some(0), "{told}");
    let aside = directory.file("world.redb.broken-1");
    assert_eq!(std::fs::read(aside).unwrap(), b"no store");
    let (status, told) = ended(&file, &flags);
    assert_eq!(status, Some(0), "{told}");
}

#[test]
fn a_mistaken_map_or_flag_is_told_with_what_would_do() {
    let directory = Directory::new("mistaken");
    let map = directory.file("yard.txt");
    std::fs::write(&map, "..\n.x\n").unwrap();
    let file = directory.file("world.redb");
    let map = map.to_str().unwrap();
    for (flags, parts) in [
        (
            vec!["--import", map],
            ["yard.txt: line 2: 'x'", "write # for"],
        ),
        (
            vec!["--import", "/no/such/map"],
            ["/no/such/map", "No such file"],
        ),
        (
            vec!["--import", map, "--cell", "0"],
            ["--cell", "0.001 to 1000"],
        ),
        (vec!["--latitude", "91"], ["--latitude", "-90 to 90"]),
    ] {
        let (status, told) = ended(&file, &flags);
        assert_eq!(status, Some(2), "{told}");
        for part in parts {
            assert!(told.contains(part), "no `{part}` in {told}");
        }
        assert!(!file.exists());
    }
}
