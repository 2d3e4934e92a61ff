//! Checks of the sections `[routing]` and `[limits]`.

use super::ConfigError;
use super::error::{in_range, not_zero};
use crate::endpoint::{Limits, Rate, Routing};

/// The largest valid `max_peers`.
const MOST_PEERS: usize = 65_536;

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
        assert!(endpoint.routing.forward && !endpoint.access.allows_subsystem(102));
        assert!(!endpoint.access.allows_address([10, 0, 9, 1].into()));
        assert_eq!(endpoint.limits.messages_per_id, Some(Rate::new(50, 100)));
        let usual = Limits::default().new_ids_per_address;
        assert_eq!(endpoint.limits.new_ids_per_address, usual);
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
