//! The subsystems of a demo, and a network of its own: the multicast group and ports that keep it apart from other demos on
//! the same host, whose components have the same ids.

use std::net::SocketAddrV4;

use jaus::link::{Group, STANDARD_GROUP};
use jaus_cli::failure::Failure;
use jaus_files::{FileLock, Readers};
use jaus_view::debug::DebugAddress;

/// The operator's subsystem.
pub(super) const OPERATOR: u16 = 42;
/// The vehicle's subsystem.
pub(super) const VEHICLE: u16 = 101;
/// The maximum number of demos on one host.
const MOST: u16 = 16;

/// The first demo has the standard group, the next ones the ports above it.
pub(super) struct OwnNetwork {
    number: u16,
    /// Locked until the process ends, however it ends; none where no file can be written.
    _lock: Option<FileLock>,
}

impl OwnNetwork {
    /// Takes the first network that no other demo has.
    pub(super) fn take() -> Result<Self, Failure> {
        let free = (0..MOST).find_map(|number| {
            let path = std::env::temp_dir().join(format!("jaus-demo-{number}.lock"));
            // The demos of all users share the network.
            let _lock = match FileLock::try_at(&path, Readers::Everyone) {
                Ok(lock) => Some(lock?),
                Err(_) => None,
            };
            Some(Self { number, _lock })
        });
        free.ok_or_else(|| Failure::new(format!("{MOST} demos run on this computer: end one")))
    }

    /// Whether another demo has the standard group.
    pub(super) const fn is_further(&self) -> bool {
        self.number > 0
    }

    pub(super) fn group(&self) -> Group {
        let port = STANDARD_GROUP.port() + self.number;
        Group::At(SocketAddrV4::new(*STANDARD_GROUP.ip(), port))
    }

    /// The address of the debug view.
    pub(super) fn debug(&self) -> DebugAddress {
        DebugAddress::usual(self.number)
    }

    /// The flags by which other commands join this network.
    pub(super) fn flags(&self) -> String {
        match self.is_further() {
            true => format!("--loopback --group {}", self.group()),
            false => "--loopback".to_owned(),
        }
    }

    /// The flag by which `jaus watch` finds the debug view.
    pub(super) fn watch_flags(&self) -> String {
        match self.is_further() {
            true => format!(" --at {}", self.debug()),
            false => String::new(),
        }
    }
}
