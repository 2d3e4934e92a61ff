//! The certificate and key with which the station serves the page, and what is wrong with them.

use std::io;
use std::path::Path;
use std::sync::Arc;
use std::time::SystemTime;

use jaus_files::Readers;
use rustls::ServerConfig;
use rustls::pki_types::pem::PemObject as _;
use rustls::pki_types::{CertificateDer, PrivateKeyDer, UnixTime};
use rustls::version::TLS13;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio_rustls::TlsAcceptor;
use tokio_rustls::server::TlsStream;

use super::certificate;
use super::crypto::{self, digest};
use super::error::{TlsError, in_file};

/// The longest file of certificates or a key, in octets.
const LONGEST: u64 = 1 << 20;

/// TLS 1.3 of the page: a certificate and its key.
#[derive(Clone)]
pub struct Tls {
    config: Arc<ServerConfig>,
    fingerprint: String,
    is_self_signed: bool,
}

impl Tls {
    /// Reads a certificate, with those of its issuers, and its key, both in PEM.
    ///
    /// # Errors
    /// If a file cannot be read or contains neither, the key is readable by other users or is
    /// another certificate's, or the certificate is expired at `now`.
    pub fn load(certificate: &Path, key: &Path, now: SystemTime) -> Result<Self, TlsError> {
        let chain = certificates(certificate)?;
        let [own, ..] = &chain[..] else {
            return Err(TlsError::NoCertificate(certificate.to_owned()));
        };
        check_time(own, now, certificate)?;
        let fingerprint = fingerprint(own);
        let private = private_key(key)?;
        let provider = Arc::new(crypto::default_provider());
        let unusable = |source| TlsError::Unusable {
            path: certificate.to_owned(),
            source,
        };
        let mut config = ServerConfig::builder_with_provider(provider)
            .with_protocol_versions(&[&TLS13])
            .map_err(unusable)?
            .with_no_client_auth()
            .with_single_cert(chain, private)
            .map_err(|error| match error {
                rustls::Error::InconsistentKeys(_) => TlsError::Mismatch {
                    certificate: certificate.to_owned(),
                    key: key.to_owned(),
                },
                error => unusable(error),
            })?;
        config.alpn_protocols = vec![b"http/1.1".to_vec()];
        Ok(Self {
            config: Arc::new(config),
            fingerprint,
            is_self_signed: false,
        })
    }

    /// Reads `page.crt` and `page.key` in a folder. Without them, makes a key and a certificate
    /// signed by it, for these names and addresses and `localhost`; only their owner can read the
    /// key.
    ///
    /// # Errors
    /// As [`load`](Self::load), or if the files cannot be written.
    pub fn load_or_make(
        folder: &Path,
        names: &[String],
        now: SystemTime,
    ) -> Result<Self, TlsError> {
        let [certificate, key] = ["page.crt", "page.key"].map(|name| folder.join(name));
        if !certificate.exists() && !key.exists() {
            certificate::make(&certificate, &key, names, now)?;
        }
        Ok(Self {
            is_self_signed: true,
            ..Self::load(&certificate, &key, now)?
        })
    }

    /// The SHA-256 fingerprint of the certificate, as browsers show it: `AB:CD:…`.
    #[must_use]
    pub fn fingerprint(&self) -> &str {
        &self.fingerprint
    }

    /// Whether browsers cannot know the certificate, so that operators have to compare its
    /// fingerprint.
    #[must_use]
    pub const fn is_self_signed(&self) -> bool {
        self.is_self_signed
    }

    pub(crate) async fn accept<S>(&self, stream: S) -> io::Result<TlsStream<S>>
    where
        S: AsyncRead + AsyncWrite + Unpin,
    {
        TlsAcceptor::from(self.config.clone()).accept(stream).await
    }
}

impl std::fmt::Debug for Tls {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Tls")
            .field("fingerprint", &self.fingerprint)
            .finish_non_exhaustive()
    }
}

fn certificates(path: &Path) -> Result<Vec<CertificateDer<'static>>, TlsError> {
    let text = jaus_files::read(path, Readers::Everyone, LONGEST).map_err(in_file(path))?;
    let chain: Result<Vec<_>, _> = CertificateDer::pem_slice_iter(&text).collect();
    chain.map_err(|_| TlsError::NoCertificate(path.to_owned()))
}

fn private_key(path: &Path) -> Result<PrivateKeyDer<'static>, TlsError> {
    let text = jaus_files::read(path, Readers::Owner, LONGEST).map_err(in_file(path))?;
    PrivateKeyDer::from_pem_slice(&text).map_err(|_| TlsError::NoKey(path.to_owned()))
}

/// Refuses a certificate that has expired or is not valid yet. Whether it is trusted is up to the
/// browser: the check has no roots, and looks at nothing but the time.
fn check_time(own: &CertificateDer<'_>, now: SystemTime, path: &Path) -> Result<(), TlsError> {
    let since_1970 = now
        .duration_since(SystemTime::UNIX_EPOCH)
        .unwrap_or_default();
    let now = UnixTime::since_unix_epoch(since_1970);
    let Ok(certificate) = webpki::EndEntityCert::try_from(own) else {
        return Err(TlsError::NoCertificate(path.to_owned()));
    };
    let usage = webpki::KeyUsage::server_auth();
    match certificate.verify_for_usage(
        webpki::ALL_VERIFICATION_ALGS,
        &[],
        &[],
        now,
        usage,
        None,
        None,
    ) {
        Err(webpki::Error::CertExpired { .. }) => Err(TlsError::Expired(path.to_owned())),
        Err(webpki::Error::CertNotValidYet { .. }) => Err(TlsError::NotYet(path.to_owned())),
        _ => Ok(()),
    }
}

fn fingerprint(certificate: &CertificateDer<'_>) -> String {
    let hash = digest::digest(&digest::SHA256, certificate);
    let octets: Vec<_> = hash.as_ref().iter().map(|it| format!("{it:02X}")).collect();
    octets.join(":")
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::path::PathBuf;
    use std::time::Duration;

    use super::*;

    const YEAR: Duration = Duration::from_secs(365 * 24 * 3600);

    /// 2026, for tests whose time is an argument.
    fn now() -> SystemTime {
        SystemTime::UNIX_EPOCH + YEAR * 56
    }

    fn files(folder: &Path) -> [PathBuf; 2] {
        ["page.crt", "page.key"].map(|name| folder.join(name))
    }

    #[test]
    fn a_station_keeps_its_certificate() {
        let folder = tempfile::tempdir().unwrap();
        let names = ["10.0.0.5".to_owned(), "ocu.local".to_owned()];
        let made = Tls::load_or_make(folder.path(), &names, now()).unwrap();
        let again = Tls::load_or_make(folder.path(), &[], now() + YEAR).unwrap();
        assert_eq!(made.fingerprint(), again.fingerprint());
        assert_eq!(made.fingerprint().len(), 32 * 3 - 1);
        let other = tempfile::tempdir().unwrap();
        let other = Tls::load_or_make(other.path(), &names, now()).unwrap();
        assert_ne!(made.fingerprint(), other.fingerprint());
    }

    #[test]
    fn a_certificate_is_refused_outside_its_validity() {
        let folder = tempfile::tempdir().unwrap();
        let [certificate, key] = files(folder.path());
        Tls::load_or_make(folder.path(), &[], now()).unwrap();
        let load = |now| Tls::load(&certificate, &key, now);
        assert!(load(now() + YEAR * 9).is_ok());
        let error = load(now() + YEAR * 11).unwrap_err().to_string();
        assert!(error.contains("has expired: renew it"), "{error}");
        let error = load(now() - YEAR).unwrap_err().to_string();
        assert!(error.contains("not valid yet: check"), "{error}");
    }

    #[test]
    fn the_key_of_another_certificate_is_refused() {
        let folders = [(); 2].map(|()| tempfile::tempdir().unwrap());
        for folder in &folders {
            Tls::load_or_make(folder.path(), &[], now()).unwrap();
        }
        let [certificate, _] = files(folders[0].path());
        let [_, key] = files(folders[1].path());
        let error = Tls::load(&certificate, &key, now()).unwrap_err();
        assert!(matches!(error, TlsError::Mismatch { .. }), "{error}");
    }

    #[test]
    fn missing_and_malformed_files_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let [certificate, key] = files(folder.path());
        Tls::load_or_make(folder.path(), &[], now()).unwrap();
        let error = Tls::load(&key, &key, now()).unwrap_err();
        assert!(matches!(error, TlsError::NoCertificate(_)), "{error}");
        let nowhere = folder.path().join("nowhere");
        let error = Tls::load(&certificate, &nowhere, now()).unwrap_err();
        assert!(error.to_string().contains("nowhere: "), "{error}");
        fs::write(&key, "no key").unwrap();
        let error = Tls::load(&certificate, &key, now()).unwrap_err();
        assert!(matches!(error, TlsError::NoKey(_)), "{error}");
    }

    #[cfg(unix)]
    #[test]
    fn a_new_key_is_for_its_owner_alone_and_one_that_others_can_read_is_refused() {
        use std::os::unix::fs::PermissionsExt as _;

        let folder = tempfile::tempdir().unwrap();
        let [certificate, key] = files(folder.path());
        Tls::load_or_make(folder.path(), &[], now()).unwrap();
        let mode = fs::metadata(&key).unwrap().permissions().mode();
        assert_eq!(mode & 0o777, 0o600);
        fs::set_permissions(&key, fs::Permissions::from_mode(0o644)).unwrap();
        let error = Tls::load(&certificate, &key, now())
            .unwrap_err()
            .to_string();
        assert!(error.contains("chmod 600"), "{error}");
    }
}
