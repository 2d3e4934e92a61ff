//! Hexadecimal text of octets.

use std::fmt::Write as _;

use super::definition::Unreadable;

/// Formats octets as lower-case hexadecimal digits, two per octet.
pub fn to_hex(octets: &[u8]) -> String {
    let mut text = String::with_capacity(2 * octets.len());
    for octet in octets {
        // Writing to a `String` cannot fail.
        let _ = write!(text, "{octet:02x}");
    }
    text
}

/// Parses hexadecimal digits of either case, ignoring white space between octets.
///
/// # Errors
/// If a character is not a digit, or an octet has only one digit. The error's offset is that of the
/// octet concerned.
pub fn from_hex(text: &str) -> Result<Vec<u8>, Unreadable> {
    let mut octets = Vec::with_capacity(text.len() / 2);
    let mut half = None;
    for character in text.chars() {
        match (half, character.to_digit(16)) {
            (None, None) if character.is_whitespace() => {}
            (None, Some(digit)) => half = Some(digit),
            (Some(high), Some(digit)) => {
                octets.push((high << 4 | digit) as u8);
                half = None;
            }
            (Some(_), None) if character.is_whitespace() => {
                return Err(Unreadable::new(
                    "an octet has two digits, but one is missing",
                    octets.len(),
                ));
            }
            (_, None) => {
                let problem = format!("{character:?} is not a hexadecimal digit");
                return Err(Unreadable::new(problem, octets.len()));
            }
        }
    }
    match half {
        Some(_) => Err(Unreadable::new(
            "an octet has two digits, but one is missing",
            octets.len(),
        )),
        None => Ok(octets),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_are_read_with_or_without_spaces() {
        for text in ["002B02", "00 2b 02", " 00 2B\t02 \r"] {
            assert_eq!(from_hex(text).unwrap(), [0x00, 0x2B, 0x02]);
        }
        assert!(from_hex("").unwrap().is_empty());
    }

    #[test]
    fn a_mistake_is_named_with_its_octet() {
        assert_eq!(from_hex("00 2").unwrap_err().offset, 1);
        assert_eq!(from_hex("00 2 B").unwrap_err().offset, 1);
        let error = from_hex("00 2B 0g").unwrap_err();
        assert_eq!(
            (error.offset, &*error.problem),
            (2, "'g' is not a hexadecimal digit")
        );
    }
}
