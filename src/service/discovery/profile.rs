//! What an application chooses about discovery: how it presents itself, whom it looks for, and
//! how often.

use std::time::Duration;

use super::super::{Identification, Kind, Level};

/// How a component presents itself and the things it belongs to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Profile {
    /// The name of the whole system; the subsystem's if empty.
    pub system: String,
    /// What the subsystem is.
    pub kind: Kind,
    /// The name of the subsystem. Empty: this component does not say, and learns it from others.
    pub subsystem: String,
    /// The name of the node; the subsystem's if empty.
    pub node: String,
    /// The name of the component; the subsystem's if empty.
    pub component: String,
}

impl Profile {
    /// A profile with one name for everything.
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

/// Whom a component looks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Scope {
    /// Everybody.
    #[default]
    System,
    /// The components of its own subsystem.
    Subsystem,
    /// Nobody: it answers, and knows only itself.
    Nobody,
}

/// How often discovery speaks, and when it gives a peer up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Timing {
    /// Between two calls to everybody, ± 10 %. With more than one peer it is at least
    /// [`call_per_peer`](Self::call_per_peer) for each of them and for oneself.
    pub call: Duration,
    /// What each peer adds to the interval between calls, because each peer answers them.
    pub call_per_peer: Duration,
    /// Between two questions to the same peer for what it has told already, ± 10 %; at least
    /// [`refresh_per_peer`](Self::refresh_per_peer) for each peer.
    pub refresh: Duration,
    /// What each peer adds to the refresh interval.
    pub refresh_per_peer: Duration,
    /// How often a silent peer is asked before it is given up.
    pub probes: u32,
    /// Between two such questions.
    pub probe_interval: Duration,
    /// The longest that a peer may be silent before it is asked, however many there are.
    pub longest_silence: Duration,
    /// The most components of one network address that are kept. Of all addresses together it is
    /// twice as many, of which the second half is for newcomers; more are ignored.
    pub max_components: usize,
}

impl Default for Timing {
    /// Calls every 5 s, refreshes every 30 s, three probes a second apart after 30 s of silence at
    /// most, 1024 components.
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

    /// How long a peer may be silent before it is asked directly.
    pub(super) fn patience(&self, peers: usize) -> Duration {
        let patience = self.call_interval(peers).mul_f64(1.5) + self.probe_interval / 2;
        patience.min(self.longest_silence)
    }

    /// How long a silent peer is kept that could not be asked because there are so many.
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
