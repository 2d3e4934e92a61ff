//! Names of topics, services and nodes, by ROS's rules.

use std::fmt;
use std::str::FromStr;

use crate::interface::shown;

/// The most octets of the name of a topic or a service, and of a namespace.
const LONGEST_TOPIC: usize = 247;
/// The most octets of the name of a node.
const LONGEST_NODE: usize = 255;

/// A name that ROS does not allow.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{name}` is not the name of a {what}: {reason}")]
pub struct NameError {
    name: String,
    what: &'static str,
    reason: &'static str,
}

/// The full name of a topic or a service, such as `/v101/odom`.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TopicName(String);

impl TopicName {
    /// The name, which begins with `/`.
    #[must_use]
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl FromStr for TopicName {
    type Err = NameError;

    fn from_str(name: &str) -> Result<Self, NameError> {
        match wrong_with_path(name) {
            None => Ok(Self(name.to_owned())),
            Some(reason) => Err(NameError {
                name: shown(name),
                what: "topic",
                reason,
            }),
        }
    }
}

impl fmt::Display for TopicName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// The name of a node with its namespace, such as `/v101/bridge`.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct NodeName {
    namespace: String,
    name: String,
}

impl NodeName {
    /// A node in a namespace, which is `/` or begins with `/`.
    ///
    /// # Errors
    /// A namespace or a name that ROS does not allow.
    pub fn new(namespace: &str, name: &str) -> Result<Self, NameError> {
        let wrong = match namespace {
            "/" => None,
            _ => wrong_with_path(namespace),
        };
        if let Some(reason) = wrong {
            return Err(NameError {
                name: shown(namespace),
                what: "namespace",
                reason,
            });
        }
        if let Some(reason) = wrong_with_word(name) {
            return Err(NameError {
                name: shown(name),
                what: "node",
                reason,
            });
        }
        Ok(Self {
            namespace: namespace.to_owned(),
            name: name.to_owned(),
        })
    }

    /// The namespace, such as `/` or `/v101`.
    #[must_use]
    pub fn namespace(&self) -> &str {
        &self.namespace
    }

    /// The name without the namespace.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }
}

impl fmt::Display for NodeName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.namespace.trim_end_matches('/'), self.name)
    }
}

fn wrong_with_path(path: &str) -> Option<&'static str> {
    let Some(words) = path.strip_prefix('/') else {
        return Some("begin it with /");
    };
    if path.len() > LONGEST_TOPIC {
        return Some("it is longer than 247 octets");
    }
    if words.is_empty() || words.ends_with('/') {
        return Some("it ends with /");
    }
    words.split('/').find_map(|word| match word {
        "" => Some("it has two / in a row"),
        _ => wrong_with_word(word),
    })
}

fn wrong_with_word(word: &str) -> Option<&'static str> {
    if word.is_empty() {
        return Some("it is empty");
    }
    if word.len() > LONGEST_NODE {
        return Some("it is longer than 255 octets");
    }
    if word.starts_with(|first: char| first.is_ascii_digit()) {
        return Some("a part begins with a digit");
    }
    let is_allowed = |c: char| c.is_ascii_alphanumeric() || c == '_';
    match word.chars().all(is_allowed) {
        true => None,
        false => Some("use only letters, digits and _ between the /"),
    }
}
