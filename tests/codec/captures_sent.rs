//! Messages of recorded peers, sent again by our endpoint in their place: the same octets, or a
//! difference with a known reason.
//!
//! Intended differences, excluded from the comparison:
//!
//! | recording | difference | reason |
//! |---|---|---|
//! | junior/08 | Junior repeats after 100, 108 and 112 ms | our timer follows the round trip; the repetitions are the same octets |
//! | junior/09, 10 | sent in an older header before anything was received | we answer in a peer's header and never begin with an old one, so the peer sends first |
//! | junior/11 | the last datagram has flags FFh | Junior's fault with priority 0: the intended message has low priority |
//! | jauspp/* | sequence numbers | JAUS++ counts from 0 for each component, we count for the whole node from a random number |
//! | jauspp/* | octets behind the message | JAUS++ leaves those of an older, longer message there |
//!
//! `jtcp_captures.rs` and `jserial_captures.rs` compare streams and serial lines; `captures.rs`
//! covers reception.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::net::SocketAddr;
use std::path::Path as FilePath;
use std::time::{Duration, Instant};

use bytes::{Bytes, BytesMut};
use jaus::endpoint::{Config, Endpoint, LinkId, LinkProfile, Outgoing, Path, Rate, Received};
use jaus::wire::{Acknowledgement, Broadcast, DataControl, Flags, Frame, judp};
use jaus_test_kit::evidence;
use jaus_view::{Capture, Network};

/// A recorded datagram: its sender, and the first message in it.
struct Recorded {
    source: SocketAddr,
    frame: Frame,
    /// The datagram up to the end of the message.
    octets: Bytes,
}

fn recorded(file: &FilePath) -> Vec<Recorded> {
    let mut capture = Capture::new(File::open(file).unwrap()).unwrap();
    let mut network = Network::new([judp::PORT]);
    let mut datagrams = Vec::new();
    while let Some(frame) = capture.next_frame() {
        let [datagram] = &network.handle_frame(&frame.unwrap())[..] else {
            continue;
        };
        let payload = Bytes::copy_from_slice(&datagram.payload);
        let mut frames = judp::frames(payload.clone()).unwrap();
        let frame = frames.next().unwrap().unwrap();
        datagrams.push(Recorded {
            source: datagram.source,
            octets: payload.slice(..frames.offset()),
            frame,
        });
    }
    datagrams
}

/// Our endpoint in place of a recorded party.
struct Party {
    endpoint: Endpoint,
    now: Instant,
    received: Vec<Received>,
    sent: Vec<Bytes>,
}

const LINK: LinkId = LinkId(0);

impl Party {
    /// A party with all ids of the recorded one, with Junior's fragments and its first sequence
    /// number.
    #[expect(
        clippy::disallowed_methods,
        reason = "virtual time starts at any instant"
    )]
    fn in_place_of(recorded: &[Recorded], address: SocketAddr) -> Self {
        let ours = || recorded.iter().filter(|it| it.source == address);
        let messages = || ours().filter(|it| !it.frame.flags.acknowledgement().is_answer());
        let first = messages().next().map_or(1, |it| it.frame.sequence);
        let mut endpoint = Endpoint::new(Config {
            payload_limit: 4079,
            first_sequence: first.wrapping_sub(1),
            // A recording answers no challenges, and only the octets matter here.
            unverified_address: Rate::new(1 << 20, 1 << 20),
            unverified_total: Rate::new(1 << 20, 1 << 20),
            ..Config::default()
        });
        endpoint.add_link(LINK, LinkProfile::judp([address]));
        for id in ours().map(|it| it.frame.source).collect::<BTreeSet<_>>() {
            endpoint.attach(id).unwrap();
        }
        Self {
            endpoint,
            now: Instant::now(),
            received: Vec::new(),
            sent: Vec::new(),
        }
    }

    fn hear(&mut self, datagram: &Recorded) {
        let path = Path {
            link: LINK,
            peer: datagram.source.into(),
        };
        let octets = datagram.octets.clone();
        self.endpoint
            .handle_datagram(self.now, path, octets, &mut self.received);
        self.drain();
    }

    /// Sends the recorded party's message, at the position of its first datagram.
    fn say(&mut self, frame: &Frame, payload: Bytes, unknown: bool) {
        let wanted = frame.flags.acknowledgement() == Acknowledgement::Request;
        let outgoing = Outgoing {
            priority: frame.flags.priority(),
            // For an unknown peer the transport sets the flags, not the sender.
            broadcast: match frame.flags.broadcast() {
                Some(broadcast) if frame.destination.has_wildcard() => broadcast,
                _ => Broadcast::None,
            },
            acknowledge: wanted && !unknown,
            ..Outgoing::new(frame.source, frame.destination, payload)
        };
        self.endpoint
            .send(self.now, outgoing, &mut self.received)
            .unwrap();
        self.drain();
    }

    fn drain(&mut self) {
        while self.endpoint.poll_event().is_some() {}
        self.received.clear();
        while let Some(transmit) = self.endpoint.poll_transmit(self.now) {
            self.sent.push(transmit.payload);
        }
    }

    /// Advances time without input, for paced messages.
    fn wait(&mut self, time: Duration) {
        let end = self.now + time;
        while let Some(due) = self.endpoint.poll_timeout().filter(|due| *due <= end) {
            self.now = self.now.max(due);
            self.endpoint.handle_timeout(self.now);
            self.drain();
        }
        self.now = end;
    }
}

/// The whole message that begins with this datagram; `None` if none begins there.
fn message(datagrams: &[Recorded], begin: usize) -> Option<Bytes> {
    let first = &datagrams[begin];
    if first.frame.flags.acknowledgement().is_answer() {
        return None;
    }
    match first.frame.flags.data() {
        DataControl::Single => return Some(first.frame.payload.clone()),
        DataControl::First => {}
        DataControl::Middle | DataControl::Last => return None,
    }
    let mut whole = BytesMut::new();
    let theirs = datagrams[begin..]
        .iter()
        .filter(|it| it.source == first.source && !it.frame.flags.acknowledgement().is_answer());
    for fragment in theirs {
        whole.extend_from_slice(&fragment.frame.payload);
        if fragment.frame.flags.data() == DataControl::Last {
            return Some(whole.freeze());
        }
    }
    None
}

fn without_repetitions(datagrams: Vec<Bytes>) -> Vec<Bytes> {
    let mut seen = BTreeSet::new();
    let first_time = |it: &Bytes| seen.insert(it.clone());
    datagrams.into_iter().filter(first_time).collect()
}

/// A message with the recorded header, in place of an acknowledgement: an unsolicited
/// acknowledgement teaches nothing, not even its sender's header version.
fn greeting(recorded: &Recorded) -> Recorded {
    let frame = Frame {
        flags: Flags::default(),
        payload: Bytes::from_static(b"\x02\x22"),
        ..recorded.frame.clone()
    };
    Recorded {
        source: recorded.source,
        octets: judp::encode(&frame).expect("a short message"),
        frame,
    }
}

/// Junior's nodes, 10.77.0.1 and 10.77.0.2, one file each.
#[test]
fn in_juniors_place_we_send_the_same_octets() {
    let captures = evidence::captures();
    let (a, b) = ("10.77.0.1:3794", "10.77.0.2:3794");
    for (file, party) in [
        ("01-discovery-then-unicast", a),
        ("01-discovery-then-unicast", b),
        ("02-acked-small", a),
        ("03-acked-100KB", a),
        ("04-unacked-100KB-bigbuf", a),
        ("05-unacked-100KB-default-loss", a),
        ("06-global-broadcast", a),
        ("07-subsystem-wildcard", a),
        ("08-ack-timeout-no-peer", a),
        ("09-as5669-v1-msgid", a),
        ("10-opc-JAUS01.0", a),
        ("11-priority0-bug", a),
        ("12-priority15", a),
    ] {
        let party: SocketAddr = party.parse().unwrap();
        let mut datagrams = recorded(&captures.join(format!("junior/{file}.pcap")));
        // Our retransmission times differ from Junior's, and we do not copy its faults: see the
        // table above.
        let mut seen = BTreeSet::new();
        datagrams.retain(|it| {
            it.frame.flags.broadcast().is_some() && seen.insert((it.source, it.octets.clone()))
        });
        let mut ours = Party::in_place_of(&datagrams, party);
        let older = file.starts_with("09") || file.starts_with("10");
        if older {
            datagrams
                .iter()
                .filter(|it| it.source != party)
                .for_each(|it| ours.hear(&greeting(it)));
        }
        let mut known = older;
        for (i, datagram) in datagrams.iter().enumerate() {
            if datagram.source != party {
                known = true;
                ours.hear(datagram);
            } else if let Some(payload) = message(&datagrams, i) {
                ours.say(&datagram.frame, payload, !known);
            }
        }
        ours.wait(Duration::from_millis(90));
        let theirs = datagrams.iter().filter(|it| it.source == party);
        let theirs: Vec<_> = theirs.map(|it| it.octets.clone()).collect();
        let sent = without_repetitions(ours.sent);
        assert_eq!(sent.len(), theirs.len(), "{file}");
        for (i, (ours, theirs)) in sent.iter().zip(&theirs).enumerate() {
            assert_eq!(ours, theirs, "{file}, datagram {i}");
        }
    }
}

/// All messages of JAUS++'s components in order, after those of its peers.
#[test]
fn in_jausplusplus_place_we_send_the_same_octets_but_for_the_numbers() {
    let captures = evidence::captures();
    let mut compared = 0;
    for file in [
        "01-vehsim-client",
        "02-rawvehicle-client",
        "05-jcopc-challenge2010",
        "06-jtcp",
        "07-cop-challenge2010",
    ] {
        let datagrams = recorded(&captures.join(format!("jauspp/{file}.pcap")));
        let parties: BTreeSet<_> = datagrams.iter().map(|it| it.source).collect();
        for party in parties {
            let mut ours = Party::in_place_of(&datagrams, party);
            let (theirs, others): (Vec<_>, Vec<_>) =
                datagrams.iter().partition(|it| it.source == party);
            others.iter().for_each(|it| ours.hear(it));
            ours.sent.clear();
            for datagram in theirs {
                if datagram.frame.flags.acknowledgement().is_answer() {
                    continue;
                }
                ours.say(&datagram.frame, datagram.frame.payload.clone(), false);
                let sent = ours.sent.pop().expect("a datagram");
                let without_number = |octets: &Bytes| octets.slice(..octets.len() - 2);
                assert_eq!(
                    without_number(&sent),
                    without_number(&datagram.octets),
                    "{file}, {} to {}",
                    datagram.frame.source,
                    datagram.frame.destination
                );
                compared += 1;
            }
        }
    }
    assert!(compared > 1000, "{compared}");
}

#[test]
fn every_recording_of_junior_and_jausplusplus_is_compared_somewhere() {
    let captures = evidence::captures();
    let sources = [
        "codec/captures_sent.rs",
        "codec/captures.rs",
        "links/jtcp_captures.rs",
        "links/jserial_captures.rs",
    ];
    let tests = sources.map(|name| {
        let path = FilePath::new(env!("CARGO_MANIFEST_DIR"))
            .join("tests")
            .join(name);
        fs::read_to_string(path).unwrap()
    });
    for folder in ["junior", "jauspp"] {
        for file in fs::read_dir(captures.join(folder)).unwrap() {
            let name = file.unwrap().file_name().into_string().unwrap();
            let stem = name.trim_end_matches(".pcap");
            let covered = tests.iter().any(|test| test.contains(stem));
            assert!(covered, "no test reads {folder}/{name}");
        }
    }
}
