//! Joins datagrams that the endpoint gives out one after the other into trains, which leave with
//! one call into the kernel: the fragments of a large message, a burst of small messages, the
//! acknowledgements of what has arrived together.
//!
//! What is on the network stays the same. Nothing waits here: a train leaves as soon as the
//! endpoint has nothing more to give out.

use bytes::BytesMut;

use crate::endpoint::Transmit;

/// Octets of one train: what the kernel takes at once.
const MOST_OCTETS: usize = 65_000;

/// The train that is being made up.
#[derive(Debug, Default)]
pub(super) struct Trains {
    /// Its first datagram, which all others resemble.
    first: Option<Transmit>,
    /// All of them, if there are more.
    octets: BytesMut,
    count: usize,
    /// A shorter datagram is the last.
    complete: bool,
}

impl Trains {
    /// Takes in a datagram for a link that takes so many at once; gives back what is to leave
    /// before it.
    pub(super) fn add(&mut self, next: Transmit, most: usize) -> Option<Transmit> {
        if self.join(&next, most) {
            return None;
        }
        let ready = self.take();
        self.complete = next.segment.is_some();
        self.first = Some(next);
        self.count = 1;
        ready
    }

    /// What has been made up so far.
    pub(super) fn take(&mut self) -> Option<Transmit> {
        let mut train = self.first.take()?;
        if self.count > 1 {
            train.segment = Some(train.payload.len());
            train.payload = self.octets.split().freeze();
        }
        Some(train)
    }

    fn join(&mut self, next: &Transmit, most: usize) -> bool {
        let Some(first) = &self.first else {
            return false;
        };
        let (segment, length) = (first.payload.len(), next.payload.len());
        let alike = (first.link, first.to, first.priority) == (next.link, next.to, next.priority);
        let fits = self.count < most
            && (1..=segment).contains(&length)
            && self.count * segment + length <= MOST_OCTETS;
        if !alike || !fits || self.complete || next.segment.is_some() {
            return false;
        }
        if self.count == 1 {
            self.octets.extend_from_slice(&first.payload);
        }
        self.octets.extend_from_slice(&next.payload);
        self.count += 1;
        self.complete = length < segment;
        true
    }
}

#[cfg(test)]
mod tests {
    use std::net::SocketAddr;

    use super::*;
    use crate::endpoint::{LinkId, To};
    use crate::wire::Priority;

    fn transmit(port: u16, octets: &'static [u8]) -> Transmit {
        let peer = SocketAddr::from(([10, 0, 0, 2], port));
        Transmit {
            link: LinkId(1),
            to: To::Peer(peer.into()),
            priority: Priority::Standard,
            payload: octets.into(),
            segment: None,
        }
    }

    /// What leaves, as text: the datagrams of each train between bars.
    fn made_of(given: Vec<Transmit>, most: usize) -> Vec<String> {
        let mut trains = Trains::default();
        let mut left: Vec<_> = given
            .into_iter()
            .filter_map(|transmit| trains.add(transmit, most))
            .collect();
        left.extend(trains.take());
        assert!(trains.take().is_none());
        let datagrams = |train: &Transmit| {
            let segment = train.segment.unwrap_or(train.payload.len());
            let texts = train.payload.chunks(segment).map(String::from_utf8_lossy);
            texts.collect::<Vec<_>>().join("|")
        };
        left.iter().map(datagrams).collect()
    }

    #[test]
    fn equal_datagrams_leave_together_and_a_shorter_one_is_the_last() {
        let given = [&b"one"[..], b"two", b"x", b"yes", b"no!", b"three"];
        let given = given.map(|octets| transmit(1, octets)).into();
        assert_eq!(made_of(given, 64), ["one|two|x", "yes|no!", "three"]);
    }

    #[test]
    fn what_goes_elsewhere_or_is_more_urgent_is_another_train() {
        let mut urgent = transmit(2, b"stop");
        urgent.priority = Priority::SafetyCritical;
        let given = vec![
            transmit(1, b"to 1"),
            transmit(1, b"to 1"),
            transmit(2, b"to 2"),
            urgent,
            transmit(2, b"to 2"),
        ];
        assert_eq!(made_of(given, 64), ["to 1|to 1", "to 2", "stop", "to 2"]);
    }

    #[test]
    fn a_train_is_no_longer_than_the_link_and_the_kernel_take() {
        let given = || vec![transmit(1, b"a"), transmit(1, b"b"), transmit(1, b"c")];
        assert_eq!(made_of(given(), 2), ["a|b", "c"]);
        assert_eq!(made_of(given(), 1), ["a", "b", "c"]);
        let large: Vec<_> = (0..3).map(|_| transmit(1, &[0; 30_000])).collect();
        assert_eq!(made_of(large, 64).len(), 2);
    }

    #[test]
    fn what_the_endpoint_has_joined_stays_as_it_is() {
        let mut joined = transmit(1, b"onetwo");
        joined.segment = Some(3);
        let given = vec![joined.clone(), transmit(1, b"three!"), joined];
        assert_eq!(made_of(given, 64), ["one|two", "three!", "one|two"]);
    }
}
