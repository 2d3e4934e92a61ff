//! The dynamic codec on the embedded definitions: two octets choose the message, one the input form
//! (JSON text, a random value, octets), and the rest is the input. The generated codec must agree.
#![no_main]

use bytes::Bytes;
use jaus_fuzz::{Declared, choose, generated, octets_come_back, with_code};
use jsidl::dynamic::{Value, arbitrary, decode, encode, from_json, to_json};
use jsidl::model::Message;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|octets: &[u8]| {
    let Some((declared, rest)) = choose(octets) else {
        return;
    };
    let message = &declared.1;
    match rest.split_first() {
        Some((0, text)) => json_comes_back(message, text),
        Some((1, entropy)) => value_comes_back(declared, arbitrary(message, entropy)),
        Some((_, body)) => {
            let octets = with_code(message.code, body);
            octets_come_back(message, &octets);
            both_agree(declared, &octets);
            if let Ok(value) = decode(message, &octets) {
                view_comes_back(message, &value);
            }
        }
        None => octets_come_back(message, &with_code(message.code, &[])),
    }
});

fn value_comes_back(declared: &Declared, value: Value) {
    let message = &declared.1;
    let octets = encode(message, &value).expect("made for the definition");
    assert_eq!(decode(message, &octets), Ok(value.clone()));
    both_agree(declared, &octets);
    view_comes_back(message, &value);
}

/// The JSON text of a value reads back as a value with the same octets, except for the bits of a
/// NaN.
fn view_comes_back(message: &Message, value: &Value) {
    let text = to_json(message, value)
        .expect("names are unique")
        .to_string();
    let json = serde_json::from_str(&text).expect("our own text");
    let again = from_json(message, &json).expect("our own view");
    if !text.contains("\"NaN\"") {
        assert_eq!(encode(message, &again), encode(message, value), "{text}");
    }
    assert_eq!(
        to_json(message, &again)
            .expect("names are unique")
            .to_string(),
        text
    );
}

fn json_comes_back(message: &Message, text: &[u8]) {
    let Ok(json) = serde_json::from_slice(text) else {
        return;
    };
    let Ok(value) = from_json(message, &json) else {
        return;
    };
    view_comes_back(message, &value);
    if let Ok(octets) = encode(message, &value) {
        assert_eq!(decode(message, &octets), Ok(value));
    }
}

/// The generated codec accepts the same octets and shows the same text.
fn both_agree(declared: &Declared, octets: &[u8]) {
    let Some(info) = generated(declared) else {
        return;
    };
    let message = &declared.1;
    match (
        (info.decode)(&Bytes::copy_from_slice(octets)),
        decode(message, octets),
    ) {
        (Ok(generated), Ok(value)) => {
            let text = serde_json::to_string(&*generated).expect("a tree of plain values");
            assert_eq!(
                text,
                to_json(message, &value)
                    .expect("names are unique")
                    .to_string()
            );
        }
        (Err(_), Err(_)) => {}
        (generated, value) => panic!("{generated:?}, but {value:?}"),
    }
}
