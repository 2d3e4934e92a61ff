//! The secret that an operator shows before the vehicle obeys.

use std::fmt;
use std::hint::black_box;
use std::path::Path;

/// Access token of an operator: from a file, or generated for one run.
///
/// ```
/// use jaus_ocu::Token;
///
/// assert!(Token::new("0123456789abcdef").is_some());
/// assert!(Token::new("too short").is_none());
/// ```
#[derive(Clone, PartialEq, Eq)]
pub struct Token(String);

/// Why no token is available.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TokenError {
    /// The file cannot be read.
    #[error("cannot read the token file {file}: {source}")]
    Unreadable {
        /// The file.
        file: String,
        /// The cause.
        source: std::io::Error,
    },
    /// The content is unsuitable as a token.
    #[error(
        "the token file {file} holds {length} characters: write one line of {} to {} letters and \
         digits, such as from `openssl rand -hex 16`",
        Token::SHORTEST,
        Token::LONGEST
    )]
    Unsuitable {
        /// The file.
        file: String,
        /// Number of characters, without surrounding whitespace.
        length: usize,
    },
    /// The system provides no random numbers.
    #[error("cannot generate a token, because the system has no random numbers: {0}")]
    NoRandomness(getrandom::Error),
}

impl Token {
    /// Minimum length of a token.
    pub const SHORTEST: usize = 16;
    /// Maximum length of a token.
    pub const LONGEST: usize = 256;
    /// Random octets in a generated token.
    const RANDOM: usize = 16;

    /// Reads the token from a file of one line.
    ///
    /// # Errors
    /// If the file cannot be read, or its content is too short, too long, or contains characters
    /// other than letters, digits and `-._~`.
    pub fn read(file: &Path) -> Result<Self, TokenError> {
        let name = || file.display().to_string();
        let text = std::fs::read_to_string(file).map_err(|source| TokenError::Unreadable {
            file: name(),
            source,
        })?;
        Self::new(text.trim()).ok_or_else(|| TokenError::Unsuitable {
            file: name(),
            length: text.trim().chars().count(),
        })
    }

    /// Creates a token from a text; `None` if it is too short, too long, or would need quoting in a
    /// URL.
    #[must_use]
    pub fn new(text: &str) -> Option<Self> {
        let plain = |it: u8| it.is_ascii_alphanumeric() || b"-._~".contains(&it);
        let suits =
            (Self::SHORTEST..=Self::LONGEST).contains(&text.len()) && text.bytes().all(plain);
        suits.then(|| Self(text.to_owned()))
    }

    /// Generates a token of 32 hexadecimal digits.
    ///
    /// # Errors
    /// If the system provides no random numbers.
    pub fn generate() -> Result<Self, TokenError> {
        let mut octets = [0; Self::RANDOM];
        getrandom::fill(&mut octets).map_err(TokenError::NoRandomness)?;
        Ok(Self(octets.iter().map(|it| format!("{it:02x}")).collect()))
    }

    /// Compares with a shown token, in constant time for equal lengths.
    #[must_use]
    pub fn is(&self, shown: &str) -> bool {
        if shown.len() != self.0.len() {
            return false;
        }
        let pairs = self.0.bytes().zip(shown.bytes());
        let difference = pairs.fold(0, |difference, (a, b)| black_box(difference | (a ^ b)));
        difference == 0
    }

    /// The token as text, for display to the operator.
    #[must_use]
    pub fn reveal(&self) -> &str {
        &self.0
    }
}

impl fmt::Debug for Token {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Token(…)")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_token_is_itself_and_nothing_else() {
        let token = Token::new("0123456789abcdef").unwrap();
        assert!(token.is("0123456789abcdef"));
        for wrong in [
            "",
            "0123456789abcdeg",
            "0123456789abcde",
            "0123456789abcdef0",
        ] {
            assert!(!token.is(wrong), "{wrong}");
        }
        assert!(!format!("{token:?}").contains("0123"));
    }

    #[test]
    fn what_is_guessed_or_has_to_be_quoted_is_no_token() {
        for text in [
            "",
            "short",
            "with spaces in it, long",
            "ümläüt-ümläüt-ümläüt",
        ] {
            assert!(Token::new(text).is_none(), "{text}");
        }
        assert!(Token::new(&"a".repeat(257)).is_none());
    }

    #[test]
    fn no_two_tokens_are_made_up_alike() {
        let [one, other] = [Token::generate().unwrap(), Token::generate().unwrap()];
        assert!(!one.is(other.reveal()));
        assert_eq!(one.reveal().len(), 32);
    }
}
