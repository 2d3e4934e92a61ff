//! Messages from the station to a page.

use serde::Serialize;
use serde_json::{Map, Value};

use super::page_link::PageLinkQuality;
use super::press::Press;
use super::state::{Fleet, Overlay, Tree};

/// One frame to a page.
#[derive(Debug, Serialize)]
#[serde(tag = "type", rename_all = "snake_case")]
pub(super) enum Said<'a> {
    /// The first frame.
    Hello {
        /// Protocol version.
        version: u32,
        /// Number of the page at the station.
        page: u64,
        /// What the page shows when it connects again in place of this connection.
        secret: Option<&'a str>,
        /// The answer to the page's nonce.
        answer: Option<&'a str>,
        token_needed: bool,
        /// Whether a page without the token may look, and stop vehicles.
        watch: bool,
        operator: String,
        authority: u8,
        /// Whether the station has a map file.
        base_map: bool,
    },
    /// What has changed in the state of the page's vehicle since the last frame of this kind: all of it in the first
    /// one of a connection.
    State(&'a Map<String, Value>),
    Fleet(&'a Fleet),
    Tree(&'a Tree),
    /// The links from page to station and from station to vehicle, once a second.
    Link {
        #[serde(flatten)]
        page: PageLinkQuality,
        vehicle_round_trip_ms: Option<u64>,
        vehicle_loss_percent: Option<u8>,
    },
    /// What lies over the map of a vehicle; nothing of an unknown one.
    Overlay {
        id: Option<u64>,
        overlay: Option<&'a Overlay>,
    },
    /// The session has handled a setpoint or the end of manual drive.
    Ok,
    /// A stop was taken and sent.
    Stopped {
        press: Press,
        /// How many stops of all pages the station had taken with it, as in [`State`](super::state::State); `null` if
        /// it was cleared since, so that the page need not repeat it.
        stops: Option<u64>,
    },
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
