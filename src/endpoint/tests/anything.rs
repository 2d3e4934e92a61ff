//! Arbitrary input in arbitrary order: no panic, bounded memory, and every message is accounted
//! for.

use proptest::collection::vec;
use proptest::prelude::*;

use super::*;

const LIMIT: usize = 8;

/// An event in the life of an endpoint.
#[derive(Clone, Debug)]
enum Step {
    Hear {
        host: u8,
        frames: Vec<Frame>,
        stale: Vec<u8>,
    },
    HearOctets(Vec<u8>),
    Send(Outgoing),
    Attach(JausId),
    Detach(JausId),
    AddLink(u16),
    RemoveLink(u16),
    Pass(u64),
    Poll,
}

/// A small set of ids, so that they coincide: zero, wildcard, ours and theirs.
fn any_id() -> impl Strategy<Value = JausId> {
    let subsystem = prop_oneof![Just(0_u16), Just(101), Just(42), Just(0xFFFF)];
    let small = || prop_oneof![3 => 1_u8..4, 1 => Just(0), 1 => Just(0xFF)];
    (subsystem, small(), small())
        .prop_map(|(subsystem, node, component)| JausId::new(subsystem, node, component))
}

fn any_frame() -> impl Strategy<Value = Frame> {
    let version = prop_oneof![3 => Just(Version::As5669a), 1 => Just(Version::As5669), 1 => Just(Version::Ra)];
    (
        version,
        any_id(),
        any_id(),
        any::<u8>(),
        0_u16..6,
        vec(0_u8..3, 2..8),
    )
        .prop_map(|(version, source, destination, flags, sequence, payload)| {
            let frame = Frame::new(source, destination, payload.into());
            Frame {
                version,
                flags: Flags(flags),
                sequence,
                ..frame
            }
        })
}

fn any_outgoing() -> impl Strategy<Value = Outgoing> {
    let broadcast = prop_oneof![
        Just(Broadcast::None),
        Just(Broadcast::Local),
        Just(Broadcast::Global)
    ];
    let length = prop_oneof![8 => 0_usize..8, 2 => 0_usize..9000];
    (
        any_id(),
        any_id(),
        0_usize..4,
        broadcast,
        any::<bool>(),
        length,
    )
        .prop_map(
            |(source, destination, priority, broadcast, acknowledge, length)| Outgoing {
                priority: Priority::ALL[priority],
                broadcast,
                acknowledge,
                ..Outgoing::new(source, destination, vec![0; length].into())
            },
        )
}

fn any_step() -> impl Strategy<Value = Step> {
    let hear = (0_u8..4, vec(any_frame(), 1..4), vec(any::<u8>(), 0..20)).prop_map(
        |(host, frames, stale)| Step::Hear {
            host,
            frames,
            stale,
        },
    );
    prop_oneof![
        8 => hear,
        1 => vec(any::<u8>(), 0..60).prop_map(Step::HearOctets),
        4 => any_outgoing().prop_map(Step::Send),
        2 => any_id().prop_map(Step::Attach),
        1 => any_id().prop_map(Step::Detach),
        1 => (0_u16..3).prop_map(Step::AddLink),
        1 => (0_u16..3).prop_map(Step::RemoveLink),
        3 => (0_u64..700).prop_map(Step::Pass),
        1 => Just(Step::Poll),
    ]
}

fn datagram(frames: &[Frame], stale: &[u8]) -> Bytes {
    let mut octets = Vec::new();
    for frame in frames {
        let datagram = judp::encode(&Frame {
            version: frames[0].version,
            ..frame.clone()
        })
        .unwrap();
        octets.extend_from_slice(if octets.is_empty() {
            &datagram
        } else {
            &datagram[1..]
        });
    }
    octets.extend_from_slice(stale);
    octets.into()
}

fn take(rig: &mut Rig, step: Step) {
    match step {
        Step::Hear {
            host,
            frames,
            stale,
        } => rig.hear_octets(host, datagram(&frames, &stale)),
        Step::HearOctets(octets) => rig.hear_octets(PEER_HOST, octets.into()),
        Step::Send(message) => {
            let _ = rig.send(message);
        }
        Step::Attach(id) => {
            let _ = rig.endpoint.attach(id);
        }
        Step::Detach(id) => rig.endpoint.detach(id),
        Step::AddLink(link) => {
            let own = path(OUR_HOST).peer.socket();
            rig.endpoint.add_link(LinkId(link), LinkProfile::judp(own));
        }
        Step::RemoveLink(link) => rig.endpoint.remove_link(LinkId(link)),
        Step::Pass(milliseconds) => rig.pass(Duration::from_millis(milliseconds)),
        Step::Poll => {
            let _ = (rig.events(), rig.received(), rig.transmits());
        }
    }
}

/// No message is dropped for two reasons: mutually exclusive reasons together do not outnumber the
/// messages.
fn is_accounted_for(rig: &Rig) -> bool {
    let before_delivery: u64 = [
        Counter::ReservedType,
        Counter::CompressedHeader,
        Counter::PriorityFault,
        Counter::ReservedBroadcast,
        Counter::InvalidSource,
        Counter::OwnEcho,
        Counter::IdConflict,
        Counter::NotForUs,
        Counter::OutOfScope,
        Counter::AcknowledgementWithPayload,
        Counter::UnawaitedAcknowledgement,
        Counter::Duplicate,
        Counter::NoMessageCode,
        Counter::MessageTooLong,
    ]
    .map(|counter| rig.count(counter))
    .iter()
    .sum();
    rig.count(Counter::MessagesReceived) >= before_delivery
}

proptest! {
    #[test]
    fn nothing_breaks_an_endpoint_or_makes_it_grow(steps in vec(any_step(), 0..120)) {
        let config = Config {
            queue_limit: LIMIT,
            limits: Limits {
                max_peers: LIMIT,
                ..Limits::default()
            },
            max_recent: LIMIT,
            max_components: LIMIT,
            max_unacknowledged: LIMIT,
            max_message: 8000,
            max_reassembly: 64,
            ..Config::default()
        };
        let mut rig = Rig::with(config);
        for step in steps {
            take(&mut rig, step);
            prop_assert!(rig.endpoint.peers().count() <= LIMIT);
            prop_assert!(rig.endpoint.components().count() <= LIMIT);
            let timeout = rig.endpoint.poll_timeout();
            prop_assert!(timeout.is_none_or(|timeout| timeout > rig.now), "what was due is done");
            prop_assert!(is_accounted_for(&rig));
        }
        prop_assert!(rig.events().len() <= 6 * LIMIT);
        prop_assert!(rig.transmits().len() <= 4 * LIMIT);
        // Without further input, all timers end.
        for _wake in 0..100 {
            let Some(timeout) = rig.endpoint.poll_timeout() else { break };
            rig.now = rig.now.max(timeout);
            rig.endpoint.handle_timeout(rig.now);
            let _ = (rig.events(), rig.received(), rig.transmits());
        }
        prop_assert_eq!(rig.endpoint.poll_timeout(), None);
    }
}
