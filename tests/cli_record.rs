//! `jaus record` and `jaus replay` over the loopback interface of this computer.
#![cfg(feature = "cli")]

mod cli_support;

use std::fs;

use cli_support::{own_group, run};

/// A file of this test's own, removed at the end.
struct File(std::path::PathBuf);

impl File {
    fn new(name: &str) -> Self {
        let name = format!("jaus-{}-{name}.pcapng", std::process::id());
        Self(std::env::temp_dir().join(name))
    }

    fn path(&self) -> &str {
        self.0.to_str().unwrap_or_default()
    }
}

impl Drop for File {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.0);
    }
}

#[test]
fn what_goes_to_the_group_is_recorded_and_can_be_decoded() {
    let group = own_group(2);
    let network: Vec<&str> = group.iter().map(String::as_str).collect();
    let file = File::new("recorded");
    let port = network[4].rsplit(':').next().unwrap();
    let recording = [
        "record",
        file.path(),
        "--interface",
        "lo",
        "--group",
        network[4],
        "--port",
        port,
        "--seconds",
        "3",
    ];
    let recording: Vec<_> = recording.iter().map(|&flag| flag.to_owned()).collect();
    let recorder = std::thread::spawn(move || {
        let recording: Vec<_> = recording.iter().map(String::as_str).collect();
        run(&recording, b"")
    });
    // Whatever is said while the recorder listens; a node asks who is there at its beginning.
    while !recorder.is_finished() {
        run(
            &[&["discover", "--seconds", "0.3"], &*network].concat(),
            b"",
        );
    }
    let recorded = recorder.join().unwrap();
    assert_eq!(recorded.status, 0, "{recorded:?}");
    assert!(
        recorded.stderr.contains(" packets recorded, "),
        "{recorded:?}"
    );
    let decoded = run(&["decode", file.path(), "--port", port], b"");
    assert!(
        decoded.stdout.contains("QueryIdentification"),
        "{decoded:?}"
    );
    assert_eq!(decoded.status, 0, "{decoded:?}");
}

#[test]
fn an_existing_file_is_not_written_over_unless_told_so() {
    let file = File::new("precious");
    fs::write(file.path(), "precious").unwrap();
    let refused = run(
        &[
            "record",
            file.path(),
            "--interface",
            "lo",
            "--seconds",
            "0.1",
        ],
        b"",
    );
    assert!(refused.stderr.contains("say --overwrite"), "{refused:?}");
    assert_eq!(refused.status, 2);
    assert_eq!(fs::read(file.path()).unwrap(), b"precious");
}

#[test]
fn an_interface_that_is_not_there_is_refused_with_those_that_are() {
    let file = File::new("nowhere");
    let refused = run(&["record", file.path(), "--interface", "eth77"], b"");
    assert!(
        refused.stderr.contains("no network interface `eth77`"),
        "{refused:?}"
    );
    assert!(refused.stderr.contains("lo 127.0.0.1"), "{refused:?}");
    assert_eq!(refused.status, 2);
    assert!(!file.0.exists());
}
