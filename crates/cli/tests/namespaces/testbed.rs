//! Four hosts: the vehicle's, and three others with a cable to it.

use std::process::Command;
use std::sync::atomic::{AtomicU32, Ordering};

use jaus_test_kit::hosts::{Process, add_host, ip, lay_cable, on_host};

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Host {
    Vehicle,
    Controller,
    /// For many components that appear once.
    Strangers,
    /// Observes the vehicle, unaffected by faults of the others.
    Observer,
}

impl Host {
    const ALL: [Self; 4] = [
        Self::Vehicle,
        Self::Controller,
        Self::Strangers,
        Self::Observer,
    ];

    /// The name of the cable to the vehicle, on both ends.
    pub(crate) const fn cable(self) -> &'static str {
        match self {
            Self::Vehicle => "lo",
            Self::Controller => "controller",
            Self::Strangers => "strangers",
            Self::Observer => "observer",
        }
    }
}

/// The vehicle's address on the strangers' cable.
pub(crate) const TO_STRANGERS: &str = "10.216.2.1";
/// The network whose addresses all belong to the strangers' host.
const STRANGERS: &str = "10.217.0.0/16";

/// Four network namespaces; removed when dropped.
pub(crate) struct Testbed {
    prefix: String,
}

impl Testbed {
    pub(crate) fn new() -> Result<Self, String> {
        static NUMBER: AtomicU32 = AtomicU32::new(0);
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let bed = Self {
            prefix: format!("jaus-bed-{}-{number}", std::process::id()),
        };
        bed.set_up().map(|()| bed)
    }

    fn set_up(&self) -> Result<(), String> {
        for host in Host::ALL {
            add_host(&self.name(host))?;
        }
        for (number, host) in (1..).zip(&Host::ALL[1..]) {
            let ends = [self.name(Host::Vehicle), self.name(*host)];
            lay_cable(&ends, host.cable(), &format!("10.216.{number}"))?;
        }
        let [vehicle, strangers] = [Host::Vehicle, Host::Strangers].map(|it| self.name(it));
        let cable = Host::Strangers.cable();
        ip(&["-n", &vehicle, "route", "add", STRANGERS, "dev", cable])?;
        let local = ["route", "add", "local", STRANGERS, "dev", "lo"];
        ip(&[&["-n", &strangers], &local[..]].concat())
    }

    pub(crate) fn name(&self, host: Host) -> String {
        format!("{}-{}", self.prefix, host.cable())
    }

    /// Starts this test binary in a role on a host.
    pub(crate) fn start(&self, host: Host, role: &str, settings: &str) -> Process {
        Process::start(&self.name(host), role, settings)
    }

    /// The tool `jaus` on a host.
    pub(crate) fn jaus(&self, host: Host, arguments: &[&str]) -> Command {
        self.program(host, env!("CARGO_BIN_EXE_jaus"), arguments)
    }

    /// Any program on a host.
    pub(crate) fn program(&self, host: Host, program: &str, arguments: &[&str]) -> Command {
        let mut command = on_host(&self.name(host), program);
        command.args(arguments);
        command
    }

    /// Pulls the controller's cable at one end, or reconnects it.
    pub(crate) fn cable(&self, end: Host, is_in: bool) {
        let state = if is_in { "up" } else { "down" };
        let cable = Host::Controller.cable();
        ip(&["-n", &self.name(end), "link", "set", cable, state]).unwrap();
    }
}

impl Drop for Testbed {
    fn drop(&mut self) {
        for host in Host::ALL {
            // Missing if the setup failed halfway.
            let _ = ip(&["netns", "delete", &self.name(host)]);
        }
    }
}
