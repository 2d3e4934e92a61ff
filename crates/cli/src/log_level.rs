//! The log level in a settings file.

use serde::Deserialize;
use tracing_subscriber::filter::Targets;

/// A log level, or levels by module: `debug`, or `warn,jaus::endpoint=trace`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(try_from = "String")]
pub struct LogLevel(pub(super) Targets);

impl TryFrom<String> for LogLevel {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        text.parse().map(Self).map_err(|error| {
            format!(
                "{error}: write error, warn, info, debug or trace, or levels by module such as \
                     warn,jaus::endpoint=trace"
            )
        })
    }
}
