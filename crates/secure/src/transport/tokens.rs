//! Tokens by which a peer proves that it receives at its address: those of Retry packets, and those
//! that each session leaves with the dialling side for its next handshake (RFC 9000, section 8.1).

use std::fmt;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::{Duration, SystemTime};

use quinn_proto::{
    BloomTokenLog, ClientConfig, ServerConfig, TimeSource, TokenMemoryCache, ValidationTokenConfig,
};

use crate::credentials::Credentials;
use crate::crypto::hkdf;

/// How long a token from a session is valid.
const LIFETIME: Duration = Duration::from_secs(14 * 24 * 60 * 60);
/// Memory for the tokens that were used, in octets.
const MEMORY: usize = 256 << 10;
/// Tokens that may be used within a lifetime before unused ones are taken for used ones, which costs
/// their peers a round trip.
const USES: u64 = 100_000;
/// Limits of tokens that this side has from others: addresses, and tokens of each.
const MOST_ADDRESSES: u32 = 256;
const MOST_PER_ADDRESS: usize = 2;

/// What both sides need for tokens. It outlives changes of the node's key.
pub(super) struct Tokens {
    key: Arc<hkdf::Prk>,
    used: Arc<BloomTokenLog>,
    clock: Arc<Clock>,
    received: Arc<TokenMemoryCache>,
}

impl Tokens {
    /// With a key that is the same after a restart, so that tokens remain valid.
    pub(super) fn new(credentials: &Credentials) -> Self {
        let secret = credentials.own_key().secret_for(b"jaus/1 address tokens");
        let key = hkdf::Salt::new(hkdf::HKDF_SHA256, &[]).extract(secret.as_ref());
        Self {
            key: Arc::new(key),
            used: Arc::new(BloomTokenLog::new_expected_items(MEMORY, USES)),
            clock: Arc::new(Clock(credentials.clone())),
            received: Arc::new(TokenMemoryCache::new(MOST_ADDRESSES, MOST_PER_ADDRESS)),
        }
    }

    /// Lets the listening side give and accept tokens.
    pub(super) fn serve(&self, config: &mut ServerConfig) {
        let mut validation = ValidationTokenConfig::default();
        validation.lifetime(LIFETIME).log(self.used.clone());
        config
            .token_key(self.key.clone())
            .time_source(self.clock.clone())
            .validation_token_config(validation);
    }

    /// Lets the dialling side keep tokens and show them.
    pub(super) fn keep(&self, config: &mut ClientConfig) {
        config.token_store(self.received.clone());
    }
}

impl fmt::Debug for Tokens {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Tokens").finish_non_exhaustive()
    }
}

/// The clock of the credentials.
struct Clock(Credentials);

impl TimeSource for Clock {
    fn now(&self) -> SystemTime {
        SystemTime::UNIX_EPOCH + Duration::from_secs(self.0.now().as_secs())
    }
}

/// The name by which the tokens from a peer are kept. It is a host name, because QUIC's interface
/// for dials expects one; it is not sent.
pub(super) fn name_of(address: SocketAddr) -> String {
    let ip = address.ip().to_string().replace(['.', ':'], "-");
    format!("at-{ip}-{}", address.port())
}
