//! A node's key: Ed25519, in a file that only its owner can read, or in a token.

#[cfg(feature = "ca")]
mod sealed;
#[cfg(feature = "pkcs11")]
mod token;
#[cfg(feature = "pkcs11")]
mod uri;

use std::fmt;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::Arc;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD as BASE64;
use jaus_files::Readers;
use rustls::SignatureScheme;
use rustls::pki_types::{PrivatePkcs8KeyDer, SubjectPublicKeyInfoDer, pem::PemObject as _};
use rustls::sign::SigningKey;
use zeroize::Zeroizing;

#[cfg(feature = "ca")]
pub use sealed::Passphrase;

use crate::crypto;
use crate::crypto::digest::{Digest, SHA256, digest};
use crate::crypto::rand::{SecureRandom as _, SystemRandom};
use crate::crypto::signature::{ED25519, Ed25519KeyPair, UnparsedPublicKey};

/// The octets before an Ed25519 key in a `SubjectPublicKeyInfo` (RFC 8410, section 4).
const SPKI_PREFIX: [u8; 12] = [
    0x30, 0x2A, 0x30, 0x05, 0x06, 0x03, 0x2B, 0x65, 0x70, 0x03, 0x21, 0x00,
];
/// The longest key file, in octets.
const LONGEST: u64 = 64 << 10;
/// The label of a key file that is encrypted with a passphrase.
const SEALED: &str = "ENCRYPTED PRIVATE KEY";
/// How the URI of a key in a token begins.
const TOKEN: &str = "pkcs11:";
/// Characters of a line of PEM.
const PEM_LINE: usize = 64;

/// Why a key cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum KeyError {
    /// The file cannot be read or written.
    #[error("the key file {}: {source}", .path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: io::Error,
    },
    /// The file exists, and a new key would replace it.
    #[error(
        "the key file {} exists: peers trust its key; remove the file first to replace it",
        .0.display()
    )]
    Exists(PathBuf),
    /// The file does not contain an Ed25519 key.
    #[error("the key file {} contains no Ed25519 private key in PKCS #8 PEM", .0.display())]
    Malformed(PathBuf),
    /// The file is encrypted, and there is no passphrase.
    #[error(
        "the key file {} is encrypted: only that of an authority may be, because nobody is asked for \
         a passphrase when a node starts",
        .0.display()
    )]
    Sealed(PathBuf),
    /// The file is encrypted with another passphrase.
    #[error("the key file {} is encrypted with another passphrase", .0.display())]
    WrongPassphrase(PathBuf),
    /// A passphrase is too short or too long.
    #[cfg(feature = "ca")]
    #[error(
        "the passphrase has {0} characters: choose {shortest} to {longest}",
        shortest = Passphrase::SHORTEST,
        longest = Passphrase::LONGEST
    )]
    PassphraseLength(usize),
    /// The key in a token cannot be used.
    #[error("the key {uri}: {what}")]
    Token {
        /// The key.
        uri: String,
        /// The reason.
        what: String,
    },
    /// The operating system provides no random numbers.
    #[error("the operating system provides no random numbers")]
    NoRandomness,
    /// A text is not a public key.
    #[error("`{0}` is not a public key: 44 characters of base64 are expected")]
    Text(String),
}

/// Without the feature, no key in a token can be used.
#[cfg(not(feature = "pkcs11"))]
mod token {
    use super::{Key, KeyError, Path};

    pub(super) fn load(path: &Path) -> Result<Key, KeyError> {
        Err(KeyError::Token {
            uri: path.display().to_string(),
            what: "this program is built without the feature `pkcs11`".to_owned(),
        })
    }

    pub(super) use load as create;
}

/// The private key of a node. It is never shown or logged.
#[derive(Clone)]
pub struct Key {
    signing: Arc<dyn SigningKey>,
    public: PublicKey,
    /// Whether a device signs, which takes its time.
    is_slow: bool,
}

impl Key {
    /// Whether this names a key in a token, by a PKCS #11 URI (RFC 7512), and not a file.
    #[must_use]
    pub fn is_in_token(path: &Path) -> bool {
        let text = path.as_os_str().as_encoded_bytes();
        let scheme = text.get(..TOKEN.len());
        scheme.is_some_and(|it| it.eq_ignore_ascii_case(TOKEN.as_bytes()))
    }

    /// Makes a new key and writes it to a file that only its owner can read. With a PKCS #11 URI in place
    /// of a path, the token makes the key and keeps it.
    ///
    /// # Errors
    /// If the file or key exists or cannot be written, or without random numbers.
    pub fn create(path: &Path) -> Result<Self, KeyError> {
        if Self::is_in_token(path) {
            return token::create(path);
        }
        let (key, der) = Self::generate()?;
        publish(path, &pem("PRIVATE KEY", &der))?;
        Ok(key)
    }

    /// A new key, and its PKCS #8 encoding.
    fn generate() -> Result<(Self, Zeroizing<Vec<u8>>), KeyError> {
        let document = Ed25519KeyPair::generate_pkcs8(&SystemRandom::new())
            .map_err(|_| KeyError::NoRandomness)?;
        let der = Zeroizing::new(document.as_ref().to_vec());
        let key = Self::from_pkcs8(&der).ok_or(KeyError::NoRandomness)?;
        Ok((key, der))
    }

    /// Reads a key file, or finds the key in a token that a PKCS #11 URI names.
    ///
    /// # Errors
    /// If the file cannot be read, can be read by other users too, is encrypted, or contains no Ed25519
    /// key; if the token or its key cannot be used.
    pub fn load(path: &Path) -> Result<Self, KeyError> {
        if Self::is_in_token(path) {
            return token::load(path);
        }
        Self::parse(path, &read(path)?)
    }

    /// Loads a key again and again: that of a token only once, because it does not change, and a slow token
    /// would stall the node.
    pub(crate) fn reader(
        path: &Path,
    ) -> Result<impl Fn() -> Result<Self, KeyError> + use<>, KeyError> {
        let kept = Self::is_in_token(path).then(|| Self::load(path));
        let (kept, path) = (kept.transpose()?, path.to_owned());
        Ok(move || kept.clone().map_or_else(|| Self::load(&path), Ok))
    }

    fn parse(path: &Path, pem: &[u8]) -> Result<Self, KeyError> {
        if is_sealed(pem) {
            return Err(KeyError::Sealed(path.to_owned()));
        }
        let key = decoded(pem).and_then(|it| Self::from_pkcs8(it.secret_pkcs8_der()));
        key.ok_or_else(|| KeyError::Malformed(path.to_owned()))
    }

    fn from_pkcs8(octets: &[u8]) -> Option<Self> {
        let signing = crypto::signing_key(&octets.into()).ok()?;
        let public = PublicKey::from_spki(signing.public_key()?.as_ref())?;
        Some(Self {
            signing,
            public,
            is_slow: false,
        })
    }

    /// The files that a key is read from: none for a key in a token.
    pub(crate) fn files(path: &Path) -> Vec<PathBuf> {
        let in_file = (!Self::is_in_token(path)).then(|| path.to_owned());
        in_file.into_iter().collect()
    }

    /// The file of the key that is to replace the one in `path`: `node.key.next`.
    #[must_use]
    pub fn next_path(path: &Path) -> PathBuf {
        let mut name = path.as_os_str().to_owned();
        name.push(".next");
        name.into()
    }

    /// Puts the key of [`next_path`](Self::next_path) in place of the one in `path`. The key file keeps
    /// its owner and mode, so the running node that reads it notices the new key within seconds.
    ///
    /// # Errors
    /// If the file of the next key cannot be used, or the key file not be replaced.
    pub fn replace_by_next(path: &Path) -> Result<Self, KeyError> {
        let next = Self::next_path(path);
        let text = read(&next)?;
        let key = Self::parse(&next, &text)?;
        jaus_files::replace(path, Readers::Owner, &text).map_err(|source| in_file(path, source))?;
        // Without the copy, because the next `--finish` would finish nothing.
        fs::remove_file(&next).map_err(|source| in_file(&next, source))?;
        Ok(key)
    }

    /// The public key.
    #[must_use]
    pub const fn public(&self) -> PublicKey {
        self.public
    }

    #[cfg(feature = "ca")]
    pub(crate) const fn public_ref(&self) -> &PublicKey {
        &self.public
    }

    /// A secret for another purpose, the same whenever the node runs with this key.
    pub(crate) fn secret_for(&self, purpose: &[u8]) -> Digest {
        // Ed25519 signs the same text always in the same way. If a token does not sign, the secret is another
        // one after the next start.
        let signature = self.sign(purpose);
        let signature = signature.or_else(|| random::<32>().ok().map(Vec::from));
        digest(&SHA256, &signature.unwrap_or_default())
    }

    /// Signs a message; `None` if the key refuses to.
    pub(crate) fn sign(&self, message: &[u8]) -> Option<Vec<u8>> {
        let signer = self.signing.choose_scheme(&[SignatureScheme::ED25519])?;
        signer.sign(message).ok()
    }

    /// Whether each signature costs so much that only peers with a proven address get one.
    pub(crate) const fn is_slow(&self) -> bool {
        self.is_slow
    }

    /// The same, as if it were in a token.
    #[cfg(test)]
    pub(crate) fn slow(self) -> Self {
        let is_slow = true;
        Self { is_slow, ..self }
    }

    pub(crate) fn signing(&self) -> Arc<dyn SigningKey> {
        self.signing.clone()
    }
}

impl fmt::Debug for Key {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Key")
            .field("public", &self.public)
            .finish_non_exhaustive()
    }
}

/// The public key of a node, as text 44 characters of base64.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct PublicKey([u8; 32]);

impl PublicKey {
    /// From the octets of the key.
    #[must_use]
    pub const fn from_octets(octets: [u8; 32]) -> Self {
        Self(octets)
    }

    /// Its fingerprint.
    #[must_use]
    pub fn fingerprint(self) -> Fingerprint {
        let mut octets = [0; 32];
        octets.copy_from_slice(digest(&SHA256, &self.0).as_ref());
        Fingerprint(octets)
    }

    /// Whether the private key has made this signature of this message.
    pub(crate) fn has_signed(self, message: &[u8], signature: &[u8]) -> bool {
        let key = UnparsedPublicKey::new(&ED25519, self.0);
        key.verify(message, signature).is_ok()
    }

    pub(crate) fn from_spki(spki: &[u8]) -> Option<Self> {
        let octets = spki.strip_prefix(&SPKI_PREFIX)?;
        octets.try_into().ok().map(Self)
    }

    /// The octets of the key.
    #[cfg(feature = "ca")]
    pub(crate) const fn octets(&self) -> &[u8; 32] {
        &self.0
    }

    pub(crate) fn spki(self) -> SubjectPublicKeyInfoDer<'static> {
        [&SPKI_PREFIX[..], &self.0].concat().into()
    }
}

impl fmt::Display for PublicKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(&BASE64.encode(self.0))
    }
}

impl fmt::Debug for PublicKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

impl FromStr for PublicKey {
    type Err = KeyError;

    fn from_str(text: &str) -> Result<Self, KeyError> {
        let octets = BASE64.decode(text).ok().and_then(|it| it.try_into().ok());
        octets
            .map(Self)
            .ok_or_else(|| KeyError::Text(text.chars().take(60).collect()))
    }
}

/// The SHA-256 of a public key, which names the key without showing it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Fingerprint([u8; 32]);

impl Fingerprint {
    /// From its octets.
    #[must_use]
    pub const fn from_octets(octets: [u8; 32]) -> Self {
        Self(octets)
    }

    /// Its octets.
    #[must_use]
    pub const fn as_octets(&self) -> &[u8; 32] {
        &self.0
    }
}

/// The PEM encoding of octets, in one allocation, so that no copy remains.
pub(crate) fn pem(label: &str, octets: &[u8]) -> Zeroizing<String> {
    let base64 = Zeroizing::new(BASE64.encode(octets));
    let [begin, end] = ["BEGIN", "END"].map(|it| format!("-----{it} {label}-----\n"));
    let length = base64.len() + base64.len() / PEM_LINE + 1;
    let mut text = Zeroizing::new(String::with_capacity(begin.len() + length + end.len()));
    text.push_str(&begin);
    let mut rest = base64.as_str();
    while !rest.is_empty() {
        let (line, after) = rest.split_at(rest.len().min(PEM_LINE));
        text.push_str(line);
        text.push('\n');
        rest = after;
    }
    text.push_str(&end);
    text
}

/// The PKCS #8 encoding in the PEM of a plain key.
fn decoded(pem: &[u8]) -> Option<Zeroizing<PrivatePkcs8KeyDer<'static>>> {
    let der = PrivatePkcs8KeyDer::from_pem_slice(pem).ok();
    der.map(Zeroizing::new)
}

fn in_file(path: &Path, source: io::Error) -> KeyError {
    KeyError::File {
        path: path.to_owned(),
        source,
    }
}

fn read(path: &Path) -> Result<Zeroizing<Vec<u8>>, KeyError> {
    jaus_files::read(path, Readers::Owner, LONGEST)
        .map(Zeroizing::new)
        .map_err(|source| in_file(path, source))
}

/// Writes the file of a new key.
fn publish(path: &Path, text: &str) -> Result<(), KeyError> {
    jaus_files::create(path, Readers::Owner, text.as_bytes()).map_err(|source| {
        match source.kind() {
            io::ErrorKind::AlreadyExists => KeyError::Exists(path.to_owned()),
            _ => in_file(path, source),
        }
    })
}

/// Whether the text of a key file is encrypted with a passphrase.
fn is_sealed(pem: &[u8]) -> bool {
    String::from_utf8_lossy(pem).contains(&format!("-----BEGIN {SEALED}-----"))
}

/// Random octets.
pub(crate) fn random<const N: usize>() -> Result<[u8; N], KeyError> {
    let mut octets = [0; N];
    let filled = SystemRandom::new().fill(&mut octets);
    filled.map_err(|_| KeyError::NoRandomness)?;
    Ok(octets)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_new_key_is_read_back_and_is_never_shown() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("node.key");
        let key = Key::create(&path).unwrap();
        assert_eq!(Key::load(&path).unwrap().public(), key.public());
        let other = Key::create(&folder.path().join("other.key")).unwrap();
        assert_ne!(other.public(), key.public());

        let text = fs::read_to_string(&path).unwrap();
        let secret = text.lines().nth(1).unwrap();
        assert!(!format!("{key:?}").contains(secret));
        assert!(format!("{key:?}").contains(&key.public().to_string()));
    }

    #[test]
    fn a_key_file_is_not_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("node.key");
        let key = Key::create(&path).unwrap();
        assert!(matches!(Key::create(&path), Err(KeyError::Exists(_))));
        assert_eq!(Key::load(&path).unwrap().public(), key.public());
    }

    #[cfg(unix)]
    #[test]
    fn a_key_file_that_others_can_read_is_refused_with_the_remedy() {
        use std::os::unix::fs::PermissionsExt as _;

        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("node.key");
        Key::create(&path).unwrap();
        let mode = fs::metadata(&path).unwrap().permissions().mode();
        assert_eq!(mode & 0o777, 0o600);
        for mode in [0o640, 0o604, 0o644, 0o620] {
            fs::set_permissions(&path, fs::Permissions::from_mode(mode)).unwrap();
            let error = Key::load(&path).unwrap_err().to_string();
            assert!(error.contains("chmod 600"), "{mode:o}: {error}");
        }
    }

    #[test]
    fn a_file_without_a_key_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("node.key");
        assert!(matches!(Key::load(&path), Err(KeyError::File { .. })));
        Key::create(&path).unwrap();
        let whole = fs::read_to_string(&path).unwrap();
        let (half, public) = (
            &whole[..whole.len() / 2],
            whole.replace("PRIVATE", "PUBLIC"),
        );
        for text in ["", "no key", half, &public] {
            fs::write(&path, text).unwrap();
            let loaded = Key::load(&path);
            assert!(matches!(loaded, Err(KeyError::Malformed(_))), "{text}");
        }
    }

    #[test]
    fn a_public_key_is_written_as_it_is_read() {
        let key = PublicKey::from_octets([7; 32]);
        assert_eq!(key.to_string().len(), 44);
        assert_eq!(key.to_string().parse::<PublicKey>().unwrap(), key);
        assert_eq!(PublicKey::from_spki(key.spki().as_ref()), Some(key));
        let (short, long) = (BASE64.encode([7; 31]), BASE64.encode([7; 33]));
        for text in ["", "rover", "AAAA", &short, &long] {
            assert!(text.parse::<PublicKey>().is_err(), "{text}");
        }
    }

    #[test]
    fn the_next_key_replaces_the_first_once() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("node.key");
        Key::create(&path).unwrap();
        let next = Key::create(&Key::next_path(&path)).unwrap().public();
        assert_eq!(Key::replace_by_next(&path).unwrap().public(), next);
        assert_eq!(Key::load(&path).unwrap().public(), next);
        assert!(Key::replace_by_next(&path).is_err());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[cfg(unix)]
    #[test]
    fn a_key_that_root_replaces_stays_the_services() {
        use std::os::unix::fs::{MetadataExt as _, chown};

        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("node.key");
        Key::create(&path).unwrap();
        Key::create(&Key::next_path(&path)).unwrap();
        if chown(&path, Some(65534), Some(65534)).is_err() {
            return eprintln!("SKIPPED: only root can give a file to another user");
        }
        Key::replace_by_next(&path).unwrap();
        let found = fs::metadata(&path).unwrap();
        let found = (found.uid(), found.gid(), found.mode() & 0o777);
        assert_eq!(found, (65534, 65534, 0o600));
    }
}
