//! Parameters of the endpoint and of its connections.

use std::sync::Arc;
use std::time::Duration;

use quinn_proto::{
    ClientConfig, EndpointConfig, HashedConnectionIdGenerator, IdleTimeout, ServerConfig,
    TransportConfig, VarInt,
};

use super::session::STREAMS;
use super::tokens::Tokens;
use crate::credentials::Credentials;
use crate::crypto::hmac;
use crate::key::Key;
use crate::tls::{self, Refusals};

/// A session without a packet from the peer for this time has ended. The stack's own timeouts, which
/// stop a vehicle, are of the same order.
pub(super) const IDLE: Duration = Duration::from_secs(5);
/// The interval of keep-alives, which also keep a NAT's mapping.
pub(super) const KEEP_ALIVE: Duration = Duration::from_secs(1);
/// The assumed round trip of a handshake until one was measured: a lost packet is repeated after three
/// times as long. On slower links a few packets are repeated in vain.
const INITIAL_ROUND_TRIP: Duration = Duration::from_millis(100);
/// Octets of QUIC datagrams that may wait in a connection. What exceeds them waits in the backlog of
/// the session, where an urgent message can overtake it.
const DATAGRAM_BUFFER: usize = 16 << 10;

/// Parameters of the endpoint. With the same secrets after a restart it resets the connections of
/// its previous life, so that the peers dial again before these time out.
pub(super) fn of_endpoint(key: &Key) -> EndpointConfig {
    let secret = key.secret_for(b"jaus/1 stateless reset");
    let mut config =
        EndpointConfig::new(Arc::new(hmac::Key::new(hmac::HMAC_SHA256, secret.as_ref())));
    let mut ids = [0; 8];
    ids.copy_from_slice(&key.secret_for(b"jaus/1 connection ids").as_ref()[..8]);
    let ids = u64::from_le_bytes(ids);
    config.cid_generator(move || Box::new(HashedConnectionIdGenerator::from_key(ids)));
    config
}

/// Parameters of every connection.
fn transport_config() -> TransportConfig {
    let mut config = TransportConfig::default();
    config
        .max_concurrent_uni_streams(VarInt::from_u32(STREAMS))
        .max_concurrent_bidi_streams(VarInt::from_u32(0))
        .max_idle_timeout(IdleTimeout::try_from(IDLE).ok())
        .keep_alive_interval(Some(KEEP_ALIVE))
        .initial_rtt(INITIAL_ROUND_TRIP)
        .datagram_send_buffer_size(DATAGRAM_BUFFER);
    config
}

/// Parameters of the listening and of the dialling side, with the present key of the node.
pub(super) fn of_sides(
    credentials: &Credentials,
    refusals: &Refusals,
    tokens: &Tokens,
) -> (Arc<ServerConfig>, ClientConfig) {
    let (server, client) = tls::configs(credentials, refusals);
    let transport = Arc::new(transport_config());
    let mut server = ServerConfig::with_crypto(server);
    server.transport_config(transport.clone());
    tokens.serve(&mut server);
    let mut client = ClientConfig::new(client);
    client.transport_config(transport);
    tokens.keep(&mut client);
    (Arc::new(server), client)
}
