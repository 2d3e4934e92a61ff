//! The exchanges of an examination, in the order in which integrations fail, and their results.

use std::time::Duration;

use serde_json::{Value as Json, json};

/// One exchange with a peer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Exchange {
    /// Locate a peer that is named by its id only.
    Find,
    /// Does its host refuse datagrams at that port?
    Reach,
    /// Does anything come back?
    Answer,
    /// In which framing?
    Framing,
    /// Does it answer from the queried port?
    SourcePort,
    /// Query Identification by unicast.
    Identification,
    /// Query Identification by multicast.
    Multicast,
    /// Do its multicasts arrive here?
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
    /// Request and Release Control, if permitted.
    TakeControl,
    EventPeriodic,
    EventArrives,
    EventCancel,
    EventOnChange,
    /// A message of this size in octets to the peer.
    Large(u32),
    /// A message of several fragments from the peer.
    LargeBack,
    Tcp,
    Sequence,
    Stacks,
    Ids,
    Rate,
    /// Reaction to a message type that the standard reserves.
    Reserved,
}

impl Exchange {
    /// All exchanges, in order.
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

    /// Name in the report.
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

    /// Whether it is about sockets of plain links.
    pub(super) const fn is_about_sockets(self) -> bool {
        matches!(
            self,
            Self::Reach | Self::SourcePort | Self::MulticastBack | Self::Tcp | Self::Stacks
        )
    }

    /// Whether everything else depends on it.
    pub(super) const fn is_basic(self) -> bool {
        matches!(
            self,
            Self::Find | Self::Reach | Self::Answer | Self::Framing
        )
    }
}

/// Result of an exchange.
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

/// The verdict on an exchange, with explanations.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Verdict {
    pub(super) mark: Mark,
    /// The observation.
    pub(super) what: String,
    /// The probable cause of a failure.
    pub(super) cause: Option<String>,
    /// The remedy.
    pub(super) remedy: Option<String>,
    /// Whether it was skipped because a basic exchange has failed.
    pub(super) cut_off: bool,
}

impl Verdict {
    pub(super) fn ok(what: impl Into<String>) -> Self {
        Self::new(Mark::Ok, what)
    }

    pub(super) fn skipped(why: impl Into<String>) -> Self {
        Self::new(Mark::Skipped, why)
    }

    /// Skipped, like everything that follows.
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

    /// Adds a recommendation, although nothing failed.
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

/// A completed exchange.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Trial {
    pub(super) exchange: Exchange,
    pub(super) verdict: Verdict,
    /// From the first query to the verdict.
    pub(super) took: Duration,
}

impl Trial {
    pub(super) fn failed(&self) -> bool {
        self.verdict.mark == Mark::Failed
    }

    pub(super) fn to_json(&self) -> Json {
        json!({
            "exchange": self.exchange.name(),
            "verdict": self.verdict.mark.name(),
            "what": self.verdict.what,
            "cause": self.verdict.cause,
            "remedy": self.verdict.remedy,
            "milliseconds": (self.took.as_secs_f64() * 1e4).round() / 10.0,
        })
    }
}
