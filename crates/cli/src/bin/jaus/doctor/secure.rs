//! The secure link: are key, certificate and trusted keys usable, and does a link to each peer stand?

use std::net::SocketAddr;
use std::time::Duration;

use jaus::address::JausId;
use jaus::link::Interfaces;
use jaus::node::Config;
use jaus_cli::output::counted;
use jaus_cli::secure::Secure;
use jaus_secure::Reached;

use super::finding::Finding;

const CHECK: &str = "secure";

/// Checks the link, and connects to its peers.
pub(super) async fn check(secure: &Secure, node: JausId, time: Duration) -> Vec<Finding> {
    let accepts = if secure.uses_certificates() {
        certificate
    } else {
        trust
    };
    let mut findings = vec![key(secure), accepts(secure)];
    if findings.iter().any(Finding::is_problem) {
        return findings;
    }
    let mut link = match secure.open(node, None) {
        Ok(link) => link,
        Err(error) => {
            findings.push(Finding::problem(CHECK, error).advice(
                "stop the node that has the port, or choose another with --secure-listen=ADDRESS:PORT",
            ));
            return findings;
        }
    };
    let peers = secure.peers();
    let reached = link.probe(&peers, time).await;
    findings.extend(
        peers
            .into_iter()
            .zip(reached)
            .map(|(peer, reached)| of_peer(peer, reached)),
    );
    findings
}

/// The node's settings for plain JUDP beside the link; `None` if it uses none.
pub(super) fn plain(config: Config) -> Result<Option<Config>, Finding> {
    let config = Secure::restrict(config).map_err(|error| Finding::problem(CHECK, error))?;
    let is_used = config.interfaces != Interfaces::Only(Vec::new());
    Ok(is_used.then_some(config))
}

fn key(secure: &Secure) -> Finding {
    match secure.key() {
        Ok(key) => Finding::ok(
            CHECK,
            format_args!(
                "the key of this node is {}; cryptography by {}",
                key.public(),
                jaus_secure::crypto_library()
            ),
        ),
        Err(error) => Finding::problem(CHECK, error),
    }
}

fn trust(secure: &Secure) -> Finding {
    match secure.trust() {
        Ok(trust) if trust.is_empty() => {
            Finding::problem(CHECK, "no key is trusted, so no link can stand").advice(
                "`jaus keys trust NAME KEY IDS`, with the key that `jaus keys show` prints there",
            )
        }
        Ok(trust) => Finding::ok(
            CHECK,
            format_args!("this node trusts {}", counted(trust.len(), "key")),
        ),
        Err(error) => Finding::problem(CHECK, error),
    }
}

fn certificate(secure: &Secure) -> Finding {
    match secure.credentials().map(|it| it.warning()) {
        Ok(None) => Finding::ok(CHECK, "the certificate of this node is valid"),
        Ok(Some(warning)) => Finding::warning(
            CHECK,
            format_args!("the certificate of this node: {warning}"),
        ),
        Err(error) => Finding::problem(CHECK, error),
    }
}

fn of_peer(peer: SocketAddr, reached: Reached) -> Finding {
    match reached {
        Ok(session) => {
            let time = session.round_trip.as_secs_f64() * 1000.0;
            let name = &session.peer.name;
            Finding::ok(CHECK, format_args!("{peer} is `{name}`"))
                .figure(format_args!("round trip {time:.1} ms"))
        }
        Err(fault) => {
            let finding = Finding::problem(CHECK, format_args!("{peer}: {fault}"));
            match fault.remedy() {
                Some(remedy) => finding.advice(remedy),
                None => finding,
            }
        }
    }
}
