//! `jaus doctor --watch`: the differences between two rounds of checks.

use std::time::Duration;

use serde_json::{Value as Json, json};

use super::finding::Finding;

/// A difference to the round before.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Difference {
    /// A finding that the round before did not have.
    New(Finding),
    /// A finding of the round before that is over.
    Over(Finding),
}

impl Difference {
    pub(super) fn in_words(&self, colours: bool) -> String {
        match self {
            Self::New(finding) => format!("new:\n{}", finding.in_words(colours)),
            Self::Over(finding) => format!("over:\n{}", finding.in_words(false)),
        }
    }

    /// The difference as JSON, this long after the start.
    pub(super) fn to_json(&self, time: Duration) -> Json {
        let (event, finding) = match self {
            Self::New(finding) => ("new", finding),
            Self::Over(finding) => ("over", finding),
        };
        let seconds = (time.as_secs_f64() * 1e3).round() / 1e3;
        let mut event = json!({ "event": event, "seconds": seconds });
        if let (Json::Object(event), Json::Object(finding)) = (&mut event, finding.to_json()) {
            event.extend(finding);
        }
        event
    }
}

/// The findings of the latest round.
#[derive(Debug, Default)]
pub(super) struct Rounds {
    latest: Vec<Finding>,
}

impl Rounds {
    /// Takes the findings of a round. Returns what is over, and then what is new.
    pub(super) fn handle_round(&mut self, findings: Vec<Finding>) -> Vec<Difference> {
        let before = std::mem::replace(&mut self.latest, findings);
        let lacks =
            |findings: &[Finding], it: &Finding| !findings.iter().any(|other| other.is_same_as(it));
        let over = before.iter().filter(|it| lacks(&self.latest, it));
        let new = self.latest.iter().filter(|it| lacks(&before, it));
        let over = over.cloned().map(Difference::Over);
        over.chain(new.cloned().map(Difference::New)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(feature = "secure")]
    #[test]
    fn another_figure_is_no_difference() {
        let reached = |time: &str| vec![Finding::ok("secure", "the peer is `rover`").figure(time)];
        let mut rounds = Rounds::default();
        assert_eq!(rounds.handle_round(reached("round trip 4.6 ms")).len(), 1);
        assert_eq!(rounds.handle_round(reached("round trip 7.6 ms")), []);
    }

    #[test]
    fn only_differences_between_rounds_are_shown() {
        let sound = Finding::ok("port", "port 3794 is free");
        let taken = Finding::problem("port", "port 3794 is taken");
        let host = Finding::ok("clock", "runs steadily");
        let mut rounds = Rounds::default();
        let first = rounds.handle_round(vec![host.clone(), sound.clone()]);
        assert_eq!(
            first,
            [
                Difference::New(host.clone()),
                Difference::New(sound.clone())
            ]
        );
        assert_eq!(rounds.handle_round(vec![sound.clone(), host.clone()]), []);
        assert_eq!(
            rounds.handle_round(vec![host, taken.clone()]),
            [Difference::Over(sound), Difference::New(taken)]
        );
    }
}
