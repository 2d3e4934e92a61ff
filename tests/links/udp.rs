//! UDP link with real sockets on the loopback interface: reception, filtering, and errors on
//! opening. Needs no network and no rights.

use std::future::poll_fn;
use std::net::{Ipv4Addr, SocketAddr, SocketAddrV4, UdpSocket};

use bytes::Bytes;
use jaus::endpoint::{LinkId, To, Transmit};
use jaus::link::udp::{PortTaken, Settings, UdpLink, kernel_drops};
use jaus::link::{Error, Group, Interface, Interfaces, Ip, Slab};
use jaus::wire::Priority;
use jaus_test_kit::evidence::not_tested;
use jaus_test_kit::waiting::{LIMIT, within_limit};

/// A free port, different for each test of this process.
fn free_port() -> u16 {
    let socket = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0)).unwrap();
    socket.local_addr().unwrap().port()
}

fn loopback() -> Interface {
    Interfaces::Loopback.choose(Ip::V4).unwrap().remove(0)
}

/// A free unicast port, and a separate multicast group.
fn settings() -> Settings {
    let group = SocketAddrV4::new(Ipv4Addr::new(239, 255, 0, 1), free_port());
    Settings {
        port: 0,
        group: Group::At(group),
        ..Settings::default()
    }
}

async fn receive(link: &mut UdpLink) -> (SocketAddr, Bytes) {
    let mut slab = Slab::default();
    within_limit(poll_fn(|cx| link.poll_recv(cx, &mut slab))).await
}

#[tokio::test]
async fn links_of_one_host_hear_each_other_by_multicast_and_answer_by_unicast() {
    let settings = settings();
    let mut a = UdpLink::open(&loopback(), &settings).unwrap();
    let mut b = UdpLink::open(&loopback(), &settings).unwrap();
    let mut c = UdpLink::open(&loopback(), &settings).unwrap();

    a.send_to_group(Priority::Standard, &Bytes::from_static(b"who is there?"));
    for other in [&mut b, &mut c] {
        let (from, datagram) = receive(other).await;
        assert_eq!((from, &datagram[..]), (a.local(), &b"who is there?"[..]));
        other.send_to(from, Priority::Standard, &Bytes::from_static(b"me"));
    }
    let mut answers = [receive(&mut a).await.0, receive(&mut a).await.0];
    answers.sort();
    let mut expected = [b.local(), c.local()];
    expected.sort();
    assert_eq!(answers, expected);
}

#[tokio::test]
async fn a_link_does_not_hear_itself() {
    let settings = settings();
    let mut a = UdpLink::open(&loopback(), &settings).unwrap();
    let mut b = UdpLink::open(&loopback(), &settings).unwrap();

    a.send_to_group(Priority::Standard, &Bytes::from_static(b"from a"));
    b.send_to_group(Priority::Standard, &Bytes::from_static(b"from b"));

    assert_eq!(receive(&mut a).await.0, b.local());
    assert_eq!(receive(&mut b).await.0, a.local());
    // Datagrams from `a` precede those from `b` in the same socket's queue.
    assert_eq!(a.counters().own_echo, 1);
    assert_eq!(a.counters().received, 1);
}

#[tokio::test]
async fn links_with_ipv6_addresses_talk_and_leave_ipv4_to_others() {
    let Ok(loopback6) = Interfaces::Loopback.choose(Ip::V6) else {
        return not_tested(
            "links_with_ipv6_addresses_talk_and_leave_ipv4_to_others",
            "this host has no IPv6",
        );
    };
    let mut a = UdpLink::open(&loopback6[0], &settings()).unwrap();
    // Another node with the same port, but on IPv4.
    let port = a.local().port();
    let same_port = Settings { port, ..settings() };
    let mut four = UdpLink::open(&loopback(), &same_port).unwrap();
    let mut b = UdpLink::open(&loopback6[0], &settings()).unwrap();

    b.send_to(a.local(), Priority::Standard, &Bytes::from_static(b"six"));
    let (peer, datagram) = receive(&mut a).await;
    assert_eq!((peer, &datagram[..]), (b.local(), &b"six"[..]));
    assert!(peer.is_ipv6() && a.group().is_none());
    a.send_to(peer, Priority::Standard, &Bytes::from_static(b"answer"));
    assert_eq!(receive(&mut b).await.1, &b"answer"[..]);

    let sender = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
    sender
        .send_to(b"four", (Ipv4Addr::LOCALHOST, port))
        .unwrap();
    assert_eq!(receive(&mut four).await.1, &b"four"[..]);

    let error = UdpLink::open(&loopback6[0], &same_port).unwrap_err();
    let text = error.to_string();
    assert!(
        text.contains(&format!("UDP port {port} of ::1 is taken")),
        "{text}"
    );
    assert!(
        !cfg!(target_os = "linux") || text.contains("by this process"),
        "{text}"
    );
}

#[tokio::test]
async fn groups_with_other_ports_are_not_heard() {
    let mut a = UdpLink::open(&loopback(), &settings()).unwrap();
    let mut stranger = UdpLink::open(&loopback(), &settings()).unwrap();
    stranger.send_to_group(Priority::Standard, &Bytes::from_static(b"not for a"));
    stranger.send_to(a.local(), Priority::Standard, &Bytes::from_static(b"for a"));
    assert_eq!(receive(&mut a).await.1, &b"for a"[..]);
}

#[tokio::test]
async fn configured_peers_get_a_copy_of_what_goes_to_the_group() {
    let mut deaf = UdpLink::open(
        &loopback(),
        &Settings {
            group: Group::Off,
            ..settings()
        },
    )
    .unwrap();
    let mut a = UdpLink::open(&loopback(), &settings()).unwrap();
    a.set_peers(vec![deaf.local()]);
    a.send_to_group(Priority::Standard, &Bytes::from_static(b"hello"));
    assert_eq!(
        receive(&mut deaf).await,
        (a.local(), Bytes::from_static(b"hello"))
    );
}

#[tokio::test]
async fn a_peer_that_is_gone_does_not_end_the_link() {
    let mut a = UdpLink::open(&loopback(), &settings()).unwrap();
    let mut b = UdpLink::open(&loopback(), &settings()).unwrap();
    let nobody = SocketAddr::from((Ipv4Addr::LOCALHOST, free_port()));
    let too_long = Bytes::from(vec![0; 70_000]);
    for _ in 0..3 {
        a.send_to(nobody, Priority::Standard, &Bytes::from_static(b"anyone?"));
        a.send_to(b.local(), Priority::Standard, &too_long);
    }
    assert_eq!(a.counters().send_errors, 3);
    b.send_to(
        a.local(),
        Priority::Standard,
        &Bytes::from_static(b"still there"),
    );
    assert_eq!(receive(&mut a).await.1, &b"still there"[..]);
}

#[cfg(target_os = "linux")]
#[tokio::test]
async fn what_the_kernel_drops_is_told() {
    let small = Settings {
        receive_buffer: 4096,
        ..settings()
    };
    let mut slow = UdpLink::open(&loopback(), &small).unwrap();
    let mut fast = UdpLink::open(&loopback(), &settings()).unwrap();
    assert_eq!(kernel_drops([slow.inodes()])[0], Some(0));
    let datagram = Bytes::from(vec![0; 1000]);
    for _ in 0..100 {
        fast.send_to(slow.local(), Priority::Standard, &datagram);
    }
    let dropped = kernel_drops([slow.inodes()])[0].unwrap();
    assert!(dropped > 0);
    for _ in dropped..100 {
        receive(&mut slow).await;
    }
    assert_eq!(slow.counters().received + dropped, 100);
}

#[tokio::test]
async fn the_longest_datagram_arrives_whole() {
    let mut a = UdpLink::open(&loopback(), &settings()).unwrap();
    let mut b = UdpLink::open(&loopback(), &settings()).unwrap();
    let longest = Bytes::from(vec![7; 65_507]);
    a.send_to(b.local(), Priority::Standard, &longest);
    assert_eq!(receive(&mut b).await.1, longest);
}

/// A GSO batch: several datagrams in one transmit, as the endpoint emits them.
fn batch(link: &UdpLink, octets: Bytes, segment: usize) -> Transmit {
    Transmit {
        link: LinkId(0),
        to: To::Peer(link.local().into()),
        priority: Priority::Standard,
        payload: octets,
        segment: Some(segment),
    }
}

#[tokio::test]
async fn a_batch_arrives_as_its_datagrams() {
    // Fits into a default receive buffer.
    let octets: Bytes = (0..90_500_u32).map(|i| (i * 7 % 251) as u8).collect();
    for (sends, receives) in [(true, true), (true, false), (false, true), (false, false)] {
        let with = |batch| Settings {
            batch,
            ..settings()
        };
        let mut a = UdpLink::open(&loopback(), &with(sends)).unwrap();
        let mut b = UdpLink::open(&loopback(), &with(receives)).unwrap();
        a.transmit(&batch(&b, octets.clone(), 1000));
        // Shorter than a datagram of the batch, and exactly as long.
        a.transmit(&batch(&b, octets.slice(..999), 1000));
        a.transmit(&batch(&b, octets.slice(..1000), 1000));
        a.flush();
        for datagram in octets.chunks(1000).chain([&octets[..999], &octets[..1000]]) {
            let (from, received) = receive(&mut b).await;
            assert_eq!(from, a.local());
            assert!(received == datagram, "{sends} {receives}");
        }
        assert_eq!((a.counters().sent, b.counters().received), (93, 93));
        assert_eq!(a.counters().sent_octets, b.counters().received_octets);
    }
}

#[tokio::test]
async fn a_batch_to_the_group_reaches_every_member_complete() {
    let settings = settings();
    let mut a = UdpLink::open(&loopback(), &settings).unwrap();
    let mut b = UdpLink::open(&loopback(), &settings).unwrap();
    let octets = Bytes::from(vec![7; 10_100]);
    let to_all = Transmit {
        to: To::Group,
        ..batch(&b, octets, 1000)
    };
    a.transmit(&to_all);
    a.flush();
    for length in [[1000; 10].as_slice(), &[100]].concat() {
        assert_eq!(receive(&mut b).await.1.len(), length);
    }
}

#[tokio::test]
async fn a_second_node_on_the_same_address_and_port_is_refused_and_told_what_to_do() {
    let port = free_port();
    let settings = Settings { port, ..settings() };
    let _first = UdpLink::open(&loopback(), &settings).unwrap();

    let error = UdpLink::open(&loopback(), &settings).unwrap_err();
    let text = error.to_string();
    assert!(matches!(error, Error::PortTaken { .. }), "{text}");
    assert!(
        text.contains(&format!("UDP port {port} of 127.0.0.1 is taken")),
        "{text}"
    );
    assert!(
        text.contains("another port (0: any free one") && text.contains("127.0.0.2"),
        "{text}"
    );
    assert!(
        !cfg!(target_os = "linux") || text.contains("by this process"),
        "{text}"
    );

    let other_address = Interfaces::Only(vec!["127.0.0.2".into()])
        .choose(Ip::V4)
        .unwrap();
    let second = UdpLink::open(&other_address[0], &settings).unwrap();
    assert_eq!(second.local(), SocketAddr::from(([127, 0, 0, 2], port)));
}

#[tokio::test]
async fn a_taken_port_is_replaced_by_a_free_one_when_that_is_wanted() {
    let settings = Settings {
        port: free_port(),
        ..settings()
    };
    let mut first = UdpLink::open(&loopback(), &settings).unwrap();
    let flexible = Settings {
        port_taken: PortTaken::UseFree,
        ..settings
    };
    let mut second = UdpLink::open(&loopback(), &flexible).unwrap();
    assert_ne!(first.local(), second.local());

    first.send_to_group(Priority::Standard, &Bytes::from_static(b"who is there?"));
    let (peer, _) = receive(&mut second).await;
    second.send_to(peer, Priority::Standard, &Bytes::from_static(b"me"));
    assert_eq!(receive(&mut first).await.0, second.local());
}

#[tokio::test]
async fn a_program_that_keeps_the_group_port_for_itself_is_named() {
    let settings = settings();
    let Group::At(group) = settings.group else {
        unreachable!()
    };
    let port = group.port();
    let _junior_like = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, port)).unwrap();
    let error = UdpLink::open(&loopback(), &settings).unwrap_err();
    let text = error.to_string();
    assert!(matches!(error, Error::GroupTaken { .. }), "{text}");
    assert!(text.contains("to all addresses without sharing"), "{text}");
    assert!(
        !cfg!(target_os = "linux") || text.contains("by this process"),
        "{text}"
    );
}

#[tokio::test]
async fn a_group_that_is_none_is_refused() {
    for (address, port) in [([192, 168, 0, 1], 3794), ([239, 255, 0, 1], 0)] {
        let group = Group::At(SocketAddrV4::new(address.into(), port));
        let error = UdpLink::open(
            &loopback(),
            &Settings {
                group,
                ..settings()
            },
        )
        .unwrap_err();
        assert!(matches!(error, Error::InvalidGroup(_)), "{error}");
        assert!(error.to_string().contains("239.255.0.1:3794"), "{error}");
    }
}

#[test]
fn an_interface_that_does_not_exist_is_refused_with_a_list_of_those_that_do() {
    for wanted in ["nosuch0", "203.0.113.77"] {
        let error = Interfaces::Only(vec![wanted.into()])
            .choose(Ip::V4)
            .unwrap_err();
        let text = error.to_string();
        assert!(
            text.contains(&format!("`{wanted}`")) && text.contains("127.0.0.1"),
            "{text}"
        );
    }
}

/// An event goes to many subscribers at once: a system call for each would take most of the time.
#[cfg(target_os = "linux")]
#[tokio::test]
async fn datagrams_to_many_peers_leave_with_few_calls() {
    let mut link = UdpLink::open(&loopback(), &settings()).unwrap();
    let peers: Vec<_> = (0..100)
        .map(|_| UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).unwrap())
        .collect();
    let payload = |number: usize| Bytes::from(vec![number as u8; 10 + number]);
    for (number, peer) in peers.iter().enumerate() {
        link.transmit(&Transmit {
            link: LinkId(0),
            to: To::Peer(peer.local_addr().unwrap().into()),
            priority: Priority::Standard,
            payload: payload(number),
            segment: None,
        });
    }
    assert!(link.flush());
    for (number, peer) in peers.iter().enumerate() {
        peer.set_read_timeout(Some(LIMIT)).unwrap();
        let mut heard = [0; 200];
        let (octets, from) = peer.recv_from(&mut heard).unwrap();
        assert_eq!(
            (&heard[..octets], from),
            (&payload(number)[..], link.local())
        );
    }
    let counters = link.counters();
    assert_eq!((counters.sent, counters.send_errors), (100, 0));
    assert!(counters.send_calls <= 4, "{} calls", counters.send_calls);
}

/// A datagram refused by the kernel loses only itself, at any position in the queue.
#[tokio::test]
async fn a_datagram_that_is_refused_does_not_take_others_with_it() {
    let mut link = UdpLink::open(&loopback(), &settings()).unwrap();
    let mut peer = UdpLink::open(&loopback(), &settings()).unwrap();
    let to = |address: SocketAddr, payload: Bytes| Transmit {
        link: LinkId(0),
        to: To::Peer(address.into()),
        priority: Priority::Standard,
        payload,
        segment: None,
    };
    let too_long = Bytes::from(vec![0; 70_000]);
    for number in 0..9_u8 {
        let payload = if number % 3 == 1 {
            too_long.clone()
        } else {
            Bytes::from(vec![number])
        };
        link.transmit(&to(peer.local(), payload));
    }
    assert!(link.flush());
    for number in [0, 2, 3, 5, 6, 8] {
        assert_eq!(receive(&mut peer).await.1, [number][..]);
    }
    assert_eq!((link.counters().sent, link.counters().send_errors), (6, 3));
}
