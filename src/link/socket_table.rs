//! Linux's tables of sockets. `/proc/net/udp`: the holder of a port, and the kernel's drop counts.
//! `/proc/net/tcp`: whose process is at the other end of a connection within this host.
//!
//! Other systems have no such table, so nothing is found there.

use std::fs;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr};

/// One socket.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Entry {
    ip: IpAddr,
    port: u16,
    /// The user id of its owner.
    pub(super) uid: u32,
    /// Its inode number.
    pub(super) inode: u64,
    /// Datagrams dropped because its receive buffer was full.
    pub(super) drops: u64,
}

impl Entry {
    /// Whether this socket is bound to the address, or to its port on all addresses. A socket on
    /// all IPv6 addresses blocks IPv4 too.
    pub(super) fn keeps_from(&self, address: SocketAddr) -> bool {
        let all = self.ip.is_unspecified() && (self.ip.is_ipv6() || address.is_ipv4());
        self.port == address.port() && (all || self.ip == address.ip())
    }
}

/// All sockets that this host lists.
pub(super) fn all() -> Vec<Entry> {
    let tables = ["/proc/net/udp", "/proc/net/udp6"].map(fs::read_to_string);
    once(tables.iter().flatten().flat_map(|table| read(table)))
}

/// Removes duplicates: while other sockets are opened and closed, the table may list one twice.
fn once(entries: impl Iterator<Item = Entry>) -> Vec<Entry> {
    let mut entries: Vec<_> = entries.collect();
    entries.sort_by_key(|entry| entry.inode);
    // Sockets that no process holds have inode 0.
    entries.dedup_by(|next, before| next.inode != 0 && next.inode == before.inode);
    entries
}

/// The inode of one of this process's sockets.
#[cfg(unix)]
pub(super) fn inode_of(socket: &impl std::os::fd::AsRawFd) -> Option<u64> {
    let socket = fs::metadata(format!("/proc/self/fd/{}", socket.as_raw_fd()));
    socket
        .ok()
        .map(|socket| std::os::unix::fs::MetadataExt::ino(&socket))
}

#[cfg(not(unix))]
pub(super) fn inode_of<S>(_: &S) -> Option<u64> {
    None
}

/// Whether a TCP connection from `peer` to `here` comes from a process of this host that is neither root's nor of the
/// user of this process. Every user reaches a port of loopback. Systems other than Linux do not tell.
#[must_use]
pub fn is_of_another_user(peer: SocketAddr, here: SocketAddr) -> bool {
    let tables = ["/proc/net/tcp", "/proc/net/tcp6"].map(fs::read_to_string);
    let user = tables
        .iter()
        .flatten()
        .find_map(|table| user_of(table, peer, here));
    match user {
        Some(uid) => !is_ours(uid),
        // Another host, or a process that has closed its end.
        None => cfg!(target_os = "linux") && peer.ip().to_canonical().is_loopback(),
    }
}

/// Whether it is root, or the user of this process.
pub(crate) fn is_ours(uid: u32) -> bool {
    #[cfg(unix)]
    return uid == 0 || uid == rustix::process::geteuid().as_raw();
    #[cfg(not(unix))]
    return uid == 0;
}

/// The user of the process at one end of a connection: once it has closed its socket, the table names root.
fn user_of(table: &str, its: SocketAddr, other: SocketAddr) -> Option<u32> {
    const ESTABLISHED: &str = "01";
    let is = |column: &str, wanted: SocketAddr| {
        let end = column.split_once(':').and_then(|(ip, port)| {
            Some((
                address(ip)?.to_canonical(),
                u16::from_str_radix(port, 16).ok()?,
            ))
        });
        end == Some((wanted.ip().to_canonical(), wanted.port()))
    };
    table.lines().skip(1).find_map(|line| {
        let columns: Vec<&str> = line.split_whitespace().collect();
        let [_, from, to, state, _, _, _, uid, ..] = columns[..] else {
            return None;
        };
        let is_it = state == ESTABLISHED && is(from, its) && is(to, other);
        is_it.then(|| uid.parse().ok()).flatten()
    })
}

fn read(table: &str) -> impl Iterator<Item = Entry> + '_ {
    table.lines().skip(1).filter_map(|line| {
        let columns: Vec<&str> = line.split_whitespace().collect();
        let (ip, port) = columns.get(1)?.split_once(':')?;
        Some(Entry {
            ip: address(ip)?,
            port: u16::from_str_radix(port, 16).ok()?,
            uid: columns.get(7)?.parse().ok()?,
            inode: columns.get(9)?.parse().ok()?,
            drops: columns.last()?.parse().ok()?,
        })
    })
}

/// The table has addresses as hexadecimal words in the host's byte order.
fn address(words: &str) -> Option<IpAddr> {
    let word = |at: usize| u32::from_str_radix(words.get(at..at + 8)?, 16).ok();
    if words.len() == 8 {
        return Some(Ipv4Addr::from(word(0)?.to_ne_bytes()).into());
    }
    let mut octets = [0; 16];
    for (i, four) in octets.chunks_exact_mut(4).enumerate() {
        four.copy_from_slice(&word(8 * i)?.to_ne_bytes());
    }
    Some(Ipv6Addr::from(octets).into())
}

#[cfg(test)]
#[cfg(target_endian = "little")]
mod tests {
    use super::*;

    const TABLE: &str = "   sl  local_address rem_address   st tx_queue rx_queue tr tm->when retrnsmt   uid  timeout inode ref pointer drops
  107: 0100007F:0ED2 00000000:0000 07 00000000:00000000 00:00000000 00000000  1000        0 4242 2 0000000000000000 9
  108: 00000000:0035 00000000:0000 07 00000000:00000000 00:00000000 00000000     0        0 77 2 0000000000000000 0
  109: 00000000000000000000000001000000:0ED2 00000000000000000000000000000000:0000 07 00000000:00000000 00:00000000 00000000     0        0 66 2 0000000000000000 0
  110: 00000000000000000000000000000000:0ED3 00000000000000000000000000000000:0000 07 00000000:00000000 00:00000000 00000000     0        0 67 2 0000000000000000 0
garbage
";

    fn in_the_way(address: &str) -> Vec<u64> {
        let address = address.parse().unwrap();
        read(TABLE)
            .filter(|e| e.keeps_from(address))
            .map(|e| e.inode)
            .collect()
    }

    #[test]
    fn the_socket_bound_to_the_address_or_to_all_is_found() {
        assert_eq!(in_the_way("127.0.0.1:3794"), [4242]);
        assert_eq!(in_the_way("10.0.0.1:53"), [77]);
        assert_eq!(in_the_way("[::1]:3794"), [66]);
        assert_eq!(in_the_way("[fe80::1]:3795"), [67]);
        assert_eq!(in_the_way("10.0.0.1:3795"), [67]);
    }

    #[test]
    fn a_socket_of_another_address_or_port_is_not_blamed() {
        assert!(in_the_way("127.0.0.2:3794").is_empty());
        assert!(in_the_way("127.0.0.1:3796").is_empty());
        assert!(in_the_way("[::1]:53").is_empty());
    }

    #[test]
    fn a_socket_that_is_told_of_twice_counts_once() {
        let inodes: Vec<u64> = once(read(TABLE).chain(read(TABLE)))
            .iter()
            .map(|e| e.inode)
            .collect();
        assert_eq!(inodes, [66, 67, 77, 4242]);
    }

    #[test]
    fn the_user_at_the_other_end_of_a_connection_is_found_until_it_closes() {
        const TABLE: &str = "  sl  local_address rem_address   st tx_queue rx_queue tr tm->when retrnsmt   uid  timeout inode
   0: 0100007F:223D 0100007F:9C40 01 00000000:00000000 00:00000000 00000000  1000        0 11 1 0 20 4 30 10 -1
   1: 0100007F:9C40 0100007F:223D 01 00000000:00000000 00:00000000 00000000 65534        0 12 1 0 20 4 30 10 -1
   2: 0100007F:9C41 0100007F:223D 05 00000000:00000000 00:00000000 00000000     0        0 0 1 0 20 4 30 10 -1
   3: 0000000000000000FFFF00000100007F:9C42 0000000000000000FFFF00000100007F:223D 01 00000000:00000000 00:00000000 00000000 1001 0 13 1
";
        let user = |port: u16| {
            let end = |port: u16| SocketAddr::from((Ipv4Addr::LOCALHOST, port));
            user_of(TABLE, end(port), end(8765))
        };
        assert_eq!(user(40_000), Some(65_534));
        assert_eq!(user(40_001), None, "it has no user any more");
        assert_eq!(user(40_002), Some(1001));
        assert_eq!(user(40_003), None);
    }

    #[test]
    fn owner_and_drops_are_read() {
        let first = read(TABLE).next().unwrap();
        assert_eq!((first.uid, first.drops), (1000, 9));
    }
}
