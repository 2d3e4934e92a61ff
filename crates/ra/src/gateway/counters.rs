//! Counters of a gateway, and the log of refusals by kind.

use std::collections::BTreeMap;
use std::fmt;
use std::time::{Duration, Instant};

use jaus::counters;

counters! {
    /// Counters of a gateway. They only grow.
    pub struct Counters;

    /// Queries of JAUS clients, sent to RA components.
    QueriesToRa = "queries to RA",
    /// Commands of JAUS clients, sent to RA components.
    CommandsToRa = "commands to RA",
    /// Reports of RA components, sent to JAUS clients or cached for them.
    ReportsFromRa = "reports from RA",
    /// Queries of RA components, sent to JAUS components.
    QueriesFromRa = "queries from RA",
    /// Commands of RA components, sent to JAUS components.
    CommandsFromRa = "commands from RA",
    /// Reports of JAUS components, sent to RA components.
    ReportsToRa = "reports to RA",
    /// Grants of control over an RA component to a JAUS client.
    ControlOfRa = "control of RA components granted",
    /// Grants of control over a JAUS component to an RA component.
    ControlFromRa = "control of JAUS components granted",
    /// Refused: no counterpart on the other side.
    NoCounterpart = "refused: no counterpart on the other side",
    /// Refused: a value that the other side cannot represent, or a malformed body.
    NotConverted = "refused: not expressible on the other side",
    /// Refused: an RA component may not send it to JAUS components.
    NotGranted = "refused: RA component has no right to it",
    /// Refused: a command of a client that is not in control.
    NotInControl = "refused: sender not in control",
    /// Refused: a command for an RA component in the emergency state.
    InEmergency = "refused: in emergency state",
    /// Refused: a driving command for an RA component that its client has sent to Standby.
    InStandby = "refused: in standby",
    /// Refused: a duplicate of a query that is still pending.
    Repeated = "refused: query already pending",
    /// Refused: too many pending queries.
    TooManyWaiting = "refused: too many pending queries",
    /// Refused: too many service connections.
    TooManyConnections = "refused: too many service connections",
    /// Refused: a change or an execution of a list that the other side's driver does not support.
    NotListed = "refused: list change unsupported by the other side",
    /// Sent without confirmation: places for an RA driver that does not report them.
    Unconfirmed = "positions sent without confirmation",
    /// Not answered: the queried component timed out.
    Unanswered = "queries timed out",
    /// Dropped: an unsolicited report.
    Unasked = "dropped: unsolicited report",
    /// Not shown: an id without counterpart.
    Unmapped = "hidden: id without counterpart",
    /// Not shown: a subsystem whose number is taken on the other side.
    Collision = "hidden: subsystem number taken on the other side",
    /// Not shown: too many components.
    TooManyComponents = "hidden: too many components",
    /// Decisions that an audit log lacks, because too many different ones came at once.
    DecisionsLost = "decisions not recorded",
    /// Not sent: the RA node rejected the message.
    NotSent = "not sent to RA",
}

/// Counts refusals and logs them: the first of each kind and message code, and again after
/// [`SILENCE`](Self::SILENCE).
#[derive(Debug, Default)]
pub(super) struct Tally {
    counters: Counters,
    /// When a refusal of each kind was last logged.
    logged: BTreeMap<(Counter, u16), Instant>,
}

impl Tally {
    /// Minimum interval between log entries of one kind.
    const SILENCE: Duration = Duration::from_secs(60);
    /// Maximum number of kinds that are logged; further kinds are only counted.
    const MOST_KINDS: usize = 512;

    pub(super) const fn counters(&self) -> &Counters {
        &self.counters
    }

    pub(super) fn add(&mut self, counter: Counter) {
        self.counters.add(counter);
    }

    /// Counts a refused message with this code and logs it at intervals.
    pub(super) fn refuse(
        &mut self,
        now: Instant,
        counter: Counter,
        code: u16,
        why: impl fmt::Display,
    ) {
        self.counters.add(counter);
        let kind = (counter, code);
        let since = self.logged.get(&kind);
        if since.is_some_and(|&logged| now < logged + Self::SILENCE) {
            return;
        }
        if since.is_none() && self.logged.len() >= Self::MOST_KINDS {
            return;
        }
        self.logged.insert(kind, now);
        let total = self.counters.get(counter);
        tracing::info!(code = %format_args!("{code:04X}h"), total, %why, "{}", counter.name());
    }
}
