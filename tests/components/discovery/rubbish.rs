//! Arbitrary input from arbitrary senders: a component stays up, with bounded state and traffic.

use std::time::{Duration, Instant};

use bytes::Bytes;
use jaus::address::JausId;
use jaus::endpoint::Received;
use jaus::service::{Discovery, Kind, Profile, Scope, Stack, Timing};
use jaus::wire::{Broadcast, Priority};
use proptest::prelude::*;

const OWN: JausId = JausId::new(101, 1, 33);
/// Queries and reports of Discovery, a heartbeat, and an unknown code.
const CODES: [u16; 12] = [
    0x2B00, 0x2B01, 0x2B02, 0x2B03, 0x2B04, 0x0B00, 0x4B00, 0x4B01, 0x4B02, 0x4B03, 0x2202, 0xFFFF,
];

fn message() -> impl Strategy<Value = Received> {
    let body = prop_oneof![
        prop::collection::vec(0..4_u8, 0..40),
        prop::collection::vec(any::<u8>(), 0..200),
    ];
    (
        any::<u32>(),
        any::<bool>(),
        prop::sample::select(&CODES[..]),
        body,
    )
        .prop_map(|(source, together, code, body)| {
            let mut payload = code.to_le_bytes().to_vec();
            payload.extend(body);
            Received {
                source: JausId::from_u32(source % 0x0005_0505),
                destination: if together { JausId::EVERYONE } else { OWN },
                priority: Priority::Standard,
                broadcast: if together {
                    Broadcast::Global
                } else {
                    Broadcast::None
                },
                payload: Bytes::from(payload),
                sequence: None,
                path: None,
                to: OWN,
                acknowledged: false,
            }
        })
}

proptest! {
    #[test]
    #[expect(clippy::disallowed_methods, reason = "virtual time starts at any instant")]
    fn arbitrary_messages_leave_a_component_responsive(
        messages in prop::collection::vec((message(), 0..20_000_u64), 0..200),
    ) {
        let timing = Timing { max_components: 8, ..Timing::default() };
        let profile = Profile::new(Kind::Vehicle, "steadfast");
        let discovery = Discovery::new(OWN, profile, Scope::System, timing, 1);
        let mut stack = Stack::new(discovery, Vec::new());
        let start = Instant::now();
        let mut now = start;
        stack.start(now);
        let mut said = 0_u64;
        for (message, pause) in &messages {
            now += Duration::from_millis(*pause);
            if stack.poll_timeout().is_some_and(|due| due <= now) {
                stack.handle_timeout(now);
            }
            stack.handle_message(now, message);
            while let Some(out) = stack.poll_transmit() {
                prop_assert_eq!(out.source, OWN);
                said += 1;
            }
            while stack.poll_event().is_some() {}
            prop_assert!(stack.directory().len() <= 1 + 8);
            prop_assert!(stack.directory().component(OWN).is_some());
        }
        // Allows a burst of queries and one per second, the multicasts, and up to nine reports per
        // received message.
        let seconds = now.duration_since(start).as_secs();
        prop_assert!(said <= 64 + 2 * seconds + 9 * messages.len() as u64, "{said} messages");
    }
}
