//! Proofs that a page and this station know the same secret. The secret itself is not sent, because
//! another user of the host can take the port while the station restarts, and gets what a page sends then.
//!
//! Of the secret a page keeps a key for the host and port by which it was opened. The key makes a *ticket* for this run
//! of the station, which the page shows instead of the secret, and the *answer* to a nonce of the page, by which the page
//! knows the station. Neither counts at another host, at another port or in another run. The page speaks first: if
//! the station answered every page, a weak token could be guessed without being noticed.

use hmac::{Hmac, Mac as _};
use sha2::Sha256;

use super::guard;
use crate::token::{Token, TokenError};

/// What proofs of this run are made for.
pub(crate) struct Proofs {
    /// The number of this run, which nobody could know before.
    run: Token,
    /// The port at which the page is served.
    port: u16,
    is_secure: bool,
    hosts: Vec<String>,
}

impl Proofs {
    /// `hosts` are names by which the page is reached besides `localhost` and addresses.
    ///
    /// # Errors
    /// If the system provides no random numbers.
    pub(crate) fn new(port: u16, is_secure: bool, hosts: &[String]) -> Result<Self, TokenError> {
        Ok(Self {
            run: Token::generate()?,
            port,
            is_secure,
            hosts: hosts.to_vec(),
        })
    }

    /// The number of this run of the station. It is no secret.
    pub(super) fn run(&self) -> &str {
        self.run.reveal()
    }

    /// Whether a page of this host has shown its ticket, or the secret itself, as scripts do.
    pub(super) fn is_shown(&self, secret: &Token, host: &str, shown: &str) -> bool {
        secret.is(shown) || self.is_ticket(secret, host, shown)
    }

    fn is_ticket(&self, secret: &Token, host: &str, shown: &str) -> bool {
        let ticket = self.prove(secret, host, &format!("page {}", self.run()));
        ticket.is_some_and(|it| it.is(shown))
    }

    /// The answer to a nonce of a page that has shown its ticket; `None` if it is no nonce.
    pub(super) fn answer(&self, secret: &Token, host: &str, nonce: &str) -> Option<Token> {
        let nonce = Token::new(nonce)?;
        let words = format!("station {} {}", nonce.reveal(), self.run());
        self.prove(secret, host, &words)
    }

    fn prove(&self, secret: &Token, host: &str, words: &str) -> Option<Token> {
        if !self.is_here(host) {
            return None;
        }
        let key = mac(secret.reveal().as_bytes(), &format!("jaus {host}"))?;
        Some(Token::of_octets(&mac(&key, words)?))
    }

    /// Whether a page of this host means this station. At another port of this machine is another program, unless the
    /// name was given: it may be that of a proxy.
    fn is_here(&self, host: &str) -> bool {
        let (name, port) = guard::name_and_port(host);
        let usual = if self.is_secure { 443 } else { 80 };
        port.unwrap_or(usual) == self.port || guard::is_given(name, &self.hosts)
    }
}

/// HMAC-SHA-256. `None` never happens: it takes keys of every length.
fn mac(key: &[u8], words: &str) -> Option<[u8; 32]> {
    let mut mac = Hmac::<Sha256>::new_from_slice(key).ok()?;
    mac.update(words.as_bytes());
    Some(mac.finalize().into_bytes().into())
}

#[cfg(test)]
mod tests {
    use super::*;

    const HOST: &str = "127.0.0.1:8080";
    const NONCE: &str = "0123456789abcdef0123456789abcdef";

    fn proofs(run: &str) -> Proofs {
        Proofs {
            run: Token::new(run).unwrap(),
            port: 8080,
            is_secure: false,
            hosts: vec!["rover.local".to_owned()],
        }
    }

    fn token() -> Token {
        Token::new("correct-horse-battery").unwrap()
    }

    /// `tests/page/pass.test.mjs` has the same values.
    #[test]
    fn ticket_and_answer_are_those_of_the_page() {
        let proofs = proofs("00112233445566778899aabbccddeeff");
        let ticket = "0ca9e004ae75439ca379669a66839a51e2aff20a8f2acc4261b4737d9da051cf";
        assert!(proofs.is_ticket(&token(), HOST, ticket));
        let answer = proofs.answer(&token(), HOST, NONCE).unwrap();
        let expected = "f441351e7482cfe1048da253a6cbcf73dc577993a544df177cdf4dd39f53d8c2";
        assert_eq!(answer.reveal(), expected);
        assert!(proofs.answer(&token(), HOST, "too short").is_none());
    }

    #[test]
    fn a_ticket_counts_for_one_secret_host_and_run() {
        let here = proofs("00112233445566778899aabbccddeeff");
        let words = format!("page {}", here.run());
        let ticket = here.prove(&token(), HOST, &words).unwrap();
        let ticket = ticket.reveal();
        assert!(here.is_ticket(&token(), HOST, ticket));
        let later = proofs("00112233445566778899aabbccddeefe");
        assert!(!later.is_ticket(&token(), HOST, ticket));
        assert!(!here.is_ticket(&token(), "127.0.0.2:8080", ticket));
        assert!(!here.is_ticket(&Token::generate().unwrap(), HOST, ticket));
    }

    #[test]
    fn proofs_are_for_the_own_port_and_for_names_that_were_given() {
        let proofs = proofs("00112233445566778899aabbccddeeff");
        for (host, counts) in [
            (HOST, true),
            ("[::1]:8080", true),
            ("127.0.0.1:8081", false),
            ("127.0.0.1", false),
            ("rover.local", true),
            ("ROVER.local:9000", true),
        ] {
            let answer = proofs.answer(&token(), host, NONCE);
            assert_eq!(answer.is_some(), counts, "{host}");
        }
    }
}
