//! Invalid settings of a node.

use std::fmt::{Debug, Display};
use std::ops::RangeInclusive;

use crate::address::ParseIdError;
use crate::link::InvalidGroup;
use crate::rights::{GrantError, RuleError};

/// An invalid setting.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ConfigError {
    /// A setting is out of its range.
    #[error("{setting} {value} is out of range: choose {range}")]
    OutOfRange {
        /// Its section and key.
        setting: String,
        /// The configured value.
        value: String,
        /// The valid range.
        range: String,
    },
    /// Junior delivers only to its own clients.
    #[error(
        "routing.forward and junior exclude each other: Junior does not deliver to components \
         behind its clients. Remove one of them"
    )]
    JuniorForward,
    /// The words of a grant are wrong.
    #[error("access.grants: {0}")]
    Grant(#[from] GrantError),
    /// The rights of a user are wrong.
    #[error("local_users: `{0}`: {1}")]
    LocalUser(String, RuleError),
    /// Two lines on one device.
    #[error("the serial port {0} appears twice: remove one entry")]
    SerialTwice(String),
    /// Not a multicast group.
    #[error(transparent)]
    Group(#[from] InvalidGroup),
    /// The id of a peer is invalid.
    #[error("the id of a peer: {0}")]
    PeerId(ParseIdError),
    /// Not the address of a peer.
    #[error(
        "`{0}` is not a peer's address: write the address of one host, with a port if it is not \
         3794, such as 192.168.7.2, 192.168.7.2:3795, [fd00::2]:3795 or (IPv6's link-local \
         addresses need the interface) [fe80::2%eth0]:3794"
    )]
    Peer(String),
    /// Not an address to listen on.
    #[error(
        "`{0}` is not an address to listen on: write an address of this host, or 0.0.0.0 for all of \
         them, with a port if it is not 3794, such as 10.0.0.5 or 0.0.0.0:3795"
    )]
    Listen(String),
}

impl ConfigError {
    pub(super) fn out_of_range(
        setting: impl Display,
        value: impl Debug,
        range: impl Display,
    ) -> Self {
        Self::OutOfRange {
            setting: setting.to_string(),
            value: format!("{value:?}"),
            range: range.to_string(),
        }
    }
}

/// Checks that a setting is in its range.
pub(super) fn in_range<T: PartialOrd + Debug>(
    setting: impl Display,
    value: T,
    range: RangeInclusive<T>,
) -> Result<(), ConfigError> {
    if range.contains(&value) {
        return Ok(());
    }
    let range = format!("from {:?} to {:?}", range.start(), range.end());
    Err(ConfigError::out_of_range(setting, value, range))
}

/// Checks that a setting is not 0.
pub(super) fn not_zero<T: PartialEq + Default + Debug>(
    setting: impl Display,
    value: T,
) -> Result<(), ConfigError> {
    if value != T::default() {
        return Ok(());
    }
    Err(ConfigError::out_of_range(setting, value, "1 or more"))
}
