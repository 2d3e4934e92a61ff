//! Writes seeds for every target to `corpus/<target>`: small inputs that reach far.
//!
//! Most are made from the embedded definitions, so that they need not be kept: run it again when
//! the definitions have changed.

use std::fs;
use std::io::Result;
use std::path::Path;

use jaus_fuzz::{Declared, catalogue};
use jsidl::dynamic::{arbitrary, encode, to_json};

fn main() -> Result<()> {
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus");
    for (choice, declared) in (0_u16..).zip(catalogue()) {
        let octets = sample(declared);
        let json = view(declared);
        let choice = choice.to_le_bytes();
        let name = format!("{:04x}-{}", declared.1.code, declared.0.version);
        write(
            &corpus.join("dynamic"),
            &format!("{name}-octets"),
            &[&choice, &[2], &octets[2..]],
        )?;
        write(
            &corpus.join("dynamic"),
            &format!("{name}-json"),
            &[&choice, &[0], json.as_bytes()],
        )?;
        write(&corpus.join("generated"), &name, &[&octets])?;
        write(&corpus.join("judp"), &name, &[&[0], &datagram(&octets)])?;
    }
    for entry in jsidl::catalogue::entries() {
        let name = entry.path.replace('/', "-");
        write(&corpus.join("jsidl_text"), &name, &[entry.text.as_bytes()])?;
    }
    let everything = include_bytes!("../../seeds/everything.xml");
    write(&corpus.join("jsidl_text"), "everything.xml", &[everything])
}

/// Octets that make a value with optional members and a few elements.
const ENTROPY: [u8; 40] = [1; 40];

fn sample((_, message): &Declared) -> Vec<u8> {
    encode(message, &arbitrary(message, &ENTROPY)).expect("made for the definition")
}

fn view((_, message): &Declared) -> String {
    to_json(message, &arbitrary(message, &ENTROPY))
        .expect("names are unique")
        .to_string()
}

/// The message in an AS5669A datagram from 1.1.2 to 1.1.1.
fn datagram(payload: &[u8]) -> Vec<u8> {
    use jaus::address::JausId;
    use jaus::wire::{Frame, judp};
    let (source, destination) = (JausId::new(1, 1, 2), JausId::new(1, 1, 1));
    let frame = Frame::new(source, destination, payload.to_vec().into());
    judp::encode(&frame).expect("a short message").into()
}

fn write(directory: &Path, name: &str, parts: &[&[u8]]) -> Result<()> {
    fs::create_dir_all(directory)?;
    fs::write(directory.join(name), parts.concat())
}
