//! What each exchange answers when it is its turn: what to ask, whether to wait, or what came of it.

use super::case::Question;
use super::exchange::Verdict;

/// What an exchange begins with.
pub(super) enum Begin {
    Ask(Question),
    /// It is judged by what is known already, or left out.
    Over(Verdict),
}

/// What is made of what was heard.
pub(super) enum Judgement {
    Wait,
    /// A next question of the same exchange.
    Ask(Question),
    Over(Verdict),
}
