//! The words of the compact form for types, units and formats.

use crate::grammar;

/// Numbers: in the compact form and in the standard.
const NUMBERS: [(&str, &str); 10] = [
    ("uint8", "unsigned byte"),
    ("uint16", "unsigned short integer"),
    ("uint32", "unsigned integer"),
    ("uint64", "unsigned long integer"),
    ("int8", "byte"),
    ("int16", "short integer"),
    ("int32", "integer"),
    ("int64", "long integer"),
    ("float", "float"),
    ("double", "long float"),
];

/// Types of a transition's parameters that are numbers.
const PARAMETERS: [(&str, &str); 4] = [
    ("uint8", "unsigned byte"),
    ("uint16", "unsigned short"),
    ("uint32", "unsigned int"),
    ("uint64", "unsigned long"),
];

/// Formats whose names have blanks in the standard.
const FORMATS: [(&str, &str); 2] = [
    ("JAUS_MESSAGE", "JAUS MESSAGE"),
    ("User_defined", "User defined"),
];

/// Formats that are words of the compact form; all others are texts.
const PLAIN_FORMATS: [&str; 15] = [
    "AU", "BMP", "JPEG", "MJPEG", "MPEG-1", "MPEG-2", "MP2", "MP3", "MP4", "RAW", "WAV", "XML",
    "RNC", "RNG", "XSD",
];

fn second(table: &[(&'static str, &'static str)], first: &str) -> Option<&'static str> {
    table.iter().find(|(it, _)| *it == first).map(|(_, it)| *it)
}

fn first(table: &[(&'static str, &'static str)], second: &str) -> Option<&'static str> {
    table
        .iter()
        .find(|(_, it)| *it == second)
        .map(|(it, _)| *it)
}

/// The standard's name of a number.
pub(super) fn number(word: &str) -> Option<&'static str> {
    second(&NUMBERS, word)
}

/// The word for a number.
pub(super) fn number_word(name: &str) -> Option<&'static str> {
    first(&NUMBERS, name)
}

/// The standard's name of a parameter's type, if it is a number.
pub(super) fn parameter(word: &str) -> Option<&'static str> {
    second(&PARAMETERS, word)
}

/// The word for a parameter's type, if it is a number.
pub(super) fn parameter_word(name: &str) -> Option<&'static str> {
    first(&PARAMETERS, name)
}

/// The standard's name of a unit.
pub(super) fn unit(word: &str) -> Option<&'static str> {
    if word == "angstrom" {
        return Some("ångstro");
    }
    grammar::units(grammar::Edition::V1_1).find(|it| unit_word(it) == word)
}

/// The word for a unit.
pub(super) fn unit_word(name: &str) -> String {
    match name {
        "ångstro" => "angstrom".to_owned(),
        name => name.replace([' ', '-'], "_"),
    }
}

/// The standard's name of a format.
pub(super) fn format(word: &str) -> &str {
    second(&FORMATS, word).unwrap_or(word)
}

/// The word for a format, if it has one.
pub(super) fn format_word(name: &str) -> Option<&'static str> {
    first(&FORMATS, name).or_else(|| PLAIN_FORMATS.into_iter().find(|it| *it == name))
}

/// The unsigned types of the standard, each with the greatest number that it holds.
pub(super) const UNSIGNED: [(&str, u64); 4] = [
    ("unsigned byte", u8::MAX as u64),
    ("unsigned short integer", u16::MAX as u64),
    ("unsigned integer", u32::MAX as u64),
    ("unsigned long integer", u64::MAX),
];

/// The type of a count between two limits, which the compact form does not name: the JAUS Tool Set
/// takes the first type whose *signed* range holds their distance.
pub(super) fn counted(least: u64, most: u64) -> &'static str {
    let distance = most.saturating_sub(least);
    let holds = |(_, greatest): &&(&str, u64)| distance <= *greatest / 2;
    UNSIGNED.iter().find(holds).unwrap_or(&UNSIGNED[3]).0
}

/// The smallest type that holds a number.
pub(super) fn smallest(most: u64) -> &'static str {
    let mut types = UNSIGNED.iter();
    types
        .find(|(_, greatest)| most <= *greatest)
        .unwrap_or(&UNSIGNED[3])
        .0
}

/// The type of a presence vector for so many optional members.
pub(super) const fn presence(optional: usize) -> &'static str {
    match optional {
        0..=8 => "unsigned byte",
        9..=16 => "unsigned short integer",
        17..=32 => "unsigned integer",
        _ => "unsigned long integer",
    }
}

/// Ending of a reference's name in the compact form if it would have the name of its type, which
/// the JAUS Tool Set's editor cannot tell apart.
pub(super) const SAME_NAME: &str = "_8A27vDR";

/// The greatest number of an unsigned type.
pub(super) fn greatest(kind: &str) -> u64 {
    let known = UNSIGNED.iter().find(|(name, _)| *name == kind);
    known.map_or(u64::MAX, |(_, greatest)| *greatest)
}
