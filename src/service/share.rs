//! Fair shares of a bounded table among the network addresses of its entries, so that one host
//! cannot fill it.

use std::collections::BTreeMap;
use std::net::IpAddr;

use crate::endpoint::{LinkId, Received, Remote, SessionId, quota_address};

/// The origin of an entry.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) enum Share {
    /// A component of the same node.
    Here,
    /// A network address, or a network that one host may own entirely.
    Address(IpAddr),
    /// A serial line.
    Line(LinkId),
    /// An authenticated session.
    Session(LinkId, SessionId),
}

impl Share {
    /// The origin of a message.
    pub(super) fn of(received: &Received) -> Self {
        let Some(path) = received.path else {
            return Self::Here;
        };
        match path.peer {
            Remote::Line => Self::Line(path.link),
            Remote::Session(session) => Self::Session(path.link, session),
            Remote::Socket(address) => Self::Address(quota_address(address.ip())),
        }
    }
}

/// How much of a bounded table each share has taken.
///
/// The table holds twice `most` entries. The first half is first come, first served. Of the second
/// half a share gets at most an eighth of the free entries, so that a newcomer finds room.
#[derive(Debug)]
pub(super) struct Shares {
    most: usize,
    total: usize,
    taken: BTreeMap<Share, usize>,
}

impl Shares {
    pub(super) const fn new(most: usize) -> Self {
        Self {
            most,
            total: 0,
            taken: BTreeMap::new(),
        }
    }

    /// Whether a share may take `more` entries.
    pub(super) fn has_room(&self, share: Share, more: usize) -> bool {
        if self.total.saturating_add(more) <= self.most {
            return true;
        }
        let free = self.most.saturating_mul(2).saturating_sub(self.total);
        let taken = self.taken.get(&share).copied().unwrap_or(0);
        more <= free && taken.saturating_add(more) <= (free / 8).max(1)
    }

    /// Whether a share holds nothing.
    pub(super) fn is_unused(&self, share: Share) -> bool {
        !self.taken.contains_key(&share)
    }

    pub(super) fn take(&mut self, share: Share, more: usize) {
        if more > 0 {
            *self.taken.entry(share).or_default() += more;
            self.total += more;
        }
    }

    pub(super) fn give_back(&mut self, share: Share, less: usize) {
        if let Some(taken) = self.taken.get_mut(&share) {
            let less = less.min(*taken);
            *taken -= less;
            self.total -= less;
            if *taken == 0 {
                self.taken.remove(&share);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::net::Ipv4Addr;

    fn host(number: u32) -> Share {
        Share::Address(Ipv4Addr::from_bits(number).into())
    }

    #[test]
    fn a_newcomer_finds_room_however_many_others_take_all_they_can() {
        for others in 0..50 {
            let mut shares = Shares::new(1000);
            for other in 0..others {
                while shares.has_room(host(other), 1) {
                    shares.take(host(other), 1);
                }
            }
            assert!(shares.has_room(host(u32::MAX), 1), "{others} others");
            assert!(shares.total <= 2000);
        }
    }

    #[test]
    fn one_address_alone_gets_the_most_and_what_it_gives_back_is_free_again() {
        let mut shares = Shares::new(8);
        assert!(shares.has_room(host(1), 8) && !shares.has_room(host(1), 9));
        shares.take(host(1), 8);
        assert!(!shares.has_room(host(1), 1));
        shares.give_back(host(1), 3);
        assert!(shares.has_room(host(1), 3) && !shares.has_room(host(1), 4));
    }
}
