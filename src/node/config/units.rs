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

const SIZES: [(&str, u64); 8] = [
    ("", 1),
    ("B", 1),
    ("kB", 1000),
    ("KiB", 1 << 10),
    ("MB", 1_000_000),
    ("MiB", 1 << 20),
    ("GB", 1_000_000_000),
    ("GiB", 1 << 30),
];

const MICROSECOND: f64 = 1e-6;
const TIMES: [(&str, f64); 6] = [
    ("us", MICROSECOND),
    ("µs", MICROSECOND),
    ("ms", 1e-3),
    ("s", 1.0),
    ("min", 60.0),
    ("h", 3600.0),
];

/// The longest plausible time: a year, in seconds.
const LONGEST: f64 = 365.0 * 86_400.0;

/// Parses a size in octets: `1500`, `64 KiB`, `1.5MiB`.
///
/// # Errors
/// [`InvalidUnit::Size`]: no number, an unknown unit, a negative size, or not whole octets.
pub fn size(text: &str) -> Result<usize, InvalidUnit> {
    let wrong = || InvalidUnit::Size(text.to_owned());
    let (number, unit) = split(text);
    let (_, factor) = SIZES
        .iter()
        .find(|(name, _)| *name == unit)
        .ok_or_else(wrong)?;
    if let Ok(whole) = number.parse::<u64>() {
        let octets = whole.checked_mul(*factor).ok_or_else(wrong)?;
        return usize::try_from(octets).map_err(|_| wrong());
    }
    let octets = number.parse::<f64>().map_err(|_| wrong())? * *factor as f64;
    // Above 2^53 an `f64` has no fraction.
    let whole = octets.fract() == 0.0 && (0.0..9e15).contains(&octets);
    whole.then_some(octets as usize).ok_or_else(wrong)
}

/// Parses a time: `5ms`, `1.5s`, `2 min`; at most a year.
///
/// # Errors
/// [`InvalidUnit::Duration`]: no number, no unit or an unknown one, a negative time, or more than a
/// year.
pub fn duration(text: &str) -> Result<Duration, InvalidUnit> {
    let wrong = || InvalidUnit::Duration(text.to_owned());
    let (number, unit) = split(text);
    let (_, factor) = TIMES
        .iter()
        .find(|(name, _)| *name == unit)
        .ok_or_else(wrong)?;
    let seconds = number.parse::<f64>().map_err(|_| wrong())? * factor;
    if !(0.0..=LONGEST).contains(&seconds) {
        return Err(wrong());
    }
    Duration::try_from_secs_f64(seconds).map_err(|_| wrong())
}

/// Splits a text into number and unit.
fn split(text: &str) -> (&str, &str) {
    let text = text.trim();
    let end = text
        .find(|c: char| !c.is_ascii_digit() && c != '.')
        .unwrap_or(text.len());
    let (number, unit) = text.split_at(end);
    (number, unit.trim_start())
}

/// Deserializes a setting that is a size: an integer is a number of octets, a string may have a
/// unit.
///
/// # Errors
/// Those of [`size`], and values that are neither integer nor string.
#[cfg(feature = "serde")]
pub fn read_size<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<usize, D::Error> {
    deserializer.deserialize_any(SizeVisitor)
}

/// Deserializes a setting that is a time, as a string with a unit.
///
/// # Errors
/// Those of [`duration`], and values that are not strings.
#[cfg(feature = "serde")]
pub fn read_duration<'de, D: serde::Deserializer<'de>>(
    deserializer: D,
) -> Result<Duration, D::Error> {
    deserializer.deserialize_any(DurationVisitor)
}

/// The reverse of [`read_duration`].
///
/// # Errors
/// Those of the serializer.
#[cfg(feature = "serde")]
pub fn write_duration<S: serde::Serializer>(
    duration: &Duration,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    serializer.collect_str(&format_args!("{}s", duration.as_secs_f64()))
}

#[cfg(feature = "serde")]
struct SizeVisitor;

#[cfg(feature = "serde")]
impl serde::de::Visitor<'_> for SizeVisitor {
    type Value = usize;

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("a number of octets, or a string with a unit such as \"4MiB\"")
    }

    fn visit_u64<E: serde::de::Error>(self, octets: u64) -> Result<usize, E> {
        usize::try_from(octets).map_err(|_| E::custom(InvalidUnit::Size(octets.to_string())))
    }

    fn visit_i64<E: serde::de::Error>(self, octets: i64) -> Result<usize, E> {
        usize::try_from(octets).map_err(|_| E::custom(InvalidUnit::Size(octets.to_string())))
    }

    fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<usize, E> {
        size(text).map_err(E::custom)
    }
}

#[cfg(feature = "serde")]
struct DurationVisitor;

#[cfg(feature = "serde")]
impl serde::de::Visitor<'_> for DurationVisitor {
    type Value = Duration;

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("a string with a unit such as \"5ms\", \"1.5s\" or \"2 min\"")
    }

    fn visit_i64<E: serde::de::Error>(self, number: i64) -> Result<Duration, E> {
        Err(E::custom(InvalidUnit::Duration(number.to_string())))
    }

    fn visit_u64<E: serde::de::Error>(self, number: u64) -> Result<Duration, E> {
        Err(E::custom(InvalidUnit::Duration(number.to_string())))
    }

    fn visit_f64<E: serde::de::Error>(self, number: f64) -> Result<Duration, E> {
        Err(E::custom(InvalidUnit::Duration(number.to_string())))
    }

    fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<Duration, E> {
        duration(text).map_err(E::custom)
    }
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
