//! The library of cryptographic primitives: ring, or aws-lc-rs, which has the same interface.

use std::sync::Arc;

use rustls::Error;
use rustls::crypto::CryptoProvider;
use rustls::pki_types::PrivatePkcs8KeyDer;
use rustls::sign::SigningKey;

#[cfg(not(any(feature = "aws-lc", feature = "ring")))]
compile_error!("choose a library of cryptographic primitives: the feature `ring` or `aws-lc`");

// quinn-proto takes keys of ring, if a build has both.
#[cfg(not(feature = "ring"))]
pub(crate) use aws_lc_rs::{digest, hkdf, hmac, rand, signature};
#[cfg(feature = "ring")]
pub(crate) use ring::{digest, hkdf, hmac, rand, signature};

#[cfg(feature = "aws-lc")]
use rustls::crypto::aws_lc_rs as tls;
#[cfg(not(feature = "aws-lc"))]
use rustls::crypto::ring as tls;
#[cfg(feature = "aws-lc")]
pub(crate) use webpki::aws_lc_rs::ED25519;
#[cfg(not(feature = "aws-lc"))]
pub(crate) use webpki::ring::ED25519;

/// What TLS and signatures are made of.
pub(crate) fn provider() -> Arc<CryptoProvider> {
    Arc::new(tls::default_provider())
}

/// An Ed25519 key, from its PKCS #8 encoding.
pub(crate) fn signing_key(der: &PrivatePkcs8KeyDer<'_>) -> Result<Arc<dyn SigningKey>, Error> {
    tls::sign::any_eddsa_type(der)
}

/// The library of cryptographic primitives in this build: `ring`, `aws-lc-rs`, or `aws-lc-rs (FIPS)`
/// with the validated module.
#[must_use]
pub fn crypto_library() -> &'static str {
    if tls::default_provider().fips() {
        "aws-lc-rs (FIPS)"
    } else if cfg!(feature = "aws-lc") {
        "aws-lc-rs"
    } else {
        "ring"
    }
}
