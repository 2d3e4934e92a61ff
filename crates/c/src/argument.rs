//! Reads arguments of calls, and writes results.

use std::ffi::{CStr, c_char};
use std::time::Duration;

use bytes::Bytes;
use jaus::address::JausId;
use jaus::wire::Priority;

use crate::status::{Failure, JausStatus};
use crate::types::JausAddress;

/// The longest message of a node, in octets.
const LONGEST_MESSAGE: usize = 16 << 20;

fn null(name: &str) -> Failure {
    Failure::new(JausStatus::NullPointer, format!("{name} is null"))
}

/// Reads a text.
///
/// # Safety
/// `text` is null, or points to octets that end with a 0 and do not change during `'a`.
pub(crate) unsafe fn text<'a>(text: *const c_char, name: &str) -> Result<&'a str, Failure> {
    if text.is_null() {
        return Err(null(name));
    }
    // SAFETY: not null, and ends with a 0 as the caller guarantees.
    let text = unsafe { CStr::from_ptr(text) };
    text.to_str().map_err(|_| {
        Failure::new(
            JausStatus::InvalidText,
            format!("{name} is not valid UTF-8"),
        )
    })
}

/// Copies a message: its code, two octets, and its body.
///
/// # Safety
/// `data` is null, or points to `length` octets that do not change during the call.
pub(crate) unsafe fn message(data: *const u8, length: usize) -> Result<Bytes, Failure> {
    if data.is_null() {
        return Err(null("the message"));
    }
    if !(2..=LONGEST_MESSAGE).contains(&length) {
        return Err(Failure::argument(format!(
            "a message has 2 to {LONGEST_MESSAGE} octets, beginning with its code, not {length}"
        )));
    }
    // SAFETY: not null, and the caller guarantees `length` octets.
    let octets = unsafe { std::slice::from_raw_parts(data, length) };
    Ok(Bytes::copy_from_slice(octets))
}

/// Checks that a result can be written, before the work is done.
pub(crate) fn check_out<T>(out: *const T, name: &str) -> Result<(), Failure> {
    match out.is_null() {
        true => Err(null(name)),
        false => Ok(()),
    }
}

/// Writes a result.
///
/// # Safety
/// `out` is null, or can be written.
pub(crate) unsafe fn put<T>(out: *mut T, value: T, name: &str) -> Result<(), Failure> {
    check_out(out, name)?;
    // SAFETY: not null, and the caller guarantees that it can be written. It may be uninitialised,
    // so it is not dropped.
    unsafe { out.write(value) };
    Ok(())
}

/// The message code of a message of at least two octets.
pub(crate) fn code_of(message: &[u8]) -> u16 {
    jaus::service::code_of(message).unwrap_or_default()
}

/// The id of one component.
pub(crate) fn one_component(address: JausAddress) -> Result<JausId, Failure> {
    let id = JausId::from(address);
    match id.is_unicast() {
        true => Ok(id),
        false => Err(Failure::argument(format!("{id} is not a single component"))),
    }
}

pub(crate) fn priority(number: u8) -> Result<Priority, Failure> {
    Ok(match number {
        0 => Priority::Low,
        1 => Priority::Standard,
        2 => Priority::High,
        3 => Priority::SafetyCritical,
        _ => {
            return Err(Failure::argument(format!(
                "priority {number}: choose 0 to 3"
            )));
        }
    })
}

/// A time limit; 0 means the default.
pub(crate) fn limit(milliseconds: u32, default: Duration) -> Duration {
    match milliseconds {
        0 => default,
        milliseconds => Duration::from_millis(milliseconds.into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn null_and_malformed_arguments_are_errors() {
        let malformed = [0xFFu8, 0];
        // SAFETY: null, or octets that end with a 0.
        let texts =
            [std::ptr::null(), malformed.as_ptr()].map(|it| unsafe { text(it.cast(), "name") });
        let statuses = texts.map(|it| it.unwrap_err().status);
        assert_eq!(statuses, [JausStatus::NullPointer, JausStatus::InvalidText]);
        for (data, length, expected) in [
            (std::ptr::null(), 2, JausStatus::NullPointer),
            (malformed.as_ptr(), 1, JausStatus::InvalidArgument),
            (malformed.as_ptr(), usize::MAX, JausStatus::InvalidArgument),
        ] {
            // SAFETY: lengths beyond those of the octets are refused before they are read.
            let read = unsafe { message(data, length) };
            assert_eq!(read.unwrap_err().status, expected, "{length}");
        }
        // SAFETY: null is refused.
        let put = unsafe { put(std::ptr::null_mut::<u8>(), 1, "result") };
        assert_eq!(put.unwrap_err().status, JausStatus::NullPointer);
        assert!(priority(4).is_err());
    }
}
