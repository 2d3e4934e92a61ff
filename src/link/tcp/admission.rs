//! Whether a new connection gets a place, and which other connection loses its own for it.
//!
//! The node cannot tell a peer from an attacker before something arrives, and not always then. So
//! places are shared between network addresses: no address holds more than its quota, and when all
//! places are taken, the address that holds the most gives one up. An idle peer keeps its connection
//! as long as there is room.

use std::cmp::Reverse;
use std::collections::BTreeMap;
use std::net::{IpAddr, SocketAddr};
use std::time::Instant;

use super::settings::HANDSHAKE;
use crate::endpoint::quota_address;

/// The most connections that others may open.
#[derive(Clone, Copy, Debug)]
pub(super) struct Quota {
    /// All together.
    pub(super) total: usize,
    /// From one network address.
    pub(super) per_address: usize,
}

/// A connection that somebody else has opened.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub(super) remote: SocketAddr,
    pub(super) opened: Instant,
    /// When the latest valid message came.
    pub(super) heard: Option<Instant>,
}

/// The answer to a newcomer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Admission {
    /// There is room.
    Admit,
    /// There is room once this connection is closed, which has said nothing valid in its time.
    ReplaceSilent(SocketAddr),
    /// There is room once this connection is closed: its network address holds the most places,
    /// and it has been idle for longest.
    ReplaceIdle(SocketAddr),
    /// There is no room.
    Refuse,
}

impl Quota {
    /// Decides about a newcomer at `remote`, given the connections that others have opened.
    pub(super) fn admit(self, remote: SocketAddr, places: &[Place], now: Instant) -> Admission {
        let newcomer = quota_address(remote.ip());
        let mut held = BTreeMap::<IpAddr, usize>::new();
        for place in places {
            *held.entry(place.source()).or_default() += 1;
        }
        let held_by = |source| held.get(&source).copied().unwrap_or_default();
        let own = held_by(newcomer);
        if own >= self.per_address {
            let own = places.iter().filter(|place| place.source() == newcomer);
            return longest_silent(own, now).unwrap_or(Admission::Refuse);
        }
        if places.len() < self.total {
            return Admission::Admit;
        }
        let idle = || {
            let others = places
                .iter()
                .filter(|place| held_by(place.source()) > own + 1);
            // An address with one place gives it up for one without, the longest idle of all.
            let any = places.iter().filter(|_| own == 0);
            let key =
                |place: &&Place| (Reverse(held_by(place.source())), place.heard, place.opened);
            others
                .chain(any)
                .min_by_key(key)
                .map(|place| Admission::ReplaceIdle(place.remote))
        };
        longest_silent(places.iter(), now)
            .or_else(idle)
            .unwrap_or(Admission::Refuse)
    }
}

impl Place {
    fn source(&self) -> IpAddr {
        quota_address(self.remote.ip())
    }

    fn is_silent(&self, now: Instant) -> bool {
        self.heard.is_none() && now.saturating_duration_since(self.opened) >= HANDSHAKE
    }
}

fn longest_silent<'a>(places: impl Iterator<Item = &'a Place>, now: Instant) -> Option<Admission> {
    let silent = places.filter(|place| place.is_silent(now));
    let oldest = silent.min_by_key(|place| place.opened)?;
    Some(Admission::ReplaceSilent(oldest.remote))
}

#[cfg(test)]
#[expect(clippy::disallowed_methods, reason = "a test needs some instant")]
mod tests {
    use std::time::Duration;

    use super::*;

    const QUOTA: Quota = Quota {
        total: 4,
        per_address: 3,
    };

    fn remote(text: &str) -> SocketAddr {
        text.parse().unwrap()
    }

    /// One connection, opened at second 0; `heard` are seconds.
    fn place(start: Instant, text: &str, heard: Option<u64>) -> Place {
        Place {
            remote: remote(text),
            opened: start,
            heard: heard.map(|seconds| start + Duration::from_secs(seconds)),
        }
    }

    fn admit(places: &[(&str, Option<u64>)], newcomer: &str, after: u64) -> Admission {
        let start = Instant::now();
        let places: Vec<_> = places
            .iter()
            .map(|(text, heard)| place(start, text, *heard))
            .collect();
        QUOTA.admit(
            remote(newcomer),
            &places,
            start + Duration::from_secs(after),
        )
    }

    #[test]
    fn an_address_that_holds_the_most_places_gives_up_the_longest_idle() {
        let places = [
            ("10.0.0.1:1", Some(20)),
            ("10.0.0.1:2", Some(10)),
            ("10.0.0.1:3", Some(30)),
            ("10.0.0.2:1", Some(1)),
        ];
        let idle = Admission::ReplaceIdle(remote("10.0.0.1:2"));
        assert_eq!(admit(&places, "10.0.0.3:1", 60), idle);
        assert_eq!(admit(&places, "10.0.0.2:2", 60), idle);
        assert_eq!(
            admit(&places, "10.0.0.1:4", 60),
            Admission::Refuse,
            "its quota"
        );
    }

    #[test]
    fn addresses_do_not_take_places_from_each_other_for_more_than_their_share() {
        let places = [
            ("10.0.0.1:1", Some(1)),
            ("10.0.0.1:2", Some(2)),
            ("10.0.0.2:1", Some(3)),
            ("10.0.0.2:2", Some(4)),
        ];
        assert_eq!(admit(&places, "10.0.0.1:3", 60), Admission::Refuse);
        let idle = Admission::ReplaceIdle(remote("10.0.0.1:1"));
        assert_eq!(admit(&places, "10.0.0.3:1", 60), idle);
        let one_each = [
            ("10.0.0.1:1", Some(4)),
            ("10.0.0.2:1", Some(2)),
            ("10.0.0.3:1", Some(3)),
            ("10.0.0.4:1", Some(5)),
        ];
        let idle = Admission::ReplaceIdle(remote("10.0.0.2:1"));
        assert_eq!(admit(&one_each, "10.0.0.5:1", 60), idle);
        assert_eq!(admit(&one_each, "10.0.0.2:2", 60), Admission::Refuse);
    }

    #[test]
    fn who_has_said_nothing_in_its_time_gives_way_first() {
        let places = [
            ("10.0.0.1:1", Some(1)),
            ("10.0.0.1:2", Some(2)),
            ("10.0.0.1:3", Some(3)),
            ("10.0.0.2:1", None),
        ];
        let silent = Admission::ReplaceSilent(remote("10.0.0.2:1"));
        assert_eq!(admit(&places, "10.0.0.3:1", 5), silent);
        let idle = Admission::ReplaceIdle(remote("10.0.0.1:1"));
        assert_eq!(admit(&places, "10.0.0.3:1", 4), idle);
    }

    #[test]
    fn the_addresses_of_one_ipv6_network_and_both_forms_of_ipv4_share_a_quota() {
        let places = [
            ("[fd00::1]:1", Some(1)),
            ("[fd00::2]:1", Some(1)),
            ("[fd00::3]:1", Some(1)),
        ];
        assert_eq!(admit(&places, "[fd00::4]:1", 60), Admission::Refuse);
        assert_eq!(admit(&places, "[fd00:0:0:1::4]:1", 60), Admission::Admit);
        let places = [
            ("10.0.0.1:1", Some(1)),
            ("10.0.0.1:2", Some(1)),
            ("10.0.0.1:3", Some(1)),
        ];
        assert_eq!(admit(&places, "[::ffff:10.0.0.1]:9", 60), Admission::Refuse);
    }
}
