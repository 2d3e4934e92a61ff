//! Quality of service, and its text in liveliness tokens.

use std::fmt;
use std::str::FromStr;
use std::time::Duration;

use crate::interface::shown;

/// Whether messages may be lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Reliability {
    /// Lost messages are sent again.
    Reliable,
    /// Lost messages are not sent again.
    BestEffort,
}

/// Whether late subscriptions get earlier messages.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Durability {
    /// The publisher keeps its last messages for them.
    TransientLocal,
    /// They get only later ones.
    Volatile,
}

/// Which messages a queue keeps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum History {
    /// The last ones, as many as [`Qos::depth`].
    KeepLast,
    /// All.
    KeepAll,
}

/// How a publisher shows that it is alive.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Liveliness {
    /// By the middleware.
    Automatic,
    /// By its own messages.
    ManualByTopic,
}

/// Quality of service of a publisher, a subscription or a service.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub struct Qos {
    /// Whether messages may be lost.
    pub reliability: Reliability,
    /// Whether late subscriptions get earlier messages.
    pub durability: Durability,
    /// Which messages a queue keeps.
    pub history: History,
    /// How many messages a queue keeps.
    pub depth: u64,
    /// The longest time between messages; `None` is no limit.
    pub deadline: Option<Duration>,
    /// The longest time that a message is valid; `None` is no limit.
    pub lifespan: Option<Duration>,
    /// How a publisher shows that it is alive.
    pub liveliness: Liveliness,
    /// How long a publisher counts as alive without showing it; `None` is no limit.
    pub lease: Option<Duration>,
}

impl Default for Qos {
    /// ROS's default: reliable, volatile, the last 10 messages.
    fn default() -> Self {
        Self {
            reliability: Reliability::Reliable,
            durability: Durability::Volatile,
            history: History::KeepLast,
            depth: 10,
            deadline: None,
            lifespan: None,
            liveliness: Liveliness::Automatic,
            lease: None,
        }
    }
}

impl Qos {
    /// ROS's profile for data of sensors: best effort, volatile, the last 5 messages.
    #[must_use]
    pub fn sensor() -> Self {
        Self {
            reliability: Reliability::BestEffort,
            depth: 5,
            ..Self::default()
        }
    }

    /// The same with another depth.
    #[must_use]
    pub const fn with_depth(mut self, depth: u64) -> Self {
        self.depth = depth;
        self
    }
}

/// A text that is no quality of service.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is not a quality of service of rmw_zenoh, such as ::,10:,:,:,,")]
pub struct QosError(String);

/// The depth that rmw_zenoh leaves out.
const DEFAULT_DEPTH: u64 = 42;
/// No limit of time, as ROS writes it.
const INFINITE: Duration = Duration::new(9_223_372_036, 854_775_807);

impl fmt::Display for Qos {
    /// Writes reliability, durability, history and depth, deadline, lifespan, liveliness and lease. What
    /// is rmw_zenoh's default is left out.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let reliability = match self.reliability {
            Reliability::Reliable => "",
            Reliability::BestEffort => "2",
        };
        let durability = match self.durability {
            Durability::TransientLocal => "1",
            Durability::Volatile => "",
        };
        let history = match self.history {
            History::KeepLast => "",
            History::KeepAll => "2",
        };
        let liveliness = match self.liveliness {
            Liveliness::Automatic => "",
            Liveliness::ManualByTopic => "3",
        };
        let depth = Omitting(self.depth, DEFAULT_DEPTH);
        let [deadline, lifespan, lease] = [self.deadline, self.lifespan, self.lease].map(Time);
        write!(
            f,
            "{reliability}:{durability}:{history},{depth}:{deadline}:{lifespan}:{liveliness},{lease}"
        )
    }
}

/// A number that is left out if it is the default.
struct Omitting(u64, u64);

impl fmt::Display for Omitting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 == self.1 {
            true => Ok(()),
            false => write!(f, "{}", self.0),
        }
    }
}

struct Time(Option<Duration>);

impl fmt::Display for Time {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let time = self.0.unwrap_or(INFINITE);
        let seconds = Omitting(time.as_secs(), INFINITE.as_secs());
        let below = |time: Duration| u64::from(time.subsec_nanos());
        write!(f, "{seconds},{}", Omitting(below(time), below(INFINITE)))
    }
}

impl FromStr for Qos {
    type Err = QosError;

    fn from_str(text: &str) -> Result<Self, QosError> {
        parse(text).ok_or_else(|| QosError(shown(text)))
    }
}

fn parse(text: &str) -> Option<Qos> {
    let mut parts = text.split(':');
    let mut part = || parts.next();
    let reliability = match part()? {
        "2" => Reliability::BestEffort,
        other => unknown(other, Reliability::Reliable)?,
    };
    let durability = match part()? {
        "1" => Durability::TransientLocal,
        other => unknown(other, Durability::Volatile)?,
    };
    let (history, depth) = part()?.split_once(',')?;
    let history = match history {
        "2" => History::KeepAll,
        other => unknown(other, History::KeepLast)?,
    };
    let depth = number(depth, DEFAULT_DEPTH)?;
    let deadline = time(part()?)?;
    let lifespan = time(part()?)?;
    let (liveliness, lease) = part()?.split_once(',')?;
    let liveliness = match liveliness {
        "3" => Liveliness::ManualByTopic,
        other => unknown(other, Liveliness::Automatic)?,
    };
    Some(Qos {
        reliability,
        durability,
        history,
        depth,
        deadline,
        lifespan,
        liveliness,
        lease: time(lease)?,
    })
}

/// The default for any other number: ROS has numbers for "best available" and "unknown", and later
/// versions may have more.
fn unknown<T>(text: &str, default: T) -> Option<T> {
    number(text, 0).map(|_| default)
}

fn number(text: &str, default: u64) -> Option<u64> {
    match text {
        "" => Some(default),
        _ => text.parse().ok(),
    }
}

/// Reads seconds and nanoseconds; the outer `None` is a malformed text, the inner one no limit.
fn time(text: &str) -> Option<Option<Duration>> {
    let (seconds, nanoseconds) = text.split_once(',')?;
    let seconds = number(seconds, INFINITE.as_secs())?;
    let nanoseconds = number(nanoseconds, INFINITE.subsec_nanos().into())?;
    let below = Duration::from_nanos(nanoseconds);
    let time = Duration::from_secs(seconds).checked_add(below)?;
    Some((time != INFINITE).then_some(time))
}
