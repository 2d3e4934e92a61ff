//! The TCP streams of a capture.

use std::collections::BTreeMap;
use std::fs::File;
use std::path::Path;

use jaus::wire::judp;
use jaus_view::Capture;

/// The octets of one direction of a connection, in order.
pub(crate) type Streams = BTreeMap<(u16, u16), Vec<u8>>;

/// The streams to and from the JAUS port, by port pair. Expects Ethernet and IPv4, and panics if a
/// segment is lost or out of order.
pub(crate) fn streams(file: &Path) -> Streams {
    let mut capture = Capture::new(File::open(file).expect("a readable file")).unwrap();
    let mut streams = Streams::new();
    let mut next = BTreeMap::new();
    while let Some(frame) = capture.next_frame() {
        let frame = frame.expect("a whole capture");
        let Some((ports, sequence, octets)) = segment(frame.octets) else {
            continue;
        };
        if octets.is_empty() || !(ports.0 == judp::PORT || ports.1 == judp::PORT) {
            continue;
        }
        let expected = next.insert(ports, sequence.wrapping_add(octets.len() as u32));
        assert!(
            expected.is_none_or(|expected| expected == sequence),
            "a segment is missing"
        );
        streams.entry(ports).or_default().extend_from_slice(octets);
    }
    streams
}

/// Ports, sequence number and content of a TCP segment in IPv4 in Ethernet.
fn segment(octets: &[u8]) -> Option<((u16, u16), u32, &[u8])> {
    const TCP: u8 = 6;
    let ip = octets.get(14..)?;
    let words = |octet: &u8| usize::from(octet & 0x0F) * 4;
    if octets[12..14] != [8, 0] || ip.get(9) != Some(&TCP) {
        return None;
    }
    let total = usize::from(u16::from_be_bytes([ip[2], ip[3]]));
    let tcp = ip.get(words(&ip[0])..total)?;
    let number = |at: usize| u16::from_be_bytes([tcp[at], tcp[at + 1]]);
    let sequence = u32::from(number(4)) << 16 | u32::from(number(6));
    let content = tcp.get(usize::from(tcp[12] >> 4) * 4..)?;
    Some(((number(0), number(2)), sequence, content))
}
