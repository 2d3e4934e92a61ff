//! The system as built into a vehicle: four hosts, two networks, and each part a process.
//!
//! ```text
//!  board A ── vehicle's network ── communicator ── operator's network ── operator
//!  board B ──┘
//! ```

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};

use jaus_test_kit::hosts::ip;

/// Address of the operator's page, on the operator's own host.
pub(crate) const PAGE: &str = "http://127.0.0.1:8080/";

/// A host of the system.
#[derive(Clone, Copy)]
enum Host {
    Communicator,
    BoardA,
    BoardB,
    Operator,
}

const HOSTS: [&str; 4] = ["communicator", "board-a", "board-b", "operator"];

/// The programs with their hosts and flags, in start order.
const PROGRAMS: [(&str, Host, &[&str]); 9] = [
    ("jaus-communicator", Host::Communicator, &[]),
    ("jaus-primitive-driver", Host::BoardA, &[]),
    ("jaus-velocity-state-sensor", Host::BoardA, &[]),
    (
        "jaus-local-pose-sensor",
        Host::BoardA,
        &["--state", "pose.toml"],
    ),
    ("jaus-vector-knowledge-store", Host::BoardB, &["--demo-map"]),
    ("jaus-local-vector-driver", Host::BoardB, &[]),
    ("jaus-local-path-segment-driver", Host::BoardB, &[]),
    // A machine that is busy delays samples, which is a fault; the tests of the vehicle continue by hand.
    ("jaus-planner", Host::BoardB, &["--retries", "20"]),
    (
        "jaus-ocu",
        Host::Operator,
        &["--listen", "127.0.0.1:8080", "--unprotected"],
    ),
];

/// Programs that have not been built; the system needs all of them.
pub(crate) fn missing() -> Vec<&'static str> {
    let programs = PROGRAMS.iter().map(|(name, ..)| *name);
    programs.filter(|name| !program(name).exists()).collect()
}

/// Path of one of our programs, which are all in one directory.
pub(crate) fn program(name: &str) -> PathBuf {
    Path::new(env!("CARGO_BIN_EXE_jaus")).with_file_name(name)
}

/// Four hosts and their processes; all removed when dropped.
pub(crate) struct System {
    names: [String; 4],
    directory: PathBuf,
    /// Flags of programs that replace the usual ones.
    flags: BTreeMap<&'static str, Vec<String>>,
    running: RefCell<BTreeMap<&'static str, Child>>,
}

impl System {
    /// Creates the hosts and their networks.
    ///
    /// # Errors
    /// If this machine does not permit it.
    pub(crate) fn new() -> Result<Self, String> {
        static NUMBER: AtomicU32 = AtomicU32::new(0);
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let number = format!("{}-{number}", std::process::id());
        let system = Self {
            names: HOSTS.map(|host| format!("jaus-{number}-{host}")),
            directory: Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("system-{number}")),
            flags: BTreeMap::new(),
            running: RefCell::default(),
        };
        for name in &system.names {
            ip(&["netns", "add", name])?;
            ip(&["-n", name, "link", "set", "lo", "up"])?;
        }
        // The vehicle's network is a switch on the communicator's host.
        let communicator = system.name(Host::Communicator);
        ip(&[
            "-n",
            communicator,
            "link",
            "add",
            "vehicle",
            "type",
            "bridge",
            "mcast_snooping",
            "0",
        ])?;
        system.address(Host::Communicator, "vehicle", "10.214.1.1/24")?;
        for (board, port, address) in [
            (Host::BoardA, "port-a", "10.214.1.2/24"),
            (Host::BoardB, "port-b", "10.214.1.3/24"),
        ] {
            system.cable(port, board, "vehicle")?;
            ip(&[
                "-n",
                communicator,
                "link",
                "set",
                port,
                "master",
                "vehicle",
                "up",
            ])?;
            system.address(board, "vehicle", address)?;
        }
        system.cable("operator", Host::Operator, "vehicle")?;
        system.address(Host::Communicator, "operator", "10.214.2.1/24")?;
        system.address(Host::Operator, "vehicle", "10.214.2.2/24")?;
        Ok(system)
    }

    /// Replaces the usual flags of a program.
    pub(crate) fn with_flags(mut self, program: &'static str, flags: &[&str]) -> Self {
        let flags = flags.iter().map(|&flag| flag.to_owned());
        self.flags.insert(program, flags.collect());
        self
    }

    fn name(&self, host: Host) -> &str {
        &self.names[host as usize]
    }

    /// The network namespace of the operator's station and, usually, browser.
    pub(crate) fn operator(&self) -> &str {
        self.name(Host::Operator)
    }

    /// Connects the communicator's host to another host.
    fn cable(&self, port: &str, to: Host, interface: &str) -> Result<(), String> {
        let (from, to) = (self.name(Host::Communicator), self.name(to));
        ip(&[
            "link", "add", port, "netns", from, "type", "veth", "peer", interface, "netns", to,
        ])
    }

    fn address(&self, host: Host, interface: &str, address: &str) -> Result<(), String> {
        let name = self.name(host);
        ip(&["-n", name, "address", "add", address, "dev", interface])?;
        ip(&["-n", name, "link", "set", interface, "up"])
    }

    /// Starts all programs.
    pub(crate) fn start_all(&self) {
        for (name, ..) in PROGRAMS {
            self.start(name);
        }
    }

    /// Names of all programs, in start order.
    pub(crate) fn programs(&self) -> impl Iterator<Item = &'static str> {
        PROGRAMS.iter().map(|(name, ..)| *name)
    }

    /// Starts a program on its host, in a directory for its files and its log.
    pub(crate) fn start(&self, wanted: &'static str) {
        let (name, host, flags) = PROGRAMS.iter().find(|(name, ..)| *name == wanted).unwrap();
        let usual: Vec<_> = flags.iter().map(|&flag| flag.to_owned()).collect();
        let flags = self.flags.get(name).unwrap_or(&usual);
        let directory = self.directory.join(name);
        std::fs::create_dir_all(&directory).unwrap();
        let log = File::options()
            .create(true)
            .append(true)
            .open(directory.join("log"))
            .unwrap();
        let child = Command::new("ip")
            .args(["netns", "exec", self.name(*host)])
            .arg(program(name))
            .args(flags)
            .args([
                "--name",
                if matches!(host, Host::Operator) {
                    "Operator"
                } else {
                    "G-Bat"
                },
            ])
            .current_dir(&directory)
            .env("XDG_STATE_HOME", &directory)
            .stdin(Stdio::null())
            .stdout(log.try_clone().unwrap())
            .stderr(log)
            .spawn()
            .unwrap();
        let before = self.running.borrow_mut().insert(name, child);
        assert!(before.is_none(), "{name} runs already");
    }

    /// Kills a program without warning, as a power cut would.
    pub(crate) fn kill(&self, name: &str) {
        let mut child = self.running.borrow_mut().remove(name).unwrap();
        assert_eq!(
            child.try_wait().unwrap(),
            None,
            "{name} has ended by itself:\n{}",
            self.log(name)
        );
        child.kill().unwrap();
        child.wait().unwrap();
    }

    /// The log of a program.
    pub(crate) fn log(&self, name: &str) -> String {
        std::fs::read_to_string(self.directory.join(name).join("log")).unwrap_or_default()
    }
}

impl Drop for System {
    fn drop(&mut self) {
        let failed = std::thread::panicking();
        for (name, mut child) in std::mem::take(&mut *self.running.borrow_mut()) {
            if failed {
                eprintln!("== {name} ({:?})\n{}", child.try_wait(), self.log(name));
            }
            let _ = child.kill();
            let _ = child.wait();
        }
        for name in &self.names {
            // Missing if the setup failed halfway.
            let _ = ip(&["netns", "delete", name]);
        }
        let _ = std::fs::remove_dir_all(&self.directory);
    }
}
