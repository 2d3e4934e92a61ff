//! Whether the links of a zenoh session prove who is at their other end.

use serde_json::Value;
use zenoh::config::{Config, EndPoint};

/// The protocol with certificates on both sides.
const PROVEN: &str = "tls";

/// Checks that every link of a session with these settings is TLS with certificates on both sides.
///
/// What goes over these links is up to the access control of the routers, which a session does not see.
///
/// # Errors
/// The setting that admits others.
pub fn check(config: &Config) -> Result<(), String> {
    let links = Links {
        mode: text(&get(config, "mode")).unwrap_or_else(|| "peer".to_owned()),
        config,
    };
    let allowed = strings(&links.get("transport/link/protocols"));
    if allowed.is_empty() {
        links.check_scouting()?;
    } else if let Some(other) = allowed.iter().find(|it| *it != PROVEN) {
        return Err(format!("transport/link/protocols allows {other}"));
    }
    links.check_endpoints(allowed.is_empty())?;
    let tls = "transport/link/tls";
    if links.get(&format!("{tls}/enable_mtls")) != Value::Bool(true) {
        return Err(format!("{tls}/enable_mtls is not true"));
    }
    match links.get(&format!("{tls}/verify_name_on_connect")) {
        Value::Bool(false) => Err(format!("{tls}/verify_name_on_connect is false")),
        _ => Ok(()),
    }
}

/// The settings of TLS that an endpoint may replace, and must not: with certificates on both sides they are
/// true, or left to the settings of all endpoints.
const OF_ENDPOINT: [&str; 2] = ["enable_mtls", "verify_name_on_connect"];

struct Links<'c> {
    /// A setting may be different in each mode.
    mode: String,
    config: &'c Config,
}

impl Links<'_> {
    fn get(&self, key: &str) -> Value {
        match get(self.config, key) {
            Value::Object(mut modes) => modes.remove(&self.mode).unwrap_or_default(),
            value => value,
        }
    }

    /// Checks the endpoints. Those of other protocols have no effect if the allowed protocols are named.
    fn check_endpoints(&self, any_protocol: bool) -> Result<(), String> {
        for key in ["connect/endpoints", "listen/endpoints"] {
            for endpoint in endpoints(&self.get(key)).map_err(|other| has(key, &other))? {
                let is_proven = endpoint.protocol().as_str() == PROVEN;
                let config = endpoint.config();
                let is_kept = |name: &&str| config.get(name).is_none_or(|value| value == "true");
                if (any_protocol && !is_proven) || !OF_ENDPOINT.iter().all(is_kept) {
                    return Err(has(key, &endpoint.to_string()));
                }
            }
        }
        Ok(())
    }

    /// What is found has endpoints of its own.
    fn check_scouting(&self) -> Result<(), String> {
        for (way, default) in [("multicast", true), ("gossip", true)] {
            let key = format!("scouting/{way}/enabled");
            if self.get(&key).as_bool().unwrap_or(default) {
                return Err(format!("{key} is true"));
            }
        }
        Ok(())
    }
}

fn get(config: &Config, key: &str) -> Value {
    let json = config.get_json(key).unwrap_or_default();
    serde_json::from_str(&json).unwrap_or_default()
}

fn text(value: &Value) -> Option<String> {
    value.as_str().map(str::to_owned)
}

/// That the endpoints of a setting have one that admits others.
fn has(key: &str, endpoint: &str) -> String {
    let endpoint: String = endpoint.chars().take(100).collect();
    format!("{key} has {endpoint}")
}

/// The endpoints in a setting, read as zenoh does: each a text, or several with a strategy.
///
/// # Errors
/// What is none.
fn endpoints(value: &Value) -> Result<Vec<EndPoint>, String> {
    match value {
        Value::Null => Ok(Vec::new()),
        Value::String(text) => match text.parse() {
            Ok(endpoint) => Ok(vec![endpoint]),
            Err(_) => Err(text.clone()),
        },
        Value::Array(values) => {
            let each = values.iter().map(endpoints);
            let each: Vec<_> = each.collect::<Result<_, _>>()?;
            Ok(each.into_iter().flatten().collect())
        }
        Value::Object(several) => match several.get("locators") {
            Some(locators) => endpoints(locators),
            None => Err(value.to_string()),
        },
        other => Err(other.to_string()),
    }
}

/// All texts in a list, which may have lists in it.
fn strings(value: &Value) -> Vec<String> {
    match value {
        Value::Array(values) => values.iter().flat_map(strings).collect(),
        other => text(other).into_iter().collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The settings of the guide.
    const TLS: &str = "{ mode: 'client', connect: { endpoints: ['tls/router.example:7447'] },
        scouting: { multicast: { enabled: false }, gossip: { enabled: false } },
        transport: { link: { tls: { enable_mtls: true, root_ca_certificate: '/ca.pem' } } } }";

    fn checked(changes: &[(&str, &str)]) -> Result<(), String> {
        let mut config = Config::from_json5(TLS).unwrap();
        for (key, value) in changes {
            config.insert_json5(key, value).unwrap();
        }
        check(&config)
    }

    #[test]
    fn tls_with_certificates_on_both_sides_proves_who_is_there() {
        assert_eq!(checked(&[]), Ok(()));
        let listens = ("listen/endpoints", "['tls/0.0.0.0:7447']");
        assert_eq!(checked(&[("mode", "'peer'"), listens]), Ok(()));
        let stated = ("connect/endpoints", "['tls/one:7447#enable_mtls=true']");
        assert_eq!(checked(&[stated]), Ok(()));
        let only_tls = ("transport/link/protocols", "['tls']");
        let finds = ("scouting/multicast/enabled", "true");
        assert_eq!(checked(&[only_tls, finds]), Ok(()));
    }

    #[test]
    fn any_other_way_into_the_session_is_named() {
        for (key, value) in [
            ("connect/endpoints", "['tls/one:7447', 'tcp/two:7447']"),
            ("listen/endpoints", "{ client: ['tcp/0.0.0.0:7447'] }"),
            (
                "connect/endpoints",
                "['tls/one:7447', { strategy: 'allOf', locators: ['tls/two:7447', 'tcp/two:7447'] }]",
            ),
            ("connect/endpoints", "['tls/one:7447#enable_mtls=false']"),
            (
                "connect/endpoints",
                "['tls/one:7447?prio=1-3#root_ca_certificate_file=/ca.pem;verify_name_on_connect=false']",
            ),
            (
                "listen/endpoints",
                "{ client: ['tls/0.0.0.0:7447#enable_mtls=0'] }",
            ),
            ("scouting/multicast/enabled", "true"),
            ("scouting/gossip/enabled", "true"),
            ("transport/link/protocols", "['tls', 'udp']"),
            ("transport/link/tls/enable_mtls", "false"),
            ("transport/link/tls/verify_name_on_connect", "false"),
        ] {
            let reason = checked(&[(key, value)]).unwrap_err();
            assert!(reason.starts_with(key), "{reason}");
        }
        // Nor where only TLS is allowed.
        let mut config = Config::from_json5(TLS).unwrap();
        for (key, value) in [
            ("transport/link/protocols", "['tls']"),
            ("connect/endpoints", "['tls/one:7447#enable_mtls=false']"),
        ] {
            config.insert_json5(key, value).unwrap();
        }
        assert!(check(&config).unwrap_err().contains("enable_mtls=false"));
        // A peer listens at tcp/[::]:0 unless it is told otherwise.
        let reason = checked(&[("mode", "'peer'")]).unwrap_err();
        assert!(reason.starts_with("listen/endpoints"), "{reason}");
    }
}
