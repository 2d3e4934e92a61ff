//! Converts names of the definition to Rust identifiers: case, keywords, collisions.

use std::collections::{HashMap, HashSet};

use heck::{ToShoutySnakeCase, ToSnakeCase, ToUpperCamelCase};

use crate::typed::names::{self, leading};

/// Keywords that can be raw identifiers.
const KEYWORDS: &[&str] = &[
    "abstract", "as", "async", "await", "become", "box", "break", "const", "continue", "do", "dyn",
    "else", "enum", "extern", "false", "final", "fn", "for", "gen", "if", "impl", "in", "let",
    "loop", "macro", "match", "mod", "move", "mut", "override", "priv", "pub", "ref", "return",
    "static", "struct", "trait", "true", "try", "type", "typeof", "unsafe", "unsized", "use",
    "virtual", "where", "while", "yield",
];

/// Keywords that cannot.
const PATH_KEYWORDS: &[&str] = &["crate", "self", "super", "_"];

/// Prelude names used by generated code.
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

/// The identifiers of one namespace, without duplicates.
#[derive(Debug, Default, Clone)]
pub(super) struct Names {
    taken: HashSet<String>,
    /// The last number after each name that was taken.
    numbers: HashMap<String, u32>,
}

impl Names {
    /// A namespace with reserved names.
    pub(super) fn reserving(names: &[&str]) -> Self {
        Self {
            taken: names.iter().map(|&name| name.to_owned()).collect(),
            numbers: HashMap::new(),
        }
    }

    /// Reserves more names.
    pub(super) fn reserve(&mut self, names: &[String]) {
        self.taken.extend(names.iter().cloned());
    }

    /// Identifier of a field, function or module: `Position_RMS` becomes `position_rms`.
    pub(super) fn snake(&mut self, name: &str) -> String {
        let ident = self.unique(leading(&name.to_snake_case(), "_"), "_");
        if KEYWORDS.contains(&ident.as_str()) {
            format!("r#{ident}")
        } else {
            ident
        }
    }

    /// Identifier of a function, and those of others with prefixes: `speed_m`, `set_speed_m` and
    /// `with_speed_m`. None is that of an earlier function.
    pub(super) fn snake_family<const N: usize>(
        &mut self,
        name: &str,
        prefixes: [&str; N],
    ) -> (String, [String; N]) {
        let base = leading(&name.to_snake_case(), "_");
        let mut free = base.clone();
        let is_taken = |names: &Self, free: &str| {
            let mut prefixed = prefixes.iter().map(|prefix| format!("{prefix}{free}"));
            names.taken.contains(free) || prefixed.any(|it| names.taken.contains(&it))
        };
        while is_taken(self, &free) {
            free = format!("{base}_{}", self.next_number(&base));
        }
        let first = self.snake(&free);
        let others = prefixes.map(|prefix| self.snake(&format!("{prefix}{free}")));
        (first, others)
    }

    /// Identifier of a type or an alternative: `ReportServiceList`.
    pub(super) fn camel(&mut self, name: &str) -> String {
        let ident = leading(&name.to_upper_camel_case(), "N");
        self.unique(ident, "")
    }

    /// Identifier of a constant: `STREAM_NOT_FOUND`.
    pub(super) fn shouty(&mut self, name: &str) -> String {
        self.unique(leading(&name.to_shouty_snake_case(), "N"), "_")
    }

    fn unique(&mut self, ident: String, separator: &str) -> String {
        let reserved = PATH_KEYWORDS.contains(&ident.as_str()) || PRELUDE.contains(&ident.as_str());
        let base = if reserved { format!("{ident}_") } else { ident };
        let mut candidate = base.clone();
        while !self.taken.insert(candidate.clone()) {
            let number = self.next_number(&base);
            candidate = match base.strip_suffix('_') {
                Some(stem) => format!("{stem}{separator}{number}"),
                None => format!("{base}{separator}{number}"),
            };
        }
        candidate
    }

    /// The next number after a name, from 2.
    fn next_number(&mut self, base: &str) -> u32 {
        let number = self.numbers.entry(base.to_owned()).or_insert(1);
        *number = number.saturating_add(1);
        *number
    }
}

/// An identifier that differs from those taken, for a local variable beside fields.
pub(super) fn local(base: &str, taken: &[&str]) -> String {
    let mut ident = base.to_owned();
    while taken.contains(&ident.as_str()) {
        ident.push('_');
    }
    ident
}

/// The constant of a version: `V1_0`.
pub(super) fn version_constant(version: crate::model::Version) -> String {
    names::version(version).to_uppercase()
}

/// The suffix of accessors in engineering units: `latitude_deg`.
pub(super) fn unit_suffix(unit: &str) -> String {
    names::unit(unit).to_snake_case()
}
