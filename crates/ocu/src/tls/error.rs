//! Why a certificate of the page cannot be used.

use std::io;
use std::path::{Path, PathBuf};

/// Why a certificate or key cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TlsError {
    /// A file cannot be read or written.
    #[error("{}: {source}", .path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: io::Error,
    },
    /// The file contains no certificate.
    #[error(
        "{} contains no certificate in PEM: it must begin with -----BEGIN CERTIFICATE-----, the \
         station's certificate first, then those of its issuers", .0.display()
    )]
    NoCertificate(PathBuf),
    /// The file contains no key.
    #[error(
        "{} contains no private key in PEM without a password, such as -----BEGIN PRIVATE \
         KEY-----", .0.display()
    )]
    NoKey(PathBuf),
    /// The key is not the one of the certificate.
    #[error(
        "the key in {} does not belong to the certificate in {}: name the two files that were \
         made together", .key.display(), .certificate.display()
    )]
    Mismatch {
        /// The file of the certificate.
        certificate: PathBuf,
        /// The file of the key.
        key: PathBuf,
    },
    /// The certificate has expired.
    #[error(
        "the certificate in {} has expired: renew it (for one that the station made, remove its \
         two files), or check this computer's clock",
        .0.display()
    )]
    Expired(PathBuf),
    /// The certificate is not valid yet.
    #[error(
        "the certificate in {} is not valid yet: check this computer's clock", .0.display()
    )]
    NotYet(PathBuf),
    /// The certificate or key cannot be used for another reason.
    #[error("the certificate in {} cannot be used: {source}", .path.display())]
    Unusable {
        /// The file of the certificate.
        path: PathBuf,
        /// The reason.
        source: rustls::Error,
    },
    /// A certificate cannot be made.
    #[error("cannot make a certificate: {0}")]
    Make(rcgen::Error),
}

pub(super) fn in_file(path: &Path) -> impl Fn(io::Error) -> TlsError {
    move |source| TlsError::File {
        path: path.to_owned(),
        source,
    }
}
