//! Parses sizes and times in settings and flags: `4MiB`, `64 KiB`, `5ms`, `1.5s`, `2 min`.
//!
//! This is a parser of our own: the rules fit on a page, and its errors say what would be valid. A
//! size may be a bare number, which means octets. A time may not, because it would be unclear
//! whether it means seconds or milliseconds.

use std::time::Duration;

/// A text that is not a valid size or time.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum InvalidUnit {
    /// Not a size.
    #[error(
        "`{0}` is not a size: write a number of octets, or a number with one of the units B, kB, \
         KiB, MB, MiB, GB and GiB, such as 1500, \"64 KiB\" or \"4MiB\""
    )]
    Size(String),
    /// Not a time.
    #[error(
        "`{0}` is not a time: write a number with one of the units us, ms, s, min and h, such as \
         \"5ms\", \"1.5s\" or \"2 min\""
    )]
    Duration(String),
}

const SIZES: [(&str, f64); 8] = [
    ("", 1.0),
    ("B", 1.0),
    ("kB", 1e3),
    ("KiB", 1024.0),
    ("MB", 1e6),
    ("MiB", 1024.0 * 1024.0),
    ("GB", 1e9),
    ("GiB", 1024.0 * 1024.0 * 1024.0),
];

const TIMES: [(&str, f64); 6] = [
    ("us", 1e-6),
    ("µs", 1e-6),
    ("ms", 1e-3),
    ("s", 1.0),
    ("min", 60.0),
    ("h", 3600.0),
];

/// The largest plausible size in octets: below it an `f64` shows fractions.
const LARGEST: f64 = 9e15;
/// The longest plausible time: a year, in seconds.
const LONGEST: f64 = 365.0 * 86_400.0;

/// Parses a size in octets: `1500`, `64 KiB`, `1.5MiB`.
///
/// # Errors
/// [`InvalidUnit::Size`]: no number, an unknown unit, a negative size, or not whole octets.
pub fn size(text: &str) -> Result<usize, InvalidUnit> {
    let most = LARGEST.min(usize::MAX as f64);
    let octets = parse(text, &SIZES).filter(|octets| octets.fract() == 0.0 && *octets <= most);
    let octets = octets.map(|octets| octets as usize);
    octets.ok_or_else(|| InvalidUnit::Size(text.to_owned()))
}

/// Parses a time: `5ms`, `1.5s`, `2 min`; at most a year.
///
/// # Errors
/// [`InvalidUnit::Duration`]: no number, no unit or an unknown one, a negative time, or more than a
/// year.
pub fn duration(text: &str) -> Result<Duration, InvalidUnit> {
    let seconds = parse(text, &TIMES).filter(|seconds| *seconds <= LONGEST);
    let duration = seconds.and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
    duration.ok_or_else(|| InvalidUnit::Duration(text.to_owned()))
}

/// Parses a number with a unit.
fn parse(text: &str, units: &[(&str, f64)]) -> Option<f64> {
    let text = text.trim();
    let end = text.find(|c: char| !c.is_ascii_digit() && c != '.');
    let (number, unit) = text.split_at(end.unwrap_or(text.len()));
    let unit = unit.trim_start();
    let (_, factor) = units.iter().find(|(name, _)| *name == unit)?;
    Some(number.parse::<f64>().ok()? * factor)
}

/// A setting that may have a unit, as written in a settings file.
#[cfg(feature = "serde")]
#[derive(serde::Deserialize)]
#[serde(
    untagged,
    expecting = "expected a number, or a text with a unit such as \"4MiB\" or \"5ms\""
)]
enum Raw {
    Integer(i64),
    Float(f64),
    Text(String),
}

/// Deserializes a setting as text, whether it is written as text or as a number.
#[cfg(feature = "serde")]
pub(super) fn read_text<'de, D: serde::Deserializer<'de>>(d: D) -> Result<String, D::Error> {
    Ok(match serde::Deserialize::deserialize(d)? {
        Raw::Integer(number) => number.to_string(),
        Raw::Float(number) => number.to_string(),
        Raw::Text(text) => text,
    })
}

/// Deserializes a setting that is a size.
#[cfg(feature = "serde")]
pub(crate) fn read_size<'de, D: serde::Deserializer<'de>>(d: D) -> Result<usize, D::Error> {
    size(&read_text(d)?).map_err(serde::de::Error::custom)
}

/// Deserializes a setting that is a time.
#[cfg(feature = "serde")]
pub(super) fn read_duration<'de, D: serde::Deserializer<'de>>(d: D) -> Result<Duration, D::Error> {
    duration(&read_text(d)?).map_err(serde::de::Error::custom)
}

/// The reverse of [`read_duration`].
#[cfg(feature = "serde")]
pub(super) fn write_duration<S: serde::Serializer>(
    duration: &Duration,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    serializer.collect_str(&format_args!("{}s", duration.as_secs_f64()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_octets_or_have_a_unit() {
        for (text, octets) in [
            ("0", 0),
            ("1500", 1500),
            ("1500 B", 1500),
            ("2kB", 2000),
            ("64 KiB", 65_536),
            ("4MiB", 4 << 20),
            ("1.5 MiB", 3 << 19),
            (" 1GiB ", 1 << 30),
        ] {
            assert_eq!(size(text), Ok(octets), "{text}");
        }
    }

    #[test]
    fn times_have_a_unit() {
        for (text, micros) in [
            ("250us", 250),
            ("5ms", 5000),
            ("1.5s", 1_500_000),
            ("2 min", 120_000_000),
            ("1h", 3_600_000_000),
            ("0s", 0),
        ] {
            assert_eq!(duration(text), Ok(Duration::from_micros(micros)), "{text}");
        }
    }

    #[test]
    fn what_is_neither_is_refused_with_what_would_be_right() {
        for text in [
            "",
            "MiB",
            "4mib",
            "4 furlongs",
            "-1",
            "0.3",
            "1e3",
            "99999999999GiB",
        ] {
            let error = size(text).unwrap_err().to_string();
            assert!(
                error.starts_with(&format!("`{text}` is not a size")),
                "{error}"
            );
            assert!(error.contains("4MiB"), "{error}");
        }
        for text in [
            "", "5", "5 m", "ms", "-5ms", "1.2.3s", "NaNs", "infs", "9000h",
        ] {
            let error = duration(text).unwrap_err().to_string();
            assert!(
                error.starts_with(&format!("`{text}` is not a time")),
                "{error}"
            );
            assert!(error.contains("1.5s"), "{error}");
        }
    }

    #[cfg(feature = "serde")]
    #[test]
    fn settings_take_both_and_name_what_is_wrong() {
        #[derive(Debug, serde::Deserialize)]
        struct Settings {
            #[serde(deserialize_with = "read_size", default)]
            buffer: usize,
            #[serde(deserialize_with = "read_duration", default)]
            every: Duration,
        }
        let read = |text: &str| toml::from_str::<Settings>(text).map_err(|e| e.to_string());
        assert_eq!(read("buffer = 7").unwrap().buffer, 7);
        assert_eq!(read("buffer = \"2 KiB\"").unwrap().buffer, 2048);
        assert_eq!(read("every = \"5ms\"").unwrap().every.as_millis(), 5);
        assert!(
            read("buffer = -1")
                .unwrap_err()
                .contains("`-1` is not a size")
        );
        assert!(read("buffer = true").unwrap_err().contains("\"4MiB\""));
        assert!(read("every = 5").unwrap_err().contains("`5` is not a time"));
        assert!(
            read("every = \"5\"")
                .unwrap_err()
                .contains("`5` is not a time")
        );
    }
}
