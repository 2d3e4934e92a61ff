//! Arbitrary text through the loader, which must answer any input with diagnostics; and some octets
//! through the codec of each definition that it accepts.
#![no_main]

use jaus_fuzz::{octets_come_back, with_code};
use jsidl::Loader;
use libfuzzer_sys::fuzz_target;

/// Message bodies to try: zeros satisfy most fields, ones request large counts.
const BODIES: [[u8; 32]; 3] = [[0; 32], [1; 32], [0xFF; 32]];

fuzz_target!(|text: &str| {
    let mut loader = Loader::new();
    loader.text("fuzz.xml", text);
    let loaded = loader.load();
    for diagnostic in loaded.diagnostics.iter() {
        let sentence = diagnostic.to_string();
        assert!(sentence.starts_with("fuzz.xml:"), "{sentence}");
    }
    for message in loaded
        .library
        .services()
        .flat_map(|service| service.messages())
    {
        for body in BODIES {
            for length in [0, 1, 2, 8, body.len()] {
                octets_come_back(message, &with_code(message.code, &body[..length]));
            }
        }
    }
});
