//! Certificates of nodes: X.509, with the name of the node and the ids that it may speak for.

use std::io;
use std::path::{Path, PathBuf};
use std::time::Duration;

use jaus::address::JausId;
use jaus_files::Readers;
use rustls::pki_types::{CertificateDer, UnixTime, pem::PemObject as _};
use webpki::EndEntityCert;
use x509_cert::der::{DateTime, Decode as _};

use crate::key::{KeyError, PublicKey};

/// How the URI with the signatures of those who have approved a certificate begins.
pub(crate) const APPROVAL: &str = "jaus-approval:";
/// The scheme of the subject alternative names that hold ids: `jaus:101.255.255`.
pub(crate) const SCHEME: &str = "jaus:";
/// The most ids in a certificate.
pub(crate) const MOST_IDS: usize = 32;
/// The longest name of a node, in characters.
pub(crate) const LONGEST_NAME: usize = 64;
/// The longest file of a certificate or revocation list, in octets.
const LONGEST: u64 = 4 << 20;

/// Why a certificate does not describe a node.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Defect {
    /// It is not X.509.
    #[error("it is not an X.509 certificate")]
    NotX509,
    /// Its key is not Ed25519.
    #[error("its key is not an Ed25519 key")]
    NotEd25519,
    /// Its subject has no usable common name.
    #[error(
        "its common name is missing, longer than 64 characters, or has other characters than \
         ASCII letters, digits and punctuation without `#`"
    )]
    Name,
    /// It has no ids.
    #[error("it has no ids: a subject alternative name such as `URI:jaus:101.255.255` is needed")]
    NoIds,
    /// It has too many ids.
    #[error("it has more than 32 ids")]
    TooManyIds,
    /// An id is malformed.
    #[error("`{0}` in it is not an id such as 101.1.33, or 101.255.255 for all of 101")]
    Id(String),
}

/// Why the files of a certificate, an authority or a revocation list cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CertificateError {
    /// A file cannot be read or written.
    #[error("the file {}: {source}", .path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: io::Error,
    },
    /// A file does not hold what is expected.
    #[error("the file {} contains no {expected} in PEM", .path.display())]
    Malformed {
        /// The file.
        path: PathBuf,
        /// What is expected.
        expected: &'static str,
    },
    /// A certificate does not describe a node.
    #[error("the certificate {}: {defect}", .path.display())]
    Defect {
        /// The file.
        path: PathBuf,
        /// The reason.
        defect: Defect,
    },
    /// The certificate is for another key.
    #[error(
        "the certificate {} is for another key than this node's, {key}: have one issued for it \
         with `jaus keys ca issue`",
        .path.display()
    )]
    OtherKey {
        /// The file.
        path: PathBuf,
        /// The node's key.
        key: PublicKey,
    },
    /// The node's key cannot be used.
    #[error(transparent)]
    Key(#[from] KeyError),
}

/// The certificate of a node.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Certificate {
    der: CertificateDer<'static>,
    name: String,
    key: PublicKey,
    ids: Vec<JausId>,
    serial: String,
    not_before: UnixTime,
    not_after: UnixTime,
    /// The signatures of those who have approved it.
    approval: Option<String>,
}

impl Certificate {
    /// Reads the DER encoding. The signature is not checked; see
    /// [`Authority::verify`](crate::Authority::verify).
    ///
    /// # Errors
    /// If the certificate does not describe a node.
    pub fn from_der(der: &CertificateDer<'_>) -> Result<Self, Defect> {
        let parsed = x509_cert::Certificate::from_der(der).map_err(|_| Defect::NotX509)?;
        let names = EndEntityCert::try_from(der).map_err(|_| Defect::NotX509)?;
        let fields = parsed.tbs_certificate();
        let name = fields.subject().common_name().ok().flatten();
        let name = name.map(|it| it.value().into_owned());
        let seconds =
            |time: x509_cert::time::Time| UnixTime::since_unix_epoch(time.to_unix_duration());
        Ok(Self {
            der: der.clone().into_owned(),
            name: name.filter(|it| is_name(it)).ok_or(Defect::Name)?,
            key: PublicKey::from_spki(names.subject_public_key_info().as_ref())
                .ok_or(Defect::NotEd25519)?,
            ids: ids(names.valid_uri_names())?,
            serial: hex(names.serial()),
            not_before: seconds(fields.validity().not_before),
            not_after: seconds(fields.validity().not_after),
            approval: names
                .valid_uri_names()
                .find_map(|it| it.strip_prefix(APPROVAL))
                .map(str::to_owned),
        })
    }

    /// Reads a PEM file.
    ///
    /// # Errors
    /// If it cannot be read, or contains no certificate of a node.
    pub fn load(path: &Path) -> Result<Self, CertificateError> {
        let der = read_certificate(path)?;
        Self::from_der(&der).map_err(|defect| CertificateError::Defect {
            path: path.to_owned(),
            defect,
        })
    }

    /// The DER encoding.
    #[must_use]
    pub const fn der(&self) -> &CertificateDer<'static> {
        &self.der
    }

    /// The name of the node.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The key that it certifies.
    #[must_use]
    pub const fn key(&self) -> PublicKey {
        self.key
    }

    /// The ids that the node may speak for; with wildcards.
    #[must_use]
    pub fn ids(&self) -> &[JausId] {
        &self.ids
    }

    /// The serial number, in hexadecimal digits.
    #[must_use]
    pub fn serial(&self) -> &str {
        &self.serial
    }

    /// From when on it is valid.
    #[must_use]
    pub const fn not_before(&self) -> UnixTime {
        self.not_before
    }

    /// Until when it is valid.
    #[must_use]
    pub const fn not_after(&self) -> UnixTime {
        self.not_after
    }

    pub(crate) fn approval(&self) -> Option<&str> {
        self.approval.as_deref()
    }

    /// All that it allows, which is what people approve.
    pub(crate) fn line(&self) -> String {
        let ids: Vec<_> = self.ids.iter().map(JausId::to_string).collect();
        let (serial, name, key, ids) = (&self.serial, &self.name, self.key, ids.join(","));
        format!(
            "issue {serial} {name} {key} {ids} {}",
            self.not_after.as_secs()
        )
    }

    /// Whether less than a third of its life is left.
    #[must_use]
    pub fn expires_soon(&self, now: UnixTime) -> bool {
        let (from, until) = (self.not_before.as_secs(), self.not_after.as_secs());
        until.saturating_sub(now.as_secs()) < until.saturating_sub(from) / 3
    }
}

/// Whether this can be the name of a node: it appears in logs and in the trust file.
pub(crate) fn is_name(text: &str) -> bool {
    (1..=LONGEST_NAME).contains(&text.len())
        && text.bytes().all(|it| it.is_ascii_graphic() && it != b'#')
}

/// The ids in the subject alternative names; those of other schemes are ignored.
fn ids<'a>(names: impl Iterator<Item = &'a str>) -> Result<Vec<JausId>, Defect> {
    let texts = names.filter_map(|it| it.strip_prefix(SCHEME));
    let ids: Vec<JausId> = texts
        .take(MOST_IDS + 1)
        .map(|text| {
            let shown = || jaus_text::shortened(text, 60).into_owned();
            text.parse().map_err(|_| Defect::Id(shown()))
        })
        .collect::<Result<_, _>>()?;
    match ids.len() {
        0 => Err(Defect::NoIds),
        1..=MOST_IDS => Ok(ids),
        _ => Err(Defect::TooManyIds),
    }
}

pub(crate) fn hex(octets: &[u8]) -> String {
    octets.iter().map(|it| format!("{it:02x}")).collect()
}

/// A time for people, in UTC.
pub(crate) fn shown(time: UnixTime) -> String {
    DateTime::from_unix_duration(Duration::from_secs(time.as_secs())).map_or_else(
        |_| format!("{} s after 1970", time.as_secs()),
        |it| it.to_string(),
    )
}

/// Reads a file that others may read, and cannot change.
pub(crate) fn read(path: &Path) -> Result<Vec<u8>, CertificateError> {
    jaus_files::read(path, Readers::Everyone, LONGEST).map_err(|source| in_file(path, source))
}

/// Reads the first certificate of a PEM file.
pub(crate) fn read_certificate(path: &Path) -> Result<CertificateDer<'static>, CertificateError> {
    CertificateDer::from_pem_slice(&read(path)?).map_err(|_| malformed(path, "certificate"))
}

pub(crate) fn malformed(path: &Path, expected: &'static str) -> CertificateError {
    CertificateError::Malformed {
        path: path.to_owned(),
        expected,
    }
}

pub(crate) fn in_file(path: &Path, source: io::Error) -> CertificateError {
    CertificateError::File {
        path: path.to_owned(),
        source,
    }
}
