//! What a gateway has carried across and what it has refused: a number for each, and a word in the
//! log for each kind of refusal.

use std::collections::BTreeMap;
use std::fmt;
use std::time::{Duration, Instant};

use jaus::counters;

counters! {
    /// The numbers of a gateway. They only grow.
    pub struct Counters;

    /// Queries of JAUS clients that were asked of RA components.
    QueriesToRa = "queries to RA",
    /// Commands of JAUS clients that were given to RA components.
    CommandsToRa = "commands to RA",
    /// Reports of RA components that were told to JAUS clients, or kept for them.
    ReportsFromRa = "reports from RA",
    /// Queries of RA components that were asked of JAUS components.
    QueriesFromRa = "queries from RA",
    /// Commands of RA components that were given to JAUS components.
    CommandsFromRa = "commands from RA",
    /// Reports of JAUS components that were told to RA components.
    ReportsToRa = "reports to RA",
    /// RA components of which a JAUS client was given control.
    ControlOfRa = "control of RA components given",
    /// JAUS components of which an RA component was given control.
    ControlFromRa = "control of JAUS components given",
    /// Refused: a message that has no counterpart on the other side.
    NoCounterpart = "refused: no counterpart on the other side",
    /// Refused: a value that the other side cannot carry, or a body that cannot be read.
    NotConverted = "refused: cannot be said on the other side",
    /// Refused: a command of a client that is not in control.
    NotInControl = "refused: sender not in control",
    /// Refused: a command for an RA component in an emergency.
    InEmergency = "refused: in an emergency",
    /// Refused: a driving command for an RA component that its client has sent to Standby.
    InStandby = "refused: in standby",
    /// Refused: a query that is waiting for its answer already.
    Repeated = "refused: question repeated while it waits",
    /// Refused: more than may wait for an answer.
    TooManyWaiting = "refused: too many questions wait",
    /// Refused: more service connections than there is room for.
    TooManyConnections = "refused: too many service connections",
    /// Refused: a change or an execution of a list that the other side's driver cannot follow.
    NotListed = "refused: not possible with the other side's list",
    /// Given without confirmation: places for an RA driver that does not tell them.
    Unconfirmed = "places given without confirmation",
    /// Not answered: whoever was asked said nothing in time.
    Unanswered = "not answered in time",
    /// Dropped: a report that nobody waits for.
    Unasked = "dropped: report that nobody waits for",
    /// Not shown: an id that has no counterpart.
    Unmapped = "not shown: id without counterpart",
    /// Not shown: a subsystem whose number is taken on the other side.
    Collision = "not shown: number taken on the other side",
    /// Not shown: more components than there is room for.
    TooManyComponents = "not shown: too many components",
    /// Not sent: the network of RA systems did not take it.
    NotSent = "not sent to RA",
}

/// Counts, and says in the log what is refused: once for each kind and message code, and again
/// after a while.
#[derive(Debug, Default)]
pub(super) struct Tally {
    counters: Counters,
    told: BTreeMap<(Counter, u16), Instant>,
}

impl Tally {
    /// Between two words on the same.
    const SILENCE: Duration = Duration::from_secs(60);
    /// The most kinds that are remembered; more are only counted.
    const MOST_KINDS: usize = 512;

    pub(super) const fn counters(&self) -> &Counters {
        &self.counters
    }

    pub(super) fn add(&mut self, counter: Counter) {
        self.counters.add(counter);
    }

    /// Counts what was refused of a message with this code, and says so now and then.
    pub(super) fn refuse(
        &mut self,
        now: Instant,
        counter: Counter,
        code: u16,
        why: impl fmt::Display,
    ) {
        self.counters.add(counter);
        let kind = (counter, code);
        let since = self.told.get(&kind);
        if since.is_some_and(|&told| now < told + Self::SILENCE) {
            return;
        }
        if since.is_none() && self.told.len() >= Self::MOST_KINDS {
            return;
        }
        self.told.insert(kind, now);
        let total = self.counters.get(counter);
        tracing::info!(code = %format_args!("{code:04X}h"), total, %why, "{}", counter.name());
    }
}
