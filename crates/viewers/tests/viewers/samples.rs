//! Samples of every message of the catalogue against their own schemas, with an independent validator.

use std::collections::HashMap;

use jaus_view::{Dictionary, Entry};
use jaus_viewers::Channels;
use jsidl::Loader;
use jsidl::dynamic::{arbitrary, to_json};
use jsonschema::Validator;
use serde_json::{Value as Json, json};

/// Octets that select the values of a message, the same in each run (SplitMix64).
fn entropy(seed: u64) -> Vec<u8> {
    let octets = |index: u64| {
        let mut x = seed.wrapping_add(index.wrapping_mul(0x9E37_79B9_7F4A_7C15));
        x = (x ^ (x >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        (x ^ (x >> 31)).to_le_bytes()
    };
    // Few octets select small values, none the least.
    let many = if seed == 0 { 0 } else { 4 << (seed % 6) };
    (1..=many).flat_map(octets).collect()
}

#[test]
fn samples_of_every_message_are_valid_in_the_schema_of_their_channel() {
    let dictionary = Dictionary::new().with_catalogue();
    let mut loader = Loader::new();
    loader.catalogue();
    let library = loader.load().library;
    let mut validators = HashMap::<String, Validator>::new();
    let (mut messages, mut samples) = (0, 0);
    for service in library.services() {
        for message in service.messages() {
            messages += 1;
            let mut channels = Channels::new(&dictionary);
            for seed in 0..12 {
                let value = arbitrary(message, &entropy(seed * 1000 + u64::from(message.code)));
                let entry = json!({
                    "source": "101.1.1", "code": format!("{:04X}", message.code),
                    "message": message.name.to_string(), "service": service.id.urn.to_string(),
                    "version": service.id.version.to_string(),
                    "body": to_json(message, &value).unwrap(),
                });
                let Json::Object(entry) = entry else {
                    unreachable!("an object");
                };
                for sample in channels.handle_entry(&Entry::of_object(entry), None, 0) {
                    let channel = channels.get(sample.channel).unwrap();
                    let text = &channel.schema.text;
                    let validator = validators.entry(text.clone()).or_insert_with(|| {
                        let schema = serde_json::from_str(text).unwrap();
                        jsonschema::draft202012::new(&schema).unwrap()
                    });
                    if let Err(error) = validator.validate(&sample.value) {
                        panic!("{}: {error}\n{:#}", channel.topic, sample.value);
                    }
                    samples += 1;
                }
            }
        }
    }
    println!("{samples} samples of {messages} messages");
    assert!(samples > 12 * 500, "{samples} of {messages}");
}
