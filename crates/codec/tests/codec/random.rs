//! Random messages.

use jaus_codec::arbitrary::{self, Arbitrary, Unstructured};
use jaus_codec::{Message, Text};

use crate::messages::{ReportSurvey, Shape};

/// Octets without a pattern, others for each seed.
fn octets(seed: u64) -> Vec<u8> {
    let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    let step = |_| {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1);
        (state >> 56) as u8
    };
    (0..400).map(step).collect()
}

#[test]
fn a_random_message_is_valid_and_reads_as_itself() {
    for seed in 0..200 {
        let octets = octets(seed);
        let message = ReportSurvey::arbitrary(&mut Unstructured::new(&octets)).unwrap();
        let encoded = message.encode().unwrap();
        assert_eq!(encoded.len(), message.encoded_len());
        assert_eq!(ReportSurvey::decode(&encoded), Ok(message));
    }
    let exhausted = ReportSurvey::arbitrary(&mut Unstructured::new(&[])).unwrap();
    assert_eq!((exhausted.name.len(), exhausted.points.len()), (1, 1));
}

#[test]
fn random_messages_differ_in_everything_that_may_differ() {
    let messages: Vec<_> = (0..200)
        .map(octets)
        .map(|octets| ReportSurvey::arbitrary(&mut Unstructured::new(&octets)).unwrap())
        .collect();
    let differs = |what: fn(&ReportSurvey) -> String, least| {
        let mut values: Vec<_> = messages.iter().map(what).collect();
        values.sort();
        values.dedup();
        assert!(values.len() >= least, "{values:?}");
    };
    differs(|message| format!("{:?}", message.mode), 50);
    differs(|message| format!("{:?}", message.depth), 50);
    differs(
        |message| format!("{:?}", message.mark.as_ref().map(Text::len)),
        6,
    );
    differs(
        |message| format!("{:?}", message.photo.as_ref().map(|photo| photo.data.len())),
        14,
    );
    differs(
        |message| format!("{:?}", message.photo.as_ref().map(|photo| photo.format)),
        30,
    );
    differs(|message| message.name.len().to_string(), 8);
    differs(|message| format!("{:?}", message.samples), 50);
    differs(|message| message.points.len().to_string(), 3);
    differs(|message| format!("{:?}", message.points[0].height), 50);
    differs(
        |message| match &message.shape {
            Shape::Circle(_) => "circle".to_owned(),
            Shape::Polygon(corners) => corners.len().to_string(),
        },
        14,
    );
}

#[test]
fn a_random_real_is_never_nan() {
    let wide = |real: f64| arbitrary::f64(&mut Unstructured::new(&real.to_le_bytes())).unwrap();
    let narrow = |real: f32| arbitrary::f32(&mut Unstructured::new(&real.to_le_bytes())).unwrap();
    assert_eq!((wide(2.5), narrow(-2.5)), (2.5, -2.5));
    assert_eq!((wide(f64::NAN), narrow(f32::NAN)), (0.0, 0.0));
    assert_eq!(wide(f64::INFINITY), f64::INFINITY);
}

#[test]
fn random_fixed_text_does_not_end_in_what_reads_as_padding() {
    for seed in 0..200 {
        let mut octets = octets(seed);
        octets.iter_mut().for_each(|octet| *octet &= 1);
        let text = arbitrary::fixed_text(&mut Unstructured::new(&octets), 8).unwrap();
        assert_ne!(text.as_bytes().last(), Some(&0));
        assert!(text.len() <= 8);
    }
}
