//! The limits of a TCP link that need time to pass, which a test can tell it.
#![cfg(feature = "node")]
#![allow(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test with sockets"
)]

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::task::Poll;
use std::time::{Duration, Instant};

use bytes::Bytes;
use jaus::address::JausId;
use jaus::endpoint::{LinkId, To, Transmit};
use jaus::link::tcp::{Arrival, Closed, Counters, HANDSHAKE, STUCK, Settings, TcpLink};
use jaus::wire::{Frame, Priority, jtcp};

/// Longer than anything takes; reached only when a test fails.
const LIMIT: Duration = Duration::from_secs(20);

fn listening(max_accepted: usize) -> TcpLink {
    let settings = Settings {
        listen: Some(([127, 0, 0, 1], 0).into()),
        max_accepted,
        ..Settings::default()
    };
    TcpLink::open(&settings).unwrap()
}

fn message(octets: usize) -> Bytes {
    let payload = Bytes::from(vec![2; octets]);
    let frame = Frame::new(JausId::new(1, 1, 1), JausId::new(2, 1, 1), payload);
    jtcp::encode(&frame).unwrap()
}

/// Gives the link a turn at the time `now`; why connections closed.
async fn turn(link: &mut TcpLink, now: Instant) -> Vec<Closed> {
    let mut closed = Vec::new();
    std::future::poll_fn(|cx| {
        link.receive(cx, now, |arrival| {
            if let Arrival::Closed(_, why) = arrival {
                closed.push(why);
            }
        });
        let _ = link.poll_flush(cx, now);
        Poll::Ready(())
    })
    .await;
    // So that the runtime looks at its sockets.
    tokio::time::sleep(Duration::from_millis(1)).await;
    closed
}

/// Gives the link turns at the time `now` until `is_enough`, and collects why connections closed.
async fn turns(
    link: &mut TcpLink,
    now: Instant,
    is_enough: impl Fn(&TcpLink) -> bool,
) -> Vec<Closed> {
    let mut closed = Vec::new();
    let turns = async {
        while !is_enough(link) {
            closed.extend(turn(link, now).await);
        }
    };
    let turned = tokio::time::timeout(LIMIT, turns).await;
    assert!(turned.is_ok(), "{:?}", link.counters());
    closed
}

fn to(address: SocketAddr, payload: &Bytes) -> Transmit {
    Transmit {
        link: LinkId(0),
        to: To::Peer(address.into()),
        priority: Priority::Standard,
        payload: payload.clone(),
        segment: None,
    }
}

#[tokio::test]
async fn a_connection_that_says_nothing_loses_its_place_when_it_is_needed() {
    let mut link = listening(1);
    let address = link.local().unwrap();
    let now = Instant::now();
    let _silent = TcpStream::connect(address).unwrap();
    turns(&mut link, now, |link| link.counters().accepted == 1).await;

    // Too early: it may be about to say something.
    let _second = TcpStream::connect(address).unwrap();
    turns(&mut link, now, |link| link.counters().refused == 1).await;

    let third = TcpStream::connect(address).unwrap();
    turns(&mut link, now + HANDSHAKE, |link| {
        link.counters().accepted == 2
    })
    .await;
    let remotes: Vec<_> = link
        .connections()
        .map(|connection| connection.remote)
        .collect();
    assert_eq!(remotes, [third.local_addr().unwrap()]);
}

#[tokio::test]
async fn a_peer_that_takes_nothing_for_too_long_is_cut_off() {
    let mut link = listening(1);
    let peer = TcpStream::connect(link.local().unwrap()).unwrap();
    let now = Instant::now();
    turns(&mut link, now, |link| link.counters().accepted == 1).await;
    let remote = peer.local_addr().unwrap();
    let payload = message(60_000);
    // The kernel makes its buffers larger for a while.
    let overflows = |link: &TcpLink| link.counters().send_overflows;
    let mut lost_without_progress = 0;
    while lost_without_progress < 20 {
        let (lost, waiting) = (
            overflows(&link),
            link.connections().map(|c| c.waiting).sum::<usize>(),
        );
        for _ in 0..100 {
            link.transmit(&to(remote, &payload));
        }
        turn(&mut link, now).await;
        let still = link.connections().map(|c| c.waiting).sum::<usize>() == waiting;
        lost_without_progress = if still && overflows(&link) == lost + 100 {
            lost_without_progress + 1
        } else {
            0
        };
    }
    assert_eq!(link.poll_timeout(), Some(now + STUCK));
    let closed = turns(&mut link, now + STUCK, |link| link.counters().stuck == 1).await;
    assert!(matches!(closed[..], [Closed::Stuck]), "{closed:?}");
    assert_eq!(link.connections().count(), 0);
}

/// Both nodes of a pair may be told to connect to each other.
#[tokio::test]
async fn what_is_sent_before_the_first_connection_waits_for_it_and_later_it_does_not() {
    let far = TcpListener::bind(("127.0.0.1", 0)).unwrap();
    let address = far.local_addr().unwrap();
    let settings = Settings {
        connect: vec![address, address],
        ..Settings::default()
    };
    let mut link = TcpLink::open(&settings).unwrap();
    link.transmit(&to(address, &message(10)));
    let now = Instant::now();
    turns(&mut link, now, |link| link.counters().sent == 1).await;
    assert_eq!(
        link.counters().connected,
        1,
        "the same peer named twice is one"
    );

    drop(far.accept().unwrap());
    drop(far);
    turns(&mut link, now, |link| link.counters().closed == 1).await;
    link.transmit(&to(address, &message(10)));
    let expected = Counters {
        connected: 1,
        closed: 1,
        sent: 1,
        not_connected: 1,
        ..Counters::default()
    };
    assert_eq!(link.counters(), expected);
    // The next attempt comes after a pause, and fails.
    let later = link.poll_timeout().unwrap();
    assert!(later > now);
    turns(&mut link, later, |link| {
        link.counters().connect_failures == 1
    })
    .await;
    assert!(link.poll_timeout().unwrap() > later);
}

/// As JAUS++ does, which loses its place in a stream without.
#[tokio::test]
async fn who_writes_the_version_octet_before_each_message_gets_it_before_each() {
    let said = message(20);
    for (repeats, expected) in [(true, [&said[..], &said]), (false, [&said[..], &said[1..]])] {
        let mut link = listening(1);
        let mut peer = TcpStream::connect(link.local().unwrap()).unwrap();
        peer.set_read_timeout(Some(LIMIT)).unwrap();
        let now = Instant::now();
        let again = if repeats { &said[..] } else { &said[1..] };
        peer.write_all(&[&said, again].concat()).unwrap();
        turns(&mut link, now, |link| link.counters().received == 2).await;

        let remote = peer.local_addr().unwrap();
        link.transmit(&to(remote, &said));
        link.transmit(&to(remote, &said));
        turn(&mut link, now).await;
        let mut answers = vec![0; expected.concat().len()];
        peer.read_exact(&mut answers).unwrap();
        assert_eq!(answers, expected.concat(), "repeats: {repeats}");
    }
}

#[tokio::test]
async fn a_peer_that_still_writes_when_the_link_hangs_up_is_not_cut_off() {
    let mut link = listening(1);
    let mut peer = TcpStream::connect(link.local().unwrap()).unwrap();
    peer.set_read_timeout(Some(LIMIT)).unwrap();
    let now = Instant::now();
    peer.write_all(&message(20)).unwrap();
    turns(&mut link, now, |link| link.counters().received == 1).await;

    assert!(
        link.hang_up().is_pending(),
        "the peer may have something to say"
    );
    assert_eq!(peer.read(&mut [0]).unwrap(), 0, "it is told");
    for received in 2..6 {
        // The stream's version octet came with the first.
        peer.write_all(&message(20)[1..]).unwrap();
        turns(&mut link, now, |link| link.counters().received == received).await;
    }
    drop(peer);
    turns(&mut link, now, |link| link.connections().count() == 0).await;
    assert!(link.hang_up().is_ready());
}
