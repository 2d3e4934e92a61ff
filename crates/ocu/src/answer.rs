//! Messages from the station to a page.

use serde::Serialize;

use super::state::{Fleet, State, Tree};

/// One frame to a page.
#[derive(Debug, Serialize)]
#[serde(tag = "type", rename_all = "snake_case")]
pub(super) enum Said<'a> {
    /// The first frame.
    Hello {
        /// Protocol version.
        version: u32,
        token_needed: bool,
        operator: String,
        authority: u8,
        /// Whether the station has a map file.
        base_map: bool,
    },
    State(&'a State),
    Fleet(&'a Fleet),
    Tree(&'a Tree),
    /// A request succeeded.
    Done {
        id: u64,
    },
    /// A request was refused.
    Refused {
        #[serde(skip_serializing_if = "Option::is_none")]
        id: Option<u64>,
        reason: &'a str,
    },
}
