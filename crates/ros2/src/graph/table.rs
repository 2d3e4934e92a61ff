//! The known entities.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Bound;
use std::sync::Arc;

use super::{EntityKind, Gid, Token, TokenError};

/// The most entities that are kept.
const MOST_ENTITIES: usize = 1 << 14;
/// The most entities that are kept of one topic or service.
const MOST_OF_TOPIC: usize = 1 << 10;
/// A session has at most one part in so many of both.
const SHARE: usize = 4;

/// The entities that exist, by their tokens.
#[derive(Debug, Default)]
pub struct Graph {
    entities: BTreeMap<Arc<str>, Entity>,
    /// The tokens of each topic or service.
    topics: BTreeMap<String, BTreeSet<Arc<str>>>,
    dropped: u64,
}

/// A node, or a publisher, a subscription or a service of a node.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Entity {
    /// Its identity, from the key of the token as it was declared.
    pub gid: Gid,
    /// What the token says.
    pub token: Token,
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
        let token: Token = key.parse().inspect_err(|_| self.dropped += 1)?;
        if !self.has_room(&token) {
            self.dropped += 1;
            return Ok(false);
        }
        let key: Arc<str> = key.into();
        if let Some(name) = token.topic() {
            let keys = self.topics.entry(name.to_owned()).or_default();
            keys.insert(key.clone());
        }
        let gid = Gid::of_token(&key);
        self.entities.insert(key, Entity { gid, token });
        Ok(true)
    }

    fn has_room(&self, token: &Token) -> bool {
        let of_session = token.prefix_of_session();
        // Keys are in order, so those of a session are together.
        let later = (Bound::Included(of_session.as_str()), Bound::Unbounded);
        let is_its_own = |key: &&Arc<str>| key.starts_with(&of_session);
        let all = self.entities.range::<str, _>(later).map(|(key, _)| key);
        let all = all.take_while(is_its_own).take(MOST_ENTITIES / SHARE);
        if self.entities.len() >= MOST_ENTITIES || all.count() >= MOST_ENTITIES / SHARE {
            return false;
        }
        let Some(of_topic) = token.topic().and_then(|name| self.topics.get(name)) else {
            return true;
        };
        let own = of_topic.range::<str, _>(later).take_while(is_its_own);
        let own = own.take(MOST_OF_TOPIC / SHARE);
        of_topic.len() < MOST_OF_TOPIC && own.count() < MOST_OF_TOPIC / SHARE
    }

    /// Removes the entity of a token that was withdrawn. Returns whether the graph changed.
    pub fn remove(&mut self, key: &str) -> bool {
        let Some(Entity { token, .. }) = self.entities.remove(key) else {
            return false;
        };
        if let Some(name) = token.topic()
            && let Some(keys) = self.topics.get_mut(name)
        {
            keys.remove(key);
            if keys.is_empty() {
                self.topics.remove(name);
            }
        }
        true
    }

    /// Every entity with its key, in the order of the keys.
    pub fn entities(&self) -> impl Iterator<Item = (&str, &Entity)> {
        self.entities
            .iter()
            .map(|(key, entity)| (key.as_ref(), entity))
    }

    /// The entities of one kind that use a topic or a service.
    pub fn of_topic(&self, kind: EntityKind, topic: &str) -> impl Iterator<Item = &Entity> {
        let keys = self.topics.get(topic).into_iter().flatten();
        keys.filter_map(|key| self.entities.get(key))
            .filter(move |entity| entity.token.kind == kind)
    }

    /// How many tokens were malformed or too many.
    #[must_use]
    pub const fn dropped(&self) -> u64 {
        self.dropped
    }
}
