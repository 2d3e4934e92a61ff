//! TLS of a station without the feature `https`.

use std::io;

/// TLS of the page. Without the feature `https` there is none.
#[derive(Clone, Debug)]
pub enum Tls {}

impl Tls {
    /// The SHA-256 fingerprint of the certificate.
    #[must_use]
    pub fn fingerprint(&self) -> &str {
        match *self {}
    }

    /// Whether browsers cannot know the certificate.
    #[must_use]
    pub fn is_self_signed(&self) -> bool {
        match *self {}
    }

    pub(crate) async fn accept<S>(&self, _: S) -> io::Result<S> {
        match *self {}
    }
}
