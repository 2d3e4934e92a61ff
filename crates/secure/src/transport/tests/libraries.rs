//! Nodes whose TLS is of different libraries of cryptographic primitives.

use std::fs;

use rustls::crypto::{CryptoProvider, aws_lc_rs, ring};
use rustls::pki_types::{PrivatePkcs8KeyDer, pem::PemObject as _};

use super::*;

const LIBRARIES: [fn() -> CryptoProvider; 2] =
    [ring::default_provider, aws_lc_rs::default_provider];

/// A vehicle and an operator with TLS of these libraries, after a second.
fn with_libraries(vehicle: CryptoProvider, operator: CryptoProvider) -> Network {
    let keys = [key(), key()];
    let [one, other] = pinned(&keys, &mutual(&keys));
    connected(&[one.with_provider(vehicle), other.with_provider(operator)])
}

#[test]
fn nodes_of_all_libraries_exchange_datagrams_both_ways() {
    for vehicle in LIBRARIES {
        for operator in LIBRARIES {
            exchange_both_ways(&mut with_libraries(vehicle(), operator()));
        }
    }
}

#[test]
fn two_nodes_of_aws_lc_rs_agree_on_a_hybrid_key_exchange() {
    let group = |provider: CryptoProvider| provider.kx_groups[0].name();
    let hybrid = rustls::NamedGroup::X25519MLKEM768;
    assert_eq!(group(aws_lc_rs::default_provider()), hybrid);
    assert_ne!(group(ring::default_provider()), hybrid);
    // With this exchange alone there is a session as well.
    let mut only = aws_lc_rs::default_provider();
    only.kx_groups.truncate(1);
    let network = with_libraries(aws_lc_rs::default_provider(), only);
    assert!(network.session(1).is_some());
}

#[test]
fn a_key_made_with_one_library_is_read_by_the_other() {
    let made_by_ring = {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("node.key");
        Key::create(&path).unwrap();
        fs::read(&path).unwrap()
    };
    let made_by_aws_lc = {
        let random = ::aws_lc_rs::rand::SystemRandom::new();
        let document = ::aws_lc_rs::signature::Ed25519KeyPair::generate_pkcs8(&random).unwrap();
        crate::key::pem("PRIVATE KEY", document.as_ref())
            .as_bytes()
            .to_vec()
    };
    for pem in [made_by_ring, made_by_aws_lc] {
        let [first, second] = LIBRARIES.map(|library| {
            let der = PrivatePkcs8KeyDer::from_pem_slice(&pem).unwrap();
            let key = library().key_provider.load_private_key(der.into()).unwrap();
            key.public_key().unwrap().to_vec()
        });
        assert_eq!(first, second);
    }
}
