//! Who holds a UDP port: asked only when binding failed, to put a name into the error.
//!
//! Linux tells through `/proc`; elsewhere, and for processes of other users, the answer is
//! [`Holder::Unknown`] or [`Holder::User`].

use std::fmt;
use std::fs;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};

/// The owner of a socket, as far as this host tells.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Holder {
    /// This very process: two nodes of one program.
    Ourselves,
    /// A process that we may look at.
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
    /// The host does not tell.
    Unknown,
}

impl fmt::Display for Holder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Ourselves => f.write_str(" by this very process"),
            Self::Process { pid, name } => write!(f, " by process {pid} ({name})"),
            Self::User { uid } => write!(f, " by a process of user {uid}"),
            Self::Unknown => Ok(()),
        }
    }
}

impl Holder {
    /// Finds who keeps us from binding to `address`.
    pub(super) fn of(address: SocketAddr) -> Self {
        let tables = ["/proc/net/udp", "/proc/net/udp6"].map(|t| fs::read_to_string(t).ok());
        let Some(entry) = tables
            .iter()
            .flatten()
            .find_map(|table| find(table, address))
        else {
            return Self::Unknown;
        };
        process_with_socket(entry.inode).unwrap_or(Self::User { uid: entry.uid })
    }
}

#[derive(Debug, PartialEq, Eq)]
struct Entry {
    uid: u32,
    inode: u64,
}

/// The first socket in the table that is bound to this port of this address or of all.
fn find(table: &str, address: SocketAddr) -> Option<Entry> {
    table.lines().skip(1).find_map(|line| {
        let mut columns = line.split_whitespace();
        let (ip, port) = columns.nth(1)?.split_once(':')?;
        let port = u16::from_str_radix(port, 16).ok()?;
        if port != address.port() || !overlaps(ip, address.ip()) {
            return None;
        }
        // After the local address: remote, state, queues, timer, retransmits, then the user.
        let uid = columns.nth(5)?.parse().ok()?;
        let inode = columns.nth(1)?.parse().ok()?;
        Some(Entry { uid, inode })
    })
}

/// The table shows addresses as hexadecimal words in the host's byte order.
fn overlaps(table: &str, wanted: IpAddr) -> bool {
    if table.bytes().all(|digit| digit == b'0') {
        return true;
    }
    match (u32::from_str_radix(table, 16), wanted) {
        (Ok(word), IpAddr::V4(v4)) => Ipv4Addr::from(word.to_ne_bytes()) == v4,
        _ => false,
    }
}

fn process_with_socket(inode: u64) -> Option<Holder> {
    let wanted = format!("socket:[{inode}]");
    let pids = fs::read_dir("/proc").ok()?.flatten().filter_map(|entry| {
        entry
            .file_name()
            .to_str()
            .and_then(|name| name.parse::<u32>().ok())
    });
    for pid in pids {
        let Ok(files) = fs::read_dir(format!("/proc/{pid}/fd")) else {
            continue;
        };
        let holds = |file: fs::DirEntry| {
            fs::read_link(file.path()).is_ok_and(|target| target.to_str() == Some(&wanted))
        };
        if files.flatten().any(holds) {
            return Some(describe(pid));
        }
    }
    None
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

#[cfg(test)]
#[cfg(target_endian = "little")]
mod tests {
    use super::*;

    const TABLE: &str = "   sl  local_address rem_address   st tx_queue rx_queue tr tm->when retrnsmt   uid  timeout inode ref pointer drops
  107: 0100007F:0ED2 00000000:0000 07 00000000:00000000 00:00000000 00000000  1000        0 4242 2 0000000000000000 0
  108: 00000000:0035 00000000:0000 07 00000000:00000000 00:00000000 00000000     0        0 77 2 0000000000000000 0
garbage
";

    #[test]
    fn the_socket_bound_to_the_address_or_to_all_is_found() {
        let bound = find(TABLE, "127.0.0.1:3794".parse().unwrap());
        assert_eq!(
            bound,
            Some(Entry {
                uid: 1000,
                inode: 4242
            })
        );
        let to_all = find(TABLE, "10.0.0.1:53".parse().unwrap());
        assert_eq!(to_all, Some(Entry { uid: 0, inode: 77 }));
    }

    #[test]
    fn a_socket_of_another_address_or_port_is_not_blamed() {
        assert_eq!(find(TABLE, "127.0.0.2:3794".parse().unwrap()), None);
        assert_eq!(find(TABLE, "127.0.0.1:3795".parse().unwrap()), None);
    }
}
