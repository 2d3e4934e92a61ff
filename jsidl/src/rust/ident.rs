//! Names of the definition as identifiers of Rust: case, keywords, collisions.

use std::collections::HashSet;

use heck::{ToShoutySnakeCase, ToSnakeCase, ToUpperCamelCase};

/// Keywords that may be written as raw identifiers.
const KEYWORDS: &[&str] = &[
    "abstract", "as", "async", "await", "become", "box", "break", "const", "continue", "do", "dyn",
    "else", "enum", "extern", "false", "final", "fn", "for", "gen", "if", "impl", "in", "let",
    "loop", "macro", "match", "mod", "move", "mut", "override", "priv", "pub", "ref", "return",
    "static", "struct", "trait", "true", "try", "type", "typeof", "unsafe", "unsized", "use",
    "virtual", "where", "while", "yield",
];

/// Keywords that may not.
const PATH_KEYWORDS: &[&str] = &["crate", "self", "super", "_"];

/// Names from the prelude that generated code uses.
const PRELUDE: &[&str] = &[
    "Self",
    "Option",
    "Some",
    "None",
    "Result",
    "Ok",
    "Err",
    "Vec",
    "Box",
    "String",
    "From",
    "Into",
    "TryFrom",
    "TryInto",
    "Default",
    "Clone",
    "Copy",
    "Debug",
    "PartialEq",
    "Eq",
    "PartialOrd",
    "Ord",
    "Hash",
    "Drop",
    "Fn",
    "FnMut",
    "FnOnce",
    "Iterator",
    "IntoIterator",
    "Send",
    "Sync",
    "Sized",
    "Unpin",
    "ToOwned",
    "ToString",
    "AsRef",
    "AsMut",
    "Extend",
];

/// The identifiers of one namespace, each given once.
#[derive(Debug, Default, Clone)]
pub(super) struct Names {
    taken: HashSet<String>,
}

impl Names {
    /// A namespace in which some names are taken from the start.
    pub(super) fn reserving(names: &[&str]) -> Self {
        Self {
            taken: names.iter().map(|&name| name.to_owned()).collect(),
        }
    }

    /// A field, a function, a module: `Position_RMS` becomes `position_rms`.
    pub(super) fn snake(&mut self, name: &str) -> String {
        let ident = self.unique(leading(&name.to_snake_case(), "_"), "_");
        if KEYWORDS.contains(&ident.as_str()) {
            format!("r#{ident}")
        } else {
            ident
        }
    }

    /// A type or an alternative: `ReportServiceList`.
    pub(super) fn camel(&mut self, name: &str) -> String {
        let ident = leading(&name.to_upper_camel_case(), "N");
        self.unique(ident, "")
    }

    /// A constant: `STREAM_NOT_FOUND`.
    pub(super) fn shouty(&mut self, name: &str) -> String {
        self.unique(leading(&name.to_shouty_snake_case(), "N"), "_")
    }

    fn unique(&mut self, ident: String, separator: &str) -> String {
        let reserved = PATH_KEYWORDS.contains(&ident.as_str()) || PRELUDE.contains(&ident.as_str());
        let base = if reserved { format!("{ident}_") } else { ident };
        let mut candidate = base.clone();
        let mut number = 2;
        while !self.taken.insert(candidate.clone()) {
            let separator = if base.ends_with('_') { "" } else { separator };
            candidate = format!("{base}{separator}{number}");
            number += 1;
        }
        candidate
    }
}

/// Gives an identifier a letter to begin with, and keeps what Rust can read.
fn leading(ident: &str, letter: &str) -> String {
    let ident: String = ident
        .chars()
        .filter(|c| c.is_ascii_alphanumeric() || *c == '_')
        .collect();
    if ident.starts_with(|c: char| c.is_ascii_alphabetic()) {
        ident
    } else {
        format!("{letter}{ident}")
    }
}

/// An identifier that is none of those taken, for a local variable beside fields.
pub(super) fn local(base: &str, taken: &[&str]) -> String {
    let mut ident = base.to_owned();
    while taken.contains(&ident.as_str()) {
        ident.push('_');
    }
    ident
}

/// A module of a version: `v1_0`.
pub(super) fn version_module(version: crate::model::Version) -> String {
    format!("v{}_{}", version.major, version.minor)
}

/// The suffix of accessors in engineering units: `latitude_deg`.
pub(super) fn unit_suffix(unit: &str) -> String {
    let words = match unit {
        "one" => "value",
        "degree" => "deg",
        "radian" => "rad",
        "meter" => "m",
        "second" => "s",
        "percent" => "percent",
        "meter per second" => "m_per_s",
        "meter per second squared" => "m_per_s2",
        "radian per second" => "rad_per_s",
        "radian per second squared" => "rad_per_s2",
        "newton" => "n",
        "newton meter" => "nm",
        "kilogram" => "kg",
        "hertz" => "hz",
        "volt" => "v",
        "ampere" => "a",
        "degree Celsius" => "celsius",
        "pascal" => "pa",
        "square meter" => "m2",
        "cubic meter" => "m3",
        other => return other.to_snake_case(),
    };
    words.to_owned()
}
