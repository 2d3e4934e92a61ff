//! The library of cryptographic primitives: ring, or aws-lc-rs, which has the same interface.

#[cfg(not(any(feature = "aws-lc", feature = "ring")))]
compile_error!("choose a library of cryptographic primitives: the feature `ring` or `aws-lc`");

#[cfg(feature = "aws-lc")]
pub(super) use aws_lc_rs::digest;
#[cfg(not(feature = "aws-lc"))]
pub(super) use ring::digest;
#[cfg(feature = "aws-lc")]
pub(super) use rustls::crypto::aws_lc_rs::default_provider;
#[cfg(not(feature = "aws-lc"))]
pub(super) use rustls::crypto::ring::default_provider;
