//! Values of attributes: patterns, words and units.

/// The permitted texts of an attribute.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Value {
    /// Letters, digits and underscores.
    Identifier,
    /// Identifiers joined by dots.
    Path,
    /// Any text.
    Text,
    /// `true`, `false`, `1` or `0`
    Boolean,
    /// `major.minor`
    Version,
    /// `major.minor`, each of them a number or `*`.
    VersionPattern,
    /// Octets as hexadecimal digits.
    Octets,
    /// 0 to 255.
    Octet,
    /// 0 to 4294967295, or the path of a constant.
    Size,
    /// An integer of eight octets.
    Long,
    /// One of these words.
    Word(&'static [&'static str]),
    /// A unit of measure.
    Unit,
    /// The type of a trigger's parameter: words or a path.
    ParameterType,
}

impl Value {
    /// Whether a text is permitted.
    pub(crate) fn admits(self, text: &str, edition: super::Edition) -> bool {
        match self {
            Self::Text => true,
            Self::Identifier => is_identifier(text),
            Self::Path => is_path(text),
            Self::Boolean => ["true", "false", "1", "0"].contains(&text),
            Self::Version => is_version(text, false),
            Self::VersionPattern => is_version(text, true),
            Self::Octets => {
                text.len().is_multiple_of(2) && text.chars().all(|c| c.is_ascii_hexdigit())
            }
            Self::Octet => text.parse::<u8>().is_ok(),
            Self::Size => text.parse::<u32>().is_ok() || is_path(text),
            Self::Long => text.parse::<i64>().is_ok(),
            Self::Word(words) => words.contains(&text),
            Self::Unit => units(edition).any(|unit| unit == text),
            Self::ParameterType => {
                is_path(text)
                    || edition == super::Edition::V1_1 && PARAMETER_NUMBERS.contains(&text)
            }
        }
    }

    /// What to write, after "use".
    pub(crate) fn advice(self) -> String {
        match self {
            Self::Text => "a text".into(),
            Self::Identifier => "letters, digits and underscores, not starting with a digit".into(),
            Self::Path => "names made of letters, digits and underscores, joined by dots".into(),
            Self::Boolean => "`true` or `false`".into(),
            Self::Version => "two numbers such as `1.0`".into(),
            Self::VersionPattern => "two numbers such as `1.0`, or `*` in place of one".into(),
            Self::Octets => "pairs of hexadecimal digits".into(),
            Self::Octet => "a number from 0 to 255".into(),
            Self::Size => "a number, or the name of a constant".into(),
            Self::Long => "an integer".into(),
            Self::Word(words) => format!("`{}`", words.join("`, `")),
            Self::Unit => "a unit of the standard".into(),
            Self::ParameterType => "the name of a message, a path or the type of a number".into(),
        }
    }
}

fn is_identifier(text: &str) -> bool {
    text.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
        && text.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
}

fn is_path(text: &str) -> bool {
    text.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
        && text
            .chars()
            .all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '.')
}

fn is_version(text: &str, wildcards: bool) -> bool {
    let is_number = |part: &str| {
        let digits = !part.is_empty() && part.chars().all(|c| c.is_ascii_digit());
        digits && (part == "0" || !part.starts_with('0')) || wildcards && part == "*"
    };
    let parts = text.split_once('.');
    parts.is_some_and(|(major, minor)| is_number(major) && is_number(minor))
}

pub(crate) const NUMBERS: &[&str] = &[
    "byte",
    "short integer",
    "integer",
    "long integer",
    "unsigned byte",
    "unsigned short integer",
    "unsigned integer",
    "unsigned long integer",
    "float",
    "long float",
];

pub(crate) const CONSTANTS: &[&str] = &[
    "byte",
    "short integer",
    "integer",
    "long integer",
    "unsigned byte",
    "unsigned short integer",
    "unsigned integer",
    "unsigned long integer",
    "float",
    "long float",
    "string",
];

pub(crate) const UNSIGNED: &[&str] = &[
    "unsigned byte",
    "unsigned short integer",
    "unsigned integer",
    "unsigned long integer",
];

const PARAMETER_NUMBERS: &[&str] = &[
    "unsigned byte",
    "unsigned short",
    "unsigned int",
    "unsigned long",
];

/// The units of an edition.
pub(crate) fn units(edition: super::Edition) -> impl Iterator<Item = &'static str> {
    let newer = match edition {
        super::Edition::V1_0 => &[][..],
        super::Edition::V1_1 => NEWER_UNITS,
    };
    UNITS.iter().chain(newer).copied()
}

/// Whether some edition has a unit.
pub(crate) fn is_unit(text: &str) -> bool {
    units(super::Edition::V1_1).any(|unit| unit == text)
}

/// The units of edition 1.0.
const UNITS: &[&str] = &[
    "ampere",
    "ampere per meter",
    "ampere per square meter",
    "are",
    "bar",
    "barn",
    "becquerel",
    "bel",
    "candela",
    "candela per square meter",
    "coulomb",
    "coulomb per cubic meter",
    "coulomb per kilogram",
    "coulomb per square meter",
    "cubic meter",
    "cubic meter per kilogram",
    "curie",
    "day",
    "degree",
    "degree Celsius",
    "farad",
    "farad per meter",
    "gray per second",
    "hectare",
    "henry",
    "henry per meter",
    "hertz",
    "hour",
    "joule",
    "joule per cubic meter",
    "joule per kelvin",
    "joule per kilogram",
    "joule per mole",
    "joule per mole kelvin",
    "katal",
    "katal per cubic meter",
    "kelvin",
    "kilogram",
    "kilogram per cubic meter",
    "knot",
    "liter",
    "lumen",
    "lux",
    "meter",
    "meter per second",
    "meter per second squared",
    "metric ton",
    "minute",
    "mole",
    "mole per cubic meter",
    "nautical mile",
    "neper",
    "newton",
    "newton meter",
    "newton per meter",
    "ohm",
    "one",
    "pascal",
    "pascal second",
    "rad",
    "radian",
    "radian per second",
    "radian per second squared",
    "reciprocal meter",
    "rem",
    "roentgen",
    "second",
    "siemens",
    "sievert",
    "square meter",
    "steradian",
    "tesla",
    "volt",
    "volt per meter",
    "watt",
    "watt per meter kelvin",
    "watt per square meter",
    "watt per square meter steradian",
    "weber",
    "ångstro",
];

/// Further units of edition 1.1.
const NEWER_UNITS: &[&str] = &[
    "ampere hour",
    "bits per second",
    "frames per second",
    "kilogram-square meter",
    "kilograms per second",
    "liters per hour",
    "liters per second",
    "parts per million",
    "parts per thousand",
    "percent",
    "rotations per minute",
];
