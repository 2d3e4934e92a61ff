//! The known entities.

use std::collections::BTreeMap;

use super::{EntityKind, Token, TokenError};

/// The most entities that are kept.
const MOST_ENTITIES: usize = 1 << 14;

/// The entities that exist, by their tokens.
#[derive(Debug, Default)]
pub struct Graph {
    entities: BTreeMap<String, Token>,
    dropped: u64,
}

impl Graph {
    /// Adds the entity of a token that was declared. Returns whether the graph changed.
    ///
    /// # Errors
    /// The key is no token of rmw_zenoh; it is counted.
    pub fn insert(&mut self, key: &str) -> Result<bool, TokenError> {
        if self.entities.contains_key(key) {
            return Ok(false);
        }
        let token = key.parse().inspect_err(|_| self.dropped += 1)?;
        if self.entities.len() >= MOST_ENTITIES {
            self.dropped += 1;
            return Ok(false);
        }
        self.entities.insert(key.to_owned(), token);
        Ok(true)
    }

    /// Removes the entity of a token that was withdrawn. Returns whether the graph changed.
    pub fn remove(&mut self, key: &str) -> bool {
        self.entities.remove(key).is_some()
    }

    /// Every entity with its key, in the order of the keys.
    pub fn entities(&self) -> impl Iterator<Item = (&str, &Token)> {
        self.entities
            .iter()
            .map(|(key, token)| (key.as_str(), token))
    }

    /// The entities of one kind that use a topic or a service, with their keys.
    pub fn of_topic(&self, kind: EntityKind, topic: &str) -> impl Iterator<Item = (&str, &Token)> {
        self.entities().filter(move |(_, token)| {
            let name = token.endpoint.as_ref().map(|it| it.name.as_str());
            token.kind == kind && name == Some(topic)
        })
    }

    /// How many tokens were malformed or too many.
    #[must_use]
    pub const fn dropped(&self) -> u64 {
        self.dropped
    }
}
