//! Comparison of message fields with values in a filter.

use serde_json::{Map, Value as Json};

use crate::query::plain;

/// A term such as `Pose.X>=1.5`.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Field {
    /// Names normalised by [`plain`], outermost first.
    path: Vec<String>,
    comparison: Comparison,
    wanted: String,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Comparison {
    Equal,
    Unequal,
    Less,
    AtMost,
    More,
    AtLeast,
    Contains,
}

/// Longer signs first, because the shorter ones are their prefixes.
const SIGNS: [(&str, Comparison); 7] = [
    ("!=", Comparison::Unequal),
    ("<=", Comparison::AtMost),
    (">=", Comparison::AtLeast),
    ("=", Comparison::Equal),
    ("<", Comparison::Less),
    (">", Comparison::More),
    ("~", Comparison::Contains),
];

impl Comparison {
    /// Whether the comparison of a field's value with `wanted` holds.
    fn holds(self, value: &Json, wanted: &str) -> bool {
        let number = wanted.parse::<f64>().ok();
        match (self, value.as_f64(), number) {
            (Self::Equal, Some(value), Some(wanted)) => value == wanted,
            (Self::Unequal, Some(value), Some(wanted)) => value != wanted,
            (Self::Less, Some(value), Some(wanted)) => value < wanted,
            (Self::AtMost, Some(value), Some(wanted)) => value <= wanted,
            (Self::More, Some(value), Some(wanted)) => value > wanted,
            (Self::AtLeast, Some(value), Some(wanted)) => value >= wanted,
            _ => {
                let plain = match value {
                    Json::String(text) => text.to_lowercase(),
                    other => other.to_string().to_lowercase(),
                };
                match self {
                    Self::Equal => plain == wanted.to_lowercase(),
                    Self::Unequal => plain != wanted.to_lowercase(),
                    Self::Contains => plain.contains(&wanted.to_lowercase()),
                    _ => false,
                }
            }
        }
    }
}

impl Field {
    /// Parses a comparison; `None` if the text is not one.
    pub(super) fn parse(text: &str) -> Option<Self> {
        let at = text.find(['!', '<', '>', '=', '~'])?;
        let (name, rest) = text.split_at(at);
        let (wanted, comparison) = SIGNS
            .iter()
            .find_map(|&(sign, comparison)| Some((rest.strip_prefix(sign)?, comparison)))?;
        let name = name.trim();
        let path: Vec<_> = name
            .strip_prefix("body.")
            .unwrap_or(name)
            .split('.')
            .collect();
        let path: Vec<_> = path.into_iter().map(plain).collect();
        if path.iter().any(String::is_empty) {
            return None;
        }
        Some(Self {
            path,
            comparison,
            wanted: wanted.trim().to_owned(),
        })
    }

    /// Whether it is an ordering comparison with a non-numeric value.
    pub(super) fn needs_number(&self) -> bool {
        use Comparison::{AtLeast, AtMost, Less, More};
        let by_size = matches!(self.comparison, Less | AtMost | More | AtLeast);
        by_size && self.wanted.parse::<f64>().is_err()
    }

    /// Whether a message has a matching field, at the top level or at any depth of its body or of
    /// the message inside it.
    pub(super) fn holds(&self, object: &Map<String, Json>) -> bool {
        let carried = object
            .get("carries")
            .and_then(|carried| carried.get("body"));
        let mut bodies = object.get("body").into_iter().chain(carried);
        bodies.any(|body| self.is_within(body)) || self.is_in(object, &self.path)
    }

    /// Whether the path starts here or further inside.
    fn is_within(&self, value: &Json) -> bool {
        match value {
            Json::Object(object) => {
                self.is_in(object, &self.path) || object.values().any(|inner| self.is_within(inner))
            }
            Json::Array(values) => values.iter().any(|inner| self.is_within(inner)),
            _ => false,
        }
    }

    /// Whether the path starts in this object.
    fn is_in(&self, object: &Map<String, Json>, path: &[String]) -> bool {
        let Some((first, rest)) = path.split_first() else {
            return false;
        };
        let mut named = object.iter().filter(|(name, _)| plain(name) == *first);
        named.any(|(_, value)| self.leads(value, rest))
    }

    /// Whether the rest of the path leads to a matching value. In a list the path may continue with
    /// an index; without one, any element may match.
    fn leads(&self, value: &Json, path: &[String]) -> bool {
        match (value, path.split_first()) {
            (Json::Array(values), Some((first, rest))) => match first.parse::<usize>() {
                Ok(index) => values
                    .get(index)
                    .is_some_and(|value| self.leads(value, rest)),
                Err(_) => values.iter().any(|value| self.leads(value, path)),
            },
            (Json::Array(values), None) => values.iter().any(|value| self.leads(value, path)),
            (Json::Object(object), Some(_)) => self.is_in(object, path),
            (_, Some(_)) => false,
            (value, None) => self.comparison.holds(value, &self.wanted),
        }
    }
}
