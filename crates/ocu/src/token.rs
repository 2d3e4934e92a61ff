//! The secret that an operator shows before the vehicle obeys.

use std::fmt;
use std::hint::black_box;
use std::io;
use std::path::Path;

use jaus_files::Readers;

/// Access token of an operator: from a file, or generated.
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
        source: io::Error,
    },
    /// The file cannot be written.
    #[error("cannot write the token file {file}: {source}")]
    Unwritable {
        /// The file.
        file: String,
        /// The cause.
        source: io::Error,
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
    /// The longest file of a token with blanks around it, in octets.
    const LONGEST_FILE: u64 = 4096;
    /// Random octets in a generated token.
    const RANDOM: usize = 16;

    /// Reads the token from a file of one line.
    ///
    /// # Errors
    /// If the file cannot be read, other users of this host can read it, or its content is too short, too long,
    /// or contains characters other than letters, digits and `-._~`.
    pub fn read(file: &Path) -> Result<Self, TokenError> {
        let name = || file.display().to_string();
        let text = jaus_files::read_text(file, Readers::Owner, Self::LONGEST_FILE);
        let text = text.map_err(|source| TokenError::Unreadable {
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

    /// The token that a file holds for its owner alone. Without the file, generates a token and
    /// writes it there; if another process does so at the same time, both get the same one.
    ///
    /// # Errors
    /// If the file cannot be read or written, others can read it, or it holds no token.
    pub fn keep(file: &Path) -> Result<Self, TokenError> {
        let failed = |source| TokenError::Unwritable {
            file: file.display().to_string(),
            source,
        };
        if !file.try_exists().map_err(failed)? {
            let token = Self::generate()?;
            match jaus_files::create(file, Readers::Owner, token.reveal().as_bytes()) {
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                created => created.map_err(failed)?,
            }
        }
        Self::read(file)
    }

    /// Generates a token of 32 hexadecimal digits.
    ///
    /// # Errors
    /// If the system provides no random numbers.
    pub fn generate() -> Result<Self, TokenError> {
        let mut octets = [0; Self::RANDOM];
        getrandom::fill(&mut octets).map_err(TokenError::NoRandomness)?;
        Ok(Self::of_octets(&octets))
    }

    /// Octets as hexadecimal digits.
    pub(crate) fn of_octets(octets: &[u8]) -> Self {
        Self(octets.iter().map(|it| format!("{it:02x}")).collect())
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

    #[cfg(unix)]
    #[test]
    fn a_kept_token_is_the_same_at_the_next_start_and_for_its_owner_alone() {
        use std::fs;
        use std::os::unix::fs::PermissionsExt as _;

        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("page.token");
        let both = [0, 1].map(|_| {
            let file = file.clone();
            std::thread::spawn(move || Token::keep(&file).unwrap())
        });
        let [one, other] = both.map(|it| it.join().unwrap());
        assert!(one.is(other.reveal()) && one.is(Token::keep(&file).unwrap().reveal()));
        let mode = |mode| fs::set_permissions(&file, fs::Permissions::from_mode(mode)).unwrap();
        assert_eq!(
            fs::metadata(&file).unwrap().permissions().mode() & 0o777,
            0o600
        );
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
        for readable in [0o640, 0o644] {
            mode(readable);
            for refused in [Token::keep(&file), Token::read(&file)] {
                let error = refused.unwrap_err().to_string();
                assert!(error.contains("chmod 600 /"), "{error}");
            }
        }
    }

    #[test]
    fn no_two_tokens_are_made_up_alike() {
        let [one, other] = [Token::generate().unwrap(), Token::generate().unwrap()];
        assert!(!one.is(other.reveal()));
        assert_eq!(one.reveal().len(), 32);
    }
}
