//! Hashes of passwords: Argon2id, in the PHC string format.

use std::fmt;

use argon2::password_hash::{self, PasswordHasher as _, PasswordVerifier as _, SaltString};
use argon2::{ARGON2ID_IDENT, Argon2, Params};

/// Why a password cannot be hashed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PasswordError {
    /// It is too short or too long.
    #[error(
        "the password has {0} characters: choose {shortest} to {longest}",
        shortest = PasswordHash::SHORTEST,
        longest = PasswordHash::LONGEST
    )]
    Length(usize),
    /// The system provides no random numbers.
    #[error("cannot hash a password, because the system has no random numbers: {0}")]
    NoRandomness(getrandom::Error),
    /// The library refuses it.
    #[error("cannot hash the password: {0}")]
    Hash(password_hash::Error),
}

/// The salted hash of a password. It is never shown or logged.
///
/// New hashes take 19 MiB of memory and two passes, the first choice of OWASP for Argon2id.
#[derive(Clone, PartialEq, Eq)]
pub struct PasswordHash(String);

impl PasswordHash {
    /// The fewest characters of a password.
    pub const SHORTEST: usize = 10;
    /// The most characters of a password.
    pub const LONGEST: usize = 128;
    /// Random octets of a salt.
    const SALT: usize = 16;
    /// The most memory of a hash in a users file, in KiB: it bounds the cost of a login.
    const MEMORY: u32 = 32 << 10;
    /// The most passes of a hash in a users file.
    const PASSES: u32 = 8;

    /// Hashes a password with a random salt. Takes some 50 ms of computing time.
    ///
    /// # Errors
    /// If the password is too short or too long, or without random numbers.
    pub fn of(password: &str) -> Result<Self, PasswordError> {
        let length = password.chars().count();
        if !(Self::SHORTEST..=Self::LONGEST).contains(&length) {
            return Err(PasswordError::Length(length));
        }
        let mut octets = [0; Self::SALT];
        getrandom::fill(&mut octets).map_err(PasswordError::NoRandomness)?;
        let salt = SaltString::encode_b64(&octets).map_err(PasswordError::Hash)?;
        let hash = Argon2::default().hash_password(password.as_bytes(), &salt);
        Ok(Self(hash.map_err(PasswordError::Hash)?.to_string()))
    }

    /// Reads a hash in the PHC string format; `None` unless it is Argon2id at a bounded cost.
    pub(super) fn parse(text: &str) -> Option<Self> {
        let hash = password_hash::PasswordHash::new(text).ok()?;
        let params = Params::try_from(&hash).ok()?;
        let is_bounded = params.m_cost() <= Self::MEMORY
            && params.t_cost() <= Self::PASSES
            && params.p_cost() == Params::DEFAULT_P_COST;
        let is_usable = hash.algorithm == ARGON2ID_IDENT
            && hash.version == Some(argon2::Version::V0x13.into())
            && hash.salt.is_some()
            && hash.hash.is_some();
        (is_bounded && is_usable).then(|| Self(text.to_owned()))
    }

    /// Whether the password is the hashed one. Takes as long as [`of`](Self::of).
    pub(crate) fn verifies(&self, password: &str) -> bool {
        let hash = password_hash::PasswordHash::new(&self.0);
        hash.is_ok_and(|hash| {
            let verified = Argon2::default().verify_password(password.as_bytes(), &hash);
            verified.is_ok()
        })
    }

    /// Takes as long as [`verifies`](Self::verifies), so that the time of a refusal does not tell
    /// whether a user exists.
    pub(crate) fn verify_nothing(password: &str) {
        let mut hash = [0; Params::DEFAULT_OUTPUT_LEN];
        // The result is of no use, and lengths are checked before.
        let _ =
            Argon2::default().hash_password_into(password.as_bytes(), &[0; Self::SALT], &mut hash);
    }

    /// For the users file.
    pub(super) fn as_str(&self) -> &str {
        &self.0
    }
}

impl fmt::Debug for PasswordHash {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("PasswordHash(…)")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PASSWORD: &str = "correct horse battery";

    #[test]
    fn a_password_is_verified_by_its_own_hash_alone() {
        let hash = PasswordHash::of(PASSWORD).unwrap();
        assert!(hash.verifies(PASSWORD));
        for wrong in ["", "correct horse batterz", "correct horse battery "] {
            assert!(!hash.verifies(wrong), "{wrong}");
        }
        let again = PasswordHash::of(PASSWORD).unwrap();
        assert_ne!(hash, again, "each hash has its own salt");
        assert_eq!(PasswordHash::parse(hash.as_str()), Some(hash));
    }

    #[test]
    fn the_cost_is_the_one_that_owasp_recommends() {
        let hash = PasswordHash::of(PASSWORD).unwrap();
        let text = hash.as_str();
        assert!(
            text.starts_with("$argon2id$v=19$m=19456,t=2,p=1$"),
            "{text}"
        );
    }

    #[test]
    fn a_hash_is_not_shown() {
        let hash = PasswordHash::of(PASSWORD).unwrap();
        assert_eq!(format!("{hash:?}"), "PasswordHash(…)");
    }

    #[test]
    fn short_and_long_passwords_are_refused() {
        for password in ["", "short", &"x".repeat(129)] {
            let refused = PasswordHash::of(password);
            assert!(
                matches!(refused, Err(PasswordError::Length(_))),
                "{password}"
            );
        }
    }

    #[test]
    fn a_hash_of_unbounded_cost_or_another_algorithm_is_refused() {
        let good = PasswordHash::of(PASSWORD).unwrap();
        for (from, to) in [
            ("m=19456", "m=4194304"),
            ("t=2", "t=4000"),
            ("p=1", "p=64"),
            ("argon2id", "argon2i"),
            ("argon2id", "scrypt"),
            ("v=19", "v=16"),
            ("$", ""),
        ] {
            let text = good.as_str().replace(from, to);
            assert_eq!(PasswordHash::parse(&text), None, "{text}");
        }
        let (without_hash, _) = good.as_str().rsplit_once('$').unwrap();
        assert_eq!(PasswordHash::parse(without_hash), None);
    }
}
