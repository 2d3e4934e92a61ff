//! Strings as received from peers: octets, in practice ASCII.

use alloc::borrow::Cow;
use alloc::string::String;
use core::fmt;

use bytes::Bytes;

/// The octets of a string field.
///
/// JSIDL specifies no character set, so the octets are kept unchanged. [`as_str`](Self::as_str) and
/// [`to_string_lossy`](Self::to_string_lossy) interpret them as UTF-8. A received text shares the
/// memory of its message.
///
/// ```
/// use jaus_codec::Text;
///
/// let name = Text::from("Rover");
/// assert_eq!(name.as_str(), Some("Rover"));
/// assert_eq!(name, "Rover");
/// ```
#[derive(Clone, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Text(Bytes);

impl Text {
    /// Creates a text from a static string without copying.
    pub const fn from_static(text: &'static str) -> Self {
        Self(Bytes::from_static(text.as_bytes()))
    }

    /// The longest prefix of `text` of at most `octets` octets, to fit a field with that limit.
    pub fn prefix(text: &str, octets: usize) -> &str {
        let mut end = octets.min(text.len());
        while !text.is_char_boundary(end) {
            end -= 1;
        }
        &text[..end]
    }

    /// The octets.
    pub fn as_bytes(&self) -> &[u8] {
        &self.0
    }

    /// The text, if it is valid UTF-8.
    pub fn as_str(&self) -> Option<&str> {
        core::str::from_utf8(&self.0).ok()
    }

    /// The text, with replacement characters for invalid UTF-8.
    pub fn to_string_lossy(&self) -> Cow<'_, str> {
        String::from_utf8_lossy(&self.0)
    }

    /// Length in octets, not characters.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Whether the length is zero.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

impl From<Bytes> for Text {
    fn from(octets: Bytes) -> Self {
        Self(octets)
    }
}

impl From<&str> for Text {
    fn from(text: &str) -> Self {
        Self(Bytes::copy_from_slice(text.as_bytes()))
    }
}

impl From<String> for Text {
    fn from(text: String) -> Self {
        Self(Bytes::from(text))
    }
}

impl From<Text> for Bytes {
    fn from(text: Text) -> Self {
        text.0
    }
}

impl PartialEq<str> for Text {
    fn eq(&self, other: &str) -> bool {
        self.as_bytes() == other.as_bytes()
    }
}

impl PartialEq<&str> for Text {
    fn eq(&self, other: &&str) -> bool {
        self == *other
    }
}

impl fmt::Debug for Text {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.as_str() {
            Some(text) => text.fmt(f),
            None => self.0.fmt(f),
        }
    }
}

impl fmt::Display for Text {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(&self.to_string_lossy())
    }
}

#[cfg(test)]
mod tests {
    use alloc::borrow::ToOwned;
    use alloc::format;

    use super::*;

    #[test]
    fn the_octets_of_a_text_are_kept_whatever_they_are_made_of() {
        let broken = Text::from(Bytes::from_static(b"d\xE9pot"));
        let cases = [
            (
                Text::from_static("dépôt"),
                "dépôt".as_bytes(),
                Some("dépôt"),
            ),
            (Text::from("dock"), b"dock", Some("dock")),
            (Text::from("quay".to_owned()), b"quay", Some("quay")),
            (Text::default(), b"", Some("")),
            (broken, b"d\xE9pot", None),
        ];
        for (text, octets, string) in cases {
            assert_eq!((text.as_bytes(), text.as_str()), (octets, string));
            assert_eq!(
                (text.len(), text.is_empty()),
                (octets.len(), octets.is_empty())
            );
            assert_eq!(Bytes::from(text), octets);
        }
    }

    #[test]
    fn a_prefix_has_whole_characters_only() {
        for (octets, prefix) in [
            (0, ""),
            (1, "q"),
            (2, "q"),
            (3, "qü"),
            (4, "qüi"),
            (9, "qüi"),
        ] {
            assert_eq!(Text::prefix("qüi", octets), prefix, "{octets}");
        }
    }

    #[test]
    fn a_text_is_compared_by_its_octets() {
        let text = Text::from("dock");
        assert!(text == "dock" && text != "docks" && text == *"dock" && text != *"Dock");
    }

    #[test]
    fn a_text_prints_as_a_string_if_it_can() {
        let broken = Text::from(Bytes::from_static(b"d\xE9pot"));
        assert_eq!(
            format!("{:?} {broken:?}", Text::from("a\"")),
            r#""a\"" b"d\xe9pot""#
        );
        assert_eq!(
            format!("{:>5}|{broken}", Text::from("quay")),
            " quay|d\u{FFFD}pot"
        );
        assert_eq!(broken.to_string_lossy(), "d\u{FFFD}pot");
    }
}
