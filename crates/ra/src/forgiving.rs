//! Reads messages of the Reference Architecture as its peers write them.
//!
//! Two habits are known, and both are mended before a message is read: presence vectors with bits
//! that no field owns (OpenJAUS sets all bits unless it is told otherwise, and writes nothing for
//! them), and a text of fixed length at the end that is shorter than it should be. What we send
//! keeps to the definitions.

use std::borrow::Cow;

use bytes::{Bytes, BytesMut};

use crate::messages::ra33::{
    CreateVksObjects, RejectEventRequest, ReportIdentification, ReportVksObjects,
};
use jaus::codec::{AnyMessage, DecodeError, DecodeErrorKind, Message, MessageInfo};

/// Presence vectors that one message may have mended: as many as the longest list of events holds.
const MOST_MENDED: usize = 256;

/// Octets of the message code.
const CODE_LEN: usize = 2;

/// Octets of the text that ends [`ReportIdentification`] and [`RejectEventRequest`].
const TEXT_LEN: usize = 80;

/// Decodes a message of the type, code and data, with the habits of peers forgiven.
///
/// # Errors
/// What is wrong beyond those habits, and at which octet.
pub fn decode(info: &MessageInfo, octets: &Bytes) -> Result<Box<dyn AnyMessage>, DecodeError> {
    forgiving(octets, info.decode)
}

/// Reads a message, code and data, with the habits of peers forgiven.
///
/// # Errors
/// What is wrong beyond those habits; offsets count in the octets as they came.
pub fn forgiving<T>(
    payload: &Bytes,
    decode: impl Fn(&Bytes) -> Result<T, DecodeError>,
) -> Result<T, DecodeError> {
    let mut mended = Cow::Borrowed(payload);
    for _ in 0..MOST_MENDED {
        match decode(&mended) {
            Ok(message) => return Ok(message),
            Err(error) => match mend(&mended, &error) {
                Some(better) => mended = Cow::Owned(better),
                None => return Err(error),
            },
        }
    }
    decode(&mended)
}

/// The octets without the mistake, if it is one of those that are forgiven.
fn mend(payload: &Bytes, error: &DecodeError) -> Option<Bytes> {
    match error.kind() {
        DecodeErrorKind::Presence { found, defined } => {
            let mut mended = BytesMut::from(payload.as_ref());
            let vector = mended.get_mut(error.offset()..)?;
            // Octets of the vector beyond the highest bit that is set need no mending.
            let set = (u64::BITS - found.leading_zeros()).div_ceil(u8::BITS) as usize;
            for (octet, defined) in vector.iter_mut().zip(defined.to_le_bytes()).take(set) {
                *octet &= defined;
            }
            Some(mended.freeze())
        }
        DecodeErrorKind::Short { .. } => padded(payload),
        DecodeErrorKind::Tag { .. } => buffered(payload),
        _ => None,
    }
}

/// The message with its final text filled up with zeros, if it has one that is too short.
fn padded(payload: &Bytes) -> Option<Bytes> {
    // Up to the text: the code, and in a rejection a presence vector that says that there is one.
    let text = match u16::from_le_bytes(*payload.first_chunk()?) {
        ReportIdentification::CODE => 6,
        RejectEventRequest::CODE if payload.get(2)? & 1 != 0 => 5,
        _ => return None,
    };
    let whole = text + TEXT_LEN;
    (text..whole).contains(&payload.len()).then(|| {
        let mut mended = BytesMut::from(payload.as_ref());
        mended.resize(whole, 0);
        mended.freeze()
    })
}

/// The message with the one bit that its vector has, if definitions have a tag in place of that.
fn buffered(payload: &Bytes) -> Option<Bytes> {
    let code = u16::from_le_bytes(*payload.first_chunk()?);
    if !matches!(code, CreateVksObjects::CODE | ReportVksObjects::CODE) {
        return None;
    }
    let mut mended = BytesMut::from(payload.as_ref());
    // A tag beyond the first octet of the data is another one, which would be the same again.
    let vector = mended.get_mut(CODE_LEN).filter(|vector| **vector > 1)?;
    *vector &= 1;
    Some(mended.freeze())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::messages::ra33::{ConfirmEventRequest, ReportConfiguration, ReportGlobalPose};

    fn read<M: Message>(payload: &[u8]) -> Result<M, DecodeError> {
        forgiving(&Bytes::copy_from_slice(payload), M::decode)
    }

    #[test]
    fn bits_that_no_field_owns_are_passed_over() {
        let all_on = [0xF3, 0x01, 0xFF, 0x07, 0x01, 0x4B, 0x00, 0x00, 0x00, 0x00];
        let confirmed = read::<ConfirmEventRequest>(&all_on).unwrap();
        assert_eq!(confirmed.request_id, 7);
        assert_eq!(confirmed.confirmed_periodic_rate_hz(), Some(0.0));

        // The second octet of the vector alone has such bits.
        let pose = read::<ReportGlobalPose>(&[0x02, 0x44, 0x00, 0xFE]).unwrap();
        assert_eq!(pose, ReportGlobalPose::default());
    }

    #[test]
    fn all_bits_mean_a_buffer_where_there_is_but_one_bit() {
        let none = read::<CreateVksObjects>(&[0x20, 0x0A, 0xFF, 0x01, 0x07, 0x00, 0x00]).unwrap();
        assert_eq!(Message::encode(&none).unwrap()[2], 1);
        assert!(read::<CreateVksObjects>(&[0x20, 0x0A, 0xFF, 0x01]).is_err());
    }

    #[test]
    fn a_name_that_ends_early_is_a_name() {
        let named = read::<ReportIdentification>(b"\x00\x4B\x02\x00\x00\x00OJ").unwrap();
        assert_eq!(named.identification.to_string(), "OJ");
        let refused = read::<RejectEventRequest>(b"\xF4\x01\xFF\x07\x05no\0").unwrap();
        assert_eq!(refused.error_message.unwrap().to_string(), "no");
    }

    #[test]
    fn other_mistakes_stay_mistakes() {
        assert!(read::<ReportIdentification>(b"\x00\x4B\x02\x00\x00").is_err());
        assert!(read::<RejectEventRequest>(b"\xF4\x01\x00\x07").is_err());
        assert!(read::<ReportConfiguration>(b"\x01\x4B\x02\x01").is_err());
        assert!(read::<ReportConfiguration>(b"").is_err());
    }
}
