//! Key files that a passphrase encrypts, for keys that a person uses rather than a service: PKCS #8
//! `EncryptedPrivateKeyInfo` (RFC 5958) with PBES2, scrypt and AES-256-CBC, as OpenSSL has it.

use std::fmt;
use std::path::Path;

use jaus_files::Readers;
use pkcs8::pkcs5::pbes2::Parameters;
use pkcs8::pkcs5::{self, scrypt};
use pkcs8::{EncryptedPrivateKeyInfoRef, PrivateKeyInfoRef, SecretDocument};
use zeroize::Zeroizing;

use super::{Key, KeyError, SEALED, decoded, in_file, is_sealed, pem, publish, random, read};

/// The cost of a guess: 16 MiB five times, a recommendation of OWASP for scrypt, and within the 32 MiB
/// with which OpenSSL reads a key by default.
const LOG_N: u8 = 14;
const BLOCK: u32 = 8;
const PASSES: u32 = 5;

/// A passphrase. It is never shown or logged, and overwritten in memory when it is dropped.
pub struct Passphrase(Zeroizing<String>);

impl Passphrase {
    /// The fewest characters.
    pub const SHORTEST: usize = 10;
    /// The most characters.
    pub const LONGEST: usize = 128;

    /// A passphrase of these characters.
    ///
    /// # Errors
    /// If it is too short or too long.
    pub fn new(text: Zeroizing<String>) -> Result<Self, KeyError> {
        let length = text.chars().count();
        if !(Self::SHORTEST..=Self::LONGEST).contains(&length) {
            return Err(KeyError::PassphraseLength(length));
        }
        Ok(Self(text))
    }
}

impl fmt::Debug for Passphrase {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Passphrase").finish_non_exhaustive()
    }
}

impl Key {
    /// Whether a passphrase encrypts a key file.
    ///
    /// # Errors
    /// If the file cannot be read, or can be read by other users too.
    pub fn is_sealed(path: &Path) -> Result<bool, KeyError> {
        Ok(is_sealed(&read(path)?))
    }

    /// Makes a new key and writes it to a file, encrypted if there is a passphrase.
    ///
    /// # Errors
    /// If the file exists or cannot be written, or without random numbers.
    pub fn create_sealed(path: &Path, passphrase: Option<&Passphrase>) -> Result<Self, KeyError> {
        let (key, der) = Self::generate()?;
        publish(path, &encode(path, &der, passphrase)?)?;
        Ok(key)
    }

    /// Reads a key file that may be encrypted. A plain one needs no passphrase.
    ///
    /// # Errors
    /// As [`load`](Self::load), and if the passphrase is missing or another one.
    pub fn unseal(path: &Path, passphrase: Option<&Passphrase>) -> Result<Self, KeyError> {
        Self::from_pkcs8(&decode(path, passphrase)?)
            .ok_or_else(|| KeyError::Malformed(path.to_owned()))
    }

    /// Encrypts a key file with another passphrase, or with none. The key stays the same.
    ///
    /// # Errors
    /// As [`unseal`](Self::unseal), and if the file cannot be replaced.
    pub fn reseal(
        path: &Path,
        old: Option<&Passphrase>,
        new: Option<&Passphrase>,
    ) -> Result<(), KeyError> {
        let der = decode(path, old)?;
        Self::from_pkcs8(&der).ok_or_else(|| KeyError::Malformed(path.to_owned()))?;
        let text = encode(path, &der, new)?;
        jaus_files::replace(path, Readers::Owner, text.as_bytes())
            .map_err(|source| in_file(path, source))
    }
}

/// The PEM of a key.
fn encode(
    path: &Path,
    der: &[u8],
    passphrase: Option<&Passphrase>,
) -> Result<Zeroizing<String>, KeyError> {
    let Some(passphrase) = passphrase else {
        return Ok(pem("PRIVATE KEY", der));
    };
    let (salt, iv) = (random::<16>()?, random()?);
    let parameters = scrypt::Params::new(LOG_N, BLOCK, PASSES)
        .ok()
        .and_then(|cost| Parameters::generate_scrypt_aes256cbc(cost, &salt, iv).ok());
    let sealed = PrivateKeyInfoRef::try_from(der)
        .ok()
        .zip(parameters)
        .and_then(|(key, it)| {
            // OpenSSL 3.0 does not read version 2, which has the public key as well.
            let key = PrivateKeyInfoRef::new(key.algorithm, key.private_key);
            key.encrypt_with_params(it, passphrase.0.as_bytes()).ok()
        })
        .ok_or_else(|| KeyError::Malformed(path.to_owned()))?;
    Ok(pem(SEALED, sealed.as_bytes()))
}

/// The PKCS #8 encoding of the key in a file.
fn decode(path: &Path, passphrase: Option<&Passphrase>) -> Result<Zeroizing<Vec<u8>>, KeyError> {
    let malformed = || KeyError::Malformed(path.to_owned());
    let text = read(path)?;
    if !is_sealed(&text) {
        let der = decoded(&text).ok_or_else(malformed)?;
        return Ok(Zeroizing::new(der.secret_pkcs8_der().to_vec()));
    }
    let passphrase = passphrase.ok_or_else(|| KeyError::Sealed(path.to_owned()))?;
    let text = std::str::from_utf8(&text).map_err(|_| malformed())?;
    let (_, sealed) = SecretDocument::from_pem(text).map_err(|_| malformed())?;
    let sealed =
        EncryptedPrivateKeyInfoRef::try_from(sealed.as_bytes()).map_err(|_| malformed())?;
    match sealed.decrypt(passphrase.0.as_bytes()) {
        Ok(der) => Ok(der.to_bytes()),
        // One wrong passphrase in 256 leaves octets that are well padded, but no DER.
        Err(
            pkcs8::Error::EncryptedPrivateKey(pkcs5::Error::DecryptFailed) | pkcs8::Error::Asn1(_),
        ) => Err(KeyError::WrongPassphrase(path.to_owned())),
        Err(_) => Err(malformed()),
    }
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::process::Command;

    use jaus_test_kit::tools;
    use tempfile::TempDir;

    use super::*;

    const PASSPHRASE: &str = "correct horse battery";

    fn passphrase(text: &str) -> Passphrase {
        Passphrase::new(text.to_owned().into()).unwrap()
    }

    fn sealed() -> (TempDir, std::path::PathBuf, Key) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("ca.key");
        let key = Key::create_sealed(&path, Some(&passphrase(PASSPHRASE))).unwrap();
        (folder, path, key)
    }

    #[test]
    fn a_sealed_key_is_opened_by_its_passphrase_alone() {
        let (_folder, path, key) = sealed();
        let opened = Key::unseal(&path, Some(&passphrase(PASSPHRASE))).unwrap();
        assert_eq!(opened.public(), key.public());
        let wrong = Key::unseal(&path, Some(&passphrase("incorrect horse"))).unwrap_err();
        assert!(matches!(wrong, KeyError::WrongPassphrase(_)), "{wrong}");
        for missing in [Key::unseal(&path, None), Key::load(&path)] {
            let error = missing.unwrap_err();
            assert!(matches!(error, KeyError::Sealed(_)), "{error}");
        }
        assert!(matches!(
            Key::create_sealed(&path, None),
            Err(KeyError::Exists(_))
        ));
        for text in ["", "too short", &"x".repeat(129)] {
            assert!(Passphrase::new(text.to_owned().into()).is_err(), "{text}");
        }
        assert!(!format!("{:?}", passphrase(PASSPHRASE)).contains("horse"));
    }

    #[test]
    fn the_passphrase_of_a_key_is_changed_set_and_removed() {
        let (_folder, path, key) = sealed();
        let [first, second] = [PASSPHRASE, "another battery"].map(passphrase);
        assert!(Key::reseal(&path, Some(&second), None).is_err());
        Key::reseal(&path, Some(&first), Some(&second)).unwrap();
        assert!(Key::unseal(&path, Some(&first)).is_err());
        Key::reseal(&path, Some(&second), None).unwrap();
        assert_eq!(Key::load(&path).unwrap().public(), key.public());
        Key::reseal(&path, None, Some(&first)).unwrap();
        let opened = Key::unseal(&path, Some(&first)).unwrap();
        assert_eq!(opened.public(), key.public());
    }

    #[test]
    fn a_cut_file_is_no_key() {
        let (_folder, path, _) = sealed();
        let text = fs::read_to_string(&path).unwrap();
        for length in [0, text.len() / 2, text.len() - 10] {
            fs::write(&path, &text[..length]).unwrap();
            let result = Key::unseal(&path, Some(&passphrase(PASSPHRASE)));
            assert!(matches!(result, Err(KeyError::Malformed(_))), "{length}");
        }
    }

    /// One key, encrypted by `openssl pkcs8 -topk8` with `-scrypt`, and with PBKDF2 (`-v2 aes-256-cbc`).
    const OF_OPENSSL: [&str; 2] = [
        "MIGTME8GCSqGSIb3DQEFDTBCMCEGCSsGAQQB2kcECzAUBAjaihZ1GUfkRgICQAAC\n\
         AQgCAQEwHQYJYIZIAWUDBAEqBBAr5zFUC6eWCEw6/kZq5CVLBEDfKqXUr+OYD0W8\n\
         vs1HpfUZD1PHiOphg8kq2e7IVQUxTj7h2OlwWVwQUNNsZhQb7IanmKPmSK91wC0f\n\
         OLk+cVLJ\n",
        "MIGbMFcGCSqGSIb3DQEFDTBKMCkGCSqGSIb3DQEFDDAcBAjrgAJH6BeN2QICCAAw\n\
         DAYIKoZIhvcNAgkFADAdBglghkgBZQMEASoEEBabGPObOQ4yJ9HSYrwZSIQEQCAJ\n\
         hp99Mu0Yf0TYlrKSOUQkPykNlIav8UVTUekeoG1LqcxzaUE/XY7SeLOjwi8hmwU/\n\
         ve2F//EBzt5xM8z8L5Q=\n",
    ];

    #[test]
    fn keys_that_openssl_has_encrypted_are_opened() {
        let folder = tempfile::tempdir().unwrap();
        for (index, base64) in OF_OPENSSL.iter().enumerate() {
            let path = folder.path().join(format!("{index}.key"));
            let text = format!("-----BEGIN {SEALED}-----\n{base64}-----END {SEALED}-----\n");
            jaus_files::create(&path, Readers::Owner, text.as_bytes()).unwrap();
            let key = Key::unseal(&path, Some(&passphrase(PASSPHRASE))).unwrap();
            let public = "zCRfsMywXVEzBB0knRx8j3STUprB/S46oSNvWw1arIc=";
            assert_eq!(key.public().to_string(), public);
        }
    }

    #[test]
    fn openssl_opens_a_sealed_key() {
        if !tools::has_program("openssl") {
            return;
        }
        let (_folder, path, key) = sealed();
        let mut openssl = Command::new("openssl");
        openssl.args(["pkey", "-pubout", "-outform", "DER", "-passin"]);
        openssl
            .arg(format!("pass:{PASSPHRASE}"))
            .arg("-in")
            .arg(&path);
        let output = openssl.output().unwrap();
        assert!(output.status.success(), "{output:?}");
        assert_eq!(output.stdout, key.public().spki().as_ref());
    }
}
