//! Writes seeds for every target to `corpus/<target>`: small inputs with a wide coverage.
//!
//! Most are made from the embedded definitions and need not be stored: run this program again when
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
        let [datagram, stream, line] = framed(&octets);
        write(&corpus.join("judp"), &name, &[&[0], &datagram])?;
        write(&corpus.join("jtcp"), &name, &[&[5], &stream, &stream])?;
        write(&corpus.join("jserial"), &name, &[&[5, 0], &line, &line])?;
    }
    let in_order: [&[u8]; 3] = [
        &[0, 0, 0, 3, 20],
        &[0, 0, 1, 2, 9],
        &[9, 0, 1, 9, 0, 0, 9, 0, 3],
    ];
    write(
        &corpus.join("fragments"),
        "in-order",
        &[&[0], &in_order.concat()],
    )?;
    write(
        &corpus.join("fragments"),
        "narrow",
        &[&[1], &in_order.concat()],
    )?;
    write(&corpus.join("local"), "component", &[&[1], &component()])?;
    write(&corpus.join("local"), "node", &[&[30], &node()])?;
    let [datagram, ..] = framed(&[0x01, 0xD7]);
    let in_stream = jaus_secure::transport::framed(&datagram).expect("a short datagram");
    write(&corpus.join("secure"), "beacon", &[&[5], &beacon()])?;
    write(&corpus.join("secure"), "datagram", &[&[5], &datagram])?;
    let streams = [&[5], &in_stream[..], &in_stream];
    write(&corpus.join("secure"), "stream", &streams)?;
    for entry in jsidl::catalogue::entries() {
        let name = entry.path.replace('/', "-");
        write(
            &corpus.join("jsidl_text"),
            &name,
            &[entry.text().as_bytes()],
        )?;
    }
    Ok(())
}

/// A beacon of the key that the target trusts, with a wrong signature.
fn beacon() -> Vec<u8> {
    use jaus_secure::PublicKey;
    use jaus_secure::beacon::{Beacon, LENGTH, Stamp};

    let beacon = Beacon {
        fingerprint: PublicKey::from_octets([7; 32]).fingerprint(),
        subsystem: 101,
        node: 1,
        address: [10, 0, 0, 1].into(),
        port: 3795,
        stamp: Stamp::default(),
    };
    let mut octets = beacon.encode();
    octets.resize(LENGTH, 0);
    octets
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

/// The AS5669A message from 1.1.2 to 1.1.1 in a datagram, at the beginning of a stream, and in the
/// packet of a serial line.
fn framed(payload: &[u8]) -> [Vec<u8>; 3] {
    use jaus::address::JausId;
    use jaus::wire::{Frame, Framing};
    let (source, destination) = (JausId::new(1, 1, 2), JausId::new(1, 1, 1));
    let frame = Frame::new(source, destination, payload.to_vec().into());
    [Framing::Judp, Framing::Jtcp, Framing::Jserial]
        .map(|framing| framing.encode(&frame).expect("a short message").into())
}

/// A component's output to its host's node: its first record, a message, and a long one.
fn component() -> Vec<u8> {
    use jaus::address::JausId;
    use jaus::link::local::record::{Head, Record};
    use jaus::wire::{Acknowledgement, Flags};
    let flags = Flags::default().with_acknowledgement(Acknowledgement::Request);
    let send = |payload: Vec<u8>| Record {
        head: Head::Send {
            flags,
            handle: 1,
            destination: JausId::new(101, 1, 1),
        },
        payload: payload.into(),
    };
    records(&[
        Record::with_text(Head::hello(JausId::new(101, 1, 33)), "rover"),
        send(vec![0x02, 0x22]),
        send(vec![0x4D; 5000]),
        Head::Leave.into(),
    ])
}

/// The node's output to a component: welcome, a message from the network, and outcomes.
fn node() -> Vec<u8> {
    use jaus::address::JausId;
    use jaus::endpoint::{LinkId, Path, Shortfall, Unacknowledged};
    use jaus::link::local::record::{Head, Outcome, Reason, Record};
    use jaus::wire::Flags;
    let id = JausId::new(101, 1, 33);
    let peer = std::net::SocketAddr::from(([10, 0, 0, 2], 3794)).into();
    let link = LinkId(0);
    let deliver = Head::Deliver {
        flags: Flags::default(),
        source: JausId::new(42, 1, 1),
        destination: id,
        sequence: 7,
        path: Some(Path { link, peer }),
    };
    let unacknowledged = Outcome::NotAcknowledged(Shortfall {
        destination: id,
        reason: Unacknowledged::TimedOut,
        acknowledged: 5,
        length: 10,
    });
    let outcome = |handle, outcome| Record::from(Head::Outcome { handle, outcome });
    let max_message = 1 << 20;
    records(&[
        Head::Welcome { id, max_message }.into(),
        Record {
            head: deliver,
            payload: vec![0x02, 0x42].into(),
        },
        outcome(1, Outcome::Acknowledged),
        outcome(2, unacknowledged),
        Record::with_text(
            Head::Outcome {
                handle: 3,
                outcome: Outcome::Rejected,
            },
            "no",
        ),
        Record::with_text(Head::Refused(Reason::Taken), "no"),
    ])
}

fn records(records: &[jaus::link::local::record::Record]) -> Vec<u8> {
    let mut octets = Vec::new();
    for record in records {
        record.encode_head(&mut octets);
        octets.extend_from_slice(&record.payload);
    }
    octets
}

fn write(directory: &Path, name: &str, parts: &[&[u8]]) -> Result<()> {
    fs::create_dir_all(directory)?;
    fs::write(directory.join(name), parts.concat())
}
