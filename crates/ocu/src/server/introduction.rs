//! What a page says as it opens a WebSocket.

use serde::Deserialize;

use super::visitor::Visitor;
use super::{Admission, Shared};
use crate::token::Token;

/// What a page says when it connects.
#[derive(Debug, Default, Deserialize)]
pub(super) struct Introduction {
    /// The vehicle to show.
    pub(super) vehicle: Option<u16>,
    /// The number of the same page's previous connection, and the secret that came with it.
    pub(super) replaces: Option<u64>,
    pub(super) secret: Option<String>,
    /// What the page wants to be answered by one who knows its token.
    nonce: Option<String>,
    #[serde(skip)]
    pub(super) answer: Option<Token>,
}

impl Introduction {
    /// Answers the nonce of a visitor who has shown the token or a ticket.
    pub(super) fn answer(&mut self, shared: &Shared, visitor: &Visitor) {
        let Admission { gate, proofs, .. } = &shared.admission;
        let asked = gate.secret_of(visitor).zip(self.nonce.as_deref());
        self.answer = asked.and_then(|(it, nonce)| proofs.answer(&it, &visitor.host, nonce));
    }
}
