//! Properties of the rules that hold for random rules and messages.

use proptest::prelude::*;

use super::*;

fn id() -> impl Strategy<Value = JausId> {
    let part = prop_oneof![Just(1), Just(255)];
    let subsystem = prop_oneof![Just(101), Just(102), Just(65_535)];
    (subsystem, part.clone(), part)
        .prop_map(|(subsystem, node, component)| JausId::new(subsystem, node, component))
}

fn rules() -> impl Strategy<Value = Rules> {
    const WORDS: [&str; 17] = [
        "command",
        "control=9",
        "control=255",
        "clear-emergency",
        "clear-emergency=any",
        "configure",
        "with=101.255.255",
        "with=101.1.1,102.255.255",
        "only=PrimitiveDriver",
        "only=SetTravelSpeed,SetElement,SpoolMission",
        "only=SetLamp",
        "except=SetTravelSpeed",
        "except=SetEmergency,QueryVelocityState",
        "except=CreateCommandEvent",
        "also=DABCh",
        "also=any",
        "observe",
    ];
    let words = prop::sample::subsequence(WORDS.to_vec(), 0..8);
    words.prop_map(|words| words.join(" ").parse().unwrap())
}

/// A message that carries no other.
fn plain() -> impl Strategy<Value = Vec<u8>> {
    const PLAIN: [&[u8]; 11] = [
        b"\x05\x04\0\0",
        b"\x0A\x04\0\0\0",
        b"\x04\x24\0\0",
        b"\x06\0\x01\0",
        b"\x07\0\x01\0",
        b"\x07\0\xFF\xFF",
        b"\x0D\0\x09",
        b"\x0D\0\xFF",
        b"\x0E\0",
        b"\x02\0",
        b"\xBC\xDA",
    ];
    prop::sample::select(PLAIN.to_vec()).prop_map(<[u8]>::to_vec)
}

/// A message to a component, by octets.
type Sent = (JausId, Vec<u8>);

/// A message with others in it, and each of these with the component that is to obey it.
fn carrier() -> impl Strategy<Value = (JausId, Vec<u8>, Vec<Sent>)> {
    let inner = plain().prop_recursive(3, 12, 2, |inner| {
        prop_oneof![
            inner.clone().prop_map(|it| element(&it)),
            inner.clone().prop_map(|it| command_event(&it)),
            inner.prop_map(|it| event(&it)),
        ]
    });
    let inner = prop::collection::vec((id(), inner), 1..4);
    (id(), inner, 0..4_u8).prop_map(|(to, inner, kind)| {
        let first = &inner[0].1;
        let here = vec![(to, first.clone())];
        match kind {
            0 => (to, element(first), here),
            1 => (to, command_event(first), here),
            2 => (to, event(first), here),
            _ => {
                let messages: Vec<_> = inner.iter().map(|(to, it)| (*to, &it[..])).collect();
                (to, mission_to(&messages), inner.clone())
            }
        }
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    /// Whatever the rules let a sender have carried, it may also send plainly to the same component.
    #[test]
    fn what_may_be_carried_may_be_sent((rules, (to, octets, inner)) in (rules(), carrier())) {
        let table = Table::default();
        let to_id = |destination, payload: Vec<u8>| Frame { destination, ..frame(payload) };
        if rules.admit(&to_id(to, octets), &table).is_ok() {
            for (to, message) in inner {
                let sent = rules.admit(&to_id(to, message.clone()), &table);
                prop_assert!(sent.is_ok(), "{rules}: {message:02X?} to {to}: {sent:?}");
            }
        }
    }

    /// What is admitted stays within `with`, unless it changes nothing.
    #[test]
    fn nothing_leaves_with((rules, (to, octets, _)) in (rules(), carrier())) {
        let frame = Frame { destination: to, ..frame(octets) };
        let table = Table::default();
        if let Ok(admitted) = rules.admit(&frame, &table) {
            let is_free = table.needs(&frame.payload).all(Permission::needs_no_right);
            for copy in admitted.copies(&frame).unwrap_or_else(|| vec![frame.clone()]) {
                prop_assert!(rules.covers(copy.destination) || is_free && rules.may_reach(to));
            }
        }
    }
}
