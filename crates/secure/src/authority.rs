//! The certificate authority whose certificates a node accepts, and its revocation list.

use std::path::Path;
use std::sync::Arc;

use rustls::pki_types::{
    CertificateDer, CertificateRevocationListDer, TrustAnchor, UnixTime, pem::PemObject as _,
};
use rustls::{CertificateError as Alert, Error};
use webpki::{
    CertRevocationList, EndEntityCert, KeyUsage, OwnedCertRevocationList, RevocationCheckDepth,
    RevocationOptionsBuilder,
};

use crate::certificate::{
    Certificate, CertificateError, Defect, malformed, read, read_certificate, shown,
};
use crate::crypto;
use crate::key::PublicKey;

/// Why a peer is refused in the handshake.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Rejection {
    /// The key is not in the trust file.
    #[error("the key {0} is not trusted here")]
    UntrustedKey(PublicKey),
    /// A file that decides which peers are trusted has become unusable.
    #[error("new sessions are refused here until a file can be used again: {0}")]
    UnusableTrust(Arc<str>),
    /// The key has no Ed25519 form.
    #[error("its key is not an Ed25519 key")]
    NotEd25519,
    /// The certificate does not describe a node.
    #[error("its certificate cannot be used: {0}")]
    Defect(#[from] Defect),
    /// Another authority has issued the certificate.
    #[error(
        "the certificate of `{0}` is not issued by the authority of this node: have it issued \
         there, or correct the file of the authority"
    )]
    OtherAuthority(String),
    /// The certificate has expired.
    #[error(
        "the certificate of `{name}` has expired at {not_after}, and the clock of this host says \
         {now}: have a new one issued with `jaus keys ca issue`, or set the clock"
    )]
    Expired {
        /// The name in the certificate.
        name: String,
        /// Until when it was valid.
        not_after: String,
        /// The time of the host's clock.
        now: String,
    },
    /// The certificate is not valid yet.
    #[error(
        "the certificate of `{name}` is valid from {not_before} on, and the clock of this host \
         says {now}: set the clock, here or where it was issued"
    )]
    NotYetValid {
        /// The name in the certificate.
        name: String,
        /// From when on it is valid.
        not_before: String,
        /// The time of the host's clock.
        now: String,
    },
    /// The authority has revoked the certificate.
    #[error("the certificate {serial} of `{name}` is revoked")]
    Revoked {
        /// The name in the certificate.
        name: String,
        /// Its serial number.
        serial: String,
    },
    /// The certificate lacks the signatures of two approvers.
    #[error(
        "the certificate of `{0}` is not approved by two people of this node's file of approvers: issue it by \
         `jaus keys ca issue --sign` and `jaus keys ca approve`"
    )]
    Unapproved(String),
    /// The revocation list cannot be used for the certificate.
    #[error(
        "the revocation list says nothing about the certificate of `{0}`: it has to be the list \
         of the same authority"
    )]
    NoStatus(String),
    /// The peer does not have the key of the certificate that it shows.
    #[error("it does not have the private key of the certificate or key that it shows")]
    NotItsKey,
}

impl Rejection {
    /// The key that is not trusted, if that is the reason.
    pub(crate) const fn key(&self) -> Option<PublicKey> {
        match self {
            Self::UntrustedKey(key) => Some(*key),
            _ => None,
        }
    }

    /// What TLS tells the peer.
    pub(crate) fn alert(&self) -> Error {
        Error::InvalidCertificate(match self {
            Self::Expired { .. } => Alert::Expired,
            Self::NotYetValid { .. } => Alert::NotValidYet,
            Self::Revoked { .. } => Alert::Revoked,
            Self::OtherAuthority(_) => Alert::UnknownIssuer,
            Self::NotItsKey => Alert::BadSignature,
            _ => Alert::ApplicationVerificationFailure,
        })
    }
}

/// A certificate authority, and the certificates that it has revoked.
#[derive(Debug)]
pub struct Authority {
    anchor: TrustAnchor<'static>,
    revoked: Option<CertRevocationList<'static>>,
}

impl Authority {
    /// Reads the authority's certificate and its revocation list, both PEM.
    ///
    /// # Errors
    /// If a file cannot be read, or does not contain what is expected.
    pub fn load(certificate: &Path, revoked: Option<&Path>) -> Result<Self, CertificateError> {
        let der = read_certificate(certificate)?;
        let anchor = webpki::anchor_from_trusted_cert(&der)
            .map_err(|_| malformed(certificate, "certificate of an authority"))?
            .to_owned();
        let revoked = revoked.map(read_list).transpose()?;
        Ok(Self { anchor, revoked })
    }

    /// Checks that the authority has issued a certificate of a node, and that it is valid now.
    ///
    /// # Errors
    /// Why the certificate is refused.
    pub fn verify(
        &self,
        der: &CertificateDer<'_>,
        now: UnixTime,
    ) -> Result<Certificate, Rejection> {
        let certificate = Certificate::from_der(der)?;
        let parsed = EndEntityCert::try_from(der).map_err(|_| Defect::NotX509)?;
        let lists = self.revoked.as_slice().iter().collect::<Vec<_>>();
        let revocation = RevocationOptionsBuilder::new(&lists)
            .map(|it| it.with_depth(RevocationCheckDepth::EndEntity).build())
            .ok();
        parsed
            .verify_for_usage(
                &[crypto::ED25519],
                std::slice::from_ref(&self.anchor),
                &[],
                now,
                KeyUsage::client_auth(),
                revocation,
                None,
            )
            .map_err(|error| rejection(&error, &certificate, now))?;
        Ok(certificate)
    }
}

fn read_list(path: &Path) -> Result<CertRevocationList<'static>, CertificateError> {
    let expected = || malformed(path, "revocation list");
    let der = CertificateRevocationListDer::from_pem_slice(&read(path)?).map_err(|_| expected())?;
    let list = OwnedCertRevocationList::from_der(&der).map_err(|_| expected())?;
    Ok(list.into())
}

fn rejection(error: &webpki::Error, certificate: &Certificate, now: UnixTime) -> Rejection {
    let name = certificate.name().to_owned();
    match error {
        webpki::Error::CertExpired { .. } => Rejection::Expired {
            name,
            not_after: shown(certificate.not_after()),
            now: shown(now),
        },
        webpki::Error::CertNotValidYet { .. } => Rejection::NotYetValid {
            name,
            not_before: shown(certificate.not_before()),
            now: shown(now),
        },
        webpki::Error::CertRevoked => Rejection::Revoked {
            name,
            serial: certificate.serial().to_owned(),
        },
        webpki::Error::UnknownRevocationStatus => Rejection::NoStatus(name),
        _ => Rejection::OtherAuthority(name),
    }
}
