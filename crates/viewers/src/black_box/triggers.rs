//! What makes a black box write: recognised in the traffic itself.

use std::collections::BTreeMap;
use std::fmt;
use std::net::IpAddr;
use std::str::FromStr;
use std::time::{Duration, Instant};

use jaus_limits::{Buckets, Rate, quota_address};
use jaus_view::{Entry, Filter};

/// The same trigger counts again after this time without it.
const QUIET: Duration = Duration::from_secs(60);
/// The same trigger counts at most once in this time, so that a component that alternates between
/// states does not replace the files of other incidents with its own.
const PAUSE: Duration = Duration::from_secs(60);
/// A loss of control within this time of the client's own release is no loss.
const RELEASE: Duration = Duration::from_secs(5);
/// Tokens that a trigger costs its network address: one a second.
const COST: u32 = 60;
/// Tokens of a network address.
const BY_ADDRESS: Rate = Rate::new(1, 16 * COST);
/// Limit of each table. The least recent entry makes room.
const MOST: usize = 1024;

const SET_EMERGENCY: &str = "0006";
const RELEASE_CONTROL: &str = "000E";
const REJECT_CONTROL: &str = "0010";
const REPORT_STATUS: &str = "4002";

/// Kind of a trigger.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum TriggerKind {
    /// A component reports the state EMERGENCY, or an emergency is commanded.
    Emergency,
    /// A component reports the state FAILURE.
    Fault,
    /// A component takes control from a client that has not released it.
    ControlLost,
    /// A message matches a filter.
    Message,
    /// The operator asks for it.
    Operator,
}

impl TriggerKind {
    /// The kinds that are recognised without a filter, with their names in flags.
    pub const NAMED: [(Self, &'static str); 3] = [
        (Self::Emergency, "emergency"),
        (Self::Fault, "fault"),
        (Self::ControlLost, "control-lost"),
    ];

    /// The name, as flags, files and events have it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Emergency => "emergency",
            Self::Fault => "fault",
            Self::ControlLost => "control-lost",
            Self::Message => "message",
            Self::Operator => "operator",
        }
    }
}

impl fmt::Display for TriggerKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for TriggerKind {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let found = Self::NAMED.iter().find(|(_, name)| *name == text);
        found.map(|(kind, _)| *kind).ok_or_else(|| {
            let names = Self::NAMED.map(|(_, name)| name).join(", ");
            format!("`{text}` is no trigger: choose from {names}")
        })
    }
}

/// A trigger, and the component that it concerns.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Trigger {
    /// Its kind.
    pub kind: TriggerKind,
    /// The sender of the message; empty for the operator.
    pub source: String,
}

impl Trigger {
    /// The operator asks for it.
    #[must_use]
    pub const fn of_operator() -> Self {
        Self {
            kind: TriggerKind::Operator,
            source: String::new(),
        }
    }
}

/// Recognises triggers in messages.
///
/// A state that is reported again and again triggers once; it triggers again after another state, or
/// after a minute without it. No trigger counts twice within a minute: a state that begins again
/// earlier counts when the minute is over, if it lasts.
///
/// Of one network address, 16 triggers count at once and one a minute after them: a host that invents
/// sources does not replace the files of other incidents.
#[derive(Debug)]
pub struct Triggers {
    kinds: Vec<TriggerKind>,
    filters: Vec<Filter>,
    occurrences: BTreeMap<Trigger, Occurrence>,
    /// When a client released a component.
    released: BTreeMap<(String, String), Instant>,
    /// The triggers of each network address.
    by_address: Buckets<Option<IpAddr>>,
}

/// How a trigger was recognised so far.
#[derive(Debug, Clone, Copy)]
struct Occurrence {
    /// When it last counted.
    counted: Instant,
    /// When it was last recognised.
    recognised: Instant,
    /// Whether the component has reported another state since it last counted.
    is_over: bool,
}

impl Occurrence {
    const fn new(now: Instant) -> Self {
        Self {
            counted: now,
            recognised: now,
            is_over: false,
        }
    }

    /// Recognises it again. Whether it counts.
    fn recur(&mut self, now: Instant) -> bool {
        let since = |at| now.saturating_duration_since(at);
        let begins = self.is_over || since(self.recognised) > QUIET;
        self.recognised = now;
        let counts = begins && since(self.counted) >= PAUSE;
        if counts {
            *self = Self::new(now);
        }
        counts
    }
}

impl Triggers {
    /// Recognises these kinds, and messages that match one of the filters.
    #[must_use]
    pub fn new(kinds: &[TriggerKind], filters: Vec<Filter>) -> Self {
        Self {
            kinds: kinds.to_vec(),
            filters,
            occurrences: BTreeMap::new(),
            released: BTreeMap::new(),
            by_address: Buckets::displacing(BY_ADDRESS, MOST),
        }
    }

    /// The trigger in a message from a network address that passed at `now`, if it counts. `None` is an
    /// origin without an address.
    pub fn handle_entry(
        &mut self,
        entry: &Entry,
        from: Option<IpAddr>,
        now: Instant,
    ) -> Option<Trigger> {
        let kind = self.recognise(entry, now)?;
        let source = entry.text("source").unwrap_or_default().to_owned();
        let trigger = Trigger { kind, source };
        let counts = match self.occurrences.get_mut(&trigger) {
            Some(occurrence) => occurrence.recur(now),
            None => {
                let new = Occurrence::new(now);
                insert(&mut self.occurrences, trigger.clone(), new, |it| {
                    it.recognised
                });
                true
            }
        };
        let from = from.map(quota_address);
        let counts = counts && self.by_address.take_many(now, from, COST).is_ok();
        counts.then_some(trigger)
    }

    fn recognise(&mut self, entry: &Entry, now: Instant) -> Option<TriggerKind> {
        let object = entry.carried().unwrap_or_else(|| entry.json());
        let text = |key: &str| object.get(key)?.as_str();
        let status = object.get("body").and_then(|it| it.get("Status")?.as_str());
        let kind = match text("code") {
            Some(SET_EMERGENCY) => Some(TriggerKind::Emergency),
            Some(REPORT_STATUS) => {
                let kind = match status {
                    Some("EMERGENCY") => Some(TriggerKind::Emergency),
                    Some("FAILURE") => Some(TriggerKind::Fault),
                    _ => None,
                };
                self.end_states(entry, kind);
                kind
            }
            Some(RELEASE_CONTROL) => {
                insert(
                    &mut self.released,
                    ends(entry, "source", "destination"),
                    now,
                    |at| *at,
                );
                None
            }
            Some(REJECT_CONTROL) => {
                let released = self.released.get(&ends(entry, "destination", "source"));
                let is_expected =
                    released.is_some_and(|&at| now.saturating_duration_since(at) <= RELEASE);
                (!is_expected).then_some(TriggerKind::ControlLost)
            }
            _ => None,
        };
        let kind = kind.filter(|kind| self.kinds.contains(kind));
        let matches = || self.filters.iter().any(|filter| filter.passes(entry));
        kind.or_else(|| matches().then_some(TriggerKind::Message))
    }

    /// A component that reports another state may report this one again.
    fn end_states(&mut self, entry: &Entry, reported: Option<TriggerKind>) {
        let source = entry.text("source").unwrap_or_default();
        for kind in [TriggerKind::Emergency, TriggerKind::Fault] {
            if reported != Some(kind) {
                let source = source.to_owned();
                if let Some(occurrence) = self.occurrences.get_mut(&Trigger { kind, source }) {
                    occurrence.is_over = true;
                }
            }
        }
    }
}

fn ends(entry: &Entry, client: &str, component: &str) -> (String, String) {
    let text = |key: &str| entry.text(key).unwrap_or_default().to_owned();
    (text(client), text(component))
}

/// Inserts a new key into a bounded table, in place of the least recent one.
fn insert<K: Ord + Clone, V>(
    table: &mut BTreeMap<K, V>,
    key: K,
    value: V,
    time: impl Fn(&V) -> Instant,
) {
    if table.len() >= MOST && !table.contains_key(&key) {
        let oldest = table.iter().min_by_key(|(_, value)| time(value));
        if let Some(oldest) = oldest.map(|(key, _)| key.clone()) {
            table.remove(&oldest);
        }
    }
    table.insert(key, value);
}

#[cfg(test)]
#[expect(clippy::disallowed_methods, reason = "tests begin at some time")]
mod tests {
    use serde_json::{Value as Json, json};

    use super::*;

    fn entry(json: Json) -> Entry {
        let Json::Object(object) = json else {
            panic!("an object");
        };
        Entry::of_object(object)
    }

    fn status(source: &str, status: &str) -> Entry {
        entry(json!({ "source": source, "code": "4002", "body": { "Status": status } }))
    }

    fn all() -> Triggers {
        Triggers::new(&TriggerKind::NAMED.map(|(kind, _)| kind), Vec::new())
    }

    #[test]
    fn a_state_triggers_when_it_begins_and_not_while_it_lasts() {
        let mut triggers = all();
        let start = Instant::now();
        let mut kind_of = |minute, entry: &Entry| {
            let now = start + minute * Duration::from_secs(60);
            triggers.handle_entry(entry, None, now).map(|it| it.kind)
        };
        assert_eq!(kind_of(0, &status("1.1.1", "READY")), None);
        let emergency = status("1.1.1", "EMERGENCY");
        assert_eq!(kind_of(0, &emergency), Some(TriggerKind::Emergency));
        for minute in 0..3 {
            assert_eq!(kind_of(minute, &emergency), None);
        }
        let failure = status("1.1.1", "FAILURE");
        assert_eq!(kind_of(2, &failure), Some(TriggerKind::Fault));
        assert_eq!(kind_of(2, &emergency), Some(TriggerKind::Emergency));
        let other = status("1.1.2", "EMERGENCY");
        assert_eq!(kind_of(2, &other), Some(TriggerKind::Emergency));
    }

    #[test]
    fn a_component_that_alternates_between_states_triggers_once_a_minute() {
        let mut triggers = all();
        let start = Instant::now();
        let mut counted = Vec::new();
        for tenth in 0..1500 {
            let now = start + tenth * Duration::from_millis(100);
            let state = if tenth % 2 == 0 { "EMERGENCY" } else { "READY" };
            let trigger = triggers.handle_entry(&status("66.1.1", state), None, now);
            counted.extend(trigger.map(|_| tenth / 10));
        }
        assert_eq!(counted, [0, 60, 120]);
    }

    #[test]
    fn a_state_that_begins_again_within_the_minute_and_lasts_triggers_after_it() {
        let mut triggers = all();
        let start = Instant::now();
        let mut counts = |second, state| {
            let now = start + Duration::from_secs(second);
            triggers
                .handle_entry(&status("1.1.1", state), None, now)
                .is_some()
        };
        assert!(counts(0, "FAILURE"));
        assert!(!counts(10, "READY"));
        assert!(!counts(20, "FAILURE"));
        assert!(!counts(59, "FAILURE"));
        assert!(counts(60, "FAILURE"));
        assert!(!counts(120, "FAILURE"));
    }

    #[test]
    fn a_report_inside_an_event_counts_as_the_report() {
        let event = entry(json!({
            "source": "1.1.1", "code": "41F1", "body": {},
            "carries": { "code": "4002", "body": { "Status": "FAILURE" } },
        }));
        let trigger = all().handle_entry(&event, None, Instant::now()).unwrap();
        assert_eq!(
            (trigger.kind, &*trigger.source),
            (TriggerKind::Fault, "1.1.1")
        );
    }

    #[test]
    fn a_commanded_emergency_that_is_repeated_triggers_again_after_a_minute_of_quiet() {
        let mut triggers = all();
        let command = entry(json!({ "source": "42.1.1", "code": "0006", "body": {} }));
        let start = Instant::now();
        let mut counts = |seconds| {
            let now = start + Duration::from_secs(seconds);
            triggers.handle_entry(&command, None, now).is_some()
        };
        assert!(counts(0));
        assert!(!counts(50));
        assert!(!counts(100));
        assert!(counts(161));
    }

    #[test]
    fn control_is_lost_if_the_client_has_not_released_it() {
        let control = |code: &str, source: &str, destination: &str| {
            entry(json!({ "source": source, "destination": destination, "code": code, "body": {} }))
        };
        let (client, component) = ("42.1.1", "101.1.33");
        let reject = control("0010", component, client);
        let now = Instant::now();
        let mut triggers = all();
        triggers.handle_entry(&control("000E", client, component), None, now);
        assert_eq!(triggers.handle_entry(&reject, None, now), None);
        let later = now + Duration::from_secs(6);
        let lost = triggers.handle_entry(&reject, None, later).unwrap();
        assert_eq!(lost.kind, TriggerKind::ControlLost);
    }

    #[test]
    fn only_what_was_chosen_triggers() {
        let mut none = Triggers::new(&[], vec!["message=ReportStatus".parse().unwrap()]);
        let mut report = status("1.1.1", "EMERGENCY").json().clone();
        assert_eq!(
            none.handle_entry(&Entry::of_object(report.clone()), None, Instant::now()),
            None
        );
        report.insert("message".to_owned(), "ReportStatus".into());
        let trigger = none.handle_entry(&Entry::of_object(report), None, Instant::now());
        assert_eq!(trigger.unwrap().kind, TriggerKind::Message);
    }

    #[test]
    fn a_host_that_invents_sources_leaves_triggers_to_others() {
        let mut triggers = all();
        let now = Instant::now();
        let [flood, other] = [66, 1].map(|host| Some(IpAddr::from([10, 0, 0, host])));
        let mut counted = |from, subsystem: u32, later: u64| {
            let status = status(&format!("{subsystem}.1.1"), "FAILURE");
            let now = now + Duration::from_secs(later);
            triggers.handle_entry(&status, from, now).is_some()
        };
        let first = (0..1000).filter(|it| counted(flood, 1000 + it, 0)).count();
        assert_eq!(first, 16);
        assert!(counted(other, 101, 0));
        let second = (0..1000).filter(|it| counted(flood, 2000 + it, 61)).count();
        assert_eq!(second, 1);
    }

    #[test]
    fn tables_are_bounded() {
        let mut triggers = all();
        let now = Instant::now();
        for number in 0..3 * MOST {
            triggers.handle_entry(&status(&format!("{number}.1.1"), "FAILURE"), None, now);
        }
        assert_eq!(triggers.occurrences.len(), MOST);
    }

    #[test]
    fn an_unknown_trigger_is_refused_with_those_that_there_are() {
        let error = "fire".parse::<TriggerKind>().unwrap_err();
        assert!(error.contains("emergency, fault, control-lost"), "{error}");
    }
}
