//! Datagrams in a stream: each is preceded by its length in two octets, little-endian.

use bytes::{Buf as _, BufMut as _, Bytes, BytesMut};

/// Octets of the length.
const PREFIX: usize = 2;

/// The datagram as it is written to a stream; `None` if it is too long for the prefix.
#[must_use]
pub fn framed(datagram: &[u8]) -> Option<Bytes> {
    let length = u16::try_from(datagram.len()).ok()?;
    let mut framed = BytesMut::with_capacity(PREFIX + datagram.len());
    framed.put_u16_le(length);
    framed.put_slice(datagram);
    Some(framed.freeze())
}

/// Collects the octets of one stream and finds the datagrams. Holds at most one incomplete
/// datagram, 64 KiB.
#[derive(Debug, Default)]
pub struct Inlet(BytesMut);

impl Inlet {
    /// Adds octets. Take the [complete datagrams](Self::next) before adding more.
    pub fn push(&mut self, octets: &[u8]) {
        self.0.extend_from_slice(octets);
    }

    /// The next complete datagram.
    #[expect(
        clippy::should_implement_trait,
        reason = "more datagrams may follow after there was none"
    )]
    pub fn next(&mut self) -> Option<Bytes> {
        let prefix = self.0.first_chunk::<PREFIX>()?;
        let length = usize::from(u16::from_le_bytes(*prefix));
        if self.0.len() < PREFIX + length {
            return None;
        }
        self.0.advance(PREFIX);
        Some(self.0.split_to(length).freeze())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn datagrams_are_found_however_the_stream_is_cut() {
        let datagrams = [&b"one"[..], b"", &[7; 3000], &[9; 65_535]];
        let stream: Vec<u8> = datagrams
            .iter()
            .flat_map(|it| framed(it).unwrap())
            .collect();
        for cut in [1, 2, 3, 1000, stream.len()] {
            let mut inlet = Inlet::default();
            let mut found = Vec::new();
            for piece in stream.chunks(cut) {
                inlet.push(piece);
                found.extend(std::iter::from_fn(|| inlet.next()));
            }
            assert_eq!(found, datagrams, "{cut}");
        }
    }

    #[test]
    fn a_datagram_beyond_the_prefix_is_not_framed() {
        assert!(framed(&[0; 65_536]).is_none());
    }
}
