//! Finds the holder of a UDP port. Only used after binding has failed, to name the holder in the
//! error.
//!
//! Linux reports it in `/proc`. On other systems, and for processes of other users, the result is
//! [`Holder::Unknown`] or [`Holder::User`].

use std::fmt;
use std::fs;
use std::net::SocketAddr;

use super::socket_table;

/// The owner of a socket, as far as this host reports it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Holder {
    /// This process: two nodes of one program.
    Ourselves,
    /// A process that this one may inspect.
    Process {
        /// Its process id.
        pid: u32,
        /// Its name, as in `/proc/<pid>/comm`.
        name: String,
    },
    /// A process of another user.
    User {
        /// The user's numeric id.
        uid: u32,
    },
    /// The host does not report it.
    Unknown,
}

impl fmt::Display for Holder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Ourselves => f.write_str(" by this process"),
            Self::Process { pid, name } => write!(f, " by process {pid} ({name})"),
            Self::User { uid } => write!(f, " by a process of user {uid}"),
            Self::Unknown => Ok(()),
        }
    }
}

impl Holder {
    /// Whether it is a node manager of Junior or of the JAUS Tool Set. (fkie's does not pass
    /// broadcasts for clients of this kind.)
    #[must_use]
    pub fn is_junior(&self) -> bool {
        const NAMES: [&str; 2] = ["JuniorRTE", "NodeManager"];
        matches!(self, Self::Process { name, .. } if NAMES.contains(&name.as_str()))
    }

    /// Finds the socket that prevents binding to `address`.
    pub(super) fn of(address: SocketAddr) -> Self {
        let mut sockets = socket_table::all().into_iter();
        match sockets.find(|entry| entry.keeps_from(address)) {
            Some(entry) => {
                process_with_socket(entry.inode).unwrap_or(Self::User { uid: entry.uid })
            }
            None => Self::Unknown,
        }
    }
}

fn process_with_socket(inode: u64) -> Option<Holder> {
    let wanted = format!("socket:[{inode}]");
    let holds = |pid: &u32| {
        let files = fs::read_dir(format!("/proc/{pid}/fd"))
            .into_iter()
            .flatten();
        let mut targets = files.flatten().flat_map(|file| fs::read_link(file.path()));
        targets.any(|target| target.to_str() == Some(&wanted))
    };
    let processes = fs::read_dir("/proc").ok()?.flatten();
    let mut pids = processes.filter_map(|entry| entry.file_name().to_str()?.parse().ok());
    pids.find(holds).map(describe)
}

fn describe(pid: u32) -> Holder {
    if pid == std::process::id() {
        return Holder::Ourselves;
    }
    let name = fs::read_to_string(format!("/proc/{pid}/comm")).unwrap_or_default();
    Holder::Process {
        pid,
        name: name.trim().to_owned(),
    }
}
