//! TLS 1.3 with raw public keys (RFC 7250) or certificates: both sides prove that they have a key
//! that the other side accepts.

use std::sync::{Arc, Mutex, PoisonError};

use quinn_proto::crypto::rustls::{QuicClientConfig, QuicServerConfig};
use rustls::client::danger::{HandshakeSignatureValid, ServerCertVerified, ServerCertVerifier};
use rustls::client::{AlwaysResolvesClientRawPublicKeys, ResolvesClientCert, Resumption};
use rustls::crypto::{
    CryptoProvider, WebPkiSupportedAlgorithms, verify_tls13_signature,
    verify_tls13_signature_with_raw_key,
};
use rustls::pki_types::{CertificateDer, ServerName, SubjectPublicKeyInfoDer, UnixTime};
use rustls::server::danger::{ClientCertVerified, ClientCertVerifier};
use rustls::server::{
    AlwaysResolvesServerRawPublicKeys, NoServerSessionStorage, ResolvesServerCert,
};
use rustls::sign::SingleCertAndKey;
use rustls::{
    ClientConfig, DigitallySignedStruct, DistinguishedName, Error, PeerIncompatible, ServerConfig,
    SignatureScheme, version::TLS13,
};

use crate::authority::Rejection;
use crate::credentials::Credentials;

/// The application protocol: the JUDP datagrams of AS5669A, version 1 of this link.
const PROTOCOL: &[u8] = b"jaus/1";

/// Why a peer was refused last.
#[derive(Clone, Debug, Default)]
pub(crate) struct Refusals(Arc<Mutex<Option<Rejection>>>);

impl Refusals {
    fn note(&self, rejection: Rejection) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(rejection);
    }

    /// The refusal since the last call, if any.
    pub(crate) fn take(&self) -> Option<Rejection> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}

/// Accepts the peers that the credentials identify, and no others.
#[derive(Debug)]
struct Verifier {
    credentials: Credentials,
    refusals: Refusals,
    algorithms: WebPkiSupportedAlgorithms,
}

/// The configurations of both sides of a handshake, with the present key and certificate of the
/// node.
pub(crate) fn configs(
    credentials: &Credentials,
    refusals: &Refusals,
) -> (Arc<QuicServerConfig>, Arc<QuicClientConfig>) {
    let provider = credentials.provider().clone();
    let verifier = Arc::new(Verifier {
        credentials: credentials.clone(),
        refusals: refusals.clone(),
        algorithms: provider.signature_verification_algorithms,
    });
    let server = server(provider.clone(), verifier.clone());
    let client = client(provider, verifier);
    (Arc::new(server), Arc::new(client))
}

#[expect(
    clippy::expect_used,
    reason = "every provider has TLS 1.3 and the cipher suite of QUIC's first packets"
)]
fn server(provider: Arc<CryptoProvider>, verifier: Arc<Verifier>) -> QuicServerConfig {
    let key = verifier.credentials.certified_key();
    let resolver: Arc<dyn ResolvesServerCert> = if verifier.credentials.uses_certificates() {
        Arc::new(SingleCertAndKey::from(key))
    } else {
        Arc::new(AlwaysResolvesServerRawPublicKeys::new(key))
    };
    let mut config = ServerConfig::builder_with_provider(provider)
        .with_protocol_versions(&[&TLS13])
        .expect("the provider has cipher suites of TLS 1.3")
        .with_client_cert_verifier(verifier)
        .with_cert_resolver(resolver);
    config.alpn_protocols = vec![PROTOCOL.to_vec()];
    // A resumed session would not be checked against the trust file again.
    config.send_tls13_tickets = 0;
    config.session_storage = Arc::new(NoServerSessionStorage {});
    config.try_into().expect("a cipher suite for first packets")
}

#[expect(
    clippy::expect_used,
    reason = "every provider has TLS 1.3 and the cipher suite of QUIC's first packets"
)]
fn client(provider: Arc<CryptoProvider>, verifier: Arc<Verifier>) -> QuicClientConfig {
    let key = verifier.credentials.certified_key();
    let resolver: Arc<dyn ResolvesClientCert> = if verifier.credentials.uses_certificates() {
        Arc::new(SingleCertAndKey::from(key))
    } else {
        Arc::new(AlwaysResolvesClientRawPublicKeys::new(key))
    };
    let mut config = ClientConfig::builder_with_provider(provider)
        .with_protocol_versions(&[&TLS13])
        .expect("the provider has cipher suites of TLS 1.3")
        .dangerous()
        .with_custom_certificate_verifier(verifier)
        .with_client_cert_resolver(resolver);
    config.alpn_protocols = vec![PROTOCOL.to_vec()];
    config.resumption = Resumption::disabled();
    config.enable_sni = false;
    config.try_into().expect("a cipher suite for first packets")
}

impl Verifier {
    fn check(&self, shown: &CertificateDer<'_>) -> Result<(), Error> {
        let identified = self.credentials.admit(shown);
        identified.map(|_| ()).map_err(|it| self.refuse(it))
    }

    fn check_signature(
        &self,
        message: &[u8],
        shown: &CertificateDer<'_>,
        signature: &DigitallySignedStruct,
    ) -> Result<HandshakeSignatureValid, Error> {
        let checked = if self.credentials.uses_certificates() {
            verify_tls13_signature(message, shown, signature, &self.algorithms)
        } else {
            let key = SubjectPublicKeyInfoDer::from(shown.as_ref());
            verify_tls13_signature_with_raw_key(message, &key, signature, &self.algorithms)
        };
        checked.map_err(|_| self.refuse(Rejection::NotItsKey))
    }

    /// Notes why a peer is refused; returns what TLS tells it.
    fn refuse(&self, rejection: Rejection) -> Error {
        let alert = rejection.alert();
        self.refusals.note(rejection);
        alert
    }
}

/// What both sides check alike.
macro_rules! signatures {
    () => {
        fn verify_tls12_signature(
            &self,
            _: &[u8],
            _: &CertificateDer<'_>,
            _: &DigitallySignedStruct,
        ) -> Result<HandshakeSignatureValid, Error> {
            Err(Error::PeerIncompatible(PeerIncompatible::Tls12NotOffered))
        }

        fn verify_tls13_signature(
            &self,
            message: &[u8],
            certificate: &CertificateDer<'_>,
            signature: &DigitallySignedStruct,
        ) -> Result<HandshakeSignatureValid, Error> {
            self.check_signature(message, certificate, signature)
        }

        fn supported_verify_schemes(&self) -> Vec<SignatureScheme> {
            vec![SignatureScheme::ED25519]
        }

        fn requires_raw_public_keys(&self) -> bool {
            !self.credentials.uses_certificates()
        }
    };
}

impl ServerCertVerifier for Verifier {
    fn verify_server_cert(
        &self,
        certificate: &CertificateDer<'_>,
        _: &[CertificateDer<'_>],
        _: &ServerName<'_>,
        _: &[u8],
        _: UnixTime,
    ) -> Result<ServerCertVerified, Error> {
        self.check(certificate)
            .map(|()| ServerCertVerified::assertion())
    }

    signatures!();
}

impl ClientCertVerifier for Verifier {
    fn root_hint_subjects(&self) -> &[DistinguishedName] {
        &[]
    }

    fn verify_client_cert(
        &self,
        certificate: &CertificateDer<'_>,
        _: &[CertificateDer<'_>],
        _: UnixTime,
    ) -> Result<ClientCertVerified, Error> {
        self.check(certificate)
            .map(|()| ClientCertVerified::assertion())
    }

    signatures!();
}
