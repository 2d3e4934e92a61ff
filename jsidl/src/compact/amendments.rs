//! What a construct must say in amendments to be read as the original.

use std::collections::BTreeSet;

use super::tree::{Element, REFERENCE};
use super::words::greatest;

/// Values that an attribute has if it is absent.
const DEFAULTS: [(&str, &str); 6] = [
    ("optional", "false"),
    ("is_command", "false"),
    ("is_stateless", "false"),
    ("deprecated", "false"),
    ("offset_to_lower_limit", "false"),
    ("min_count", "0"),
];

/// The amendments that make `read` the `original`; `None` if none do.
pub(super) fn amendments(original: &Element, read: &Element) -> Option<Vec<String>> {
    let mut found = Vec::new();
    let mut difference = Difference {
        root: read,
        found: &mut found,
    };
    difference.element(original, read, true)?;
    Some(found)
}

struct Difference<'d> {
    root: &'d Element,
    found: &'d mut Vec<String>,
}

impl Difference<'_> {
    fn element(&mut self, original: &Element, read: &Element, is_root: bool) -> Option<()> {
        if !same_name(original, read) {
            return None;
        }
        let pairs = pairs(original, read)?;
        if !pairs.is_empty() {
            let reachable = is_root
                || self
                    .root
                    .first(original.name)
                    .is_some_and(|it| std::ptr::eq(it, read));
            // Attributes of a child that is a construct are amended before the child.
            if !reachable {
                return None;
            }
            let inner = if is_root {
                String::new()
            } else {
                format!("{} ", original.name)
            };
            self.found.push(format!("{inner}{}", pairs.join(" ")));
        }
        let text = |it: &Element| {
            it.text
                .as_ref()
                .map(|it| fold(&it.value))
                .unwrap_or_default()
        };
        if text(original) != text(read) {
            return None;
        }
        self.children(original, read, is_root)
    }

    fn children(&mut self, original: &Element, read: &Element, is_root: bool) -> Option<()> {
        let vector = |it: &Element| it.child("presence_vector").cloned();
        let mut skipped = (0, 0);
        match (vector(original), vector(read)) {
            (Some(vector), None) if is_root => {
                let kind = vector.value("field_type_unsigned");
                self.found
                    .push(format!("presence_vector field_type_unsigned=\"{kind}\""));
                skipped = (1, 0);
            }
            (None, Some(_)) if is_root => {
                self.found.push("no presence_vector".to_owned());
                skipped = (0, 1);
            }
            (Some(_), None) | (None, Some(_)) => return None,
            _ => {}
        }
        if original.children.len() - skipped.0 != read.children.len() - skipped.1 {
            return None;
        }
        let mut both = original
            .children
            .iter()
            .skip(skipped.0)
            .zip(read.children.iter().skip(skipped.1));
        both.try_for_each(|(original, read)| self.element(original, read, false))
    }
}

fn same_name(original: &Element, read: &Element) -> bool {
    original.name == read.name || read.name == REFERENCE && original.is_reference()
}

fn fold(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// The attributes that differ, as `name="value"`; `None` if an amendment cannot say it.
fn pairs(original: &Element, read: &Element) -> Option<Vec<String>> {
    let names = original.attributes.iter().chain(&read.attributes);
    let names: BTreeSet<_> = names.map(|it| it.name.as_str()).collect();
    let mut pairs = Vec::new();
    for name in names {
        let (wanted, found) = (value(original, name), value(read, name));
        if wanted == found {
            continue;
        }
        let wanted = wanted.unwrap_or_default();
        if name == "xmlns" && wanted.is_empty() || wanted.contains(['\n', '\r']) {
            return None;
        }
        let wanted = wanted
            .replace('&', "&amp;")
            .replace('<', "&lt;")
            .replace('"', "&quot;");
        pairs.push(format!("{name}=\"{wanted}\""));
    }
    Some(pairs)
}

/// The value of an attribute, folded; the default if that means the same.
fn value(element: &Element, name: &str) -> Option<String> {
    if let Some(given) = element.attribute(name) {
        let folded = fold(&given.value);
        return Some(folded).filter(|it| !it.is_empty());
    }
    // A reference without it inherits the value of its target.
    if name == "optional" && element.is_reference() {
        return None;
    }
    if name == "max_count" && element.name.ends_with("_field") {
        let kind = element.value("field_type_unsigned");
        return (!kind.is_empty()).then(|| greatest(kind).to_string());
    }
    let default = DEFAULTS.iter().find(|(known, _)| *known == name);
    default.map(|(_, value)| (*value).to_owned())
}
