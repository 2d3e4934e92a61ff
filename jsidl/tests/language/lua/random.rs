//! The dissector on random messages of every built-in type: tshark prints the values that our
//! codec decodes.

use jaus_test_kit::tools::has_tshark;
use jsidl::Loader;
use jsidl::dynamic::{arbitrary, encode};

use super::golden::{Family, check_source};

/// Reproducible pseudo-random octets (an xorshift generator).
fn entropy(seed: u64) -> Vec<u8> {
    let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    let mut octet = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        state.to_le_bytes()[3]
    };
    (0..300).map(|_| octet()).collect()
}

#[test]
fn tshark_prints_the_values_of_random_messages_of_every_built_in_type() {
    check_random("random", Loader::catalogue, Family::Services, 200);
}

#[test]
fn tshark_prints_the_values_of_random_messages_of_the_reference_architecture() {
    let load = Loader::reference_architecture;
    check_random("random_ra", load, Family::ReferenceArchitecture, 100);
}

/// Checks a random message of every loaded type; there must be more than `least`.
fn check_random(name: &str, load: fn(&mut Loader) -> &mut Loader, family: Family, least: usize) {
    if !has_tshark() {
        return;
    }
    let mut loader = Loader::new();
    load(&mut loader);
    let library = loader.load().library;
    let messages = library.services().flat_map(|service| service.messages());
    // A seed per code, so that a new message does not change the values of all others.
    let random = |code: u16| entropy(code.into());
    let vectors: Vec<_> = messages
        .filter_map(|message| encode(message, &arbitrary(message, &random(message.code))).ok())
        .collect();
    assert!(vectors.len() > least, "{} messages", vectors.len());
    let checked = check_source(&library, name, family, &vectors);
    assert_eq!(checked, vectors.len());
}
