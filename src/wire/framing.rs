//! The framing of a link: how messages are delimited on it.

use bytes::Bytes;

use super::{EncodeError, Frame, jserial, jtcp, judp};

/// The framing of a link.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Framing {
    /// UDP: datagrams, each beginning with its version.
    #[default]
    Judp,
    /// TCP: a stream of messages that carry their own sizes.
    Jtcp,
    /// Serial lines: packets with markers and checksums, one message each.
    Jserial,
}

impl Framing {
    /// Encodes one frame for such a link, with the frame's own header version.
    ///
    /// # Errors
    /// The header cannot carry the frame.
    pub fn encode(self, frame: &Frame) -> Result<Bytes, EncodeError> {
        match self {
            Self::Judp => judp::encode(frame),
            Self::Jtcp => jtcp::encode(frame),
            Self::Jserial => jserial::encode(frame),
        }
    }

    /// The frames in a datagram or in the whole of a stream, up to the first that does not decode.
    #[must_use]
    pub fn frames(self, octets: Bytes) -> Vec<Frame> {
        match self {
            Self::Judp => {
                let frames = judp::frames(octets).into_iter().flatten();
                frames.map_while(Result::ok).collect()
            }
            Self::Jtcp => {
                let mut decoder = jtcp::Decoder::new();
                decoder.input().extend_from_slice(&octets);
                std::iter::from_fn(|| decoder.next_frame().ok().flatten()).collect()
            }
            Self::Jserial => {
                let mut decoder = jserial::Decoder::new();
                decoder.push(&octets);
                std::iter::from_fn(|| decoder.next_frame()).collect()
            }
        }
    }
}
