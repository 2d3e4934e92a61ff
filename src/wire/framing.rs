//! How a link frames messages: which octets stand around them, and where one ends.

use bytes::Bytes;

use super::{EncodeError, Frame, jserial, jtcp, judp};

/// The framing of a link.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Framing {
    /// Datagrams, each with its version in front: UDP.
    #[default]
    Judp,
    /// Messages in a stream that delimit themselves: TCP.
    Jtcp,
    /// Packets marked and checked, each with one message: serial lines.
    Jserial,
}

impl Framing {
    /// The octets that carry one frame on such a link, with the frame's own header version.
    ///
    /// # Errors
    /// A frame that its header cannot carry.
    pub fn encode(self, frame: &Frame) -> Result<Bytes, EncodeError> {
        match self {
            Self::Judp => judp::encode(frame),
            Self::Jtcp => jtcp::encode(frame),
            Self::Jserial => jserial::encode(frame),
        }
    }
}
