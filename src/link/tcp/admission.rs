//! Admission control: decides whether a new connection gets a place, and which connection it
//! displaces.
//!
//! The node cannot tell a peer from an attacker before data arrives, and not always then. So places
//! are shared among network addresses: no address gets more than its quota, and when all places are
//! taken, the address with the most places gives one up. An idle peer keeps its connection while
//! there is room.

use std::cmp::Reverse;
use std::collections::BTreeMap;
use std::net::{IpAddr, SocketAddr};
use std::time::Instant;

use super::settings::{HANDSHAKE, Settings};
use crate::endpoint::quota_address;

/// An accepted connection.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub(super) remote: SocketAddr,
    pub(super) opened: Instant,
    /// When the last valid message arrived.
    pub(super) heard: Option<Instant>,
}

/// The decision about a new connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Admission {
    /// There is room.
    Admit,
    /// There is room after closing this connection, which has sent nothing valid within
    /// [`HANDSHAKE`].
    ReplaceSilent(SocketAddr),
    /// There is room after closing this connection: its network address has the most places, and it
    /// has been idle the longest.
    ReplaceIdle(SocketAddr),
    /// There is no room.
    Refuse,
}

impl Settings {
    /// Decides about a new connection from `remote`, given the accepted connections.
    pub(super) fn admit(&self, remote: SocketAddr, places: &[Place], now: Instant) -> Admission {
        let newcomer = quota_address(remote.ip());
        let mut held = BTreeMap::<IpAddr, usize>::new();
        for place in places {
            *held.entry(place.source()).or_default() += 1;
        }
        let held_by = |source| held.get(&source).copied().unwrap_or_default();
        let own = held_by(newcomer);
        if own >= self.max_per_address {
            let own = places.iter().filter(|place| place.source() == newcomer);
            return longest_silent(own, now).unwrap_or(Admission::Refuse);
        }
        if places.len() < self.max_accepted {
            return Admission::Admit;
        }
        let idle = || {
            // An address with one place gives it up for an address with none.
            let gives = |place: &&Place| own == 0 || held_by(place.source()) > own + 1;
            let key =
                |place: &&Place| (Reverse(held_by(place.source())), place.heard, place.opened);
            let longest = places.iter().filter(gives).min_by_key(key)?;
            Some(Admission::ReplaceIdle(longest.remote))
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
#[expect(
    clippy::disallowed_methods,
    reason = "the test starts at an arbitrary instant"
)]
mod tests {
    use std::time::Duration;

    use super::*;

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
        let settings = Settings {
            max_accepted: 4,
            max_per_address: 3,
            ..Settings::default()
        };
        let now = start + Duration::from_secs(after);
        settings.admit(remote(newcomer), &places, now)
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
