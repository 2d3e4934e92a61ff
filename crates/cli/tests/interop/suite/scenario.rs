//! Scenarios for every peer, in execution order.

use crate::suite::settings::Side;

/// One row of the table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Scenario {
    /// Discovers the other party.
    Discover,
    /// Lists its services.
    Services,
    /// Queries its velocity.
    Query,
    /// Subscribes to its velocity at a rate.
    Periodic,
    /// Subscribes to its velocity on change.
    OnChange,
    /// Takes control, and loses it to a client with more authority.
    Control,
    /// Takes control, and moves it by wrench effort.
    Drive,
    /// Sends a message, and expects it back unchanged.
    Large(Size, Transport),
    /// The answerer is killed and restarted; its reports must resume.
    AnswererRestarts,
    /// The actor is killed and restarted; it must receive reports again.
    ActorRestarts,
    /// The cable is pulled and reconnected; the reports must resume.
    Cable,
    /// All of this for a while.
    Mixed,
}

/// Size of a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Size {
    name: &'static str,
    /// Octets, including the message code.
    pub(crate) octets: usize,
}

const SIZES: [Size; 4] = [
    Size {
        name: "1-KiB",
        octets: 1 << 10,
    },
    Size {
        name: "10-KiB",
        octets: 10 << 10,
    },
    Size {
        name: "100-KiB",
        octets: 100 << 10,
    },
    Size {
        name: "1-MiB",
        octets: 1 << 20,
    },
];

/// How a message is sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Transport {
    /// UDP, acknowledged.
    Acknowledged,
    /// UDP, not acknowledged: the sender repeats lost messages a few times.
    Unacknowledged,
    /// TCP.
    Tcp,
}

impl Transport {
    const ALL: [Self; 3] = [Self::Acknowledged, Self::Unacknowledged, Self::Tcp];

    const fn key(self) -> &'static str {
        match self {
            Self::Acknowledged => "large",
            Self::Unacknowledged => "large-unacknowledged",
            Self::Tcp => "large-tcp",
        }
    }

    const fn title(self) -> &'static str {
        match self {
            Self::Acknowledged => "acknowledged",
            Self::Unacknowledged => "not acknowledged",
            Self::Tcp => "by TCP",
        }
    }
}

/// Acts that query continuously during disturbances: of a vehicle, and of an echo.
pub(crate) const KEEP: [(Side, &str); 2] = [(Side::Vehicle, "keep"), (Side::Echo, "keep-echo")];

/// The act that sends large messages to either side during mixed traffic.
pub(crate) const LOAD: &str = "load";

impl Scenario {
    /// All scenarios, in order.
    pub(crate) fn all() -> Vec<Self> {
        let large = Transport::ALL
            .into_iter()
            .flat_map(|transport| SIZES.map(|size| Self::Large(size, transport)));
        let mut all = vec![
            Self::Discover,
            Self::Services,
            Self::Query,
            Self::Periodic,
            Self::OnChange,
            Self::Control,
            Self::Drive,
        ];
        all.extend(large);
        all.extend([
            Self::AnswererRestarts,
            Self::ActorRestarts,
            Self::Cable,
            Self::Mixed,
        ]);
        all
    }

    /// Every act that a party may have a command for.
    pub(crate) fn acts() -> Vec<&'static str> {
        let mut acts: Vec<&str> = Self::all().into_iter().filter_map(Self::act).collect();
        acts.dedup();
        acts.extend(KEEP.map(|(_, act)| act));
        acts.push(LOAD);
        acts
    }

    /// Its name in settings and file names.
    pub(crate) fn key(self) -> String {
        match self {
            Self::Large(size, transport) => format!("{}-{}", transport.key(), size.name),
            Self::AnswererRestarts => "restart-of-answerer".to_owned(),
            Self::ActorRestarts => "restart-of-actor".to_owned(),
            Self::Cable => "cable".to_owned(),
            Self::Mixed => "mixed".to_owned(),
            _ => self.act().unwrap_or_default().to_owned(),
        }
    }

    /// Its name in the table.
    pub(crate) fn title(self) -> String {
        match self {
            Self::Discover => "discover".to_owned(),
            Self::Services => "list services".to_owned(),
            Self::Query => "query".to_owned(),
            Self::Periodic => "subscribe, periodic".to_owned(),
            Self::OnChange => "subscribe, on change".to_owned(),
            Self::Control => "take and lose control".to_owned(),
            Self::Drive => "drive".to_owned(),
            Self::Large(size, transport) => {
                format!("{}, {}", size.name.replace('-', " "), transport.title())
            }
            Self::AnswererRestarts => "restart of the answering party".to_owned(),
            Self::ActorRestarts => "restart of the acting party".to_owned(),
            Self::Cable => "cable pulled".to_owned(),
            Self::Mixed => "mixed traffic".to_owned(),
        }
    }

    /// The act of the acting party; `None` for continuous queries.
    pub(crate) const fn act(self) -> Option<&'static str> {
        match self {
            Self::Discover => Some("discover"),
            Self::Services => Some("services"),
            Self::Query => Some("query"),
            Self::Periodic => Some("subscribe-periodic"),
            Self::OnChange => Some("subscribe-on-change"),
            Self::Control => Some("control"),
            Self::Drive => Some("drive"),
            Self::Large(_, transport) => Some(transport.key()),
            _ => None,
        }
    }

    /// The side that the answering party plays; `None` if either will do.
    pub(crate) const fn side(self) -> Option<Side> {
        match self {
            Self::Large(..) => Some(Side::Echo),
            Self::AnswererRestarts | Self::ActorRestarts | Self::Cable | Self::Mixed => None,
            _ => Some(Side::Vehicle),
        }
    }

    /// Whether one failed attempt is inconclusive: discovery takes an unknown time, and
    /// unacknowledged messages may be lost.
    pub(crate) const fn may_try_again(self) -> bool {
        matches!(
            self,
            Self::Discover | Self::Services | Self::Large(_, Transport::Unacknowledged)
        )
    }

    /// Size of the message that is sent, in octets.
    pub(crate) const fn octets(self) -> usize {
        match self {
            Self::Large(size, _) => size.octets,
            // The messages of mixed traffic.
            _ => 10 << 10,
        }
    }
}
