//! The `[delivery]` section: acknowledged messages, packing and pacing.

use std::ops::RangeInclusive;
use std::time::Duration;

#[cfg(feature = "serde")]
use super::units;
use super::{ConfigError, error::in_range};
use crate::endpoint::{self, Pacing, Packing};

const PATIENCES: RangeInclusive<Duration> = Duration::from_millis(100)..=Duration::from_secs(600);
const WINDOWS: RangeInclusive<usize> = 2..=16_384;
const BURSTS: RangeInclusive<usize> = 8192..=1 << 30;
const LONGEST_PACKING: Duration = Duration::from_secs(1);

/// Acknowledgement, packing and pacing of messages.
///
/// ```toml
/// [delivery]
/// patience = "3s"          # until a message that is not acknowledged is given up
/// window = 512             # packets on their way to one destination, at most
/// waiting = "64MiB"        # of messages that wait for acknowledgements
/// packing = "off"          # or for how long small messages wait for others: "2ms"
/// pace_burst = "192kB"     # of a receive buffer that a large message may fill at once
/// pace_rate = "200MB"      # of it that is emptied each second; 0: no pacing
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields, default))]
#[non_exhaustive]
pub struct Delivery {
    /// How long a destination may be silent before a message that waits for its acknowledgement is
    /// given up; 0.1 s to 10 minutes.
    #[cfg_attr(
        feature = "serde",
        serde(
            deserialize_with = "units::read_duration",
            serialize_with = "units::write_duration"
        )
    )]
    pub patience: Duration,
    /// Limit of packets in flight to one destination, 2 to 16384.
    pub window: usize,
    /// Limit of octets of messages that wait for acknowledgements.
    #[cfg_attr(feature = "serde", serde(deserialize_with = "units::read_size"))]
    pub waiting: usize,
    /// Whether small messages share datagrams; they wait for others up to 1 s.
    #[cfg_attr(
        feature = "serde",
        serde(deserialize_with = "read_packing", serialize_with = "write_packing")
    )]
    pub packing: Packing,
    /// Octets of a receive buffer that the fragments of an unacknowledged large message may fill at
    /// once; 8192 to 1 GiB.
    #[cfg_attr(feature = "serde", serde(deserialize_with = "units::read_size"))]
    pub pace_burst: usize,
    /// Octets of a receive buffer that the receiver is assumed to read per second; 0 disables
    /// pacing.
    #[cfg_attr(feature = "serde", serde(deserialize_with = "units::read_size"))]
    pub pace_rate: usize,
}

impl Default for Delivery {
    fn default() -> Self {
        let (usual, pacing) = (endpoint::Config::default(), Pacing::default());
        Self {
            patience: usual.acknowledge_patience,
            window: usual.max_window,
            waiting: usual.max_unacknowledged_octets,
            packing: usual.packing,
            pace_burst: pacing.burst,
            pace_rate: pacing.rate as usize,
        }
    }
}

impl Delivery {
    /// Checks that the settings are in their ranges.
    pub(super) fn validate(&self) -> Result<(), ConfigError> {
        in_range("delivery.patience", self.patience, PATIENCES)?;
        in_range("delivery.window", self.window, WINDOWS)?;
        if self.pace_rate > 0 {
            in_range("delivery.pace_burst", self.pace_burst, BURSTS)?;
        }
        match self.packing {
            Packing::Within(time) if time > LONGEST_PACKING => {
                let range = "\"off\" or a time up to 1s";
                Err(ConfigError::out_of_range("delivery.packing", time, range))
            }
            _ => Ok(()),
        }
    }
}

#[cfg(feature = "serde")]
fn read_packing<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<Packing, D::Error> {
    match units::read_text(deserializer)?.as_str() {
        "off" => Ok(Packing::Off),
        time => units::duration(time)
            .map(Packing::Within)
            .map_err(|error| serde::de::Error::custom(format_args!("{error}, or \"off\""))),
    }
}

#[cfg(feature = "serde")]
fn write_packing<S: serde::Serializer>(
    packing: &Packing,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    match packing {
        Packing::Off => serializer.serialize_str("off"),
        Packing::Within(time) => units::write_duration(time, serializer),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::node::Config;

    fn endpoint(delivery: Delivery) -> endpoint::Config {
        let config = Config {
            delivery,
            ..Config::new(1, 1)
        };
        config.endpoint(0)
    }

    #[test]
    fn what_is_out_of_range_is_refused_with_the_range() {
        let refused = |delivery: Delivery| delivery.validate().unwrap_err().to_string();
        let usual = Delivery::default;
        assert_eq!(usual().validate(), Ok(()));
        assert_eq!(
            refused(Delivery {
                patience: Duration::from_millis(5),
                ..usual()
            }),
            "delivery.patience 5ms is out of range: choose from 100ms to 600s"
        );
        assert_eq!(
            refused(Delivery {
                window: 1,
                ..usual()
            }),
            "delivery.window 1 is out of range: choose from 2 to 16384"
        );
        let short = Delivery {
            pace_burst: 100,
            ..usual()
        };
        assert!(refused(short.clone()).starts_with("delivery.pace_burst 100 is out of range"));
        let unpaced = Delivery {
            pace_rate: 0,
            ..short
        };
        assert_eq!(unpaced.validate(), Ok(()));
        assert_eq!(endpoint(unpaced).pacing, None);
    }

    #[test]
    fn what_is_taken_for_a_repetition_does_not_depend_on_our_own_patience() {
        let usual = endpoint::Config::default();
        let patient = Delivery {
            patience: Duration::from_secs(60),
            ..Delivery::default()
        };
        let window = endpoint(patient).retransmission_window;
        assert_eq!(window, usual.retransmission_window);
    }

    #[cfg(feature = "serde")]
    #[test]
    fn a_file_says_times_and_sizes_with_their_units() {
        let read = |text: &str| toml::from_str::<Delivery>(text).map_err(|error| error.to_string());
        let text =
            "patience = \"1.5s\"\npacking = \"2ms\"\npace_rate = \"1MB\"\nwaiting = \"1MiB\"";
        let endpoint = endpoint(read(text).unwrap());
        assert_eq!(endpoint.acknowledge_patience, Duration::from_millis(1500));
        assert_eq!(endpoint.packing, Packing::Within(Duration::from_millis(2)));
        assert_eq!(endpoint.pacing.unwrap().rate, 1_000_000);
        assert_eq!(endpoint.max_unacknowledged_octets, 1 << 20);
        assert_eq!(read("packing = \"off\"").unwrap(), Delivery::default());
        assert!(read("packing = 5").unwrap_err().contains("or \"off\""));
        assert!(read("patience = 3").unwrap_err().contains("time"));
        assert!(read("windwo = 3").unwrap_err().contains("windwo"));
    }
}
