//! The sections `[routing]` and `[limits]`: whether a node forwards messages, and how much it
//! accepts from others. The section `[access]`, which senders it accepts, is
//! [`Access`](crate::endpoint::Access).
//!
//! ```toml
//! [routing]
//! forward = true                                        # between the node's links
//! broadcasts = { per_second = 500, burst = 1000 }       # what goes to many, in all
//!
//! [access]
//! allow_subsystems = ["101", "200-299"]
//! deny_networks = ["10.0.9.0/24", "fd00:9::/32"]
//!
//! [limits]
//! max_peers = 1024
//! new_ids_per_address = { per_second = 64, burst = 1024 }
//! messages_per_address = { per_second = 20000, burst = 40000 }
//! messages_per_id = { per_second = 5000, burst = 10000 }
//! ```

use super::ConfigError;
use super::error::{in_range, not_zero};
use crate::endpoint::{self, Rate};

/// The largest valid `max_peers`.
const MOST_PEERS: usize = 65_536;

/// Whether and how much a node forwards between its links. By default it does not, even with
/// several links: joining two networks is a deliberate decision.
#[derive(Clone, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields, default))]
#[non_exhaustive]
pub struct Routing {
    /// Whether to forward messages for other nodes.
    pub forward: bool,
    /// The total rate of forwarded messages with many receivers or an unknown destination.
    pub broadcasts: Rate,
}

impl Default for Routing {
    fn default() -> Self {
        let usual = endpoint::Config::default();
        Self {
            forward: usual.forwarding,
            broadcasts: usual.forwarded_broadcasts,
        }
    }
}

/// Limits of what a node accepts from others.
#[derive(Clone, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields, default))]
#[non_exhaustive]
pub struct Limits {
    /// Limit of known peers, 1 to 65536.
    pub max_peers: usize,
    /// Rate of new ids from each network address.
    pub new_ids_per_address: Rate,
    /// Rate of messages from each network address; unlimited if omitted.
    pub messages_per_address: Option<Rate>,
    /// Rate of messages from each id; unlimited if omitted.
    pub messages_per_id: Option<Rate>,
}

impl Default for Limits {
    fn default() -> Self {
        let usual = endpoint::Config::default();
        Self {
            max_peers: usual.max_peers,
            new_ids_per_address: usual.rates.new_ids,
            messages_per_address: usual.rates.messages_per_address,
            messages_per_id: usual.rates.messages_per_id,
        }
    }
}

/// Rejects limits that would block everything, or are too large.
pub(super) fn validate(routing: &Routing, limits: &Limits) -> Result<(), ConfigError> {
    in_range("limits.max_peers", limits.max_peers, 1..=MOST_PEERS)?;
    let rates = [
        ("routing.broadcasts", Some(routing.broadcasts)),
        (
            "limits.new_ids_per_address",
            Some(limits.new_ids_per_address),
        ),
        ("limits.messages_per_address", limits.messages_per_address),
        ("limits.messages_per_id", limits.messages_per_id),
    ];
    for (setting, rate) in rates {
        let Some(Rate { per_second, burst }) = rate else {
            continue;
        };
        not_zero(format_args!("{setting}.per_second"), per_second)?;
        not_zero(format_args!("{setting}.burst"), burst)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    #[cfg(feature = "serde")]
    use crate::endpoint::Rates;
    use crate::node::Config;

    #[test]
    fn nothing_is_no_rate_and_no_table() {
        let error = |change: fn(&mut Config)| {
            let mut config = Config::new(1, 1);
            change(&mut config);
            config.validate().unwrap_err().to_string()
        };
        let none = error(|config| config.limits.messages_per_id = Some(Rate::new(0, 5)));
        assert_eq!(
            none,
            "limits.messages_per_id.per_second 0 is out of range: choose 1 or more"
        );
        let none = error(|config| config.routing.broadcasts = Rate::new(5, 0));
        assert!(none.contains("routing.broadcasts.burst 0"), "{none}");
        let none = error(|config| config.limits.max_peers = 0);
        assert!(
            none.contains("max_peers 0") && none.contains("1 to 65536"),
            "{none}"
        );
    }

    #[cfg(feature = "serde")]
    #[test]
    fn a_file_sets_what_it_names_and_mistakes_are_named() {
        let read = |text: &str| toml::from_str::<Config>(text).map_err(|error| error.to_string());
        let config = read(
            r#"
            [routing]
            forward = true
            [access]
            allow_subsystems = ["101", "200-299"]
            deny_networks = ["10.0.9.0/24"]
            [limits]
            messages_per_id = { per_second = 50, burst = 100 }
            "#,
        )
        .unwrap();
        let endpoint = config.endpoint(0);
        assert!(endpoint.forwarding && !endpoint.access.allows_subsystem(102));
        assert!(!endpoint.access.allows_address([10, 0, 9, 1].into()));
        assert_eq!(endpoint.rates.messages_per_id, Some(Rate::new(50, 100)));
        assert_eq!(endpoint.rates.new_ids, Rates::default().new_ids);
        for (text, value, remedy) in [
            (
                "[routing]\nforwards = true",
                "forwards",
                "expected `forward`",
            ),
            (
                "[access]\nallow_subsystems = [\"9-2\"]",
                "`9-2`",
                "\"200-299\"",
            ),
            (
                "[access]\ndeny_networks = [\"10.0.9.1/24\"]",
                "`10.0.9.1/24`",
                "\"10.0.9.0/24\"",
            ),
            (
                "[limits]\nmessages_per_id = { per_second = 5 }",
                "per_second",
                "burst",
            ),
        ] {
            let error = read(text).unwrap_err();
            assert!(error.contains("line 2"), "{error}");
            assert!(error.contains(value) && error.contains(remedy), "{error}");
        }
    }
}
