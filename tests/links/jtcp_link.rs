//! Time-dependent limits of a TCP link, in virtual time.

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::task::Poll;
use std::time::{Duration, Instant};

use bytes::Bytes;
use jaus::address::JausId;
use jaus::endpoint::{Access, LinkId, To, Transmit};
use jaus::link::tcp::{Arrival, Closed, Counters, HANDSHAKE, STUCK, Settings, TcpLink};
use jaus::wire::{Frame, Priority, jtcp};
use jaus_test_kit::waiting::{LIMIT, within_limit};

fn listening(max_accepted: usize) -> TcpLink {
    let settings = Settings {
        listen: Some(([127, 0, 0, 1], 0).into()),
        max_accepted,
        ..Settings::default()
    };
    TcpLink::open(&settings).unwrap()
}

/// A connection from `address`, one of this host's other loopback addresses.
async fn connect_from(address: [u8; 4], to: SocketAddr) -> TcpStream {
    let socket = tokio::net::TcpSocket::new_v4().unwrap();
    socket.bind((address, 0).into()).unwrap();
    let stream = within_limit(socket.connect(to)).await;
    stream.unwrap().into_std().unwrap()
}

fn message(octets: usize) -> Bytes {
    let payload = Bytes::from(vec![2; octets]);
    let frame = Frame::new(JausId::new(1, 1, 1), JausId::new(2, 1, 1), payload);
    jtcp::encode(&frame).unwrap()
}

/// Polls the link once at the time `now`; returns why connections closed.
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
    // Let the runtime poll its sockets.
    tokio::time::sleep(Duration::from_millis(1)).await;
    closed
}

/// Polls the link at the time `now` until `is_enough`; returns why connections closed.
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
    within_limit(turns).await;
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

    // Too early: the connection may be about to send.
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
    // The kernel enlarges its buffers for a while.
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

/// Both nodes of a pair may be configured to connect to each other.
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
    // The next attempt follows after a pause, and fails.
    let later = link.poll_timeout().unwrap();
    assert!(later > now);
    turns(&mut link, later, |link| {
        link.counters().connect_failures == 1
    })
    .await;
    assert!(link.poll_timeout().unwrap() > later);
}

/// JAUS++ writes the version octet before each message, and loses its place in a stream without it.
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
        // The stream's version octet came with the first message.
        peer.write_all(&message(20)[1..]).unwrap();
        turns(&mut link, now, |link| link.counters().received == received).await;
    }
    drop(peer);
    turns(&mut link, now, |link| link.connections().count() == 0).await;
    assert!(link.hang_up().is_ready());
}

#[tokio::test]
async fn idle_connections_of_one_address_do_not_keep_newcomers_out() {
    let settings = Settings {
        listen: Some(([127, 0, 0, 1], 0).into()),
        max_per_address: 64,
        ..Settings::default()
    };
    let mut link = TcpLink::open(&settings).unwrap();
    let address = link.local().unwrap();
    let now = Instant::now();
    let mut hoard = Vec::new();
    for count in 1..=64 {
        let mut stream = TcpStream::connect(address).unwrap();
        stream.write_all(&message(20)).unwrap();
        let at = now + Duration::from_millis(count);
        turns(&mut link, at, |link| link.counters().received == count).await;
        hoard.push(stream);
    }
    let _one_more = TcpStream::connect(address).unwrap();
    turns(&mut link, now, |link| link.counters().refused == 1).await;

    let later = now + Duration::from_secs(3600);
    let newcomer = connect_from([127, 0, 0, 2], address).await;
    let closed = turns(&mut link, later, |link| link.counters().accepted == 65).await;
    assert!(matches!(closed[..], [Closed::Idle]), "{closed:?}");
    let remotes: Vec<_> = link.connections().map(|c| c.remote).collect();
    assert!(remotes.contains(&newcomer.local_addr().unwrap()));
    let longest_idle = hoard[0].local_addr().unwrap();
    assert!(!remotes.contains(&longest_idle) && remotes.len() == 64);
    let _again = TcpStream::connect(address).unwrap();
    turns(&mut link, later, |link| link.counters().refused == 2).await;
    assert_eq!(link.counters().displaced, 1);
}

#[tokio::test]
async fn an_address_has_a_quota_of_its_own() {
    let settings = Settings {
        listen: Some(([127, 0, 0, 1], 0).into()),
        max_per_address: 2,
        ..Settings::default()
    };
    let mut link = TcpLink::open(&settings).unwrap();
    let address = link.local().unwrap();
    let now = Instant::now();
    let _three = [(); 3].map(|()| TcpStream::connect(address).unwrap());
    turns(&mut link, now, |link| link.counters().refused == 1).await;
    let _other = connect_from([127, 0, 0, 2], address).await;
    turns(&mut link, now, |link| link.counters().accepted == 3).await;
}

#[tokio::test]
async fn who_may_not_speak_may_not_connect() {
    let access = Access {
        deny_networks: vec!["127.0.0.1".parse().unwrap()],
        ..Access::default()
    };
    let settings = Settings {
        listen: Some(([127, 0, 0, 1], 0).into()),
        access,
        ..Settings::default()
    };
    let mut link = TcpLink::open(&settings).unwrap();
    let address = link.local().unwrap();
    let now = Instant::now();
    let mut denied = TcpStream::connect(address).unwrap();
    turns(&mut link, now, |link| link.counters().denied == 1).await;
    denied.set_read_timeout(Some(LIMIT)).unwrap();
    assert_eq!(denied.read(&mut [0]).unwrap(), 0, "it is closed");
    let _allowed = connect_from([127, 0, 0, 2], address).await;
    turns(&mut link, now, |link| link.counters().accepted == 1).await;
}

#[tokio::test]
async fn what_is_for_everyone_waits_for_the_first_connection_too() {
    let far = TcpListener::bind(("127.0.0.1", 0)).unwrap();
    let settings = Settings {
        connect: vec![far.local_addr().unwrap()],
        ..Settings::default()
    };
    let mut link = TcpLink::open(&settings).unwrap();
    let to_all = |payload: &Bytes| Transmit {
        to: To::Group,
        ..to(([127, 0, 0, 1], 1).into(), payload)
    };
    let said = message(20);
    link.transmit(&to_all(&said));
    let now = Instant::now();
    turns(&mut link, now, |link| link.counters().sent == 1).await;
    let (mut peer, _) = far.accept().unwrap();
    peer.set_read_timeout(Some(LIMIT)).unwrap();
    let mut heard = vec![0; said.len()];
    peer.read_exact(&mut heard).unwrap();
    assert_eq!(heard, said);

    drop((peer, far));
    turns(&mut link, now, |link| link.counters().closed == 1).await;
    link.transmit(&to_all(&said));
    assert_eq!(link.counters().not_connected, 1, "lost, and counted");
}

/// The backlogs of peers that read nothing share one memory limit per link.
#[tokio::test]
async fn what_waits_for_all_connections_is_bounded() {
    const MOST: usize = 16 << 20;
    let mut link = listening(64);
    let address = link.local().unwrap();
    let now = Instant::now();
    let _deaf: Vec<_> = (0..16)
        .map(|_| TcpStream::connect(address).unwrap())
        .collect();
    turns(&mut link, now, |link| link.counters().accepted == 16).await;
    let payload = message(60_000);
    for _ in 0..200 {
        link.transmit(&Transmit {
            to: To::Group,
            ..to(address, &payload)
        });
    }
    let waiting: usize = link.connections().map(|c| c.waiting * payload.len()).sum();
    assert!(waiting <= MOST, "{waiting} octets wait");
    assert!(waiting > MOST / 2, "{waiting} octets wait: no test at all");
}
