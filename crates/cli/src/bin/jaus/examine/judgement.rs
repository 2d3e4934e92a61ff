//! Decisions of an exchange: send a query, wait, or finish.

use super::case::Question;
use super::exchange::Verdict;

/// Start of an exchange.
pub(super) enum Begin {
    Ask(Question),
    /// Decided by what is known already, or skipped.
    Over(Verdict),
}

/// Evaluation of the received messages.
pub(super) enum Judgement {
    Wait,
    /// Another query of the same exchange.
    Ask(Question),
    Over(Verdict),
}
