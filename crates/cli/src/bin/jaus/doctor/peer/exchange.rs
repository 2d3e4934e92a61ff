//! The exchanges that are tried, in the order in which integrations fail, and what becomes of them.

use std::time::Duration;

use serde_json::{Value as Json, json};

/// One exchange with a peer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Exchange {
    /// Where is it? For a peer that is named by its id alone.
    Find,
    /// Does its host refuse datagrams at that port?
    Reach,
    /// Does anything come back?
    Answer,
    /// In which framing?
    Framing,
    /// From the port that was asked?
    SourcePort,
    /// Query Identification, asked of it alone.
    Identification,
    /// The same, asked of everybody.
    Multicast,
    /// Does what it says to everybody arrive here?
    MulticastBack,
    Heartbeat,
    Acknowledgement,
    Configuration,
    /// Query Services with 255 for node and component.
    ServicesWildcard,
    /// Query Services with numbers.
    ServicesNamed,
    /// Query Services with an empty list.
    ServicesAll,
    Authority,
    Status,
    Control,
    /// Request and Release Control, if that is wanted.
    TakeControl,
    EventPeriodic,
    EventArrives,
    EventCancel,
    EventOnChange,
    /// A message of so many octets to the peer.
    Large(u32),
    /// A message of several fragments from the peer.
    LargeBack,
    Tcp,
    Sequence,
    Stacks,
    Ids,
    Rate,
    /// What does it do with a message type that the standard reserves?
    Reserved,
}

impl Exchange {
    /// All of them, in the order of the trials.
    pub(super) const ALL: [Self; 33] = [
        Self::Find,
        Self::Reach,
        Self::Answer,
        Self::Framing,
        Self::SourcePort,
        Self::Identification,
        Self::Multicast,
        Self::MulticastBack,
        Self::Heartbeat,
        Self::Acknowledgement,
        Self::Configuration,
        Self::ServicesWildcard,
        Self::ServicesNamed,
        Self::ServicesAll,
        Self::Authority,
        Self::Status,
        Self::Control,
        Self::TakeControl,
        Self::EventPeriodic,
        Self::EventArrives,
        Self::EventCancel,
        Self::EventOnChange,
        Self::Large(1 << 10),
        Self::Large(10 << 10),
        Self::Large(100 << 10),
        Self::Large(1 << 20),
        Self::LargeBack,
        Self::Tcp,
        Self::Rate,
        Self::Reserved,
        Self::Sequence,
        Self::Stacks,
        Self::Ids,
    ];

    /// What it is called in the report.
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Find => "finding it",
            Self::Reach => "UDP port",
            Self::Answer => "any answer",
            Self::Framing => "framing",
            Self::SourcePort => "source port",
            Self::Identification => "identification",
            Self::Multicast => "multicast to it",
            Self::MulticastBack => "multicast from it",
            Self::Heartbeat => "heartbeat",
            Self::Acknowledgement => "acknowledgement",
            Self::Configuration => "configuration",
            Self::ServicesWildcard => "services, any",
            Self::ServicesNamed => "services, by id",
            Self::ServicesAll => "services, all",
            Self::Authority => "authority",
            Self::Status => "status",
            Self::Control => "control",
            Self::TakeControl => "taking control",
            Self::EventPeriodic => "event, periodic",
            Self::EventArrives => "event arrives",
            Self::EventCancel => "event, cancel",
            Self::EventOnChange => "event, on change",
            Self::Large(octets) => match octets {
                1_024 => "1 KiB to it",
                10_240 => "10 KiB to it",
                102_400 => "100 KiB to it",
                _ => "1 MiB to it",
            },
            Self::LargeBack => "large from it",
            Self::Tcp => "JTCP port",
            Self::Rate => "many at once",
            Self::Reserved => "reserved type",
            Self::Sequence => "sequence numbers",
            Self::Stacks => "stacks there",
            Self::Ids => "ids",
        }
    }

    /// Whether nothing at all works without it.
    pub(super) const fn is_basic(self) -> bool {
        matches!(
            self,
            Self::Find | Self::Reach | Self::Answer | Self::Framing
        )
    }
}

/// What became of an exchange.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mark {
    Ok,
    Failed,
    Skipped,
}

impl Mark {
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::Failed => "failed",
            Self::Skipped => "skipped",
        }
    }
}

/// The judgement on an exchange, with what to say about it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Verdict {
    pub(super) mark: Mark,
    /// What was seen.
    pub(super) what: String,
    /// Why that probably is, if it failed.
    pub(super) cause: Option<String>,
    /// What to do about it.
    pub(super) remedy: Option<String>,
    /// Whether it was left out because nothing works without what failed before.
    pub(super) cut_off: bool,
}

impl Verdict {
    pub(super) fn ok(what: impl Into<String>) -> Self {
        Self::new(Mark::Ok, what)
    }

    pub(super) fn skipped(why: impl Into<String>) -> Self {
        Self::new(Mark::Skipped, why)
    }

    /// Left out, as is all that follows.
    pub(super) fn cut_off(why: impl Into<String>) -> Self {
        Self {
            cut_off: true,
            ..Self::skipped(why)
        }
    }

    pub(super) fn failed(
        what: impl Into<String>,
        cause: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Self {
        Self {
            cause: Some(cause.into()),
            remedy: Some(remedy.into()),
            ..Self::new(Mark::Failed, what)
        }
    }

    /// Adds what is worth doing although nothing failed.
    pub(super) fn advice(mut self, remedy: impl Into<String>) -> Self {
        self.remedy = Some(remedy.into());
        self
    }

    fn new(mark: Mark, what: impl Into<String>) -> Self {
        Self {
            mark,
            what: what.into(),
            cause: None,
            remedy: None,
            cut_off: false,
        }
    }
}

/// An exchange that has come to its end.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Trial {
    pub(super) exchange: Exchange,
    pub(super) verdict: Verdict,
    /// From the first question to the judgement.
    pub(super) took: Duration,
}

impl Trial {
    pub(super) fn failed(&self) -> bool {
        self.verdict.mark == Mark::Failed
    }

    pub(super) fn to_json(&self) -> Json {
        json!({
            "exchange": self.exchange.name(),
            "result": self.verdict.mark.name(),
            "what": self.verdict.what,
            "cause": self.verdict.cause,
            "remedy": self.verdict.remedy,
            "milliseconds": (self.took.as_secs_f64() * 1e4).round() / 10.0,
        })
    }
}
