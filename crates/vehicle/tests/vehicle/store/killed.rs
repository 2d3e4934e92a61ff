//! A process that writes at full speed is killed at random times.

use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use jaus_vehicle::world::World;

use crate::store::{chance, cuts, ledger};

const FILE: &str = "JAUS_STORE_OF_THE_CHILD";

#[test]
fn nothing_acknowledged_is_lost_when_the_writer_is_killed() {
    let mut chance = chance("killed");
    let directory = std::env::temp_dir().join(format!("jaus-killed-{}", std::process::id()));
    let _ = std::fs::remove_dir_all(&directory);
    let file = directory.join("world.redb");
    let mut last = 0;
    for cut in 0..cuts(25) {
        // The earliest kills hit the creation or repair of the file.
        let instant = Duration::from_micros(chance.number() % 60_000);
        let acknowledged = write_until_killed(&file, instant).max(last);
        let world = World::open(&file).unwrap_or_else(|error| panic!("cut {cut}: {error}"));
        last = if world.rasters().is_empty() {
            0
        } else {
            ledger::last_step(&world)
        };
        let more = acknowledged..=acknowledged + 1;
        assert!(more.contains(&last), "cut {cut}: {last} of {acknowledged}");
    }
    println!("{last} steps");
    std::fs::remove_dir_all(&directory).unwrap();
}

/// The last step that the writer acknowledged before it was killed; 0 if none.
fn write_until_killed(file: &Path, instant: Duration) -> u32 {
    let this = std::env::current_exe().unwrap();
    let mut child = Command::new(this)
        .args([
            "--ignored",
            "--exact",
            "--nocapture",
            "store::killed::writes_until_it_is_killed",
        ])
        .env(FILE, file)
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let output = BufReader::new(child.stdout.take().unwrap());
    let reader = std::thread::spawn(move || {
        let lines = output.lines().map_while(Result::ok);
        // The test harness's output comes first, and the last line may be truncated.
        let numbers =
            lines.filter_map(|line| line.strip_prefix("done ")?.strip_suffix('.')?.parse().ok());
        numbers.last().unwrap_or(0)
    });
    std::thread::sleep(instant);
    child.kill().unwrap();
    child.wait().unwrap();
    reader.join().unwrap()
}

#[test]
#[ignore = "the child process of the other test"]
fn writes_until_it_is_killed() {
    let Some(file) = std::env::var_os(FILE) else {
        return;
    };
    let mut world = World::open(Path::new(&file)).unwrap();
    ledger::begin(&mut world);
    let mut output = std::io::stdout().lock();
    for n in ledger::last_step(&world) + 1.. {
        assert!(ledger::step(&mut world, n));
        writeln!(output, "done {n}.").unwrap();
    }
}
