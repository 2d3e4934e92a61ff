//! TLS of the page, if the feature `https` is enabled.

#[cfg(feature = "https")]
mod certificate;
#[cfg(feature = "https")]
mod crypto;
#[cfg(feature = "https")]
mod error;
#[cfg(feature = "https")]
mod https;
#[cfg(not(feature = "https"))]
mod without;

#[cfg(feature = "https")]
pub use self::error::TlsError;
#[cfg(feature = "https")]
pub use self::https::Tls;
#[cfg(not(feature = "https"))]
pub use self::without::Tls;
