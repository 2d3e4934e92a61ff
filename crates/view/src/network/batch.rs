//! Batches of datagrams, as a capture on the sending host shows them.
//!
//! Linux senders hand datagrams of equal length to the kernel at once (generic segmentation offload),
//! and a packet socket sees them before they are cut: as one datagram, longer than any that arrives.
//! The capture does not tell the length of the parts; the messages in them do.

use std::borrow::Cow;

use bytes::Bytes;

use super::{Datagram, first_message};
use jaus::wire::{Version, judp};

/// The datagrams of a batch; a datagram that is none comes back as it was.
pub(super) fn cut(batch: Datagram<'_>) -> Vec<Datagram<'_>> {
    let Some(length) = length_of_parts(&batch) else {
        return vec![batch];
    };
    let parts = batch.payload.len().div_ceil(length);
    let missing = |part| if part + 1 == parts { batch.missing } else { 0 };
    let with = |(part, payload)| Datagram {
        payload,
        missing: missing(part),
        ..batch
    };
    match &batch.payload {
        Cow::Borrowed(octets) => {
            let payloads = octets.chunks(length).map(Cow::Borrowed);
            payloads.enumerate().map(with).collect()
        }
        Cow::Owned(octets) => {
            let payloads = octets.chunks(length).map(|it| Cow::Owned(it.to_vec()));
            payloads.enumerate().map(with).collect()
        }
    }
}

/// The length of all parts but the last, which may be shorter; `None` for a single datagram.
///
/// The first part ends with its messages. Every other one must begin like a datagram; what JAUS++
/// leaves behind a message never does so at each multiple of the length.
fn length_of_parts(batch: &Datagram<'_>) -> Option<usize> {
    let payload = &batch.payload;
    let mut frames = judp::frames(Bytes::copy_from_slice(payload)).ok()?;
    if frames.version() != Version::As5669a {
        return None;
    }
    frames.by_ref().for_each(drop);
    let length = frames.offset();
    let begins_like_a_datagram =
        |part: &[u8]| first_message(part).is_some_and(|frame| frame.version == Version::As5669a);
    // The last part may be too short to read, if the capture truncated it.
    let readable = payload.len().div_ceil(length) - usize::from(batch.missing > 0);
    let mut parts = payload.chunks(length).take(readable);
    let is_batch = length < payload.len() && parts.all(begins_like_a_datagram);
    is_batch.then_some(length)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::net::{Ipv4Addr, SocketAddr};

    use jaus::address::JausId;
    use jaus::wire::{DataControl, Flags, Frame};

    fn part(data: DataControl, sequence: u16, length: usize) -> Vec<u8> {
        let (source, destination) = (JausId::new(101, 2, 51), JausId::new(101, 3, 36));
        let frame = Frame {
            flags: Flags::default().with_data(data),
            sequence,
            ..Frame::new(source, destination, vec![7; length].into())
        };
        judp::encode(&frame).unwrap().to_vec()
    }

    fn datagram(payload: Vec<u8>, missing: usize) -> Datagram<'static> {
        let address = SocketAddr::from((Ipv4Addr::LOCALHOST, 3794));
        Datagram {
            source: address,
            destination: address,
            payload: Cow::Owned(payload),
            missing,
            by_tcp: false,
        }
    }

    #[test]
    fn a_batch_is_cut_into_the_datagrams_that_arrive() {
        let parts = [
            part(DataControl::First, 1, 100),
            part(DataControl::Middle, 2, 100),
            part(DataControl::Last, 3, 40),
        ];
        let cut = cut(datagram(parts.concat(), 0));
        let payloads: Vec<_> = cut.iter().map(|it| it.payload.as_ref()).collect();
        assert_eq!(payloads, parts);
    }

    #[test]
    fn the_last_part_bears_what_the_capture_truncated() {
        let parts = [
            part(DataControl::First, 1, 100),
            part(DataControl::Last, 2, 40),
        ];
        let mut batch = parts.concat();
        batch.truncate(batch.len() - 5);
        let cut = cut(datagram(batch, 5));
        let missing: Vec<_> = cut.iter().map(|it| it.missing).collect();
        assert_eq!(missing, [0, 5]);
    }

    #[test]
    fn what_follows_a_single_datagram_s_message_stays_with_it() {
        let mut octets = part(DataControl::Single, 1, 100);
        for rest in [vec![], vec![2, 0, 9], vec![2; 300]] {
            octets.extend(rest);
            assert_eq!(cut(datagram(octets.clone(), 0)).len(), 1);
        }
    }
}
