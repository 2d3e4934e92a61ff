//! The vehicle, a well-behaved client, and observations of both.

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};

use crate::testbed::{Host, Testbed};
use jaus_test_kit::hosts::{Process, on_hosts};
use jaus_test_kit::vehicle_process::VehicleProcess;
use jaus_test_kit::waiting::block_until;
use tempfile::NamedTempFile;

/// `MemoryMax` of the packaged services, in KiB.
pub(crate) const MEMORY: u64 = 64 * 1024;

/// Permitted number of answers, at 20 Hz, between two events at 25 Hz: more than on a busy machine,
/// and fewer than if the events went to an address that was taken over.
pub(crate) const ANSWERS: u64 = 50;

/// Permitted number of queries of a newcomer until the first answer. Most get it at once.
const QUERIES: u64 = 3;

/// A vehicle and a client that has found it.
pub(crate) struct Scene<'a> {
    pub(crate) bed: &'a Testbed,
    pub(crate) vehicle: VehicleProcess,
    pub(crate) client: Process,
    /// The log of the vehicle.
    log: NamedTempFile,
}

/// Numbers that a process has printed, by name.
pub(crate) type Figures = BTreeMap<String, u64>;

pub(crate) fn figures(line: &str) -> Figures {
    let pairs = line.split(' ').filter_map(|word| word.split_once('='));
    pairs
        .map(|(name, number)| (name.to_owned(), number.parse().unwrap()))
        .collect()
}

impl<'a> Scene<'a> {
    /// Starts the vehicle with flags, and the client with settings.
    pub(crate) fn start(bed: &'a Testbed, flags: &[&str], settings: &str) -> Self {
        let arguments = [&["vehicle", "--id", "101.1.1"], flags].concat();
        let log = NamedTempFile::new().unwrap();
        let mut vehicle = bed.jaus(Host::Vehicle, &arguments);
        let vehicle = VehicleProcess::start(vehicle.stderr(log.reopen().unwrap()));
        let client = bed.start(Host::Controller, "client", settings);
        client.says("client");
        Self {
            bed,
            vehicle,
            client,
            log,
        }
    }

    /// Waits until the vehicle has logged a warning that contains this text.
    pub(crate) fn warns(&self, text: &str) {
        block_until(|| {
            let log = std::fs::read_to_string(&self.log).unwrap();
            let mut lines = log.lines();
            lines.any(|line| line.contains("WARN") && line.contains(text))
        });
    }

    /// Runs an attack to its end. Returns the attacker's figures.
    pub(crate) fn attack(&self, name: &str) -> Figures {
        self.attack_with(name, "")
    }

    /// Runs an attack with these settings to its end. Returns the attacker's figures.
    pub(crate) fn attack_with(&self, name: &str, settings: &str) -> Figures {
        let attacker = self.bed.start(Host::Strangers, name, settings);
        figures(&attacker.says("attack"))
    }

    /// The client's next complete report.
    pub(crate) fn client(&self) -> Figures {
        self.client.says("client");
        figures(&self.client.says("client"))
    }

    /// Peak memory of the vehicle, in KiB.
    pub(crate) fn memory(&self) -> u64 {
        memory(self.vehicle.id())
    }

    /// Starts a newcomer. Checks that it finds the vehicle and gets an answer after few queries,
    /// and waits until the vehicle's directory lists it. Ends the vehicle. Returns how long the
    /// newcomer took, in ms.
    pub(crate) fn welcomes_newcomer(self, settings: &str) -> u64 {
        let newcomer = self.bed.start(Host::Observer, "newcomer", settings);
        let seen = figures(&newcomer.says("newcomer"));
        assert!(seen["queries"] <= QUERIES, "{seen:?}");
        self.vehicle.says("104.1.1");
        seen["ms"]
    }
}

/// Attempts per test: other load on the machine can starve the attacked program more than any
/// attack.
const ATTEMPTS: u32 = 3;

/// Runs the body of a test until it passes once.
pub(crate) fn on_testbed(body: impl Fn(&Testbed)) {
    for attempt in 1..=ATTEMPTS {
        let run = || on_hosts(Testbed::new, &body);
        match catch_unwind(AssertUnwindSafe(run)) {
            Ok(()) => {
                return;
            }
            Err(failure) if attempt == ATTEMPTS => resume_unwind(failure),
            Err(_) => println!("attempt {attempt} of {ATTEMPTS} has failed"),
        }
    }
}

pub(crate) fn on_scene(flags: &[&str], body: impl Fn(Scene<'_>)) {
    on_testbed(|bed| body(Scene::start(bed, flags, "")));
}

/// Peak memory of a process in KiB, without the pages of its program file: an unoptimised program
/// has many, and the kernel need not keep them.
pub(crate) fn memory(process: u32) -> u64 {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).unwrap();
    let number = |name| {
        let line = status.lines().find_map(|line| line.strip_prefix(name));
        let number = line.unwrap().trim().trim_end_matches(" kB");
        number.parse::<u64>().unwrap()
    };
    number("VmHWM:") - number("RssFile:")
}
