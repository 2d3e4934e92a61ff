//! The generated messages: the first two octets are the message code, the rest is the body. An
//! unassigned code stands for one of the existing messages.
#![no_main]

use bytes::Bytes;
use jaus::codec::{MessageInfo, view};
use jaus_fuzz::with_code;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|octets: &[u8]| {
    let Some((code, body)) = octets.split_first_chunk() else {
        return;
    };
    let code = u16::from_le_bytes(*code);
    let mut types: Vec<_> = every_message().filter(|info| info.code == code).collect();
    if types.is_empty() {
        let all: Vec<_> = every_message().collect();
        types.push(all[usize::from(code) % all.len()]);
    }
    for info in types {
        message_comes_back(info, &Bytes::from(with_code(info.code, body)));
    }
});

fn every_message() -> impl Iterator<Item = &'static MessageInfo> {
    let jaus = jaus_vehicle::messages::registry();
    let ra = jaus_ra::messages::registry();
    [jaus, ra].into_iter().flat_map(|registry| registry.iter())
}

fn message_comes_back(info: &MessageInfo, octets: &Bytes) {
    let message = match (info.decode)(octets) {
        Ok(message) => message,
        Err(error) => {
            assert!(error.offset() <= octets.len(), "{error}");
            assert!(error.to_string().contains(info.name), "{error}");
            return;
        }
    };
    assert_eq!(message.encode().as_ref(), Ok(octets));
    let text = serde_json::to_string(&*message).expect("a tree of plain values");
    let view: view::Value = serde_json::from_str(&text).expect("our own text");
    let again = (info.from_view)(&view).expect("our own view");
    // A NaN has many bit patterns and one name.
    if !text.contains("\"NaN\"") {
        assert_eq!(again.encode().as_ref(), Ok(octets), "{text}");
        assert!(*again == *message, "{text}");
    }
    assert_eq!(
        serde_json::to_string(&*again).expect("a tree of plain values"),
        text
    );
}
