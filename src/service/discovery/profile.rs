//! The application's settings of discovery: names, scope and timing.

use std::time::Duration;

use super::super::{Identification, Kind, Level};

/// How a component presents itself, its node and its subsystem.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Profile {
    /// The name of the whole system. If empty, that of the subsystem.
    pub system: String,
    /// The kind of the subsystem.
    pub kind: Kind,
    /// The name of the subsystem. If empty, this component reports none and learns it from others.
    pub subsystem: String,
    /// The name of the node. If empty, that of the subsystem.
    pub node: String,
    /// The name of the component. If empty, that of the subsystem.
    pub component: String,
}

impl Profile {
    /// A profile with the same name at every level.
    #[must_use]
    pub fn new(kind: Kind, name: impl Into<String>) -> Self {
        Self {
            kind,
            subsystem: name.into(),
            system: String::new(),
            node: String::new(),
            component: String::new(),
        }
    }

    pub(super) fn system(&self) -> Identification {
        self.named(self.kind, &self.system)
    }

    pub(super) fn identification(&self, level: Level) -> Identification {
        match level {
            Level::Subsystem => self.named(self.kind, &self.subsystem),
            Level::Node => self.named(Kind::Node, &self.node),
            Level::Component => self.named(Kind::Component, &self.component),
        }
    }

    fn named(&self, kind: Kind, name: &str) -> Identification {
        let name = if name.is_empty() {
            &self.subsystem
        } else {
            name
        };
        Identification {
            kind,
            name: name.to_owned(),
        }
    }
}

/// The components that discovery searches for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Scope {
    /// All components.
    #[default]
    System,
    /// The components of its own subsystem.
    Subsystem,
    /// None: it only answers, and knows only itself.
    Nobody,
}

/// The pace of discovery, and its timeouts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Timing {
    /// Interval between calls (broadcast queries), ± 10 %. It is at least
    /// [`call_per_peer`](Self::call_per_peer) for each peer and for this component itself.
    pub call: Duration,
    /// What each peer adds to the call interval, because each peer answers calls.
    pub call_per_peer: Duration,
    /// Interval between repeated queries to the same peer, ± 10 %. It is at least
    /// [`refresh_per_peer`](Self::refresh_per_peer) for each peer.
    pub refresh: Duration,
    /// What each peer adds to the refresh interval.
    pub refresh_per_peer: Duration,
    /// The number of probes to a silent peer before it is lost.
    pub probes: u32,
    /// Interval between probes.
    pub probe_interval: Duration,
    /// The longest silence of a peer before the first probe, however many peers there are.
    pub longest_silence: Duration,
    /// Limit of known components per network address. The limit for all addresses together is twice
    /// this, with the second half reserved for newcomers. Components beyond it are ignored.
    pub max_components: usize,
}

impl Default for Timing {
    /// Calls every 5 s, refreshes every 30 s, three probes at intervals of 1 s after at most 30 s
    /// of silence, 1024 components.
    fn default() -> Self {
        Self {
            call: Duration::from_secs(5),
            call_per_peer: Duration::from_millis(1500),
            refresh: Duration::from_secs(30),
            refresh_per_peer: Duration::from_secs(20),
            probes: 3,
            probe_interval: Duration::from_secs(1),
            longest_silence: Duration::from_secs(30),
            max_components: 1024,
        }
    }
}

impl Timing {
    pub(super) fn call_interval(&self, peers: usize) -> Duration {
        self.call.max(times(self.call_per_peer, peers + 1))
    }

    /// How long a peer may be silent before it is probed.
    pub(super) fn patience(&self, peers: usize) -> Duration {
        let patience = self.call_interval(peers).mul_f64(1.5) + self.probe_interval / 2;
        patience.min(self.longest_silence)
    }

    /// How long a silent peer is kept if it cannot be probed because too many are silent.
    pub(super) fn longest_search(&self) -> Duration {
        self.probe_interval * self.probes + self.longest_silence
    }

    pub(super) fn refresh_interval(&self, peers: usize) -> Duration {
        self.refresh.max(times(self.refresh_per_peer, peers))
    }
}

fn times(duration: Duration, factor: usize) -> Duration {
    duration.saturating_mul(u32::try_from(factor).unwrap_or(u32::MAX))
}
