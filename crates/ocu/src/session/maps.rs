//! Cells of the map shown on pages: fetched at the first request, and cached until the
//! map changes.

use bytes::Bytes;

use super::client::{Client, Finished};
use crate::orders::CellsReply;
use crate::state::{Edition, Map};
use jaus::address::JausId;
use jaus::component::Component;
use jaus_vehicle::ground::{RasterEdition, fetch_cells};

/// The cached map, and the requesters waiting for a map.
#[derive(Default)]
pub(super) struct Maps {
    kept: Option<(Edition, Bytes)>,
    wanted: Option<Edition>,
    waiting: Vec<CellsReply>,
}

impl Maps {
    /// Limit of waiting requesters.
    const MOST_WAITING: usize = 64;

    /// Handles a page's request for the cells of `map` at `store`.
    pub(super) fn want(
        &mut self,
        store: Option<JausId>,
        map: Option<Map>,
        client: &mut Client,
        reply: CellsReply,
    ) {
        let (Some(store), Some(map)) = (store, map) else {
            return reply(Err("unknown map".to_owned()));
        };
        let edition = map.edition();
        if let Some((kept, cells)) = &self.kept
            && *kept == edition
        {
            return reply(Ok(cells.clone()));
        }
        if self.waiting.len() >= Self::MOST_WAITING {
            return reply(Err(
                "too many pending requests for the map; try again".to_owned()
            ));
        }
        self.waiting.push(reply);
        if self.wanted.is_none() {
            self.wanted = Some(edition);
            let component = client.component().clone();
            client.start(async move {
                let result = cells(&component, store, &map).await;
                Finished::Mapped {
                    store,
                    edition,
                    result,
                }
            });
        }
    }

    /// Handles the fetched cells or the failure.
    pub(super) fn handle_mapped(&mut self, edition: Edition, result: &Result<Bytes, String>) {
        self.wanted = None;
        self.kept = result.as_ref().ok().map(|cells| (edition, cells.clone()));
        for reply in self.waiting.drain(..) {
            reply(result.clone());
        }
    }
}

async fn cells(component: &Component, store: JausId, map: &Map) -> Result<Bytes, String> {
    let edition = RasterEdition {
        map: map.id,
        revision: map.revision,
        rows: map.rows,
        columns: map.columns,
    };
    match fetch_cells(component, store, edition).await {
        Ok(Some(cells)) => Ok(cells.into()),
        Ok(None) => Err(format!("{store} changed the map while it was fetched")),
        Err(error) => Err(error.to_string()),
    }
}
