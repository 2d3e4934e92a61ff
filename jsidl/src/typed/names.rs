//! Converts names of definitions to identifiers: case, reserved words, collisions.

use std::collections::HashSet;

use heck::{ToSnakeCase, ToUpperCamelCase};

use crate::model::Version;

/// How a language spells identifiers.
#[derive(Debug)]
pub(crate) struct Spelling {
    /// A member, or an alternative of a variant.
    pub(crate) member: fn(&str) -> String,
    /// A named value.
    pub(crate) value: fn(&str) -> String,
    /// Words that cannot be identifiers, or that the generated code uses itself.
    pub(crate) reserved: &'static [&'static [&'static str]],
    /// What such a word gets appended.
    pub(crate) suffix: &'static str,
}

/// The identifiers of one namespace, without duplicates.
#[derive(Debug)]
pub(crate) struct Names {
    spelling: &'static Spelling,
    taken: HashSet<String>,
}

impl Names {
    pub(crate) fn new(spelling: &'static Spelling) -> Self {
        Self {
            spelling,
            taken: HashSet::new(),
        }
    }

    /// A namespace in which this name is taken.
    pub(crate) fn beside(spelling: &'static Spelling, name: &str) -> Self {
        Self {
            spelling,
            taken: HashSet::from([name.to_owned()]),
        }
    }

    /// A member: `Position_RMS` becomes `position_rms` or `positionRms`.
    pub(crate) fn member(&mut self, name: &str) -> String {
        let ident = leading(&(self.spelling.member)(name), "n");
        self.unique(ident)
    }

    /// A type: `ReportServiceList`.
    pub(crate) fn type_name(&mut self, name: &str) -> String {
        let ident = leading(&name.to_upper_camel_case(), "N");
        self.unique(ident)
    }

    /// A named value.
    pub(crate) fn value(&mut self, name: &str) -> String {
        let spelled = (self.spelling.value)(name);
        let is_upper = spelled.starts_with(|c: char| c.is_ascii_uppercase());
        let ident = leading(&spelled, if is_upper { "N" } else { "n" });
        self.unique(ident)
    }

    /// A set of services: `urn:jaus:jss:core` becomes `core`, `urn:example:lamps` becomes
    /// `example_lamps`.
    pub(crate) fn set(&mut self, urn: &str) -> String {
        let name = urn.strip_prefix("urn:").unwrap_or(urn);
        let name = name.strip_prefix("jaus:jss:").unwrap_or(name);
        let name = match name.replace(':', " ").to_snake_case() {
            none if none.is_empty() => "messages".to_owned(),
            name => name,
        };
        let ident = leading(&name, "n");
        self.unique(ident)
    }

    fn unique(&mut self, ident: String) -> String {
        let mut reserved = self.spelling.reserved.iter();
        let base = if reserved.any(|words| words.contains(&ident.as_str())) {
            format!("{ident}{}", self.spelling.suffix)
        } else {
            ident
        };
        let mut candidate = base.clone();
        let mut number = 2;
        while !self.taken.insert(candidate.clone()) {
            // Without a separator, `a` and `2` would make the `a2` of another name in vain.
            candidate = format!("{}_{number}", base.trim_end_matches('_'));
            number += 1;
        }
        candidate
    }
}

/// An identifier of ASCII characters that begins with a letter.
pub(crate) fn leading(ident: &str, letter: &str) -> String {
    let is_valid = |c: &char| c.is_ascii_alphanumeric() || *c == '_';
    let ident: String = ident.chars().filter(is_valid).collect();
    if ident.starts_with(|c: char| c.is_ascii_alphabetic()) {
        ident
    } else {
        format!("{letter}{ident}")
    }
}

/// The namespace of a version: `v1_0`.
pub(crate) fn version(version: Version) -> String {
    format!("v{}_{}", version.major, version.minor)
}

/// The words for a unit in the name of an accessor: `deg` in `latitude_deg`.
pub(crate) fn unit(unit: &str) -> &str {
    match unit {
        "one" | "" => "value",
        "degree" => "deg",
        "radian" => "rad",
        "meter" => "m",
        "second" => "s",
        "meter per second" => "m per s",
        "meter per second squared" => "m per s2",
        "radian per second" => "rad per s",
        "radian per second squared" => "rad per s2",
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
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    static SPELLING: Spelling = Spelling {
        member: |name| name.to_snake_case(),
        value: |name| name.to_upper_camel_case(),
        reserved: &[&["class"]],
        suffix: "_",
    };

    #[test]
    fn names_are_unique_valid_and_not_reserved() {
        let mut names = Names::new(&SPELLING);
        let members = ["Class", "class", "X", "x", "3D", "é", "--", "X_2"];
        let idents = members.map(|name| names.member(name));
        assert_eq!(
            idents,
            ["class_", "class_2", "x", "x_2", "n3d", "n", "n_2", "x_2_2"]
        );
    }

    #[test]
    fn a_set_is_named_by_its_urn() {
        let mut names = Names::new(&SPELLING);
        let urns = [
            "urn:jaus:jss:core",
            "urn:jaus:jss:environmentSensing",
            "urn:example:lamps",
            "urn:class",
            "",
        ];
        let sets = urns.map(|urn| names.set(urn));
        let expected = [
            "core",
            "environment_sensing",
            "example_lamps",
            "class_",
            "messages",
        ];
        assert_eq!(sets, expected);
    }
}
