//! Properties of every pair, for arbitrary messages.

use proptest::collection::vec;
use proptest::prelude::*;
use proptest::test_runner::TestRunner;

use super::*;
use crate::messages as ra;
use jaus::codec::arbitrary::Unstructured;
use jaus::codec::view::Value;
use jaus::codec::{MessageInfo, OutOfRange};
use jaus_vehicle::messages::registry;

/// Octets to generate a message from; after the last octet, all values are zero or absent.
fn seed() -> impl Strategy<Value = Vec<u8>> {
    prop_oneof![
        Just(Vec::new()),
        vec(any::<u8>(), 0..12),
        vec(any::<u8>(), 0..200)
    ]
}

/// The layout of a pair's message in a set: of several, that of the pair's version.
fn layout(
    infos: impl Iterator<Item = &'static MessageInfo>,
    code: u16,
    name: &str,
    pair: &Pair,
) -> &'static MessageInfo {
    let old = pair.is_meant(contexts()[1]) && !pair.is_meant(Context::default());
    let mut same = infos.filter(|info| info.code == code && info.name == name);
    let first = same.next().unwrap();
    same.find(|_| old).unwrap_or(first)
}

fn random(info: &MessageInfo, seed: &[u8]) -> Bytes {
    let message = (info.arbitrary)(&mut Unstructured::new(seed)).unwrap();
    message.encode().unwrap()
}

/// Contexts of the runs: none, and components of version 1.0.
fn contexts() -> [Context<'static>; 2] {
    let old = Context {
        minor: Some(0),
        ..Context::default()
    };
    [Context::default(), old]
}

/// Messages that rarely convert: an emergency with the right code, a list of the right shape, a
/// vector with a speed within our range.
const RARE: &[u16] = &[0x0006, 0x0007, 0x041A, 0x0407, 0x4407, 0x0408, 0x4408];

/// Runs over all pairs, and requires that some messages of each convert.
fn for_every_pair(
    info: impl Fn(&Pair) -> &'static MessageInfo,
    property: impl Fn(&Pair, &MessageInfo, Bytes) -> Result<bool, TestCaseError>,
) {
    for pair in pairs() {
        let converted = std::cell::Cell::new(0);
        let info = info(pair);
        let mut runner = TestRunner::new(ProptestConfig {
            cases: 32,
            failure_persistence: None,
            ..ProptestConfig::default()
        });
        let outcome = runner.run(&seed(), |seed| {
            let was = property(pair, info, random(info, &seed))?;
            converted.set(converted.get() + u32::from(was));
            Ok(())
        });
        if let Err(failure) = outcome {
            panic!("{pair:?}: {failure}");
        }
        assert!(
            converted.get() > 0 || RARE.contains(&pair.jaus),
            "nothing of {pair:?}"
        );
    }
}

#[test]
fn one_of_ours_comes_back_as_it_was_or_is_refused() {
    let ours = |pair: &Pair| layout(registry().iter(), pair.jaus, pair.jaus_name, pair);
    for_every_pair(ours, |pair, info, payload| {
        let mut converted = false;
        for context in contexts() {
            let Ok(data) = pair.to_ra(&payload, context) else {
                continue;
            };
            let back = pair.to_jaus(&data, context).unwrap();
            if let (Ok(before), Ok(after)) = ((info.decode)(&payload), (info.decode)(&back)) {
                close(&before.view(), &after.view(), "")?;
                converted = true;
            }
            // A value on the steps of both scales converts without change.
            prop_assert_eq!(&pair.to_ra(&back, context).unwrap(), &data);
        }
        Ok(converted)
    });
}

/// Whether this is the lowest number of a signed 16-bit field, which is one step below the field's own range:
/// where the other side has room for it, it passes, but it does not come back.
fn is_lowest_number(error: &OutOfRange) -> bool {
    let step = (error.upper - error.lower) / f64::from(u16::MAX - 1);
    (error.lower - error.value - step).abs() < step / 2.0
}

#[test]
fn the_lowest_number_of_a_signed_field_passes_but_does_not_come_back() {
    let seed = [
        122, 28, 133, 71, 154, 88, 180, 108, 123, 39, 71, 13, 0, 128, 28, 179, 78, 112, 247, 164,
        27, 221, 65, 108, 91, 43, 124, 190, 255, 102, 88, 142, 199, 253, 41, 10, 200, 138, 112,
        231, 6, 51, 201,
    ];
    let mut refused = 0;
    for pair in pairs() {
        let info = layout(ra::registry().iter(), pair.ra, pair.ra_name, pair);
        let message = random(info, &seed);
        for context in contexts() {
            let Ok(payload) = pair.to_jaus(&message[2..], context) else {
                continue;
            };
            if let Err(Refusal::OutOfRange(error)) = pair.to_ra(&payload, context) {
                assert!(is_lowest_number(&error), "{error}");
                refused += 1;
            }
        }
    }
    assert!(refused > 0);
}

#[test]
fn one_of_theirs_comes_back_as_it_was_or_is_refused() {
    let theirs = |pair: &Pair| layout(ra::registry().iter(), pair.ra, pair.ra_name, pair);
    for_every_pair(theirs, |pair, info, message| {
        let mut converted = false;
        for context in contexts() {
            let Ok(payload) = pair.to_jaus(&message[2..], context) else {
                continue;
            };
            let data = match pair.to_ra(&payload, context) {
                Err(Refusal::OutOfRange(error)) if is_lowest_number(&error) => continue,
                data => data.unwrap(),
            };
            let back = [&message[..2], data.as_ref()].concat().into();
            let (before, after) = ((info.decode)(&message), (info.decode)(&back));
            close(&before.unwrap().view(), &after.unwrap().view(), "")?;
            converted = true;
        }
        Ok(converted)
    });
}

#[test]
fn no_octets_whatever_make_a_conversion_panic() {
    let mut runner = TestRunner::new(ProptestConfig {
        cases: 64,
        failure_persistence: None,
        ..ProptestConfig::default()
    });
    let octets = vec(any::<u8>(), 0..80);
    runner
        .run(&octets, |octets| {
            for pair in pairs() {
                for context in contexts() {
                    let _ = pair.to_jaus(&octets, context);
                    let payload = [&pair.jaus.to_le_bytes(), octets.as_slice()].concat();
                    let _ = pair.to_ra(&payload.into(), context);
                }
            }
            Ok(())
        })
        .unwrap();
}

/// Fields of one side only, which a round trip leaves out or fills in.
const LEFT_OUT: &[&str] = &[
    "SecondaryStatusCode",
    "Reserved",
    "WaypointNumber",
    "PathSegmentNumber",
    "WaypointTolerance",
    "PathTolerance",
    "PresenceVector",
    "ResponseCode",
    "RequestID",
    "ElementUID",
];

/// Left out of Set Velocity State and, in reports, of Local Vector.
const LEFT_OUT_OF_SOME: &[&str] = &["VelocityRMS", "RateRMS", "TimeStamp", "Z", "Roll", "Pitch"];

/// Half a step of each of the two scales, rounded up.
fn tolerance(field: &str) -> f64 {
    match field {
        // 10 000 m/s in 16 bits there, steps of 5 mm/s here.
        "Speed" => 0.08,
        "WeightingFactor" => 0.005,
        _ if field.contains("Effort") => 0.004,
        _ if field.contains("Rate") => 0.001,
        "Roll" | "Pitch" | "Yaw" | "Heading" => 1e-4,
        _ => 1e-4,
    }
}

/// Whether two views are equal except for fields left out in the conversion.
fn close(before: &Value, after: &Value, field: &str) -> Result<(), TestCaseError> {
    match (before, after) {
        (Value::Object(before), Value::Object(after)) => {
            for (name, value) in before {
                if LEFT_OUT.contains(&name.as_ref()) {
                    continue;
                }
                match after.iter().find(|(other, _)| other == name) {
                    Some((_, other)) => close(value, other, name)?,
                    None => {
                        prop_assert!(LEFT_OUT_OF_SOME.contains(&name.as_ref()), "{name} is lost");
                    }
                }
            }
        }
        (Value::Real(before), Value::Real(after)) => {
            prop_assert!(
                (before - after).abs() <= tolerance(field),
                "{field}: {before} became {after}"
            );
        }
        _ => prop_assert_eq!(before, after, "{}", field),
    }
    Ok(())
}
