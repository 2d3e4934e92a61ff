//! Once its tables are filled, an endpoint passes a small unacknowledged message without an
//! allocation.

use std::net::SocketAddr;
use std::time::{Duration, Instant};

use bytes::Bytes;
use jaus::address::JausId;
use jaus::endpoint::{Config, Endpoint, LinkId, LinkProfile, Outgoing, Path, Remote, StaticPeer};
use jaus::wire::{Frame, judp};
use stats_alloc::Region;

use super::{ALLOCATOR, ALONE};

const US: JausId = JausId::new(101, 1, 1);
const PEER: JausId = JausId::new(42, 1, 1);
const MESSAGES: usize = 5000;
const STRETCH: usize = 1000;

/// An endpoint with a component, and a peer with a configured address.
fn endpoint() -> (Endpoint, Path) {
    let address = |host| SocketAddr::from(([10, 0, 0, host], judp::PORT));
    let path = Path {
        link: LinkId(0),
        peer: Remote::Socket(address(2)),
    };
    let mut endpoint = Endpoint::new(Config {
        static_peers: vec![StaticPeer {
            id: PEER,
            path,
            gets_broadcasts: false,
        }],
        max_recent: 64,
        ..Config::default()
    });
    endpoint.add_link(LinkId(0), LinkProfile::judp([address(1)]));
    endpoint.attach(US).expect("an id of one component");
    (endpoint, path)
}

/// The fewest allocations of `handle` in any `STRETCH` calls, once tables are filled: a table may
/// still grow late, because the positions of its entries are random.
fn allocations(mut handle: impl FnMut(usize)) -> usize {
    let stretch = |number: usize| {
        let region = Region::new(ALLOCATOR);
        (number * STRETCH..(number + 1) * STRETCH).for_each(&mut handle);
        let change = region.change();
        change.allocations + change.reallocations
    };
    let each: Vec<usize> = (0..MESSAGES / STRETCH).map(stretch).collect();
    each.into_iter().min().unwrap_or_default()
}

#[test]
fn a_small_message_is_received_and_sent_without_allocation() {
    let _alone = ALONE.blocking_lock();
    let start = Instant::now();
    let at = |number: usize| start + Duration::from_millis(number as u64);
    let payload = Bytes::from_static(&[0x02, 0x44, 1, 2, 3, 4, 5, 6, 7, 8]);

    let (mut receiver, path) = endpoint();
    let datagram = |sequence| {
        let frame = Frame {
            sequence,
            ..Frame::new(PEER, US, payload.clone())
        };
        let octets = judp::encode(&frame).expect("a short frame");
        // The first copy of a vector's buffer allocates its reference counter.
        [octets.clone(), octets]
    };
    let mut datagrams = (1..=MESSAGES as u16).map(datagram).collect::<Vec<_>>();
    let mut received = 0;
    let mut inbox = Vec::new();
    let on_receipt = allocations(|number| {
        let [datagram, _] = std::mem::take(&mut datagrams[number]);
        receiver.handle_datagram(at(number), path, datagram, &mut inbox);
        while receiver.poll_event().is_some() {}
        received += inbox.drain(..).count();
    });
    assert_eq!((received, on_receipt), (MESSAGES, 0));

    let (mut sender, _) = endpoint();
    let message = Outgoing::new(US, PEER, payload);
    let mut sent = 0;
    let on_sending = allocations(|number| {
        let now = at(number);
        let sent_now = sender.send(now, message.clone(), &mut inbox);
        sent_now.expect("a known peer");
        while sender.poll_transmit(now).is_some() {
            sent += 1;
        }
    });
    assert_eq!((sent, on_sending), (MESSAGES, 0));
}
