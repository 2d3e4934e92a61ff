//! What rmw_zenoh attaches to each message.

use super::Gid;

/// The octets of an attachment: two numbers, the length of the gid, the gid.
const LENGTH: usize = 33;

/// What rmw_zenoh attaches to each message.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Attachment {
    /// The number of the message among those of its publisher, from 1.
    pub sequence: i64,
    /// When it was sent, by the sender's system clock. Nanoseconds since 1970-01-01 UTC
    pub stamp: i64,
    /// Its publisher.
    pub gid: Gid,
}

/// Octets that are no attachment of rmw_zenoh.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "the attachment of {0} octets is not one of rmw_zenoh 0.2.4 or newer: update ROS's package \
     rmw_zenoh_cpp"
)]
pub struct AttachmentError(usize);

impl Attachment {
    /// Writes the attachment, as zenoh's serialization does.
    #[must_use]
    pub fn encode(&self) -> [u8; LENGTH] {
        let mut octets = [0; LENGTH];
        octets[..8].copy_from_slice(&self.sequence.to_le_bytes());
        octets[8..16].copy_from_slice(&self.stamp.to_le_bytes());
        octets[16] = 16;
        octets[17..].copy_from_slice(&self.gid.0);
        octets
    }

    /// Reads an attachment.
    ///
    /// # Errors
    /// The octets are of another form, such as that of rmw_zenoh before 0.2.4.
    pub fn decode(octets: &[u8]) -> Result<Self, AttachmentError> {
        let parse = || {
            let (sequence, rest) = octets.split_first_chunk()?;
            let (stamp, rest) = rest.split_first_chunk()?;
            let (16, gid) = rest.split_first()? else {
                return None;
            };
            Some(Self {
                sequence: i64::from_le_bytes(*sequence),
                stamp: i64::from_le_bytes(*stamp),
                gid: Gid(gid.try_into().ok()?),
            })
        };
        parse().ok_or(AttachmentError(octets.len()))
    }
}
