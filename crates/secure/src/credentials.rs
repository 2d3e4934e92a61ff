//! How a node proves who it is, and whom it accepts: with pinned keys, or with certificates.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, SystemTime};

use jaus_files::Followed;
use rustls::crypto::CryptoProvider;
use rustls::pki_types::{CertificateDer, UnixTime};
use rustls::sign::CertifiedKey;

use crate::authority::{Authority, Rejection};
use crate::certificate::{Certificate, CertificateError, shown};
use crate::crypto;
use crate::follow::{KEEPING, REFUSING, follow};
use crate::key::{Key, PublicKey};
use crate::trust::{Peer, TrustFile};

/// Why a node has no usable credentials.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CredentialsError {
    /// A file cannot be used.
    #[error(transparent)]
    File(#[from] CertificateError),
    /// Peers would refuse the node's own certificate.
    #[error("the certificate of this node, {}: {rejection}", .path.display())]
    Own {
        /// The file.
        path: PathBuf,
        /// Why they would.
        rejection: Rejection,
    },
}

/// The files of a node that uses certificates; all are PEM.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CertificateFiles {
    /// The node's certificate.
    pub certificate: PathBuf,
    /// The certificate of the authority that issued it and those of the peers.
    pub authority: PathBuf,
    /// The authority's revocation list.
    pub revoked: Option<PathBuf>,
}

/// A node's own key, with its certificate if it uses one.
#[derive(Debug)]
struct Identity {
    key: Key,
    certificate: Option<Certificate>,
}

/// A node's own key, and how it checks those of its peers. Shared by its clones.
#[derive(Clone, Debug)]
pub struct Credentials {
    own: Followed<Identity, CertificateError>,
    trust: TrustFile,
    /// For nodes that use certificates.
    authority: Option<Followed<Authority, CertificateError>>,
    /// The wall clock, in seconds since 1970.
    clock: Arc<AtomicU64>,
    provider: Arc<CryptoProvider>,
}

/// A peer that has proved who it is.
#[derive(Debug)]
pub(crate) struct Identified {
    pub(crate) peer: Peer,
    /// Until when its certificate is valid.
    pub(crate) valid_until: Option<UnixTime>,
}

impl Credentials {
    /// A key, and the peers that it trusts by their keys.
    #[must_use]
    pub fn pinned(key: Key, trust: TrustFile) -> Self {
        let certificate = None;
        Self::new(Followed::of(Identity { key, certificate }), trust, None)
    }

    /// The key in this file, and the peers that it trusts by their keys.
    ///
    /// # Errors
    /// If the key file cannot be used.
    pub fn load(key: &Path, trust: TrustFile) -> Result<Self, CertificateError> {
        let read = Key::reader(key)?;
        let own = Followed::load(Key::files(key), move || Identity::of(read()?, None))?;
        Ok(Self::new(own, trust, None))
    }

    /// The key in this file, with certificates. The trust file may have lines that narrow the ids
    /// of certificates; it accepts no keys.
    ///
    /// # Errors
    /// If a file cannot be used, or the node's own certificate is not valid at `now`.
    pub fn load_certified(
        key: &Path,
        files: &CertificateFiles,
        trust: TrustFile,
        now: SystemTime,
    ) -> Result<Self, CredentialsError> {
        let read = Key::reader(key).map_err(CertificateError::from)?;
        let (mut followed, path) = (Key::files(key), files.certificate.clone());
        followed.push(path.clone());
        let own = Followed::load(followed, move || Identity::of(read()?, Some(&path)))?;
        let (certificate, revoked) = (files.authority.clone(), files.revoked.clone());
        let paths = [certificate.clone()].into_iter().chain(revoked.clone());
        let authority = Followed::load(paths.collect(), move || {
            Authority::load(&certificate, revoked.as_deref())
        })?;
        let credentials = Self::new(own, trust, Some(authority));
        credentials.set_clock(now);
        credentials
            .check_own()
            .map_err(|rejection| CredentialsError::Own {
                path: files.certificate.clone(),
                rejection,
            })?;
        Ok(credentials)
    }

    fn new(
        own: Followed<Identity, CertificateError>,
        trust: TrustFile,
        authority: Option<Followed<Authority, CertificateError>>,
    ) -> Self {
        Self {
            own,
            trust,
            authority,
            clock: Arc::default(),
            provider: crypto::provider(),
        }
    }

    /// The node's public key.
    #[must_use]
    pub fn public(&self) -> PublicKey {
        self.own.get().key.public()
    }

    pub(crate) fn trust(&self) -> TrustFile {
        self.trust.clone()
    }

    pub(crate) fn own_key(&self) -> Key {
        self.own.get().key.clone()
    }

    /// What TLS is made of.
    pub(crate) const fn provider(&self) -> &Arc<CryptoProvider> {
        &self.provider
    }

    /// Whether the node uses certificates.
    #[must_use]
    pub const fn uses_certificates(&self) -> bool {
        self.authority.is_some()
    }

    /// Reads the node's own files and those of its authority again. On an error the previous contents of
    /// that file stay; with an unusable file of the authority, new sessions are refused.
    ///
    /// # Errors
    /// If a file of keys or certificates cannot be used.
    pub fn reload(&self) -> Result<(), CertificateError> {
        self.own.reload()?;
        self.authority.as_ref().map_or(Ok(()), Followed::reload)
    }

    /// Reads each file again whenever it has changed, as long as the credentials are in use. Must
    /// be called within a tokio runtime.
    pub fn follow(&self) {
        follow(&self.own, KEEPING);
        self.trust.follow();
        if let Some(authority) = &self.authority {
            follow(authority, REFUSING);
        }
    }

    /// Sets the time at which certificates are checked.
    pub fn set_clock(&self, now: SystemTime) {
        let now = now.duration_since(SystemTime::UNIX_EPOCH);
        let seconds = now.as_ref().map_or(0, Duration::as_secs);
        self.clock.store(seconds, Ordering::Relaxed);
    }

    pub(crate) fn now(&self) -> UnixTime {
        UnixTime::since_unix_epoch(Duration::from_secs(self.clock.load(Ordering::Relaxed)))
    }

    /// How often the node's own key or certificate was replaced.
    pub(crate) fn own_edition(&self) -> u64 {
        self.own.edition()
    }

    /// How often that by which peers are accepted was replaced.
    pub(crate) fn trust_edition(&self) -> u64 {
        let authority = self.authority.as_ref().map_or(0, Followed::edition);
        self.trust.edition() + authority
    }

    /// The key with the certificate, or with its own encoding in place of one.
    pub(crate) fn certified_key(&self) -> Arc<CertifiedKey> {
        let own = self.own.get();
        let shown = match &own.certificate {
            Some(certificate) => certificate.der().clone(),
            None => own.key.public().spki().to_vec().into(),
        };
        Arc::new(CertifiedKey::new(vec![shown], own.key.signing()))
    }

    /// Why no new session is accepted: a file that decides about peers cannot be used, and may lack a
    /// peer that was revoked.
    pub(crate) fn fault(&self) -> Option<Arc<str>> {
        let authority = self.authority.as_ref().and_then(Followed::fault);
        self.trust.fault().or(authority)
    }

    /// The peer of a new session, if it is accepted now.
    pub(crate) fn admit(&self, shown: &CertificateDer<'_>) -> Result<Identified, Rejection> {
        match self.fault() {
            Some(fault) => Err(Rejection::UnusableTrust(fault)),
            None => self.identify(shown),
        }
    }

    /// The peer of a session that this key or certificate belongs to, if it is accepted now.
    pub(crate) fn identify(&self, shown: &CertificateDer<'_>) -> Result<Identified, Rejection> {
        let Some(authority) = &self.authority else {
            let key = PublicKey::from_spki(shown).ok_or(Rejection::NotEd25519)?;
            let peer = self.trust.find(key).ok_or(Rejection::UntrustedKey(key))?;
            let valid_until = None;
            return Ok(Identified { peer, valid_until });
        };
        let certificate = authority.get().verify(shown, self.now())?;
        let peer = self.trust.certified(&certificate);
        Ok(Identified {
            peer: peer.ok_or_else(|| Rejection::Unapproved(certificate.name().to_owned()))?,
            valid_until: Some(certificate.not_after()),
        })
    }

    fn check_own(&self) -> Result<(), Rejection> {
        match (&self.authority, &self.own.get().certificate) {
            (Some(authority), Some(own)) => {
                authority.get().verify(own.der(), self.now()).map(|_| ())
            }
            _ => Ok(()),
        }
    }

    /// The same, with a key and a certificate that may not belong together.
    #[cfg(test)]
    pub(crate) fn with_own(&self, key: Key, certificate: Certificate) -> Self {
        let certificate = Some(certificate);
        let own = Followed::of(Identity { key, certificate });
        Self {
            own,
            ..self.clone()
        }
    }

    /// The same, with TLS of another library.
    #[cfg(all(test, feature = "aws-lc", feature = "ring"))]
    pub(crate) fn with_provider(self, provider: CryptoProvider) -> Self {
        let provider = Arc::new(provider);
        Self { provider, ..self }
    }

    /// Why the node's own certificate is not accepted now or will not be soon, and the remedy.
    #[must_use]
    pub fn warning(&self) -> Option<String> {
        if let Err(rejection) = self.check_own() {
            return Some(rejection.to_string());
        }
        let own = self.own.get();
        let own = own.certificate.as_ref()?;
        own.expires_soon(self.now()).then(|| {
            format!(
                "it expires at {}: have a new one issued with `jaus keys ca issue`",
                shown(own.not_after())
            )
        })
    }
}

impl Identity {
    fn of(key: Key, certificate: Option<&Path>) -> Result<Self, CertificateError> {
        let Some(path) = certificate else {
            let certificate = None;
            return Ok(Self { key, certificate });
        };
        let certificate = Certificate::load(path)?;
        if certificate.key() != key.public() {
            return Err(CertificateError::OtherKey {
                path: path.to_owned(),
                key: key.public(),
            });
        }
        Ok(Self {
            key,
            certificate: Some(certificate),
        })
    }
}
