//! Random octets, and random messages in valid packets: no panics, bounded state.

use proptest::prelude::*;

use super::*;

/// A packet with a valid header, mostly with messages that the node handles itself.
fn packet() -> impl Strategy<Value = Bytes> {
    let id = (
        any::<u8>(),
        0..4_u8,
        prop::sample::select(vec![1, 33, 35, 255]),
        0..3_u8,
    );
    let to = (
        prop::sample::select(vec![30, 255, 31]),
        0..3_u8,
        any::<u8>(),
        0..3_u8,
    );
    let codes = vec![
        0x4202, 0x2202, 0x2B00, 0x2B01, 0x2B03, 0x4B00, 0x4B01, 0x4B03, 0x01F0, 0x01F2, 0x01F3,
        0x01F4, 0x41F1, 0x0405,
    ];
    let code = prop::sample::select(codes);
    let data = prop::collection::vec(prop_oneof![0..4_u8, any::<u8>()], 0..64);
    let flags = prop::sample::select(vec![0_u8, 0x10, 0x20, 0x80]);
    (id, to, code, data, flags).prop_map(|(id, to, code, data, flags)| {
        let message = Message::new(
            RaId::new(id.0, id.1, id.2, id.3),
            RaId::new(to.0, to.1, to.2, to.3),
            code,
            data.into(),
        );
        let mut octets = datagram(&message).to_vec();
        octets[21] |= flags;
        octets.into()
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

    #[test]
    fn nothing_that_comes_does_harm(
        story in prop::collection::vec(
            (
                prop_oneof![
                    4 => packet(),
                    1 => prop::collection::vec(any::<u8>(), 0..80).prop_map(Bytes::from),
                ],
                0..2000_u64,
            ),
            0..60,
        ),
    ) {
        let settings = Settings::default();
        let bound = settings.carrier.max_parts;
        let mut rig = Rig::new(settings);
        for (datagram, pause) in story {
            let host = datagram.first().copied().unwrap_or(0) % 4;
            rig.node.handle_datagram(rig.now, address(host), datagram);
            rig.now += Duration::from_millis(pause);
            rig.node.handle_timeout(rig.now);
            prop_assert!(rig.node.carrier().unfinished() <= bound);
            prop_assert!(rig.node.poll_timeout().is_some_and(|next| next > rig.now));
            rig.sent();
            rig.events();
        }
    }
}
